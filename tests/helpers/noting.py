"""Records of a run made by hand, for tests that start from a log's entries."""

import shutil
import tempfile
import weakref
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec

from farside.logs import LogEntry, LogFile, Recorder, RunView
from farside.node import Journal, Record, Topic, to_ns
from farside.topics import TOPICS


def topic_of(entry: msgspec.Struct) -> Topic[msgspec.Struct]:
    """The first topic that carries entries of this type."""
    return next(topic for topic in TOPICS.values() if topic.kind is type(entry))


def logged(t_ns: int, entry: msgspec.Struct) -> LogEntry:
    """An entry as it is read from a log."""
    return LogEntry(t_ns, t_ns, topic_of(entry).name, entry)


def records_of(entries: Iterable[tuple[float, msgspec.Struct]]) -> list[Record]:
    """Records of entries, each with the time in seconds when it became known."""
    journal = Journal()
    for t_s, entry in entries:
        journal.note(topic_of(entry), entry, log_time_ns=to_ns(t_s))
    return journal.take()


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
