"""The link as it was delivered, against what was asked of it."""

from typing import Any

from farside.frames import Fate, FrameEvent, FrameFate
from farside.logs.file.reading import LogEntry
from farside.logs.report.model import LinkRow, Panel, Series, Side, View
from farside.logs.report.parts.asked import Asked
from farside.logs.report.thinning import Curve, ms, rounded, steps, thinning_note
from farside.logs.spans import LinkTally
from farside.node import Direction, Topic, to_s
from farside.topics import GROUND_FRAME, LINK_FRAME, ROVER_FRAME

_SPANS = 240
_NAMES = {Direction.UP: "uplink", Direction.DOWN: "downlink"}
_MISSED = {Fate.LOST, Fate.BIT_ERROR}


class Buckets:
    """Sums in equal spans of the run, none shorter than a second.

    Attributes:
        width_ms: of a span.
    """

    def __init__(self, until_ns: int) -> None:
        self.width_ms = max(1000, -(-(ms(until_ns) + 1) // _SPANS // 1000) * 1000)
        self._until = ms(until_ns)
        self._sums = [0] * (self._until // self.width_ms + 1)
        self._width_ns = self.width_ms * 1_000_000

    @property
    def width_text(self) -> str:
        """The width for people."""
        return f"{self.width_ms // 1000} s"

    def add(self, time_ns: int, amount: int) -> None:
        """Add to the sum of the span in which a time lies."""
        self._sums[min(time_ns // self._width_ns, len(self._sums) - 1)] += amount

    def rates(self, name: str, *, known: bool = False) -> Series:
        """The sums per second, in steps; with `known`, each known at the end of its span."""
        spans = range(len(self._sums))
        starts = steps([span * self.width_ms for span in spans])
        rates = [rounded(total * 1000 / self.width_ms) for total in self._sums]
        ends = steps([min((span + 1) * self.width_ms, self._until) for span in spans])
        return Series(name, starts, list(rates), known=ends if known else [], look="steps")

    def shares(self, name: str, of: "Buckets") -> Series:
        """The sums as shares of others, in steps; broken where there was nothing."""
        starts = steps([span * self.width_ms for span in range(len(self._sums))])
        shares = [
            rounded(part / whole) if whole else None
            for part, whole in zip(self._sums, of._sums, strict=True)  # noqa: SLF001
        ]
        return Series(name, starts, shares, look="steps")


class _Way:
    """One direction as delivered."""

    def __init__(self, until_ns: int, overheads: list[tuple[int, int]]) -> None:
        self.delay = Curve(until_ns)
        self.bits, self.tried, self.lost = (Buckets(until_ns) for _ in range(3))
        self.tally = LinkTally()
        self._overheads = overheads

    def add(self, frame: FrameFate) -> None:
        self.tally.add(frame)
        if frame.copy:
            return
        if frame.arrival_ns is not None:
            self.delay.add(frame.queued_ns, to_s(frame.arrival_ns - frame.queued_ns))
            in_force = (byte for at_ns, byte in self._overheads if at_ns <= frame.sent_ns)
            overhead_byte = next(in_force, 0)
            self.bits.add(frame.arrival_ns, (frame.size_byte + overhead_byte) * 8)
        if frame.arrival_ns is not None or frame.fate in _MISSED:
            self.tried.add(frame.sent_ns, 1)
            if frame.fate in _MISSED:
                self.lost.add(frame.sent_ns, 1)


class DeliveredLink:
    """Delay, loss and rate of both directions, of what was so."""

    topics: tuple[Topic[Any], ...] = (LINK_FRAME, ROVER_FRAME, GROUND_FRAME)

    def __init__(self, side: Side, asked: Asked) -> None:
        self._asked = asked
        self._ways = {
            direction: _Way(side.until_ns, self._asked.overheads(direction))
            for direction in Direction
        }

    def take(self, entry: LogEntry) -> None:
        """See `Gatherer`."""
        match entry.message:
            case FrameFate() as frame:
                self._ways[frame.direction].add(frame)
            case FrameEvent(direction=direction, stage=stage):
                self._ways[direction].tally.stages[stage] += 1

    def fill(self, view: View) -> None:
        """See `Gatherer`."""
        view.notes += self._asked.problems
        for panels in zip(*map(self._panels, Direction), strict=True):
            view.panels += panels
        for direction, way in self._ways.items():
            name = _NAMES[direction]
            view.notes += thinning_note(f"Delay, {name}", [way.delay])
            view.link.append(LinkRow(name, way.tally.counters()))

    def _panels(self, direction: Direction) -> list[Panel]:
        way, name, asked = self._ways[direction], _NAMES[direction], self._asked
        counters = way.tally.counters()
        mean_byte = counters.bytes / counters.sent if counters.sent else 0
        span = f"in spans of {way.bits.width_text}"
        delay = [way.delay.series("delivered"), *asked.delay(direction)]
        loss = [way.lost.shares("lost", way.tried), *asked.loss(direction, mean_byte)]
        rate = [way.bits.rates("delivered"), *asked.rate(direction)]
        return [
            Panel(f"Delay, {name}", "s", delay),
            Panel(f"Loss outside outages, {name}, {span}", "%", loss, top=0.02),
            Panel(f"Rate, {name}, {span}", "bit/s", rate),
        ]
