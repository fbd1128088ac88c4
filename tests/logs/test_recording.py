"""What is recorded is in the file, and the digest changes with any of it."""

from contextlib import suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from farside.logs import LogError, LogFile, Recorder, digest_of
from farside.node import Record
from farside.topics import TOPICS

times = st.integers(0, 2**62)
some_records = st.lists(
    st.builds(Record, st.sampled_from(list(TOPICS)), times, times, st.binary(max_size=40)),
    max_size=12,
)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(windows=st.lists(some_records, max_size=5))
def test_a_log_holds_the_written_records_in_the_same_order(
    tmp_path: Path, windows: list[list[Record]]
) -> None:
    path = tmp_path / "run.mcap"
    path.unlink(missing_ok=True)
    with Recorder(path) as recorder:
        for window in windows:
            recorder.write(window)
            recorder.flush()

    log = LogFile(path)
    written = [record for window in windows for record in window]

    assert list(log.records()) == written
    assert log.complete
    assert log.digest() == recorder.digest == digest_of(written)


def test_attachments_and_metadata_are_in_the_log(path: Path) -> None:
    with Recorder(path) as recorder:
        recorder.attach("mission.toml", "application/toml", b"name = 'blackout'\n")
        recorder.metadata("run", {"seed": "5"})
        recorder.metadata("result", {"outcome": "success"})

    log = LogFile(path)

    assert log.attachments == {"mission.toml": ("application/toml", b"name = 'blackout'\n")}
    assert log.metadata == {"run": {"seed": "5"}, "result": {"outcome": "success"}}


def test_any_mcap_reader_finds_every_topic_with_its_schema(run: Any, path: Path) -> None:
    records = run.start().records
    run.log(path)

    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        header, summary = reader.get_header(), reader.get_summary()
        messages = list(reader.iter_messages())

    assert header.profile == ""
    assert header.library.startswith("farside ")
    assert summary is not None
    assert [channel.topic for channel in summary.channels.values()] == list(TOPICS)
    assert {channel.message_encoding for channel in summary.channels.values()} == {"json"}
    assert {schema.encoding for schema in summary.schemas.values()} == {"jsonschema"}
    assert [
        (channel.topic, message.log_time, message.data) for _, channel, message in messages
    ] == [(record.topic, record.log_time_ns, record.payload) for record in records]


def test_every_flush_finishes_a_chunk_unless_it_is_empty(run: Any, path: Path) -> None:
    records = run.start().records
    with Recorder(path) as recorder:
        for record in records:
            recorder.write([record])
            recorder.flush()
            recorder.flush()

    with path.open("rb") as file:
        summary = make_reader(file).get_summary()

    assert summary is not None
    assert len(summary.chunk_indexes) == len(records)
    assert {chunk.compression for chunk in summary.chunk_indexes} == {"zstd"}


def test_two_recordings_of_one_run_are_identical_files(run: Any, tmp_path: Path) -> None:
    run.start()

    first, second = run.log(tmp_path / "a.mcap"), run.log(tmp_path / "b.mcap")

    assert first.read_bytes() == second.read_bytes()


def test_an_existing_log_is_not_overwritten(path: Path) -> None:
    path.write_bytes(b"years of work")

    with pytest.raises(LogError, match=r"run\.mcap already exists"):
        Recorder(path)

    assert path.read_bytes() == b"years of work"


def test_a_log_in_a_missing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="cannot be written: No such file or directory"):
        Recorder(tmp_path / "nowhere" / "run.mcap")


def test_a_log_closed_by_an_error_is_finished(run: Any, path: Path) -> None:
    with suppress(ZeroDivisionError), Recorder(path) as recorder:
        recorder.write(run.start().records)
        raise ZeroDivisionError

    log = LogFile(path)
    assert log.complete
    assert list(log.records()) == run.records


# --- the digest --------------------------------------------------------------------------------

POSE = Record("/truth/pose", 1, 1, b"{}")


@pytest.mark.parametrize(
    "other",
    [
        [],
        [POSE, POSE],
        [Record("/truth/bump", 1, 1, b"{}")],
        [Record("/truth/pose", 2, 1, b"{}")],
        [Record("/truth/pose", 1, 1, b"{ }")],
        [Record("/truth/pos", 1, 1, b"e{}")],
    ],
    ids=["none", "twice", "topic", "log time", "payload", "border between topic and payload"],
)
def test_the_digest_differs_for(other: list[Record]) -> None:
    assert digest_of(other) != digest_of([POSE])


def test_the_digest_depends_on_the_order() -> None:
    later = Record("/truth/pose", 2, 2, b"{}")

    assert digest_of([POSE, later]) != digest_of([later, POSE])


def test_the_digest_hashes_the_bytes_that_its_docstring_describes() -> None:
    head = bytes.fromhex("0b00010000000000000002000000")

    assert digest_of([POSE]) == sha256(head + b"/truth/pose" + b"{}").hexdigest()
