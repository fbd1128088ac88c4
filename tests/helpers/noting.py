"""Handmade records and log entries, for tests that start from the messages of a run."""

import shutil
import tempfile
import weakref
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec

from farside.control import Cause, CommandStage, Failsafe, TakeBackChance, Verdict
from farside.logs import LogEntry, LogFile, Recorder, RunView
from farside.logs.foxglove.pictures import Pictures
from farside.messages import Meant, Order, When
from farside.node import Journal, Record, Topic, to_ns
from farside.topics import TOPICS, CommandSent, FailsafeEntry, LifeEntry, StageDue

WHY = {
    Failsafe.NOMINAL: "the link is up",
    Failsafe.HOLD: "nothing is heard",
    Failsafe.ALONE: "the link is lost",
    Failsafe.SAFE: "the rover is stuck",
}
_CAUSES = {
    Failsafe.NOMINAL: (),
    Failsafe.HOLD: (Cause.SILENCE,),
    Failsafe.ALONE: (Cause.SILENCE, Cause.LOST),
    Failsafe.SAFE: (Cause.STUCK,),
}


def topic_of(message: msgspec.Struct) -> Topic[msgspec.Struct]:
    """The first topic that carries messages of this type."""
    return next(topic for topic in TOPICS.values() if topic.kind is type(message))


def logged(t_ns: int, message: msgspec.Struct) -> LogEntry:
    """A message as an entry read from a log."""
    return LogEntry(t_ns, t_ns, topic_of(message).name, message)


def records_of(messages: Iterable[tuple[float, msgspec.Struct]]) -> list[Record]:
    """Records of messages, each with its log time in seconds."""
    journal = Journal()
    for t_s, message in messages:
        journal.note(topic_of(message), message, log_time_ns=to_ns(t_s))
    return journal.take()


def failsafe_entry(
    state: Failsafe = Failsafe.NOMINAL, silence_s: float = 0.0, *, lost_after_s: float = 30.0
) -> FailsafeEntry:
    """The failsafe's entry in a state for a reason that is usual for it."""
    countdown_s = max(0.0, lost_after_s - silence_s)
    return FailsafeEntry(state, WHY[state], _CAUSES[state], silence_s, countdown_s)


def command_sent(
    number: int,
    order: Order,
    *,
    expires_s: float = 1000.0,
    meant: Meant | None = None,
    when: When | None = None,
    due_s: dict[CommandStage, float] | None = None,
) -> CommandSent:
    """A command as the ground notes it, good for the whole of a short run.

    Each stage is due a second after `due_s`, and word of it seven seconds after.
    """
    dues = (
        StageDue(stage, to_ns(t_s), to_ns(t_s + 1), to_ns(t_s + 7))
        for stage, t_s in (due_s or {}).items()
    )
    return CommandSent(number, order, to_ns(expires_s), meant, when, tuple(dues))


def said_of(
    number: int,
    stage: CommandStage | None = None,
    verdict: Verdict | None = None,
    *,
    due_s: float | None = None,
    so_s: float | None = None,
    take_back: TakeBackChance = TakeBackChance.TOO_LATE,
    until_s: float | None = None,
    why: str | None = None,
) -> LifeEntry:
    """What the ground says of a command, with times in seconds."""

    def ns(t_s: float | None) -> int | None:
        return None if t_s is None else to_ns(t_s)

    return LifeEntry(number, stage, verdict, ns(due_s), None, ns(so_s), take_back, ns(until_s), why)


def with_pictures(records: Iterable[Record]) -> list[Record]:
    """All that a log of these records holds."""
    return Pictures().beside(records)


@contextmanager
def log_of(records: Iterable[Record]) -> Iterator[LogFile]:
    """A finished log of these records, for as long as it is looked at."""
    with tempfile.TemporaryDirectory() as folder:
        with Recorder(Path(folder) / "run.mcap") as recorder:
            recorder.write(records)
        yield LogFile(recorder.path)


def view_of(records: Iterable[Record]) -> RunView:
    """A view of a run with these records; its log goes when the view does."""
    folder = Path(tempfile.mkdtemp())
    with Recorder(folder / "run.mcap") as recorder:
        recorder.write(records)
    view = RunView(LogFile(recorder.path))
    weakref.finalize(view, shutil.rmtree, folder)
    return view
