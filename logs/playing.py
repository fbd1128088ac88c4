"""Playing a log: where playback is, and what is due as wall time passes."""

from collections.abc import Collection, Iterator
from typing import Any, NamedTuple, Protocol

from farside.node import NEVER_NS, Record, Topic, to_ns, to_s


class Source(Protocol):
    """What a player plays: a `LogFile`, whole, as the ground had it, or still growing.

    Attributes:
        end_ns: where it ends; it may grow.
    """

    end_ns: int

    @property
    def there_until_ns(self) -> int:
        """Log time up to which every record is there: nothing comes later with a time up to it."""
        ...

    def records(
        self, topics: Collection[Topic[Any]] | None = None, *, start_ns: int = 0, end_ns: int = ...
    ) -> Iterator[Record]:
        """See `LogFile.records`."""
        ...


class Played(NamedTuple):
    """What a stretch of playback brings.

    Attributes:
        jumped: whether playback did not get here by playing forwards. What was shown before is
            void then: show what is so at `Player.now_ns`.
        records: those since the last stretch, in log order, read as they are taken; none after a
            jump. What is not taken comes with the next stretch.
    """

    jumped: bool
    records: Iterator[Record]


class Player:
    """A position in a log, which moves with wall time while it plays.

    It starts with a jump to `start_ns`. It knows no clock: whoever plays says how much time went
    by. Where the log ends it waits, and goes on if the log grows.

    Args:
        log: what to play.
        topics: which records it gives; all by default.
        speed: simulated seconds per wall second, above 0; `math.inf` goes straight to the end.
        start_ns: where to start.

    Attributes:
        log: what it plays.
        now_ns: simulated time that playback has reached.
        playing: whether time passes.
        backwards: whether it passes from the end to the beginning.
        speed: see above; set it with `set_speed`.
        loop_ns: beginning and end of the stretch that is played over and over; `None` for none.

    Raises:
        ValueError: if `speed` is not above 0.
    """

    def __init__(
        self,
        log: Source,
        topics: Collection[Topic[Any]] | None = None,
        *,
        speed: float = 1.0,
        start_ns: int = 0,
    ) -> None:
        self.log = log
        self.now_ns = 0
        self.playing = True
        self.backwards = False
        self.loop_ns: tuple[int, int] | None = None
        self._topics = topics
        self.set_speed(speed)
        self.seek(start_ns)

    @property
    def at_end(self) -> bool:
        """Whether it has nowhere to go: the end of the log or, backwards, its beginning."""
        if self.loop_ns is not None:
            return False
        return self.now_ns <= 0 if self.backwards else self.now_ns >= self.log.end_ns

    def play(self) -> None:
        """Let time pass, in the direction it had."""
        self.playing = True

    def pause(self) -> None:
        """Let time stand still."""
        self.playing = False

    def set_speed(self, speed: float) -> None:
        """Set the simulated seconds per wall second.

        Raises:
            ValueError: if it is not above 0.
        """
        if not speed > 0:
            raise ValueError(f"expected a speed above 0, found {speed:g}")
        self.speed = speed

    def reverse(self) -> None:
        """Turn round."""
        self.backwards = not self.backwards

    def seek(self, time_ns: int) -> None:
        """Jump to a time, or to the nearest one within the log."""
        self.now_ns = max(0, min(time_ns, self.log.end_ns))
        self._jumped = True

    def loop(self, begin_ns: int, end_ns: int) -> None:
        """Play one stretch over and over: from its end, or the log's, on to its beginning.

        Raises:
            ValueError: if it does not end after it begins.
        """
        if not 0 <= begin_ns < end_ns:
            raise ValueError(
                f"expected a stretch that ends after it begins, found {begin_ns} ns to {end_ns} ns"
            )
        self.loop_ns = begin_ns, end_ns

    def unloop(self) -> None:
        """Play on to the end of the log."""
        self.loop_ns = None

    def advance(self, wall_s: float) -> Played:
        """Let wall time pass, and say what it brings.

        Args:
            wall_s: seconds since the last call.

        Raises:
            LogError: while the records are taken, if the log is damaged or missing.
        """
        if self.playing:
            self._pass(wall_s)
        jumped, self._jumped = self._jumped, False
        if jumped:
            self._read_from(min(self.now_ns, self.log.there_until_ns) + 1)
        return Played(jumped, self._due(self.now_ns))

    def _pass(self, wall_s: float) -> None:
        if self._wrap():
            return
        begin_ns, end_ns = self._limits_ns()
        if self.backwards:
            self.seek(max(begin_ns, self.now_ns - self._passed_ns(wall_s)))
        else:
            self.now_ns = max(self.now_ns, min(end_ns, self.now_ns + self._passed_ns(wall_s)))

    def _passed_ns(self, wall_s: float) -> int:
        if wall_s <= 0:
            return 0
        return to_ns(min(wall_s * self.speed, to_s(NEVER_NS)))

    def _limits_ns(self) -> tuple[int, int]:
        """How far it plays before it waits, or wraps."""
        begin_ns, end_ns = self.loop_ns or (0, self.log.end_ns)
        # From outside of the stretch it plays towards it, or to the end of the log.
        return (
            begin_ns if self.now_ns >= begin_ns else 0,
            min(end_ns if self.now_ns <= end_ns else NEVER_NS, self.log.end_ns),
        )

    def _wrap(self) -> bool:
        """Jump from one end of the loop to the other, if it is there."""
        if self.loop_ns is None:
            return False
        begin_ns, end_ns = self._limits_ns()
        if self.now_ns != (begin_ns if self.backwards else end_ns):
            return False
        self.seek(self.loop_ns[1 if self.backwards else 0])
        return True

    # --- what is due ---------------------------------------------------------------------------

    def _read_from(self, start_ns: int) -> None:
        self._read_to_ns = self.log.there_until_ns
        self._coming = self.log.records(self._topics, start_ns=start_ns, end_ns=self._read_to_ns)
        self._next: Record | None = None

    def _peek(self, until_ns: int) -> Record | None:
        """The next record, if it is due by `until_ns`."""
        if self._next is None:
            self._next = next(self._coming, None)
            while self._next is None and self.log.there_until_ns > self._read_to_ns:
                self._read_from(self._read_to_ns + 1)
                self._next = next(self._coming, None)
        record = self._next
        return record if record is not None and record.log_time_ns <= until_ns else None

    def _due(self, until_ns: int) -> Iterator[Record]:
        while (record := self._peek(until_ns)) is not None:
            self._next = None
            yield record
