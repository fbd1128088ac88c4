"""Reading a run's log by topic and time, even if its writer was killed."""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from copy import copy
from operator import attrgetter
from pathlib import Path
from typing import BinaryIO, NamedTuple, Protocol, Self

import msgspec

from farside.logs.file.digest import digest_of
from farside.logs.file.index import LogIndex
from farside.logs.file.mcap_bytes import DAMAGE, PICTURE, messages
from farside.logs.file.parts import Attachment, Block, LogError, block_records
from farside.node import NEVER_NS, Record, to_s
from farside.topics import TOPICS

_log_time_ns = attrgetter("log_time_ns")


class LogEntry(NamedTuple):
    """A record with its message decoded.

    Attributes:
        log_time_ns: see `farside.node.Record`.
        publish_time_ns: likewise.
        topic: name of the topic.
        message: the decoded payload, of the type of the topic in `TOPICS`.
    """

    log_time_ns: int
    publish_time_ns: int
    topic: str
    message: msgspec.Struct

    @classmethod
    def of(cls, record: Record) -> Self:
        """Decode a record.

        Raises:
            LogError: see `decode`.
        """
        return cls(record.log_time_ns, record.publish_time_ns, record.topic, decode(record))


def decode(record: Record) -> msgspec.Struct:
    """The message of a record.

    Raises:
        LogError: if the topic is not in `TOPICS`, or the payload does not match its type.
    """
    topic = TOPICS.get(record.topic)
    if topic is None:
        raise LogError(
            f"unknown topic {record.topic}: read the log with the version of Farside that wrote it"
        )
    try:
        return topic.decode(record.payload)
    except (msgspec.MsgspecError, ValueError, RecursionError) as error:
        where = f"{record.topic} at {to_s(record.log_time_ns)} s"
        raise LogError(f"{where}: expected a {topic.kind.__name__}, found: {error}") from error


class Named(Protocol):
    """What has the name of a topic: a `Topic`, or one of pictures."""

    @property
    def name(self) -> str:
        """The name."""
        ...


class LogFile:
    """A log on disk, indexed when it is opened and read lazily by topic and time.

    What is damaged or cut off is passed over; `damage` says what is missing. A log that is
    replaced while it is open, as when its writer packs it, is indexed anew when it is read next.

    Attributes:
        path: the file.
        end_ns: log time of the last message, 0 without any.
        known_until_ns: see `as_ground`; `None` for the whole log.
        is_to_end: whether `end_ns` moves on where `refresh` finds more.
        index: what it holds and where.

    Raises:
        LogError: if there is no such file, or it is not a log of Farside's.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.known_until_ns: int | None = None
        self.is_to_end = True
        self._last_read: tuple[Block, bytes] | None = None
        with self._file() as file:
            self._look_over(file)

    def _look_over(self, file: BinaryIO) -> None:
        self.index = LogIndex(self.path, file)
        self._reach()

    def _reach(self) -> None:
        if not self.is_to_end:
            return
        self.end_ns = max((block.end_ns for block in self.index.blocks), default=0)
        if self.known_until_ns is not None:
            self.known_until_ns = self.end_ns

    def refresh(self) -> bool:
        """Take in what was written since the log was opened, or refreshed last.

        Only what is new is scanned; a log that was packed meanwhile is indexed by its summary.

        Returns:
            Whether there was anything new, or the log is another file now.

        Raises:
            LogError: if the file is gone, or is no log of Farside's any more.
        """
        with self._file() as file:
            if not self.index.is_of(file):
                self._look_over(file)
                return True
            news = self.index.update(file)
        self._reach()
        return news

    @property
    def damage(self) -> tuple[str, ...]:
        """What is missing: a sentence for each damaged part found so far, in order of the file.

        Where the log has an index, the contents of a part are checked only as they are read.
        """
        return self.index.sentences(self.known_until_ns)

    @property
    def holes(self) -> tuple[str, ...]:
        """The part of `damage` with something readable behind it: not an end that was cut off."""
        return self.index.sentences(self.known_until_ns, inside=True)

    def as_ground(self, until_ns: int | None = None) -> Self:
        """The same log as the ground had it at `until_ns`: what it had learned by then, only.

        All but the topics of `/ground`, and all later ones of these, are as if they had never been
        written; and so are the attachments, which tell of what lay ahead, and how it ended.

        Args:
            until_ns: simulated time; the end of the log by default, wherever `refresh` finds it.
        """
        known = copy(self)
        known.is_to_end = until_ns is None
        known.known_until_ns = self.end_ns if until_ns is None else until_ns
        known.end_ns = known.known_until_ns
        return known

    @property
    def is_as_ground(self) -> bool:
        """Whether it holds only what the ground knew; see `as_ground`."""
        return self.known_until_ns is not None

    @property
    def there_until_ns(self) -> int:
        """Log time up to which every message is there, -1 before the first.

        Where the log grows, nothing comes later with this time or one before: see `Recorder.write`.
        """
        return self.end_ns if self.index.blocks else -1

    @property
    def complete(self) -> bool:
        """Whether the writer finished it."""
        return self.index.complete

    @property
    def library(self) -> str:
        """The program that wrote it, such as `farside 0.1.0`."""
        return self.index.library

    @property
    def attachments(self) -> Mapping[str, Attachment]:
        """The attached files by name; of several with one name, the last."""
        return {} if self.is_as_ground else self.index.attachments

    @property
    def metadata(self) -> Mapping[str, Mapping[str, str]]:
        """Groups of keys and values by name; of several with one name, the last."""
        metadata = self.index.metadata
        if not self.is_as_ground:
            return metadata
        return {name: values for name, values in metadata.items() if name == "farside.run"}

    @property
    def size_byte(self) -> int:
        """Length of the file when it was looked at last."""
        return self.index.size_byte

    def sizes(self) -> dict[str, tuple[int, int]]:
        """For each topic with messages how many it has, and the length of all their payloads.

        A finished log says it. Any other is read for it.

        Raises:
            LogError: if the file is gone.
        """
        index = self.index
        if index.counts is not None and index.payload_byte and not self.is_as_ground:
            topics = {number: channel.topic for number, channel in index.channels.items()}
            said = {topics[number]: count for number, count in index.counts.items()}
            return {topic: (count, index.payload_byte[topic]) for topic, count in said.items()}
        counts: Counter[str] = Counter()
        sizes: Counter[str] = Counter()
        for record in self.records(pictures=True):
            counts[record.topic] += 1
            sizes[record.topic] += len(record.payload)
        return {topic: (count, sizes[topic]) for topic, count in counts.items()}

    def records(
        self,
        topics: Collection[Named] | None = None,
        *,
        start_ns: int = 0,
        end_ns: int = NEVER_NS,
        pictures: bool = False,
    ) -> Iterator[Record]:
        """The records of some topics in log order. Each call reads the file again.

        Args:
            topics: which ones; all of Farside's own by default.
            start_ns: least log time.
            end_ns: greatest log time.
            pictures: whether all topics are those of the pictures, too: all that the log holds.

        Raises:
            LogError: if the file is gone.
        """
        names = self._known(
            self._names(pictures=pictures) if topics is None else {topic.name for topic in topics}
        )
        end_ns = self._end_ns(end_ns)
        with self._opened() as file:
            wanted, channels = self._wanted(names)
            for block in self._blocks(file, wanted.values(), start_ns, end_ns):
                if block.start_ns > end_ns or block.end_ns < start_ns or not block.has(channels):
                    continue
                records = self._read(file, block, wanted)
                if start_ns <= block.start_ns and block.end_ns <= end_ns:
                    yield from records
                else:
                    yield from (r for r in records if start_ns <= r.log_time_ns <= end_ns)

    def latest(self, topic: Named, time_ns: int) -> Record | None:
        """The last record of a topic with a log time of `time_ns` or before; `None` if none has.

        Raises:
            LogError: as `records`.
        """
        return next(iter(self.latest_each(time_ns, (topic.name,))), None)

    def latest_each(self, time_ns: int, names: Iterable[str] | None = None) -> list[Record]:
        """The last record of each topic with a log time of `time_ns` or before, in log order.

        Args:
            time_ns: greatest log time.
            names: of these topics; of all that the log holds by default, pictures included.

        Raises:
            LogError: as `records`.
        """
        missing = self._known(self._names(pictures=True) if names is None else set(names))
        time_ns = self._end_ns(time_ns)
        found: list[Record] = []
        with self._opened() as file:
            wanted, channels = self._wanted(missing)
            for block in reversed(self.index.blocks):
                if not missing:
                    break
                if block.start_ns > time_ns or not block.has(channels):
                    continue
                last: dict[str, Record] = {}
                for record in self._read(file, block, wanted):
                    if record.log_time_ns <= time_ns:
                        last[record.topic] = record
                found += last.values()
                missing -= last.keys()
                wanted, channels = self._wanted(missing)
        return sorted(found, key=_log_time_ns)

    def entries(self) -> Iterator[LogEntry]:
        """All records in log order, each decoded when it is reached.

        Raises:
            LogError: at a record that cannot be decoded.
        """
        return map(LogEntry.of, self.records())

    def digest(self) -> str:
        """The `Digest` of all that the log holds, pictures included, computed from the file.

        Raises:
            LogError: if some are missing: it would not be that of the run.
        """
        digest = digest_of(self.records(pictures=True))
        if self.damage:
            raise LogError(f"{self.path} is damaged: {self.damage[0]}")
        return digest

    def _names(self, *, pictures: bool) -> set[str]:
        """The topics of the log."""
        return {
            channel.topic
            for channel in self.index.channels.values()
            if pictures or PICTURE not in channel.metadata
        }

    def _known(self, names: set[str]) -> set[str]:
        """Of these topics those that may be told of."""
        if not self.is_as_ground:
            return names
        return {name for name in names if name.startswith("/ground/")}

    def _end_ns(self, end_ns: int) -> int:
        known_ns = self.known_until_ns
        return end_ns if known_ns is None else min(known_ns, end_ns)

    # --- by block ------------------------------------------------------------------------------

    def contents(self) -> Iterator[tuple[Block, bytes]]:
        """The encoded records of each chunk that is as it was written, in order.

        Raises:
            LogError: if the file is gone.
        """
        with self._opened() as file:
            for block in self.index.blocks:
                try:
                    data = self._bytes(file, block)
                except DAMAGE as error:
                    self.index.note_block(block, error)
                else:
                    yield block, data

    @contextmanager
    def _file(self) -> Iterator[BinaryIO]:
        try:
            file = self.path.open("rb")
        except OSError as error:
            raise LogError(f"the log {self.path} cannot be read: {error.strerror}") from error
        with file:
            yield file

    @contextmanager
    def _opened(self) -> Iterator[BinaryIO]:
        """The file that the index is of."""
        with self._file() as file:
            if not self.index.is_of(file):
                self._look_over(file)
            yield file

    def _blocks(
        self, file: BinaryIO, topics: Collection[str], start_ns: int, end_ns: int
    ) -> list[Block]:
        """The chunks in which to look for topics: the copies, if they hold all of these."""
        index = self.index
        copies = [b for b in index.sparse if b.start_ns <= end_ns and start_ns <= b.end_ns]
        if not (topics and index.sparse and index.sparse_topics.issuperset(topics)):
            return index.blocks
        for block in copies:
            try:
                self._bytes(file, block)
            except DAMAGE:
                return index.blocks
        return copies

    def _wanted(self, names: Collection[str]) -> tuple[dict[int, str], int]:
        """The topics of these names by channel number, and a bit for each number."""
        wanted = {
            number: channel.topic
            for number, channel in self.index.channels.items()
            if channel.topic in names
        }
        return wanted, sum(1 << number for number in wanted)

    def _read(self, file: BinaryIO, block: Block, wanted: Mapping[int, str]) -> list[Record]:
        """The records of a block; none if it is damaged, which is noted."""
        try:
            data = self._bytes(file, block)
            found = messages(data, wanted, self.index.channels)
        except DAMAGE as error:
            self.index.note_block(block, error)
            return []
        block.learn(data)
        return found

    def _bytes(self, file: BinaryIO, block: Block) -> bytes:
        """The encoded records of a block; those of the block read last are kept."""
        if self._last_read is None or self._last_read[0] is not block:
            self._last_read = block, block_records(file, block)
        return self._last_read[1]
