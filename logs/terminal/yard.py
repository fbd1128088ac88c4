"""A map as rows of text, cut to the part about the rover where it is larger."""

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

from rich.text import Text

from farside.logs.picture import Picture
from farside.places import ROCK, SHADOW, WALL, Cell, Chart, place_name
from farside.topics import Prediction

_DIM, _FAIR = "bright_black", "yellow"
_SURE = 0.5  # below this no single place can stand for a prediction (project default)

Mark = tuple[str, str]
"""What stands on a place, of one or two characters, and its style."""


class DrawnMap(NamedTuple):
    """The map as it is shown.

    Attributes:
        rows: its rows, northernmost first.
        more: an arrow for each direction in which it goes on: `←`, `→`, `↑` and `↓`.
    """

    rows: list[Text]
    more: str

    @property
    def width(self) -> int:
        """Columns of the widest row."""
        return max(row.cell_len for row in self.rows)


class _View(NamedTuple):
    """The cells that are shown: from `east` and `south` on, so many of them."""

    east: int
    south: int
    columns: int
    rows: int

    def more_of(self, chart: Chart) -> str:
        beyond = {
            "←": self.east > 0,
            "→": self.east + self.columns < len(chart.rows[0]),
            "↑": self.south + self.rows < len(chart.rows),
            "↓": self.south > 0,
        }
        return "".join(arrow for arrow, there in beyond.items() if there)

    def cells(self) -> Iterator[Iterator[Cell]]:
        """Row by row, northernmost first."""
        for north in reversed(range(self.south, self.south + self.rows)):
            yield (Cell(east, north) for east in range(self.east, self.east + self.columns))


def draw_yard(picture: Picture, width: int, height: int) -> DrawnMap:
    """Draw the map in at most `width` columns and `height` rows.

    A cell takes two columns, to look square, if the whole width of the map then has room. What is
    shown of a larger map has the rover in the middle, as far as the map goes.
    """
    chart = picture.chart
    if chart is None:
        return DrawnMap([Text("no map yet", style=_DIM)], "")
    return draw_chart(chart, _marks(picture, chart), _rover(picture, chart), width, height)


def draw_chart(
    chart: Chart, marks: Mapping[Cell, Mark], middle: Cell | None, width: int, height: int
) -> DrawnMap:
    """Draw a chart with marks on its places, as `draw_yard` does.

    Args:
        chart: the chart.
        marks: what stands on its places; of two characters the second is left out where a cell has
            one column only.
        middle: the cell to be in the middle, if possible; by default that of the chart.
        width: the most columns.
        height: the most rows.
    """
    per_cell = 2 if 2 * len(chart.rows[0]) <= width else 1
    view = _view(chart, middle, max(width // per_cell, 1), max(height, 1))
    rows = []
    for cells in view.cells():
        row = Text(no_wrap=True)
        for cell in cells:
            row.append(*_drawn(chart, cell, marks, per_cell))
        rows.append(row)
    return DrawnMap(rows, view.more_of(chart))


def _view(chart: Chart, middle: Cell | None, columns: int, rows: int) -> _View:
    columns, rows = min(columns, len(chart.rows[0])), min(rows, len(chart.rows))
    middle = middle or Cell(len(chart.rows[0]) // 2, len(chart.rows) // 2)
    return _View(
        _first(middle.east, columns, len(chart.rows[0])),
        _first(middle.north, rows, len(chart.rows)),
        columns,
        rows,
    )


def _first(middle: int, shown: int, size: int) -> int:
    return min(max(middle - shown // 2, 0), size - shown)


def _rover(picture: Picture, chart: Chart) -> Cell | None:
    """Where the rover is, or was when the ground last heard of it."""
    if picture.pose is not None:
        return chart.cell_at(picture.pose.x_m, picture.pose.y_m)
    if picture.telemetry is not None:
        return chart.cell_at(picture.telemetry.x_m, picture.telemetry.y_m)
    return None


def _drawn(chart: Chart, cell: Cell, marks: Mapping[Cell, Mark], columns: int) -> Mark:
    character = chart.rows[len(chart.rows) - 1 - cell.north][cell.east]
    mark, style = marks.get(cell, (" ", ""))
    if character == WALL:
        return "█" * columns, _DIM
    if character == ROCK:
        return "▒" * columns, _FAIR
    if character == SHADOW and mark == " ":
        return "~".ljust(columns), _DIM
    return mark.ljust(columns)[:columns], style


def _marks(picture: Picture, chart: Chart) -> dict[Cell, Mark]:
    """The mark of each place; the rover covers the ground's fix of it, then its prediction."""
    proposed = {
        token for step in (picture.proposal.path if picture.proposal else ()) for token in step.sign
    }
    goals = {token for sign in picture.goals for token in sign}
    marks = {
        cell: _place_mark(
            place_name(token),
            visited=token in picture.visited,
            proposed=token in proposed,
            goal=token in goals,
        )
        for token, cell in chart.cells.items()
    }
    foreseen = foreseen_place(picture.prediction)
    if foreseen in chart.cells:
        marks[chart.cells[foreseen]] = ("◌", "magenta")
    if picture.telemetry is not None:
        marks[chart.cell_at(picture.telemetry.x_m, picture.telemetry.y_m)] = ("◇", "bold magenta")
    if picture.pose is not None:
        arrow = heading(picture.pose.heading_rad)
        marks[chart.cell_at(picture.pose.x_m, picture.pose.y_m)] = (arrow, "bold green")
    return marks


def heading(heading_rad: float) -> str:
    """An arrow that points there; 0 is east, and angles grow towards north."""
    return "→↗↑↖←↙↓↘"[round(heading_rad % math.tau / (math.pi / 4)) % 8]


def foreseen_place(prediction: Prediction | None) -> str | None:
    """The Token of the place where the rover is predicted to be with at least 50 %, if any."""
    if prediction is None or not prediction.likely:
        return None
    first = prediction.likely[0]
    return first.sign[0] if first.probability >= _SURE and first.sign else None


def _place_mark(place: str, *, visited: bool, proposed: bool, goal: bool) -> Mark:
    if place.isalpha():
        return place, "bold yellow" if goal else "bold cyan" if proposed else "bold"
    if proposed:
        return "•", "cyan"
    return ("·", _DIM) if visited else (" ", "")
