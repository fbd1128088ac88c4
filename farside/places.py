"""The chart: the places that rover and ground both speak of, their names and their Tokens."""

import re
from collections.abc import Iterator
from typing import NamedTuple

from farside.validation import did_you_mean, shown

WALL, PLACE, ROCK, SHADOW = "#", ".", "o", "~"
"""What a cell of a drawn yard holds, beside capital letters; see `Chart`."""

ACTIONS: dict[str, tuple[int, int]] = {"N": (0, 1), "E": (1, 0), "S": (0, -1), "W": (-1, 0)}
"""Moves to a neighbouring place, as (east, north) in cells."""

ON_CHARGE = "on_charge"
"""The Token that is sensed on the dock."""

BATTERY_LOW = "battery:low"
"""The Token that is sensed while the battery needs charging."""

LINK_UP = "link:up"
"""The Token that is sensed where the radio has a signal, on maps with terrain shadow."""

MAX_CELLS = 250_000
"""The most cells of a map, such as 500 x 500: charts and physics grow with them (project
default)."""

_PLACE = "at:"
_DOCK = "D"
# No map of `MAX_CELLS` is 100,000 cells long.
_COORDINATES = re.compile(r"([0-9]{1,5}),([0-9]{1,5})")


def place_token(place: str) -> str:
    """The Token that is sensed at the place of this name, such as `at:A` or `at:3,4`."""
    return _PLACE + place


def is_place_token(token: str) -> bool:
    """Whether a Token says where the rover is."""
    return token.startswith(_PLACE)


def place_name(token: str) -> str:
    """The name of the place whose Token this is: the reverse of `place_token`."""
    return token.removeprefix(_PLACE)


class Cell(NamedTuple):
    """A square of the chart; `east` and `north` count from 0 at the south-west corner."""

    east: int
    north: int

    def beside(self, action: str) -> "Cell":
        """The cell one `action` away."""
        east, north = ACTIONS[action]
        return Cell(self.east + east, self.north + north)


def cell_named(place: str) -> Cell | None:
    """The cell, on a map or not, that a place is named by, as in `3,4`; `None` if by none."""
    pair = _COORDINATES.fullmatch(place)
    return None if pair is None else Cell(int(pair[1]), int(pair[2]))


class Chart:
    """A walled yard drawn with one character a cell, northernmost row first.

    `#` is wall, `o` a rock, `.` a place, and any capital letter a place with that name; `~` is a
    place from which terrain hides the other end of the link. Places without a letter are named by
    their cell, `EAST,NORTH`. `D` is the dock, where the rover charges.

    Attributes:
        rows: the drawing.
        cell_m: side of a cell.
        places: every place by its name.
        tokens: the Token of every place; see `place_token`.
        cells: the place of every Token.
        rocks: cells with a rock.
        shadow: places in terrain shadow.
        dock: where the rover charges; `None` without one.

    Raises:
        ValueError: if the drawing is empty, ragged, open at its edge, larger than `MAX_CELLS`,
            has an unknown character, or names two places alike. The message says where.
    """

    def __init__(self, rows: tuple[str, ...], cell_m: float) -> None:
        self.rows = rows
        self.cell_m = cell_m
        self.places: dict[str, Cell] = {}
        self.rocks: list[Cell] = []
        self.shadow: set[Cell] = set()
        self._check_shape()
        for row, line in enumerate(rows):
            for east, character in enumerate(line):
                self._read(Cell(east, len(rows) - 1 - row), character, row)
        self.tokens = {cell: place_token(name) for name, cell in self.places.items()}
        self.cells = {token: cell for cell, token in self.tokens.items()}
        self.dock = self.places.get(_DOCK)

    def _check_shape(self) -> None:
        if not self.rows or not self.rows[0]:
            raise ValueError("an empty map")
        for number, line in enumerate(self.rows, start=1):
            if len(line) != len(self.rows[0]):
                raise ValueError(
                    f"map row {number} has {len(line)} cells, the first row {len(self.rows[0])}"
                )
        cells = len(self.rows) * len(self.rows[0])
        if cells > MAX_CELLS:
            raise ValueError(f"expected a map of at most {MAX_CELLS} cells, found {cells}")
        edge = self.rows[0] + self.rows[-1] + "".join(line[0] + line[-1] for line in self.rows)
        if edge.strip(WALL):
            raise ValueError(f"a map that is not walled in: its edge must be all '{WALL}'")

    def _read(self, cell: Cell, character: str, row: int) -> None:
        if character == WALL:
            return
        if character == ROCK:
            self.rocks.append(cell)
            return
        if character in {PLACE, SHADOW}:
            name = f"{cell.east},{cell.north}"
            if character == SHADOW:
                self.shadow.add(cell)
        elif "A" <= character <= "Z":
            name = character
        else:
            expected = f"'{WALL}', '{PLACE}', '{ROCK}', '{SHADOW}' or a capital letter"
            raise ValueError(f"map row {row + 1} has {shown(character)}: expected {expected}")
        if name in self.places:
            raise ValueError(f"map row {row + 1} names a second place '{character}'")
        self.places[name] = cell

    def centre_m(self, cell: Cell) -> tuple[float, float]:
        """The centre of a cell, in metres east and north of the chart's south-west corner."""
        return (cell.east + 0.5) * self.cell_m, (cell.north + 0.5) * self.cell_m

    def cell_at(self, x_m: float, y_m: float) -> Cell:
        """The place at a point, or the nearest place if there is none."""
        cell = Cell(int(x_m // self.cell_m), int(y_m // self.cell_m))
        return cell if cell in self.tokens else self._nearest(cell, x_m, y_m)

    def _nearest(self, cell: Cell, x_m: float, y_m: float) -> Cell:
        """The place nearest to a point of `cell`: the northernmost, then westernmost, of equals.

        Looks at one square ring of cells about `cell` after the other, until none farther out can
        be nearer: the centre of a cell in the n-th ring is at least n - 1/2 cells away, and beside
        that as far as the point is from the map.
        """
        off_east_m = max(0.0, -x_m, x_m - len(self.rows[0]) * self.cell_m)
        off_north_m = max(0.0, -y_m, y_m - len(self.rows) * self.cell_m)
        off_m2 = off_east_m**2 + off_north_m**2
        east = min(max(cell.east, 0), len(self.rows[0]) - 1)
        north = min(max(cell.north, 0), len(self.rows) - 1)
        nearest: tuple[float, int, Cell] | None = None
        for ring in range(max(len(self.rows), len(self.rows[0]))):
            if nearest and off_m2 + ((ring - 0.5) * self.cell_m) ** 2 > nearest[0]:
                break
            for place in _ring(east, north, ring):
                if place in self.tokens:
                    x, y = self.centre_m(place)
                    found = ((x - x_m) ** 2 + (y - y_m) ** 2, -place.north, place)
                    nearest = min(nearest, found) if nearest else found
        if nearest is None:
            raise ValueError("a map without a place")
        return nearest[2]

    def like(self, place: str) -> str:
        """A suggestion of the place that somebody may have meant by a name not on the map."""
        if self.places and (cell := cell_named(place)) is not None:
            return f"; did you mean {place_name(self.tokens[self.cell_at(*self.centre_m(cell))])}?"
        return did_you_mean(place, self.named)

    @property
    def named(self) -> list[str]:
        """The places that have a name of their own, in order."""
        return sorted(place for place in self.places if "," not in place)

    def neighbours(self, cell: Cell) -> Iterator[tuple[str, Cell]]:
        """The actions that lead from `cell` to another place, each with that place."""
        for action in ACTIONS:
            if (beside := cell.beside(action)) in self.tokens:
                yield action, beside

    def reachable(self, start: Cell) -> set[Cell]:
        """The places that a path leads to from `start`, which is one of them."""
        seen, frontier = {start}, [start]
        while frontier:
            for _, beside in self.neighbours(frontier.pop()):
                if beside not in seen:
                    seen.add(beside)
                    frontier.append(beside)
        return seen

    def way(self, start: Cell, goal: Cell) -> list[str]:
        """The actions of a shortest path from `start` to `goal`; empty if they are the same.

        Raises:
            ValueError: if no path leads there.
        """
        came_by: dict[Cell, tuple[str, Cell]] = {}
        frontier, seen = [start], {start}
        while frontier and goal not in seen:
            reached = []
            for cell in frontier:
                for action, beside in self.neighbours(cell):
                    if beside not in seen:
                        seen.add(beside)
                        came_by[beside] = (action, cell)
                        reached.append(beside)
            frontier = reached
        if goal not in seen:
            raise ValueError(f"no way from {self.tokens[start]} to {self.tokens[goal]}")
        actions = []
        while goal != start:
            action, goal = came_by[goal]
            actions.append(action)
        return actions[::-1]


def _ring(east: int, north: int, ring: int) -> Iterator[Cell]:
    """The cells at `ring` king's moves from a cell."""
    for step in range(-ring, ring + 1):
        yield Cell(east + step, north + ring)
        yield Cell(east + step, north - ring)
        yield Cell(east + ring, north + step)
        yield Cell(east - ring, north + step)
