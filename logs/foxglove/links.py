"""State, numbers and events of the link."""

from contextlib import suppress

import msgspec

from farside.frames import LinkOutage
from farside.logs.file.reading import LogEntry
from farside.logs.foxglove.names import LINK_EVENTS, LINK_NUMBERS, LINK_STATE
from farside.logs.foxglove.poses import Drawn
from farside.logs.foxglove.states import OPEN, LinkNumbers, LinkState
from farside.logs.foxglove.telling import PLOT_NS, told, told_event
from farside.node import Direction, Record, to_s


class SentFrame(msgspec.Struct, frozen=True, gc=False):
    """A `farside.frames.FrameFate`, as far as it is counted here."""

    direction: Direction
    size_byte: int
    queued_ns: int
    sent_ns: int
    sent_end_ns: int
    arrival_ns: int | None


_sent_frame = msgspec.json.Decoder(SentFrame)
_sent_frames = msgspec.json.Decoder(list[SentFrame])


class _Way:
    """One direction of the link.

    Attributes:
        delay_ns: of the last frame delivered.
        queue_ns: how long the last frame sent had waited.
        lost: how many frames were not delivered.
        byte: sent since the numbers were told.
    """

    __slots__ = ("byte", "delay_ns", "lost", "queue_ns")

    def __init__(self) -> None:
        self.delay_ns = self.queue_ns = self.lost = self.byte = 0


class LinkSide:
    """The link's state, numbers and events."""

    def __init__(self) -> None:
        self._state = LinkState(OPEN, OPEN)
        self._ways = {direction: _Way() for direction in Direction}
        self._payloads: list[bytes] = []
        self._told_ns = 0

    def start(self, t_ns: int, _message: msgspec.Struct) -> Drawn:
        """The run begins with the link open."""
        return told(LINK_STATE, t_ns, self._state)

    def event(self, entry: LogEntry) -> Drawn:
        """What happened."""
        return told_event(LINK_EVENTS, "link", None, entry)

    def outage(self, t_ns: int, outage: LinkOutage) -> Drawn:
        """An outage begins or ends."""
        now = str(outage.reason) if outage.down else OPEN
        if outage.direction is Direction.UP:
            self._state = LinkState(now, self._state.down)
        else:
            self._state = LinkState(self._state.up, now)
        return told(LINK_STATE, t_ns, self._state)

    def frame(self, record: Record, drawn: list[Record]) -> None:
        """Count a frame by its record; the numbers follow once they are due.

        Frames are the most of a log: they are decoded many at a time.
        """
        self._payloads.append(record.payload)
        if record.log_time_ns - self._told_ns >= PLOT_NS:
            self._count()
            drawn.append(self._numbers(record.log_time_ns))

    def _count(self) -> None:
        for frame in self._frames():
            way, queued_ns = self._ways[frame.direction], frame.queued_ns
            if frame.arrival_ns is None:
                way.lost += 1
            else:
                way.delay_ns = frame.arrival_ns - queued_ns
            if frame.sent_end_ns > queued_ns:
                way.queue_ns = frame.sent_ns - queued_ns
                way.byte += frame.size_byte
        self._payloads.clear()

    def _frames(self) -> list[SentFrame]:
        try:
            return _sent_frames.decode(b"[" + b",".join(self._payloads) + b"]")
        except (msgspec.MsgspecError, ValueError, RecursionError):
            frames = []
            for payload in self._payloads:
                with suppress(msgspec.MsgspecError, ValueError, RecursionError):
                    frames.append(_sent_frame.decode(payload))
            return frames

    def _numbers(self, t_ns: int) -> Record:
        since_ns = t_ns - self._told_ns
        up, down = self._ways[Direction.UP], self._ways[Direction.DOWN]
        numbers = LinkNumbers(
            up_delay_s=to_s(up.delay_ns),
            down_delay_s=to_s(down.delay_ns),
            up_rate_bit_s=round(8 * up.byte / to_s(since_ns)),
            down_rate_bit_s=round(8 * down.byte / to_s(since_ns)),
            up_queue_s=to_s(up.queue_ns),
            down_queue_s=to_s(down.queue_ns),
            up_lost_frames=up.lost,
            down_lost_frames=down.lost,
        )
        self._told_ns = t_ns
        up.byte = down.byte = 0
        return told(LINK_NUMBERS, t_ns, numbers)[0]
