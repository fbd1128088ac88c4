"""A log as tables, read back and compared with the messages it was written from."""

import json
from itertools import chain
from pathlib import Path
from typing import Any

import msgspec
import msgspec.inspect as mi
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import pytest
from any_message import values
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from noting import log_of

from farside.control import Mode, ModeCause
from farside.logs import LogError, LogFile
from farside.logs.tables import writing
from farside.logs.tables.columns import columns_of
from farside.logs.tables.writing import Format, write_tables
from farside.node import Journal, Record, Topic, to_ns, to_s
from farside.topics import GROUND_COMMAND, GROUND_SILENCE, ROVER_MODE, TOPICS, ModeEntry, Silence


def read(path: Path, form: Format) -> list[dict[str, Any]]:
    """The rows of a table as whoever has nothing but the file reads them."""
    if form is Format.PARQUET:
        rows: list[dict[str, Any]] = pyarrow.parquet.read_table(path).to_pylist()
        return rows
    topic = "/" + path.stem.replace("_", "/", 1)
    kinds = {
        column.name: pa.string() if pa.types.is_nested(column.kind) else column.kind
        for column in columns_of(TOPICS[topic])
    }
    table = pyarrow.csv.read_csv(
        path,
        parse_options=pyarrow.csv.ParseOptions(newlines_in_values=True),
        convert_options=pyarrow.csv.ConvertOptions(
            column_types=kinds, strings_can_be_null=True, quoted_strings_can_be_null=False
        ),
    )
    lists = {column.name for column in columns_of(TOPICS[topic]) if pa.types.is_nested(column.kind)}
    return [
        {
            name: json.loads(cell) if name in lists and cell is not None else cell
            for name, cell in row.items()
        }
        for row in table.to_pylist()
    ]


def whole(value: Any) -> Any:
    """A message as JSON would have it, if what goes without saying were said there too."""
    if isinstance(value, msgspec.Struct):
        fields = {name: whole(getattr(value, name)) for name in value.__struct_fields__}
        tag = value.__struct_config__.tag
        return fields if tag is None else {"type": tag, **fields}
    return [whole(item) for item in value] if isinstance(value, tuple) else value


def there(value: Any) -> Any:
    """Without what is null."""
    if isinstance(value, dict):
        return {name: there(item) for name, item in value.items() if item is not None}
    return [there(item) for item in value] if isinstance(value, list) else value


def flat(value: dict[str, Any], columns: set[str], *above: str) -> dict[str, Any]:
    """With the names of columns; of what can be of one type only, the type goes unsaid."""
    cells: dict[str, Any] = {}
    for name, item in value.items():
        path = (*above, name)
        if isinstance(item, dict):
            cells |= flat(item, columns, *path)
        elif name != "type" or "_".join(path) in columns:
            cells["_".join(path)] = item
    return cells


def within(part: Any, of: Any) -> bool:
    """Whether all that JSON says is in a cell or row."""
    if isinstance(part, dict):
        return all(within(item, of[name]) for name, item in part.items())
    if isinstance(part, list):
        return all(within(one, other) for one, other in zip(part, of, strict=True))
    return bool(part == of)


MESSAGES = st.fixed_dictionaries(
    {
        name: st.lists(values(mi.type_info(topic.kind)), min_size=1, max_size=2)
        for name, topic in TOPICS.items()
    }
)


@settings(max_examples=5, phases=[Phase.generate], suppress_health_check=list(HealthCheck))
@given(messages=MESSAGES)
def test_whatever_a_topic_holds_its_tables_hold(
    messages: dict[str, list[msgspec.Struct]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    out = tmp_path_factory.mktemp("tables")
    records = {name: noted(TOPICS[name], *said) for name, said in messages.items()}
    with log_of(chain(*records.values())) as log:
        tables = [(form, table) for form in Format for table in write_tables(log, out, form)]

    assert len(tables) == len(Format) * len(TOPICS)
    for form, table in tables:
        said = messages[table.topic]
        rows = read(table.path, form)
        assert table.rows == len(said)
        for row, message, record in zip(rows, said, records[table.topic], strict=True):
            assert row.pop("time_s") == to_s(record.log_time_ns)
            assert row.pop("so_s") == to_s(record.publish_time_ns)
            assert there(row) == there(flat(whole(message), set(row)))
            assert within(there(flat(json.loads(record.payload), set(row))), row)


def noted(topic: Topic[Any], *messages: msgspec.Struct) -> list[Record]:
    journal = Journal()
    for second, message in enumerate(messages, start=1):
        so_ns = to_ns(second - 0.5)
        journal.note(topic, message, log_time_ns=to_ns(second), publish_time_ns=so_ns)
    return journal.take()


def test_every_column_has_a_name_of_its_own() -> None:
    for topic in TOPICS.values():
        names = [column.name for column in columns_of(topic)]
        assert len({*names, "time_s", "so_s"}) == len(names) + 2


def test_a_column_has_the_type_of_its_field() -> None:
    kinds = {column.name: column.kind for column in columns_of(GROUND_COMMAND)}

    assert kinds["number"] == kinds["expires_ns"] == kinds["order_proposal"] == pa.int64()
    assert kinds["order_type"] == kinds["order_mode"] == pa.string()
    assert kinds["order_force"] == pa.bool_()
    assert kinds["order_priority"] == pa.float64()
    assert kinds["order_tokens"] == pa.list_(pa.string())
    assert pa.types.is_struct(kinds["dues"].value_type)


@pytest.mark.parametrize("form", Format)
def test_a_table_is_written_batch_by_batch(
    form: Format, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writing, "_BATCH_ROWS", 3)
    said = [Silence(silent=bool(number % 2)) for number in range(7)]

    with log_of(noted(GROUND_SILENCE, *said)) as log:
        (written,) = write_tables(log, tmp_path, form)

    assert [row["silent"] for row in read(written.path, form)] == [one.silent for one in said]
    if form is Format.PARQUET:
        assert pyarrow.parquet.ParquetFile(written.path).num_row_groups == 3


def test_only_what_is_asked_for_is_written_even_if_it_is_nothing(tmp_path: Path) -> None:
    with log_of(noted(ROVER_MODE, ModeEntry(Mode.SHARED, ModeCause.START))) as log:
        written = write_tables(log, tmp_path, Format.PARQUET, [GROUND_SILENCE])

    assert [(table.topic, table.rows) for table in written] == [("/ground/silence", 0)]
    assert read(written[0].path, Format.PARQUET) == []
    assert [path.name for path in tmp_path.iterdir()] == ["ground_silence.parquet"]


def test_as_ground_there_are_only_the_grounds_tables(run: Any, path: Path, tmp_path: Path) -> None:
    run.start().hear(4, "at:A", since_s=2.75).hear(6, "at:B", since_s=5)
    log = LogFile(run.log(path)).as_ground(to_ns(5))

    (written,) = write_tables(log, tmp_path / "out", Format.CSV)

    assert (written.path.name, written.rows) == ("ground_telemetry.csv", 1)


@pytest.mark.parametrize(
    ("payload", "why"),
    [
        (b'{"number": 18446744073709551616, "why": "?"}', "numbers of at most 64 bits"),
        (b'{"number": "one", "why": "?"}', "expected a ProposalEnded"),
    ],
)
def test_a_message_that_no_table_can_hold_leaves_the_tables_as_they_were(
    payload: bytes, why: str, tmp_path: Path
) -> None:
    kept = tmp_path / "rover_proposal_ended.parquet"
    kept.write_bytes(b"from last time")

    with (
        log_of([Record("/rover/proposal_ended", 0, 0, payload)]) as log,
        pytest.raises(LogError, match=why),
    ):
        write_tables(log, tmp_path, Format.PARQUET)

    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"from last time"]
