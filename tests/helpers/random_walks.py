"""Random actions in a yard, for many seeds at once."""

from typing import Any

import numpy as np

from farside.places import ACTIONS, Chart


def times_sensed(chart: Chart, actions: int, walks: int, rng: np.random.Generator) -> Any:
    """How often each place is sensed in walks from the dock; walks × places.

    A move against a wall has no effect, and the place is sensed again.
    """
    numbers = {cell: number for number, cell in enumerate(chart.tokens)}
    after = np.array(
        [
            [numbers.get(cell.beside(action), number) for action in ACTIONS]
            for cell, number in numbers.items()
        ]
    )
    every, at = np.arange(walks), np.full(walks, numbers[chart.places["D"]])
    sensed = np.zeros((walks, len(numbers)), int)
    sensed[every, at] = 1
    for _ in range(actions):
        at = after[at, rng.integers(len(ACTIONS), size=walks)]
        sensed[every, at] += 1
    return sensed
