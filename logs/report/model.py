"""What the page is drawn from: one `View` of the run as it was, one as the ground had it.

Times are milliseconds of simulated time, places metres east and north of the chart's south-west
corner. What the script of the page reads has the same names there. A `known` time says when the
ground learned of a thing; where it is absent, the thing is of the run as it was.
"""

from typing import Any, NamedTuple

import msgspec

from farside.logs.spans import LinkCounters
from farside.node import Topic


class Side(NamedTuple):
    """From where a run is looked at.

    Attributes:
        until_ns: the end of what is known of it.
        is_ground: whether it is what the ground knew, and not what was so.
    """

    until_ns: int
    is_ground: bool

    def may_read(self, topic: Topic[Any]) -> bool:
        """Whether a topic tells what is known there."""
        return not self.is_ground or topic.name.startswith("/ground/")


class Series(msgspec.Struct, omit_defaults=True):
    """A curve.

    Attributes:
        name: of the curve.
        t: times, each but the first as its distance from the one before.
        v: values; `None` where the curve is broken.
        lo, hi: the least and the greatest value at each time, where `v` is the mean of several.
        known: when the ground learned each value, likewise by distances.
        look: how it is drawn: as a `line`, in `steps`, or as `dots`.
        asked: whether it is what was asked for, and not what was so.
    """

    name: str
    t: list[int]
    v: list[float | None]
    lo: list[float | None] = []
    hi: list[float | None] = []
    known: list[int] = []
    look: str = "line"
    asked: bool = False


class Panel(msgspec.Struct, omit_defaults=True):
    """Curves on one scale, which begins at 0.

    Attributes:
        title: of the panel.
        unit: of its values; empty for plain numbers, `%` for values of 0 to 1.
        series: the curves.
        top: where the scale ends at least.
    """

    title: str
    unit: str
    series: list[Series]
    top: float = 0.0


class Span(msgspec.Struct, array_like=True):
    """Something lasted for a time.

    Attributes:
        start: when it began.
        end: when it was over; `None` if it was not.
        kind: how it is drawn.
        label: what is written on it.
        title: what is told where one points at it.
        known, known_end: when the ground learned that it had begun, and that it was over.
        count: how many it stands for.
    """

    start: int
    end: int | None
    kind: str
    label: str
    title: str
    known: int | None = None
    known_end: int | None = None
    count: int = 1


class Mark(msgspec.Struct, omit_defaults=True):
    """Something happened at a moment; see `Span`."""

    t: int
    kind: str
    title: str
    known: int | None = None


class Lane(msgspec.Struct, omit_defaults=True):
    """A row of the timeline."""

    name: str
    spans: list[Span] = []
    marks: list[Mark] = []


class Track(msgspec.Struct):
    """Where something was: times as in `Series`, and centimetres east and north."""

    t: list[int] = []
    x: list[int] = []
    y: list[int] = []


class Heard(msgspec.Struct):
    """Telemetry at the ground, in the order in which it arrived; a row for each that is kept.

    Attributes:
        known: when it arrived, as in `Series`.
        so: when it was measured.
        x, y: centimetres east and north, by the estimate on board.
        battery: state of charge, in 1/1000.
        mode, failsafe, action, goals: numbers of words below.
        words: the words.
        gap: rows that are farther apart than this are not taken for neighbours.
    """

    known: list[int] = []
    so: list[int] = []
    x: list[int] = []
    y: list[int] = []
    battery: list[int] = []
    mode: list[int] = []
    failsafe: list[int] = []
    action: list[int] = []
    goals: list[int] = []
    words: list[str] = []
    gap: int = 0


class Words(msgspec.Struct):
    """Every word that crossed, or was lost: columns, in order of sending.

    Attributes:
        t: when the sender handed it to the channel, as in `Series`.
        flight: how long it took, in microseconds; of one that did not arrive, or is not known to,
            how long the one before it took.
        kind: numbers of `kinds`, of a word from the rover plus 100.
        lost: numbers of `losses`; 0 for a word that was not lost.
        again: numbers of the rows whose message had been sent before.
        unended: numbers of the rows of which the log does not tell how they ended.
        named: what is said of the rows that are not of many alike, in their order.
        kinds, losses: the words for both.
    """

    t: list[int]
    flight: list[int]
    kind: list[int]
    lost: list[int]
    again: list[int]
    unended: list[int]
    named: list[str]
    kinds: list[str]
    losses: list[str]


class CommandRow(msgspec.Struct, array_like=True):
    """A command's life; on board in the view of what was so, as told in that of the ground.

    Attributes:
        number, text: of the command.
        sent: when it left.
        taken, begun, ended: when it came to these stages.
        end: the stage that ended it; empty while none is known.
        why: why it ended without being done.
        told_taken, told_begun, told_ended: when the ground learned of these stages.
    """

    number: int
    text: str
    sent: int
    taken: int | None = None
    begun: int | None = None
    ended: int | None = None
    end: str = ""
    why: str = ""
    told_taken: int | None = None
    told_begun: int | None = None
    told_ended: int | None = None


class Proposed(msgspec.Struct, omit_defaults=True):
    """A proposal: when it was made, until when it stood, and its policy path."""

    number: int
    made: int
    action: str
    goal: str
    path: list[str]
    ended: int | None = None
    why: str = ""
    known: int | None = None
    known_end: int | None = None


class Predicted(msgspec.Struct):
    """Where the ground took the rover to be: from when, by what, and places with their chances."""

    t: int
    since: int
    places: list[tuple[str, float]]
    unknown: float


class PolicyMoment(msgspec.Struct):
    """The policy map when a Sign became the top-goal: Signs with value, action and depth."""

    t: int
    goal: str
    places: list[tuple[str, float, str, int]]


class EventRow(msgspec.Struct, omit_defaults=True):
    """An event: its time, who recorded it, what happened, and how much it asks for attention."""

    t: int
    role: str
    text: str
    level: str = ""


class LinkRow(msgspec.Struct):
    """The counts of the frames of one direction."""

    name: str
    counters: LinkCounters


class View(msgspec.Struct, omit_defaults=True):
    """All that a page shows of a run from one side."""

    until: int
    rows: list[str] = []
    cell_m: float = 1.0
    track: Track | None = None
    believed: Track | None = None
    bumps: list[tuple[int, int, int]] = []
    heard: Heard | None = None
    predicted: list[Predicted] = []
    lanes: list[Lane] = []
    words: Words | None = None
    panels: list[Panel] = []
    link: list[LinkRow] = []
    maps: list[PolicyMoment] = []
    commands: list[CommandRow] = []
    command_counts: dict[str, int] = {}
    proposals: list[Proposed] = []
    events: list[EventRow] = []
    notes: list[str] = []
