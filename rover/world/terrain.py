"""The terrain as the physics sees it: walls and rocks as rigid shapes."""

import pymunk

from farside.places import WALL, Chart

OBSTACLE = 1
"""Collision type of whatever stops the rover."""

_ROCK_RADIUS_CELL = 0.4


def obstacles(space: pymunk.Space, chart: Chart, friction: float) -> list[pymunk.Shape]:
    """Walls and rocks of a chart as static shapes of `space`, of collision type `OBSTACLE`."""
    shapes: list[pymunk.Shape] = []
    cell_m, height = chart.cell_m, len(chart.rows)
    for row, line in enumerate(chart.rows):
        south = (height - 1 - row) * cell_m
        for begin, end in _runs(line):
            west, east = begin * cell_m, end * cell_m
            corners = [(west, south), (east, south), (east, south + cell_m), (west, south + cell_m)]
            shapes.append(pymunk.Poly(space.static_body, corners))
    shapes += (
        pymunk.Circle(space.static_body, _ROCK_RADIUS_CELL * cell_m, chart.centre_m(cell))
        for cell in chart.rocks
    )
    for shape in shapes:
        shape.friction = friction
        shape.collision_type = OBSTACLE
    return shapes


def _runs(line: str) -> list[tuple[int, int]]:
    """Columns [begin, end) of each stretch of wall in one row."""
    runs: list[tuple[int, int]] = []
    for east, character in enumerate(line):
        if character != WALL:
            continue
        if runs and runs[-1][1] == east:
            runs[-1] = runs[-1][0], east + 1
        else:
            runs.append((east, east + 1))
    return runs
