"""The light strip: ground above, rover below, and between them every word on its way."""

from collections.abc import Iterator

from rich.console import Group
from rich.panel import Panel
from rich.text import Text

from farside.logs.file.reading import LogFile
from farside.logs.picture import Picture
from farside.logs.spacetime import Word, words
from farside.logs.terminal.screen import panel
from farside.node import NS_PER_S, Direction, Role, to_s
from farside.topics import GROUND_TELEMETRY, LINK_OUTAGE

STRIP_HEIGHT = 7
"""Rows of the strip, its frame included."""

SLOPE = 6
"""Columns that a word takes on its way: enough for one to see that it takes time."""

LEAST_NS = NS_PER_S // 2
"""The light time below which the scale stays as it is."""

NAMES_WIDTH = 7
"""Columns of the names of the rails."""

_ROWS = 5  # the ground's rail, the way, the rover's rail
_AHEAD = 8  # columns after now, into which the words on their way go on
_FRAME = 4
_KEPT = 16  # stretches

_DIM, _NEWS, _LOST = "bright_black", "bold", "bold red"
_WORDS_OF_COURSE = ("telemetry", "heartbeat", "report", "stored")
_RAILS = {Role.GROUND: 0, Role.ROVER: _ROWS - 1}
_STROKES = {Direction.UP: "╲", Direction.DOWN: "╱"}

_Mark = tuple[str, str]
"""A character and its style."""


class LightStrip:
    """Draws the words of a log about a moment, as a space-time diagram.

    Args:
        log: the log; as ground, the words that the ground sent and heard.
    """

    def __init__(self, log: LogFile) -> None:
        self._log = log
        self._stretches: dict[tuple[int, int], list[Word]] = {}

    def draw(self, picture: Picture, now_ns: int, width: int) -> Panel:
        """The strip at a moment: what comes after it is not drawn, but where words will arrive.

        Args:
            picture: the state of the run at `now_ns`.
            now_ns: simulated time.
            width: columns to fill.

        Raises:
            LogError: if the log is damaged there.
        """
        columns = max(width - _FRAME - NAMES_WIDTH, _AHEAD + 1)
        light_ns = self._light_ns(now_ns)
        per_ns = max(light_ns, LEAST_NS) // SLOPE
        # In whole columns, so that what is drawn moves and does not flicker.
        first = now_ns // per_ns - (columns - _AHEAD)
        drawing = Drawing(first * per_ns, per_ns, columns, now_ns)
        for down_ns, up_ns in self._gaps(picture, now_ns, first * per_ns):
            drawing.gap(down_ns, up_ns)
        for word in self._words(first * per_ns - 2 * light_ns, now_ns, per_ns * columns):
            number = word.what.removeprefix("command ")
            drawing.word(
                word.direction,
                word.sent_ns,
                word.sent_ns + light_ns if word.arrives_ns is None else word.arrives_ns,
                label=number if number.isdecimal() else "",
                lost=word.lost is not None,
                routine=word.what.startswith(_WORDS_OF_COURSE),
            )
        title = f"light {to_s(light_ns):.1f} s: ╲ to the rover  ╱ to the ground  × lost"
        return panel(title, Group(*drawing.rows()), height=STRIP_HEIGHT)

    def _light_ns(self, now_ns: int) -> int:
        """How long the last telemetry was on its way; 0 before the first."""
        heard = self._log.latest(GROUND_TELEMETRY, now_ns)
        return 0 if heard is None else max(heard.log_time_ns - heard.publish_time_ns, 0)

    def _words(self, start_ns: int, now_ns: int, length_ns: int) -> Iterator[Word]:
        """Those sent from `start_ns` to `now_ns`, read in stretches that are kept."""
        for number in range(max(start_ns, 0) // length_ns, now_ns // length_ns + 1):
            begin_ns, end_ns = number * length_ns, (number + 1) * length_ns - 1
            key = begin_ns, min(end_ns + length_ns, self._log.end_ns)
            if key not in self._stretches:
                self._stretches[key] = list(words(self._log, begin_ns, end_ns))
                if len(self._stretches) > _KEPT:
                    del self._stretches[next(iter(self._stretches))]
            yield from (w for w in self._stretches[key] if start_ns <= w.sent_ns <= now_ns)

    def _gaps(self, picture: Picture, now_ns: int, start_ns: int) -> Iterator[tuple[int, int]]:
        """When either direction was out, as far as that is seen; newest first."""
        changes = [
            (record.log_time_ns, LINK_OUTAGE.decode(record.payload))
            for record in self._log.records([LINK_OUTAGE], start_ns=start_ns, end_ns=now_ns)
        ]
        for direction, side in picture.link.items():
            until_ns, down = now_ns, side.down
            for time_ns, change in reversed(changes):
                if change.direction is not direction:
                    continue
                if down:
                    yield time_ns, until_ns
                until_ns, down = time_ns, not change.down
            if down:
                yield start_ns, until_ns


class Drawing:
    """The characters of a strip.

    Args:
        start_ns: time of the first column.
        per_ns: of a column.
        columns: how many there are.
        now_ns: simulated time.
    """

    def __init__(self, start_ns: int, per_ns: int, columns: int, now_ns: int) -> None:
        self._start_ns, self._per_ns, self._columns = start_ns, per_ns, columns
        self._now_ns = now_ns
        self._marks: dict[tuple[int, int], _Mark] = {}
        now = self._column(now_ns)
        for row in (0, _ROWS - 1):
            for column in range(columns):
                self._marks[row, column] = ("─" if column <= now else " ", _DIM)
        for row in range(_ROWS):
            self._marks[row, now] = ("┃", "")

    def _column(self, time_ns: int) -> int:
        return (time_ns - self._start_ns) // self._per_ns

    def gap(self, begin_ns: int, end_ns: int, mark: str = " ", side: Role = Role.ROVER) -> None:
        """Draw a stretch of a rail, by default the rover's, another way: open where it is out."""
        row = _RAILS[side]
        for column in range(max(self._column(begin_ns), 0), self._column(end_ns)):
            if column < self._columns and column != self._column(self._now_ns):
                self._marks[row, column] = (mark, _DIM)

    def word(
        self,
        direction: Direction,
        sent_ns: int,
        arrives_ns: int,
        *,
        label: str = "",
        lost: bool = False,
        routine: bool = False,
    ) -> None:
        """Draw a word from one rail to the other, or to where it was lost; dotted after now."""
        for step in range(1, _ROWS - 1):
            time_ns = sent_ns + (arrives_ns - sent_ns) * step // (_ROWS - 1)
            row = step if direction is Direction.UP else _ROWS - 1 - step
            if time_ns > self._now_ns:
                self._put(row, time_ns, ("·", _DIM))
                continue
            ends = lost and step == _ROWS // 2
            mark = ("×", _LOST) if ends else (_STROKES[direction], _DIM if routine else _NEWS)
            self._put(row, time_ns, mark)
            if ends:
                return
        self.label(sent_ns, label)

    def label(self, time_ns: int, text: str, side: Role = Role.GROUND) -> None:
        """Write on a rail, by default the ground's, from a time on."""
        for place, character in enumerate(text):
            self._put(_RAILS[side], time_ns + place * self._per_ns, (character, _NEWS))

    def _put(self, row: int, time_ns: int, mark: _Mark) -> None:
        """Draw a character, unless one that matters more is there."""
        column = self._column(time_ns)
        there = self._marks.get((row, column))
        if 0 <= column < self._columns and (there is None or there[1] == _DIM):
            self._marks[row, column] = mark

    def rows(self) -> Iterator[Text]:
        """The rows from the ground's rail to the rover's."""
        names = {row: str(side) for side, row in _RAILS.items()}
        for row in range(_ROWS):
            text = Text(names.get(row, "").ljust(NAMES_WIDTH), style=_DIM, no_wrap=True)
            for column in range(self._columns):
                text.append(*self._marks.get((row, column), (" ", "")))
            yield text
