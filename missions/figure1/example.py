"""The worked example of the seed: rooms along a corridor, 2000 random actions, three goals."""

import time
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from farside.dem import DynamicExpectancyModel, PolicyValue
from farside.dem.lab.picture import ramp
from farside.places import ACTIONS, Cell, Chart

CYCLES = 2000
"""Random actions before the first goal is set. Source: seed."""

ACTION_COST = 2.66
"""Cost of each action. Source: seed."""

GOALS = ("A", "B", "C")
"""The goals, one after another. Source: seed."""

YARD = (
    "###########",
    "#A...#...B#",
    "#.........#",
    "#...###..##",
    "#....D....#",
    "##..###...#",
    "#.........#",
    "#C...#o...#",
    "###########",
)
"""Rooms on both sides of a corridor, each with a door to it and to the room beside, so wide that
random actions get everywhere (`VISITED_TWICE`). Source: project default."""

VISITED_TWICE = 0.96
"""Share of the seeds with which every place is sensed at least twice, as in the seed. Measured with
10,000 of them; it is .06 in the yard of the mission `blackout`, whose doors are narrower."""

SEED = 1

TALLEST = 4.0
"""Height of the highest column, in cells."""

_GOAL, _WALL, _ROCK, _UNSEEN = "#2fae72", "#cfd5dd", "#98897a", "#f3f4f6"


class Panel(NamedTuple):
    """The policy map for one goal.

    Attributes:
        goal: the goal's name.
        values: policy values by place, without places that have no known path to the goal.
        build_s: wall time to build the Dynamic Policy Map. For display only.
    """

    goal: str
    values: Mapping[Cell, PolicyValue]
    build_s: float


class Figure1(NamedTuple):
    """The yard, the model that learned it, and a panel for each goal.

    Attributes:
        chart: the yard.
        model: the model.
        twice: number of places that it sensed at least twice.
        panels: a policy map for each goal.
    """

    chart: Chart
    model: DynamicExpectancyModel
    twice: int
    panels: tuple[Panel, ...]


class Block(NamedTuple):
    """A box that fills a cell of the chart, ready to be drawn.

    Attributes:
        cell: the cell.
        height: in cells.
        colour: as `#rrggbb`.
        words: lines of text about it.
    """

    cell: Cell
    height: float
    colour: str
    words: tuple[str, ...]


def run_figure1(seed: int) -> Figure1:
    """Learn the yard by random actions from the dock, then build the three maps.

    A move against a wall or a rock has no effect.

    Args:
        seed: seed of the random actions.
    """
    chart = Chart(YARD, 1.0)
    action_seed, model_seed = np.random.SeedSequence(seed).spawn(2)
    model = DynamicExpectancyModel(
        dict.fromkeys(ACTIONS, ACTION_COST), rng=np.random.default_rng(model_seed)
    )
    cell, sensed = chart.cells["at:D"], Counter[Cell]()
    for action in np.random.default_rng(action_seed).choice(list(ACTIONS), CYCLES):
        model.sense([chart.tokens[cell]])
        sensed[cell] += 1
        model.perform(str(action))
        beside = cell.beside(action)
        cell = beside if beside in chart.tokens else cell
    twice = sum(times > 1 for times in sensed.values())
    return Figure1(chart, model, twice, tuple(_panel(chart, model, goal) for goal in GOALS))


def _panel(chart: Chart, model: DynamicExpectancyModel, goal: str) -> Panel:
    sign = [f"at:{goal}"]
    model.set_goal(sign, priority=1.0)
    began = time.perf_counter()
    values = model.policy_map()
    build_s = time.perf_counter() - began
    model.withdraw_goal(sign)
    return Panel(goal, {chart.cells[value.sign[0]]: value for value in values}, build_s)


def greatest_value(figure: Figure1) -> float:
    """The greatest policy value in any panel, for a common scale; 0 if there is none."""
    values = (value.value for panel in figure.panels for value in panel.values.values())
    return max(values, default=0.0)


def blocks(figure: Figure1, panel: Panel) -> Iterator[Block]:
    """The contents of one picture: a column for each place, walls and rocks."""
    chart, greatest = figure.chart, greatest_value(figure)
    rocks = set(chart.rocks)
    for row, line in enumerate(reversed(chart.rows)):
        for east in range(len(line)):
            cell = Cell(east, row)
            if cell in chart.tokens:
                yield _column(chart.tokens[cell], cell, panel.values.get(cell), greatest)
            elif cell in rocks:
                yield Block(cell, 0.3, _ROCK, ("rock",))
            else:
                yield Block(cell, 0.5, _WALL, ("wall",))


def _column(token: str, cell: Cell, value: PolicyValue | None, greatest: float) -> Block:
    if value is None:
        return Block(cell, 0.0, _UNSEEN, (token, "no known path to the goal"))
    if value.action is None:
        return Block(cell, 0.0, _GOAL, (token, "the goal"))
    return Block(
        cell,
        TALLEST * value.value / greatest,
        ramp(value.value / greatest),
        (
            token,
            f"policy value {value.value:.2f}",
            f"best action {value.action}",
            f"valence depth {value.depth}",
        ),
    )
