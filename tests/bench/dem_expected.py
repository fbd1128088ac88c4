"""Time of a cycle on slippery ground, by the best outcome of each action and by all of them."""

import statistics
import time

import numpy as np
from rich.console import Console
from rich.table import Table

from farside.dem import DynamicExpectancyModel, Exploration, Parameters, Values

ACTIONS = "NESW"
STEPS = ((0, 1), (1, 0), (0, -1), (-1, 0))
SIDE = 100
CYCLES = 200


class Ground:
    """A square of places where three moves in five go ahead, and one to each side."""

    def __init__(self, values: Values) -> None:
        self.model = DynamicExpectancyModel(
            dict.fromkeys(ACTIONS, 1.0),
            Parameters(values=values, exploration=Exploration.NONE),
            rng=np.random.default_rng(0),
        )
        for east in range(SIDE):
            for north in range(SIDE):
                for action in range(4):
                    for ahead in (0, 0, 0, 1, -1):
                        self._teach((east, north), action, (action + ahead) % 4)

    def _teach(self, place: tuple[int, int], action: int, went: int) -> None:
        for here, done in ((place, ACTIONS[action]), (self._after(place, went), None)):
            self.model.sense([f"at:{here[0]},{here[1]}"])
            self.model.perform(done)

    @staticmethod
    def _after(place: tuple[int, int], went: int) -> tuple[int, int]:
        east, north = np.clip(np.add(place, STEPS[went]), 0, SIDE - 1).tolist()
        return east, north

    def cycles(self) -> list[float]:
        """Go to a goal near a corner, and return the time of each cycle but the first."""
        rng, place = np.random.default_rng(1), (SIDE // 2, SIDE // 2)
        goal = [f"at:{SIDE - 3},{SIDE - 3}"]
        took = []
        for _ in range(CYCLES):
            if not self.model.goals:
                self.model.set_goal(goal)
            began = time.perf_counter()
            self.model.sense([f"at:{place[0]},{place[1]}"])
            choice = self.model.choose()
            self.model.perform(None if choice is None else choice.action)
            took.append(time.perf_counter() - began)
            if choice is not None:
                aside = int(rng.choice((0, 0, 0, 1, -1)))
                place = self._after(place, (ACTIONS.index(choice.action) + aside) % 4)
        return took[1:]


def table() -> Table:
    """Measure, and tabulate the figures."""
    found = Table("values", "hypotheses", "cycle, median (ms)", "99 of 100 within (ms)")
    for values in Values:
        ground = Ground(values)
        took = ground.cycles()
        found.add_row(
            values.value,
            f"{ground.model.hypothesis_count:,}",
            f"{1e3 * statistics.median(took):.2f}",
            f"{1e3 * statistics.quantiles(took, n=100)[-1]:.2f}",
        )
    return found


if __name__ == "__main__":
    Console().print(table())
