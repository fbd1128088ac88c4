"""Time of a cycle and memory of a hypothesis, in a small world and a large one."""

import resource
import statistics
import time
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from farside.dem import DynamicExpectancyModel

ACTIONS = "NESW"
SMALL, LARGE = 16, 500  # sides of the squares: about 1,000 and 1,000,000 hypotheses
CYCLES = 20_000
PURSUED = 200


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
