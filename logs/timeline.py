"""A run's modes, failsafe, link and goals over time, as lines of text."""

from collections.abc import Iterable
from itertools import pairwise

from farside.control import Failsafe, Mode
from farside.logs.events import time_text
from farside.logs.views.run import RunView
from farside.node import Direction, to_ns
from farside.places import place_name

_MODES = {Mode.GUIDED: "g", Mode.SHARED: "s", Mode.AUTONOMOUS: "A"}
_FAILSAFES = {Failsafe.NOMINAL: "·", Failsafe.HOLD: "h", Failsafe.ALONE: "A", Failsafe.SAFE: "S"}
_UP, _OUT = "─", "x"
_LEGEND = "g guided, s shared, A autonomous; h hold, A alone, S safe; x outage"
_NAME_WIDTH = 10

_Span = tuple[float, float, str]
"""From when until when, in seconds, and the character that stands for it."""


def timeline(run: RunView, columns: int = 64) -> list[str]:
    """A run's modes, failsafe, outages and goals reached, in so many columns, under its seconds.

    A column shows the least usual of all that was so in its share of the time: what was short is
    seen too.

    Raises:
        ValueError: as ground, which does not know most of it.
    """
    end_s = run.duration_s
    modes = [(span.t_s, _MODES[span.mode]) for span in run.modes]
    failsafes = [(span.t_s, _FAILSAFES[span.state]) for span in run.failsafes]
    outages = {
        way: [(out.start_s, out.end_s, _OUT) for out in run.outages if out.direction is way]
        for way in Direction
    }
    reached = [
        (goal.reached_s, goal.reached_s, _letter(goal.tokens))
        for goal in run.goals
        if goal.reached_s is not None
    ]
    always: list[_Span] = [(0.0, end_s, _UP)]
    bands = {
        "mode": _painted(_spans(modes, end_s), "".join(_MODES.values()), end_s, columns),
        "failsafe": _painted(_spans(failsafes, end_s), "·hAS", end_s, columns),
        "uplink": _painted([*always, *outages[Direction.UP]], _UP + _OUT, end_s, columns),
        "downlink": _painted([*always, *outages[Direction.DOWN]], _UP + _OUT, end_s, columns),
        "reached": _painted(reached, "", end_s, columns),
    }
    return [
        " " * _NAME_WIDTH + _axis(end_s, columns),
        *(f"{name:<{_NAME_WIDTH}}{band}".rstrip() for name, band in bands.items()),
        " " * _NAME_WIDTH + _LEGEND,
    ]


def _spans(changes: list[tuple[float, str]], end_s: float) -> list[_Span]:
    ends = [*changes, (end_s, "")]
    return [(start_s, until_s, mark) for (start_s, mark), (until_s, _) in pairwise(ends)]


def _painted(spans: Iterable[_Span], order: str, end_s: float, columns: int) -> str:
    """The spans as characters; of those in one column the last in `order` is seen."""
    cells = [" "] * columns
    per_s = columns / end_s if end_s else 0.0
    for start_s, until_s, mark in sorted(spans, key=lambda span: order.find(span[2])):
        first = min(int(start_s * per_s), columns - 1)
        # What ends where a column begins is not in it; what has no length has a column.
        last = max(first, min(-int(-until_s * per_s // 1) - 1, columns - 1))
        cells[first : last + 1] = mark * (last + 1 - first)
    return "".join(cells)


def _letter(tokens: Iterable[str]) -> str:
    name = place_name(next(iter(tokens), ""))
    return name if len(name) == 1 and name.isprintable() else "*"


def _axis(end_s: float, columns: int) -> str:
    middle, end = (time_text(to_ns(share * end_s)) for share in (0.5, 1.0))
    axis = "0 s".ljust(columns // 2) + middle
    return axis.ljust(columns - len(end)) + end
