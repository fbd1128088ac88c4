"""The yard with the rover and its goals, as text and as a picture."""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from farside.places import PLACE, ROCK, SHADOW, WALL, Chart

_PIXELS = 16  # of a cell
_ROVER, _GOAL = "@", "*"
_COLOURS = {
    WALL: (70, 70, 78),
    ROCK: (120, 92, 70),
    SHADOW: (150, 150, 170),
    PLACE: (236, 233, 226),
    "D": (150, 190, 235),
}
_GOAL_COLOUR, _ROVER_COLOUR = (110, 180, 110), (200, 60, 50)


def as_text(chart: Chart, place: str | None, goals: Collection[str]) -> str:
    """The map, with `@` where the rover is taken to be, and `*` at goals without a letter."""
    rows = [list(row) for row in chart.rows]
    marks = [(goal, _GOAL) for goal in goals if goal not in chart.named]
    marks += [] if place is None else [(place, _ROVER)]
    for name, mark in marks:
        cell = chart.places[name]
        rows[len(rows) - 1 - cell.north][cell.east] = mark
    return "\n".join(map("".join, rows)) + "\n"


def as_picture(chart: Chart, place: str | None, goals: Collection[str]) -> NDArray[np.uint8]:
    """The map in colours, (rows x 16, columns x 16, 3): goals are green, the rover a red spot."""
    cells = np.array(
        [[_COLOURS.get(mark, _COLOURS[PLACE]) for mark in row] for row in chart.rows], np.uint8
    )
    for goal in goals:
        cell = chart.places[goal]
        cells[len(chart.rows) - 1 - cell.north, cell.east] = _GOAL_COLOUR
    picture = cells.repeat(_PIXELS, axis=0).repeat(_PIXELS, axis=1)
    if place is not None:
        cell, quarter = chart.places[place], _PIXELS // 4
        top = (len(chart.rows) - 1 - cell.north) * _PIXELS
        left = cell.east * _PIXELS
        spot = slice(top + quarter, top + 3 * quarter), slice(left + quarter, left + 3 * quarter)
        picture[spot] = _ROVER_COLOUR
    return picture
