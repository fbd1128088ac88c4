"""The light strip's data: every word between ground and rover about now, as the ground knows it."""

from collections import deque
from collections.abc import Iterator

from farside.console.screen.screen import Strip, StripWord
from farside.control import CommandStage, TakeBackChance
from farside.ground.view.view import GroundView, Way
from farside.logs.file.reading import LogEntry
from farside.logs.known import KnownCommand, KnownCommands
from farside.logs.spacetime import HeardAndSent, Word
from farside.messages import ACTS
from farside.node import NS_PER_S, Direction
from farside.topics import GROUND_FRAME, GROUND_TELEMETRY, CommandSent, Silence

PAST_NS = 40 * NS_PER_S
"""How far back the strip reaches at least; half as far it reaches ahead (project default)."""

_LIGHT_TIMES = 3  # that it reaches back where that is more: a word takes two ninths of its width
_MOST_WORDS = 400  # what a page draws ten times a second without effort
_ROUTINE_STEPS = 100  # of routine words, in each direction, as many as the past has room for
_GAPS_KEPT = 100
_ROUTINE = ("telemetry", "stored telemetry", "heartbeat", "report", "part of a message")

_NS = tuple[int, int]


class StripOf:
    """Keeps what a light strip about now shows, fed with the ground's log.

    The past that it shows is `PAST_NS` or, where that is more, three light times; it shows half as
    much of the future, so now stands at two thirds of its width, at any light time.

    Of routine words (telemetry, heartbeats, reports, parts of messages) one is kept in each
    hundredth of the past, in each direction. Of all words together the newest 400 are shown; what
    is routine gives way to what is not.
    """

    def __init__(self) -> None:
        self._heard_and_sent = HeardAndSent()
        self._light_ns = dict.fromkeys(Direction, 0)
        self._words: deque[Word] = deque(maxlen=_MOST_WORDS)
        self._routine: deque[Word] = deque(maxlen=2 * _ROUTINE_STEPS)
        self._last_routine_ns: dict[Direction, int] = {}
        self._known_ns = 0
        self._taken_ns: dict[int, int] = {}  # when a command is due to be taken, on board
        self._silent_ns: int | None = None
        self._closed_ns: dict[Direction, int] = {}  # since when, by plan
        self._plan: dict[Direction, Way] = {}  # as seen last
        self._gaps: deque[_NS] = deque(maxlen=_GAPS_KEPT)

    # --- from the run --------------------------------------------------------------------------

    def take(self, entry: LogEntry) -> None:
        """Take the next entry of the ground's log, in order."""
        now_ns = entry.log_time_ns
        if entry.topic == GROUND_FRAME.name:
            for word in self._heard_and_sent.take(now_ns, entry.message):
                self._keep(word)
        elif entry.topic == GROUND_TELEMETRY.name:
            if not self._plan:
                self._light_ns = dict.fromkeys(Direction, max(0, now_ns - entry.publish_time_ns))
        elif isinstance(entry.message, CommandSent):
            self._send(entry.message)
        elif isinstance(entry.message, Silence):
            if entry.message.silent:
                self._silent_ns = now_ns if self._silent_ns is None else self._silent_ns
            elif self._silent_ns is not None:
                self._gaps.append((self._silent_ns, now_ns))
                self._silent_ns = None

    def _send(self, sent: CommandSent) -> None:
        for due in sent.dues:
            if due.stage is CommandStage.TAKEN:
                self._taken_ns[sent.number] = due.expected_ns
        while len(self._taken_ns) > _MOST_WORDS:
            del self._taken_ns[next(iter(self._taken_ns))]

    def _keep(self, word: Word) -> None:
        if word.direction is Direction.DOWN:
            self._known_ns = max(self._known_ns, word.sent_ns)
        if not _is_routine(word):
            self._words.append(word)
            return
        last_ns = self._last_routine_ns.get(word.direction)
        if last_ns is None or word.sent_ns - last_ns >= self._past_ns // _ROUTINE_STEPS:
            self._last_routine_ns[word.direction] = word.sent_ns
            self._routine.append(word)

    @property
    def _past_ns(self) -> int:
        return max(PAST_NS, _LIGHT_TIMES * max(self._light_ns.values()))

    # --- to the person -------------------------------------------------------------------------

    def strip(self, now_ns: int, view: GroundView | None, commands: KnownCommands) -> Strip:
        """The strip at a moment, and what has left it is forgotten.

        Args:
            now_ns: simulated time at the ground; not before that of the last call.
            view: what the ground can know beside its log; `None` before the first.
            commands: the commands as the ground knows them.
        """
        if view is not None:
            self._see(view)
        from_ns, until_ns = now_ns - self._past_ns, now_ns + self._past_ns // 2
        for words in (self._words, self._routine):
            while words and self._arrives_ns(words[0]) < from_ns:
                words.popleft()
        free = _MOST_WORDS - len(self._words)
        routine = list(self._routine)[max(0, len(self._routine) - free) :]
        shown = sorted((*self._words, *routine), key=lambda word: word.sent_ns)
        open_commands = [one for one in commands.open.values() if not one.is_over]
        begins = ((one.number, _begins_ns(one)) for one in open_commands)
        return Strip(
            from_ns=from_ns,
            until_ns=until_ns,
            known_ns=self._known_ns,
            words=tuple(self._drawn(word) for word in shown if self._arrives_ns(word) >= from_ns),
            begins=tuple(
                (number, begins_ns)
                for number, begins_ns in begins
                if begins_ns is not None and from_ns <= begins_ns <= until_ns
            ),
            take_backs=tuple(
                (one.number, one.take_back_until_ns)
                for one in open_commands
                if one.take_back is TakeBackChance.SURE
                and one.take_back_until_ns is not None
                and now_ns < one.take_back_until_ns
            ),
            gaps=_joined(self._all_gaps(now_ns, until_ns), from_ns, until_ns),
        )

    def _arrives_ns(self, word: Word) -> int:
        """When it arrived or is due to: a command by its plan, which counts the queue as well."""
        if word.arrives_ns is not None:
            return word.arrives_ns
        number = _first_of_command(word)
        due_ns = None if number is None else self._taken_ns.get(number)
        light_ns = self._light_ns[word.direction]
        return max(word.sent_ns + light_ns, due_ns or 0)

    def _drawn(self, word: Word) -> StripWord:
        number = _first_of_command(word)
        return StripWord(
            direction=word.direction,
            what=word.what if word.lost is None else f"{word.what}, {word.lost}",
            sent_ns=word.sent_ns,
            arrives_ns=self._arrives_ns(word),
            label="" if number is None else str(number),
            routine=_is_routine(word),
        )

    # --- gaps ----------------------------------------------------------------------------------

    def _see(self, view: GroundView) -> None:
        """Note the changes by plan since the view before, which said when the next was due."""
        self._light_ns = {Direction.UP: view.up.light_ns, Direction.DOWN: view.down.light_ns}
        if view.silent_since_ns is not None:
            self._silent_ns = view.silent_since_ns
        for direction, way in ((Direction.UP, view.up), (Direction.DOWN, view.down)):
            before = self._plan.get(direction)
            planned_ns = None if before is None else before.changes_ns
            changed_ns = view.now_ns if planned_ns is None else min(planned_ns, view.now_ns)
            if not way.is_open:
                self._closed_ns.setdefault(direction, changed_ns)
            elif direction in self._closed_ns:
                self._gaps.append((self._closed_ns.pop(direction), changed_ns))
            self._plan[direction] = way

    def _all_gaps(self, now_ns: int, until_ns: int) -> Iterator[_NS]:
        yield from self._gaps
        if self._silent_ns is not None:
            yield self._silent_ns, now_ns
        for direction, way in self._plan.items():
            changes_ns = until_ns if way.changes_ns is None else way.changes_ns
            if not way.is_open:
                yield self._closed_ns[direction], changes_ns
            else:
                yield changes_ns, until_ns


def _is_routine(word: Word) -> bool:
    return word.what.startswith(_ROUTINE)


def _first_of_command(word: Word) -> int | None:
    """The number of the command whose first sending this is."""
    carried = word.carries
    if carried is None or carried.kind != "command" or carried.attempt > 1:
        return None
    return carried.number


def _begins_ns(command: KnownCommand) -> int | None:
    """When it begins on board, or takes effect: as known, or as planned."""
    stage = CommandStage.BEGUN if isinstance(command.order, ACTS) else CommandStage.DONE
    known = command.stages.get(stage)
    if known is None:
        return None
    if known.so_ns is not None or known.due is None:
        return known.so_ns
    return known.due.expected_ns


def _joined(gaps: Iterator[_NS], from_ns: int, until_ns: int) -> tuple[_NS, ...]:
    """Gaps in order, cut to the window, those that touch as one."""
    joined: list[_NS] = []
    for begin_ns, end_ns in sorted(
        (max(begin_ns, from_ns), min(end_ns, until_ns)) for begin_ns, end_ns in gaps
    ):
        if begin_ns >= end_ns:
            continue
        if joined and begin_ns <= joined[-1][1]:
            joined[-1] = joined[-1][0], max(joined[-1][1], end_ns)
        else:
            joined.append((begin_ns, end_ns))
    return tuple(joined)
