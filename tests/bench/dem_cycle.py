"""Time of a cycle and memory of a hypothesis, in a small world and a large one.

And what a goal adds to a cycle, however far it is.
"""

import math
import resource
import statistics
import time
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from farside.dem import DynamicExpectancyModel, Parameters

ACTIONS = "NESW"
SMALL, LARGE = 16, 500  # sides of the squares: about 1,000 and 1,000,000 hypotheses
CYCLES = 20_000
PURSUED = 200
PATHS = 10, 1_000, 50_000  # steps


class Size(NamedTuple):
    """The number of hypotheses of a model, and what it costs to keep them.

    `pursuit_s` is the time of a cycle in which the model goes to a goal by itself.
    """

    hypotheses: int
    cycle_s: float
    pursuit_s: float
    byte_per_hypothesis: float


class Torus:
    """A square of places that wraps around at its sides, so that all places are alike."""

    def __init__(self, side: int) -> None:
        self.side = side
        self.model = DynamicExpectancyModel(
            dict.fromkeys(ACTIONS, 2.66), rng=np.random.default_rng(0)
        )
        self._tokens = [(f"at:{place}",) for place in range(side * side)]
        self._east = self._north = 0

    def cycle(self, action: int) -> float:
        """Run one cycle and return the time that the model took."""
        tokens = self._tokens[self._north * self.side + self._east]
        began = time.perf_counter()
        self.model.sense(tokens)
        self.model.perform(ACTIONS[action])
        took = time.perf_counter() - began
        self._move(action)
        return took

    def _move(self, action: int) -> None:
        self._east = (self._east + (0, 1, 0, -1)[action]) % self.side
        self._north = (self._north + (1, 0, -1, 0)[action]) % self.side

    def pursue(self, rng: np.random.Generator) -> float:
        """Run one cycle towards a goal, a random one of those nearby, and return its time."""
        place = self._north * self.side + self._east
        if not self.model.goals:
            east, north = (self._east + rng.integers(1, 6), self._north + rng.integers(1, 6))
            self.model.set_goal(self._tokens[north % self.side * self.side + east % self.side], 1.0)
        began = time.perf_counter()
        self.model.sense(self._tokens[place])
        choice = self.model.choose()
        assert choice is not None
        self.model.perform(choice.action)
        took = time.perf_counter() - began
        self._move(ACTIONS.index(choice.action))
        return took

    def try_everything(self) -> None:
        """Perform every action at every place once."""
        for _ in range(self.side):
            for _ in range(self.side):
                for action in (0, 2, 1):
                    self.cycle(action)
            for _ in range(self.side):
                self.cycle(3)
            self.cycle(0)


def measure(side: int) -> Size:
    """Learn the whole world, then move around in it at random."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    torus = Torus(side)
    torus.try_everything()
    grown_byte = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    actions = np.random.default_rng(1).integers(4, size=CYCLES).tolist()
    cycle_s = statistics.median(torus.cycle(action) for action in actions)
    known, rng = torus.model.hypothesis_count, np.random.default_rng(2)
    pursuit_s = statistics.median(torus.pursue(rng) for _ in range(PURSUED))
    return Size(known, cycle_s, pursuit_s, grown_byte / known)


class Ring:
    """Places in a ring, each learned both ways; a goal one step east of the first.

    Without a `wall` the robot goes the long way round to a goal in the east. With one, the step
    east of the first place fails from now on, and the way west is as long as the ring.
    """

    def __init__(self, places: int, *, wall: bool = False) -> None:
        self.places, self.wall, self.at = places, wall, 0
        learning = Parameters(removal=False, differentiation=False)
        self.model = DynamicExpectancyModel(
            {"E": 1.0, "W": 1.0}, learning, rng=np.random.default_rng(0)
        )
        self._tokens = [(f"at:{place}",) for place in range(places)]
        for action in "EEWW":
            for _ in range(places):
                self.model.sense(self._tokens[self.at])
                self.model.perform(action)
                self.at = (self.at + (1 if action == "E" else -1)) % places

    def carry_to_start(self) -> None:
        """Have somebody carry the robot: nothing is learned from that."""
        self.model.sense(self._tokens[self.at])
        self.model.perform(None)
        self.at = 0

    def cycle(self) -> float:
        """Run one cycle, east unless the model says otherwise, and return the model's time."""
        tokens = self._tokens[self.at]
        began = time.perf_counter()
        self.model.sense(tokens)
        choice = self.model.choose()
        action = choice.action if choice is not None and choice.goal else "E"
        self.model.perform(action)
        took = time.perf_counter() - began
        if not (self.wall and action == "E"):
            self.at = (self.at + (1 if action == "E" else -1)) % self.places
        return took


class Pursuits(NamedTuple):
    """Medians in seconds of a cycle on a path of so many steps."""

    without_s: float
    under_s: float
    past_s: float


def pursuits(steps: int) -> Pursuits:
    """Follow a path without a goal, with one, and with one whose value was far less when set."""
    ring, cycles = Ring(2 * steps + 2), min(steps - 2, PURSUED)
    rounds = PURSUED // cycles
    goal = (f"at:{steps}",)

    def median_s(*, past: bool = False, wanted: bool = True) -> float:
        took: list[float] = []
        for _ in range(rounds):
            ring.carry_to_start()
            if wanted:
                ring.model.set_goal(goal, 1.0)
            ring.cycle()
            if past:
                ring.model._goals._entries[goal].value_at_start = 1e-3
                ring.cycle()  # in which it looks at the whole path
            took += (ring.cycle() for _ in range(cycles - past))
        return statistics.median(took)

    return Pursuits(median_s(wanted=False), median_s(), median_s(past=True))


def at_a_wall(places: int) -> Pursuits:
    """Try in vain, without a goal; with one, before and after it is kept for a detour."""
    without = Ring(places, wall=True)
    without_s = statistics.median([without.cycle() for _ in range(28)][8:])
    ring = Ring(places, wall=True)
    ring.model.set_goal(("at:1",), 1.0)
    under_s = past_s = math.nan
    for _ in range(8):
        detour = ring.model._planner._detour
        took = [ring.cycle() for _ in range(5)]
        if ring.at or ring.model.goals[0].aside:
            break
        if detour is None:
            under_s = statistics.median(took)
        else:
            past_s = statistics.median(took)
    return Pursuits(without_s, under_s, past_s)


def goals_table() -> Table:
    """What a goal adds to a cycle."""
    found = Table("measure", "figure", "limit")
    for steps in PATHS:
        pursuit = pursuits(steps)
        for state, took in [("under", pursuit.under_s), ("past", pursuit.past_s)]:
            found.add_row(
                f"path of {steps:,} steps: cycle with a goal {state} the multiple / without "
                f"({1e6 * pursuit.without_s:.0f} µs)",
                f"{took / pursuit.without_s:.2f}",
                "2",
            )
    wall = at_a_wall(5000)
    for state, took in [("under the multiple", wall.under_s), ("kept for a detour", wall.past_s)]:
        found.add_row(
            f"at a wall, {state} / without a goal ({1e6 * wall.without_s:.0f} µs)",
            f"{took / wall.without_s:.2f}",
            "2",
        )
    return found


def table() -> Table:
    """Measure, and tabulate the figures."""
    small, large = measure(SMALL), measure(LARGE)
    found = Table("measure", "figure", "limit")
    for size in (small, large):
        found.add_row(
            f"cycle with {size.hypotheses:,} hypotheses (µs)", f"{1e6 * size.cycle_s:.1f}", "40"
        )
        found.add_row("the same towards a goal (µs)", f"{1e6 * size.pursuit_s:.1f}")
    found.add_row("second / first", f"{large.cycle_s / small.cycle_s:.2f}", "2")
    found.add_row(
        f"memory with {large.hypotheses:,}, Signs included (bytes per hypothesis)",
        f"{large.byte_per_hypothesis:.0f}",
        "300",
    )
    return found


if __name__ == "__main__":
    Console().print(table())
    Console().print(goals_table())
