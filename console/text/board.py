"""How the blocks share the terminal: two columns, one column, or rows without frames."""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from farside.console.screen.screen import Screen
from farside.console.text.blocks import (
    event_rows,
    exercise_rows,
    next_rows,
    state_rows,
    status_rows,
    way_rows,
    way_title,
)
from farside.console.text.chart import draw_map, legend
from farside.console.text.strip import STRIP_ROWS, strip_rows, strip_title
from farside.console.text.words import filled, line, told
from farside.logs.terminal.screen import map_panel, panel
from farside.places import Chart

LEAST_WIDTH, LEAST_HEIGHT = 40, 10
"""Columns and rows that `board` needs."""

_NEXT, _WAY, _MAP, _REST, _STATE, _STRIP = range(6)  # the ranks, see `Block`
_TWO_COLUMNS = 78, 18  # columns and rows from which the map has others beside it
_FRAMED = 30  # rows from which a single column has frames
_ROOMY = 33  # rows from which all but the events stands in the columns
_STATE_SPARE = 3  # rows that the state can do without
_RIGHT_LEAST, _RIGHT_SHARE, _RIGHT_MOST = 40, 0.46, 64
_NEXT_ROWS, _WAY_ROWS, _STATE_ROWS, _EVENT_ROWS = 10, 4, 8, 5
_FRAME_WIDTH, _FRAME_HEIGHT = 4, 2

Rows = Callable[[int], list[Text]]
RowsOf = Callable[[Screen, int, int], list[Text]]
"""The rows of a block that has so many."""


class Block(NamedTuple):
    """A block of the board.

    Attributes:
        rank: which has its rows first: 0 before 1.
        least: the rows without which it is left out, its frame included.
        most: the rows that it can use.
        draw: draws it in so many rows.
    """

    rank: int
    least: int
    most: int
    draw: Callable[[int], RenderableType]


def board(screen: Screen, chart: Chart | None, width: int, height: int) -> RenderableType:
    """Draw a screen, from 40 columns by 10 rows on, not below.

    The clocks, the mode and the sign of what is on the way always have their rows, and all keep
    their places while the terminal keeps its size. What is less important gives way where there is
    no room: NEXT has its rows first, then what is on the way, the map, alarms, and the rest.

    Args:
        screen: what is shown.
        chart: the map; `None` before the ground has it.
        width: columns to fill.
        height: rows to fill.
    """
    status = status_rows(screen, width)
    drawn = _Blocks(screen, chart)
    room = height - len(status)
    if width >= _TWO_COLUMNS[0] and height >= _TWO_COLUMNS[1]:
        return Group(*status, *_columns(drawn, width, room))
    framed = height >= _FRAMED
    exercise = drawn.exercise(width) if framed else []
    blocks = [
        *exercise,
        drawn.next(width, framed=framed),
        drawn.way(width, framed=framed),
        drawn.map(width, framed=framed),
        drawn.state(width, framed=framed),
        drawn.events(width, framed=framed),
        drawn.strip(width),
    ]
    # What is over goes from the map on: it alone can use more.
    return Group(*status, _stack(blocks, room, elastic=len(exercise) + 2))


def _columns(drawn: "_Blocks", width: int, height: int) -> Sequence[RenderableType]:
    """The map beside what is next; all else below them, or where there is room beside them too."""
    right = min(max(_RIGHT_LEAST, int(width * _RIGHT_SHARE)), _RIGHT_MOST)
    left = width - right
    west, east = [drawn.map(left)], [drawn.next(right)]
    if height >= _ROOMY:
        east = [*drawn.exercise(right), *east, drawn.way(right)]
        below = [drawn.events(width)]
        rows = height - below[0].most
        west.append(drawn.strip(left))
        state = drawn.state(left)
        free = rows - sum(block.most for block in west)
        (west if free >= state.most - _STATE_SPARE else east).append(state)
    else:
        below = [
            *(block._replace(least=3, most=4) for block in drawn.exercise(width)),
            drawn.way(width, framed=False)._replace(least=2, most=3),
            drawn.state(width, framed=False)._replace(least=3),
            drawn.events(width, framed=False),
        ]
        rows = min(max(west[0].most, east[0].most), height - sum(block.least for block in below))
    body = Table.grid()
    body.add_column(width=left)
    body.add_column(width=right)
    elastic = next((i for i, block in enumerate(east) if block.rank == _WAY), 0)
    body.add_row(_stack(west, rows, elastic=0), _stack(east, rows, elastic=elastic))
    return [body, _stack(below, height - rows, elastic=len(below) - 1)]


def _stack(blocks: Sequence[Block], height: int, *, elastic: int) -> RenderableType:
    """Blocks below each other, in exactly so many rows.

    Args:
        blocks: the blocks, from the top.
        height: the rows.
        elastic: the index of the one that has what the others cannot use.
    """
    ranked = sorted(range(len(blocks)), key=lambda index: blocks[index].rank)
    given = [0] * len(blocks)
    for index in ranked:
        if sum(given) + blocks[index].least <= height:
            given[index] = blocks[index].least
    for index in _turns(blocks, ranked):
        if given[index] and sum(given) < height and given[index] < blocks[index].most:
            given[index] += 1
    given[elastic if given[elastic] else ranked[0]] += height - sum(given)
    return Group(*(block.draw(rows) for block, rows in zip(blocks, given, strict=True) if rows > 0))


def _turns(blocks: Sequence[Block], ranked: Sequence[int]) -> Iterator[int]:
    """Which block is to have the next row: the first until it has enough, the others in turn."""
    yield from [ranked[0]] * blocks[ranked[0]].most
    yield from list(ranked[1:]) * max(block.most for block in blocks)


class _Blocks:
    """The blocks of a screen, each for a width, with a frame or without."""

    def __init__(self, screen: Screen, chart: Chart | None) -> None:
        self.screen, self._chart = screen, chart

    def exercise(self, width: int) -> list[Block]:
        """It, if there is one."""

        def rows(height: int) -> list[Text]:
            shown = exercise_rows(self.screen, width - _FRAME_WIDTH, height)
            for row in shown:
                row.pad_left(_FRAME_WIDTH // 2)  # in line with what has a frame
            return shown

        return [_bare(_REST, 1, 2, rows)] if self.screen.exercise else []

    def next(self, width: int, *, framed: bool = True) -> Block:
        rows = self._rows(next_rows, width, framed=framed)
        if not framed:
            return _bare(_NEXT, 4, _NEXT_ROWS, rows)
        return _framed(_NEXT, 4, _NEXT_ROWS, "NEXT", rows)

    def way(self, width: int, *, framed: bool = True) -> Block:
        rows = self._rows(way_rows, width, framed=framed)
        if not framed:
            return _bare(_WAY, 1, _WAY_ROWS, rows)
        return _framed(_WAY, 3, _WAY_ROWS, way_title(self.screen).upper(), rows)

    def _rows(self, drawn: RowsOf, width: int, *, framed: bool) -> Rows:
        inside = width - _FRAME_WIDTH if framed else width
        return lambda rows: drawn(self.screen, inside, rows)

    def map(self, width: int, *, framed: bool = True) -> Block:
        view, chart = self.screen.map, self._chart
        high = len(chart.rows) if chart is not None else 1
        if not framed:
            return _bare(_MAP, 3, high, lambda rows: draw_map(view, chart, width, rows).rows)

        def draw(rows: int) -> RenderableType:
            drawn = draw_map(view, chart, width - _FRAME_WIDTH, rows - _FRAME_HEIGHT)
            arrows = 2 * len(drawn.more) + 6 if drawn.more else 0
            title = line(told(view.policy_label or "map"), max(width - 6 - arrows, 8))
            return map_panel(drawn, rows, title=title, legend=legend(view, width - 6))

        return Block(_MAP, min(high, 5) + _FRAME_HEIGHT, high + _FRAME_HEIGHT, draw)

    def state(self, width: int, *, framed: bool = True) -> Block:
        rows = self._rows(state_rows, width, framed=framed)
        if not framed:
            return _bare(_STATE, 1, _STATE_ROWS, rows)
        return _framed(_STATE, 3, _STATE_ROWS, "STATE", rows)

    def events(self, width: int, *, framed: bool = True) -> Block:
        rows = self._rows(event_rows, width, framed=framed)
        if not framed:
            return _bare(_REST, 1, _EVENT_ROWS, rows)
        return _framed(_REST, 2, _EVENT_ROWS, "EVENTS", rows)

    def strip(self, width: int) -> Block:
        strip, now_ns = self.screen.strip, self.screen.now_ns
        inside = width - _FRAME_WIDTH
        rows: Rows = lambda _: strip_rows(strip, now_ns, inside)  # noqa: E731
        return _framed(_STRIP, STRIP_ROWS, STRIP_ROWS, strip_title(strip), rows)


def _bare(rank: int, least: int, most: int, rows: Rows) -> Block:
    return Block(rank, least, most, lambda height: Group(*filled(rows(height), height)))


def _framed(rank: int, least: int, most: int, title: str, rows: Rows) -> Block:
    def draw(height: int) -> RenderableType:
        inside = height - _FRAME_HEIGHT
        shown = filled(rows(inside), inside)
        return panel(Text(title), Group(*shown), height=height)

    return Block(rank, least + _FRAME_HEIGHT, most + _FRAME_HEIGHT, draw)
