"""What is recorded is in the file, and the digest changes with any of it."""

import errno
import os
import resource
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager, suppress
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from noting import with_pictures

from farside.logs import LogError, LogFile, Recorder, digest_of, recover
from farside.logs.file import packing
from farside.logs.foxglove.names import PICTURES
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
    assert list(log.records(pictures=True)) == with_pictures(written)
    assert log.digest() == recorder.digest == digest_of(with_pictures(written))


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
    assert [channel.topic for channel in summary.channels.values()] == [*TOPICS, *PICTURES]
    encodings = {
        channel.topic: (channel.message_encoding, summary.schemas[channel.schema_id].encoding)
        for channel in summary.channels.values()
    }
    assert {encodings[topic] for topic in TOPICS} == {("json", "jsonschema")}
    assert {encodings[topic] for topic in PICTURES} == {("protobuf", "protobuf")}
    assert [
        (channel.topic, message.log_time, message.data) for _, channel, message in messages
    ] == [(record.topic, record.log_time_ns, record.payload) for record in with_pictures(records)]


def test_windows_share_the_chunks_of_a_finished_log(run: Any, path: Path) -> None:
    records = run.start().records
    with Recorder(path) as recorder:
        for record in records:
            recorder.write([record])
            recorder.flush()

    with path.open("rb") as file:
        summary = make_reader(file).get_summary()

    assert summary is not None
    (chunk,) = summary.chunk_indexes
    assert chunk.compression == "zstd"
    assert {summary.channels[number].topic for number in chunk.message_index_offsets} == {
        record.topic for record in with_pictures(records)
    }


def test_any_mcap_reader_takes_a_log_that_is_still_written(run: Any, path: Path) -> None:
    records = run.start().stand(1, "at:A").stand(2, "at:B").records
    recorder = Recorder(path)
    for count, record in enumerate(records, start=1):
        recorder.write([record])
        recorder.flush()

        with path.open("rb") as file:
            messages = list(make_reader(file).iter_messages())
        assert [message.data for _, _, message in messages] == [
            record.payload for record in with_pictures(records[:count])
        ]
    recorder.close()


def test_a_full_disk_is_told_with_the_log_and_leaves_what_was_flushed(run: Any, path: Path) -> None:
    records = run.start().records
    recorder = Recorder(path)
    recorder.write(records)
    recorder.flush()
    with no_larger_files_than(path.stat().st_size + 20):
        recorder.write(records)
        with pytest.raises(LogError, match=rf"the log {path} cannot be written: File too large"):
            recorder.flush()

    assert list(LogFile(path).records()) == records


@contextmanager
def no_larger_files_than(size_byte: int) -> Iterator[None]:
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size_byte, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_log_that_was_deleted_meanwhile_is_missed(run: Any, path: Path) -> None:
    recorder = Recorder(path)
    recorder.write(run.start().records)
    path.unlink()

    with pytest.raises(LogError, match=rf"the log {path} was deleted or replaced"):
        recorder.close()


def test_a_log_that_was_cut_meanwhile_is_missed(run: Any, path: Path) -> None:
    recorder = Recorder(path)
    recorder.write(run.start().records)
    recorder.flush()
    os.truncate(path, 100)

    with pytest.raises(LogError, match=rf"the log {path} was cut short"):
        recorder.close()


def test_recorders_in_one_folder_get_a_file_each(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        recorders = list(pool.map(lambda _: Recorder.in_folder(tmp_path / "runs", "a"), range(24)))

    assert sorted(r.path.name for r in recorders) == sorted(f"a-{n}.mcap" for n in range(1, 25))
    for recorder in recorders:
        recorder.close()


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


# --- recovery ----------------------------------------------------------------------------------


def test_what_a_killed_writer_left_is_made_whole(run: Any, path: Path) -> None:
    killed = Recorder(path)
    killed.attach("mission.toml", "application/toml", b"seed = 1")
    killed.write(run.start().records)
    killed.flush()

    recovered = recover(LogFile(path))

    whole = LogFile(recovered.path)
    count = len(with_pictures(run.records))
    assert recovered == (path.with_name("run-recovered.mcap"), count, ())
    assert whole.complete
    assert list(whole.records()) == run.records
    assert whole.attachments["mission.toml"].data == b"seed = 1"
    assert not LogFile(path).complete, "the old one stays as it is"
    killed.close()


def test_what_is_readable_is_recovered_and_the_damage_told(
    run: Any, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packing, "_CHUNK_BYTE", 100)
    damaged = bytearray(run.start().stand(2, "at:A").log(path, window=1).read_bytes())
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    last = summary.chunk_indexes[-1]
    damaged[last.chunk_start_offset + last.chunk_length - 5] ^= 1
    path.write_bytes(damaged)

    recovered = recover(LogFile(path))

    [sentence] = recovered.damage
    assert sentence.startswith(f"bytes {last.chunk_start_offset} to ")
    lost = len(with_pictures(run.records)) - len(with_pictures(run.records[:-1]))
    found = list(LogFile(recovered.path).records(pictures=True))
    assert found == with_pictures(run.records)[:-lost]


def test_a_recovered_log_is_not_overwritten(run: Any, path: Path) -> None:
    recover(LogFile(run.start().log(path)))

    with pytest.raises(LogError, match=r"run-recovered\.mcap already exists"):
        recover(LogFile(path))


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


def test_a_disk_that_is_full_from_the_start_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every free name would be as good as the last, for ever."""

    def no_room(*_: object) -> int:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "pwrite", no_room)
    with pytest.raises(LogError, match=r"run-1\.mcap cannot be written: No space left on device"):
        Recorder.in_folder(tmp_path, "run")
    assert list(tmp_path.iterdir()) == []
