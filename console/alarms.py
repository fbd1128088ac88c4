"""The alarms: few, each with its cause and its two times, and each stays until acknowledged."""

from collections import deque
from dataclasses import dataclass

from farside.console.news import (
    OVERDUE,
    SHADOW,
    SIGNAL,
    SILENCE,
    Trouble,
    ends,
    sentence,
    so_ns,
    trouble_of,
)
from farside.console.screen.screen import AlarmRow, Tone
from farside.console.wording import clock_text
from farside.control import Signal, Verdict
from farside.ground.view.view import GroundView
from farside.logs.file.reading import LogEntry
from farside.messages import Telemetry
from farside.node import NS_PER_S
from farside.topics import BeliefEntry, LifeEntry, ShadowEntry

ACKNOWLEDGED_KEPT = 50
"""How many acknowledged alarms are still shown."""

SHADOW_PATIENCE_NS = 60 * NS_PER_S
"""How long the shadow may be out of step, beside the way there and back that a repair takes.

A repair is asked for by a heartbeat and comes as one update; a minute lets one of each get lost
(project default).
"""


@dataclass
class _Alarm:
    number: int
    trouble: Trouble
    so_ns: int
    learned_ns: int
    text: str
    count: int = 1
    over_ns: int | None = None
    acknowledged: bool = False

    def row(self) -> AlarmRow:
        text, tone = self.text, self.trouble.tone
        if self.over_ns is not None:
            text, tone = f"{text}; over since {clock_text(self.over_ns)}", Tone.CAUTION
        return AlarmRow(
            self.number, self.so_ns, self.learned_ns, text, self.count, tone, self.acknowledged
        )


class Alarms:
    """Raises alarms by the ground's log and its view, and keeps them.

    The same trouble again, while its alarm is not acknowledged, is counted there: the alarm then
    has the text and the times of the latest. One that is over by itself stays, and says so.

    Attributes:
        raised: how many were ever raised, each time counted: who remembers it sees news.
    """

    def __init__(self) -> None:
        self.raised = 0
        self._numbers = 0
        self._open: list[_Alarm] = []
        self._acknowledged: deque[_Alarm] = deque(maxlen=ACKNOWLEDGED_KEPT)
        self._overdue: set[int] = set()
        self._signal_lost = False
        self._out_of_step: tuple[int, str] | None = None

    # --- from the run --------------------------------------------------------------------------

    def take(self, entry: LogEntry) -> None:
        """Take the next entry of the ground's log, in order."""
        message, now_ns = entry.message, entry.log_time_ns
        for alarm in self._not_over():
            if ends(message, alarm.trouble.kind):
                alarm.over_ns = so_ns(entry)
        match message:
            case LifeEntry():
                self._life(message, entry, now_ns)
            case Telemetry(commands_done=done):
                self._resolve({number for number in self._overdue if number <= done}, now_ns)
            case BeliefEntry():
                self._signal(message)
            case ShadowEntry(in_step=True):
                self._out_of_step = None
                self._end(SHADOW, so_ns(entry))
            case ShadowEntry():
                since_ns = now_ns if self._out_of_step is None else self._out_of_step[0]
                self._out_of_step = since_ns, sentence(entry)
            case _:
                trouble = trouble_of(message)
                if trouble is not None:
                    self._raise(trouble, so_ns(entry), now_ns, sentence(entry))

    def see(self, view: GroundView) -> None:
        """Take what the ground can know now beside its log."""
        silence = self._standing(SILENCE)
        if silence is not None and view.silent_since_ns is not None:
            silence.so_ns = view.silent_since_ns
        if self._out_of_step is None or self._standing(SHADOW) is not None:
            return
        since_ns, text = self._out_of_step
        patience_ns = SHADOW_PATIENCE_NS + view.up.light_ns + view.down.light_ns
        if view.now_ns - since_ns >= patience_ns:
            self._raise(SHADOW, since_ns, view.now_ns, text)

    def _life(self, life: LifeEntry, entry: LogEntry, now_ns: int) -> None:
        """Of each command only the first stage that is overdue counts."""
        if life.verdict is not Verdict.OVERDUE:
            if life.verdict in {Verdict.ON_TIME, Verdict.LATE}:
                self._resolve({life.number} & self._overdue, now_ns)
        elif life.number not in self._overdue:
            self._overdue.add(life.number)
            self._raise(OVERDUE, so_ns(entry), now_ns, sentence(entry))

    def _resolve(self, numbers: set[int], now_ns: int) -> None:
        """Word of these overdue commands has come."""
        self._overdue -= numbers
        if numbers and not self._overdue:
            self._end(OVERDUE, now_ns)

    def _signal(self, belief: BeliefEntry) -> None:
        signal = belief.signal
        if signal is None or (signal.value is Signal.NONE) is self._signal_lost:
            return
        self._signal_lost = not self._signal_lost
        if self._signal_lost:
            text = "signal lost: terrain hides the other end of the link"
            self._raise(SIGNAL, signal.so_ns, signal.learned_ns, text)
        else:
            self._end(SIGNAL, signal.so_ns)

    def _raise(self, trouble: Trouble, since_ns: int, now_ns: int, text: str) -> None:
        self.raised += 1
        for alarm in self._open:
            if alarm.trouble.kind == trouble.kind:
                alarm.trouble, alarm.text, alarm.over_ns = trouble, text, None
                alarm.so_ns, alarm.learned_ns = since_ns, now_ns
                alarm.count += 1
                return
        self._numbers += 1
        self._open.append(_Alarm(self._numbers, trouble, since_ns, now_ns, text))

    def _end(self, trouble: Trouble, over_ns: int) -> None:
        for alarm in self._not_over():
            if alarm.trouble.kind == trouble.kind:
                alarm.over_ns = over_ns

    def _standing(self, trouble: Trouble) -> _Alarm | None:
        """The alarm of a trouble that is not over, acknowledged or not."""
        return next((one for one in self._not_over() if one.trouble.kind == trouble.kind), None)

    def _not_over(self) -> list[_Alarm]:
        return [one for one in (*self._open, *self._acknowledged) if one.over_ns is None]

    # --- to and from the person ----------------------------------------------------------------

    def acknowledge(self, number: int | None = None) -> int:
        """Acknowledge an alarm, or all of them; gives how many that were not yet."""
        chosen = [alarm for alarm in self._open if number in {None, alarm.number}]
        for alarm in chosen:
            alarm.acknowledged = True
            self._open.remove(alarm)
            self._acknowledged.append(alarm)
        return len(chosen)

    @property
    def left(self) -> int:
        """How many are not acknowledged."""
        return len(self._open)

    def rows(self) -> tuple[AlarmRow, ...]:
        """Those not acknowledged, then the last 50 that are; in each part the newest first.

        One that is raised again keeps its place, so that nothing moves under the pointer.
        """
        kept = sorted(self._acknowledged, key=lambda alarm: alarm.number)
        return tuple(alarm.row() for alarm in (*reversed(self._open), *reversed(kept)))
