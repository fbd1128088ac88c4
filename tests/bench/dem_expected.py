"""Time of a cycle on slippery ground, by the best outcome of each action and by all of them."""

import statistics
import time
from collections.abc import Sequence

import msgspec
import numpy as np
from rich.console import Console
from rich.table import Table

from farside.dem import DynamicExpectancyModel, Exploration, Parameters, Values

ACTIONS = "NESW"
STEPS = ((0, 1), (1, 0), (0, -1), (-1, 0))
SLIPS = (0, 0, 0, 1, -1)
TRIES = 10
SIDES = (50, 100)
CYCLES = 200
FINDS = 30


class Ground:
    """A square of places where three moves in five go ahead, and one to each side.

    The model has tried every move from every place ten times. A goal is near a corner.
    """

    def __init__(self, side: int) -> None:
        self._side = side
        self._goal = [f"at:{side - 3},{side - 3}"]
        self.model = DynamicExpectancyModel(
            dict.fromkeys(ACTIONS, 1.0),
            Parameters(exploration=Exploration.NONE),
            rng=np.random.default_rng(0),
        )
        slips = np.random.default_rng(1)
        for east in range(side):
            for north in range(side):
                for action in range(4):
                    for slip in slips.choice(SLIPS, TRIES).tolist():
                        went = self._after((east, north), (action + slip) % 4)
                        for here, done in (((east, north), ACTIONS[action]), (went, None)):
                            self.model.sense([self._token(here)])
                            self.model.perform(done)

    @staticmethod
    def _token(place: tuple[int, int]) -> str:
        return f"at:{place[0]},{place[1]}"

    def _after(self, place: tuple[int, int], went: int) -> tuple[int, int]:
        east, north = np.clip(np.add(place, STEPS[went]), 0, self._side - 1).tolist()
        return east, north

    def _cycle(self, token: str) -> tuple[str | None, float]:
        """A cycle in which the model does what it wants to: that, and the time in seconds."""
        if not self.model.goals:
            self.model.set_goal(self._goal)
        began = time.perf_counter()
        self.model.sense([token])
        choice = self.model.choose()
        action = None if choice is None else choice.action
        self.model.perform(action)
        return action, time.perf_counter() - began

    def travel(self) -> list[float]:
        """Go to the goal, again and again, and return the time of each cycle but the first."""
        slips, place, took = np.random.default_rng(2), (self._side // 2, self._side // 2), []
        for _ in range(CYCLES):
            action, seconds = self._cycle(self._token(place))
            took.append(seconds)
            if action is not None:
                went = (ACTIONS.index(action) + int(slips.choice(SLIPS))) % 4
                place = self._after(place, went)
        return took[1:]

    def find(self) -> list[float]:
        """Come to places that nobody knows, and return the time of each cycle there and after."""
        took, place = [], self._token((self._side // 2, self._side // 2))
        for number in range(FINDS):
            self._cycle(place)
            took += [self._cycle(token)[1] for token in (f"new {number}", place)]
        return took

    def be_worth(self, values: Values) -> None:
        """Reckon by these values from now on."""
        self.model.change(msgspec.structs.replace(self.model.parameters, values=values))


def within(took: Sequence[float]) -> tuple[str, str]:
    """The median, and what 99 of 100 are within, in milliseconds."""
    return (
        f"{1e3 * statistics.median(took):.2f}",
        f"{1e3 * statistics.quantiles(took, n=100)[-1]:.2f}",
    )


def table() -> Table:
    """Measure, and tabulate the figures."""
    found = Table(
        "values", "hypotheses", "cycle, median (ms)", "99 of 100 within", "with a find, median",
        "99 of 100 within",
    )  # fmt: skip
    for side in SIDES:
        ground = Ground(side)
        for values in Values:
            ground.be_worth(values)
            count = f"{ground.model.hypothesis_count:,}"
            found.add_row(values.value, count, *within(ground.travel()), *within(ground.find()))
    return found


if __name__ == "__main__":
    Console().print(table())
