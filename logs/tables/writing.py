"""Writing the tables of a log in one pass, with no more of it in memory than a batch a topic."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import msgspec
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from farside.logs.file.parts import LogError
from farside.logs.file.reading import LogEntry, LogFile
from farside.logs.tables.columns import Column, Value, columns_of
from farside.node import Topic, to_s
from farside.topics import TOPICS

_BATCH_ROWS = 8192
"""How many rows of a topic are collected before they are written (project default)."""


class Format(StrEnum):
    """How tables are written. In CSV a list is written as JSON, and what is not there as nothing.

    Text stands in quotation marks, so that empty text is not taken for what is not there.
    """

    PARQUET = "parquet"
    CSV = "csv"


class Written(NamedTuple):
    """A table that was written: of which topic, where, and how many rows it has."""

    topic: str
    path: Path
    rows: int


class _Writer(Protocol):
    def write_batch(self, batch: pa.RecordBatch) -> None: ...

    def close(self) -> None: ...


def write_tables(
    log: LogFile, out: Path, form: Format, topics: Collection[Topic[Any]] = ()
) -> list[Written]:
    """Write a table for each topic, with the columns of `columns_of` after those of the times.

    `time_s` is when it became known where it was recorded, `so_s` when it was so. A table has its
    place only once it is whole; one of the same name is replaced.

    Args:
        log: the log; as ground, there are only the ground's tables.
        out: the folder, created if missing.
        form: the format.
        topics: those to write, with messages or without; all that have messages by default.

    Returns:
        the tables in order of their topics.

    Raises:
        LogError: if a message cannot be decoded, or holds a number that tables have no room for.
        OSError: if a table cannot be written.
    """
    out.mkdir(parents=True, exist_ok=True)
    wanted = topics or TOPICS.values()
    with ExitStack() as stack:
        tables = {topic.name: _Table(topic, out, form, stack) for topic in wanted}
        for record in log.records(list(wanted)):
            tables[record.topic].add(LogEntry.of(record))
        finished = [table for table in tables.values() if topics or table.rows]
        for table in finished:
            table.finish()
        # No table of a log that could be read in part only takes the place of a whole one.
        return [table.place() for table in finished]


class _Table:
    """A table that is being written, under another name than it will have."""

    def __init__(self, topic: Topic[Any], out: Path, form: Format, stack: ExitStack) -> None:
        self.rows = 0
        self._topic, self._form, self._stack = topic, form, stack
        self._path = out / f"{topic.name.strip('/').replace('/', '_')}.{form}"
        self._partial = self._path.with_name(f".{self._path.name}.part")
        self._columns = columns_of(topic)
        self._schema = pa.schema(
            [("time_s", pa.float64()), ("so_s", pa.float64()), *map(self._field, self._columns)]
        )
        self._waiting: list[LogEntry] = []
        self._writer: _Writer | None = None

    def _field(self, column: Column) -> tuple[str, pa.DataType]:
        return column.name, pa.string() if self._as_text(column) else column.kind

    def _as_text(self, column: Column) -> bool:
        return self._form is Format.CSV and pa.types.is_nested(column.kind)

    def add(self, entry: LogEntry) -> None:
        self._waiting.append(entry)
        self.rows += 1
        if len(self._waiting) == _BATCH_ROWS:
            self._write()

    def finish(self) -> None:
        if self._waiting or self._writer is None:
            self._write()
        assert self._writer is not None  # noqa: S101 - made by the first write
        self._writer.close()

    def place(self) -> Written:
        self._partial.replace(self._path)
        return Written(self._topic.name, self._path, self.rows)

    def _write(self) -> None:
        if self._writer is None:
            self._stack.callback(self._partial.unlink, missing_ok=True)
            self._writer = self._opened()
            self._stack.callback(self._writer.close)
        try:
            batch = pa.record_batch(list(self._arrays()), schema=self._schema)
        except (pa.ArrowInvalid, OverflowError) as error:
            raise LogError(
                f"{self._topic.name}: expected numbers of at most 64 bits, found: {error}"
            ) from error
        self._writer.write_batch(batch)
        self._waiting.clear()

    def _opened(self) -> _Writer:
        write = pyarrow.csv.CSVWriter if self._form is Format.CSV else pyarrow.parquet.ParquetWriter
        writer: _Writer = write(self._partial, self._schema)
        return writer

    def _arrays(self) -> Iterator[pa.Array]:
        yield pa.array([to_s(entry.log_time_ns) for entry in self._waiting], pa.float64())
        yield pa.array([to_s(entry.publish_time_ns) for entry in self._waiting], pa.float64())
        for column in self._columns:
            cells: Sequence[Value] = [column.of(entry.message) for entry in self._waiting]
            if self._as_text(column):
                cells = [None if cell is None else _json(cell) for cell in cells]
            yield pa.array(cells, self._field(column)[1])


def _json(cell: Value) -> str:
    return msgspec.json.encode(cell).decode()
