"""Reading a log by topic and time, and the errors that name what is wrong."""

from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer

from farside.control import Mode, ModeCause
from farside.logs import LogEntry, LogError, LogFile, Recorder, decode, recover
from farside.logs.file import packing, sparse
from farside.node import Record, Topic, to_ns
from farside.topics import (
    GROUND_SILENCE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_STUCK,
    TRUTH_POSE,
    ModeEntry,
    Pose,
    Silence,
)


def test_entries_are_decoded_in_log_order(run: Any, path: Path) -> None:
    run.note(1.5, ModeEntry(Mode.SHARED, ModeCause.OPERATOR)).note(2.0, Silence(silent=True))

    log = LogFile(run.log(path))

    assert list(log.entries()) == [
        LogEntry(to_ns(1.5), to_ns(1.5), "/rover/mode", ModeEntry(Mode.SHARED, ModeCause.OPERATOR)),
        LogEntry(to_ns(2.0), to_ns(2.0), "/ground/silence", Silence(silent=True)),
    ]
    assert log.end_ns == to_ns(2.0)


def test_an_entry_has_both_its_log_time_and_its_publish_time(run: Any, path: Path) -> None:
    run.hear(4.0, "at:A", since_s=2.75)

    (entry,) = LogFile(run.log(path)).entries()

    assert (entry.log_time_ns, entry.publish_time_ns) == (to_ns(4.0), to_ns(2.75))


def test_a_record_is_decoded_only_when_it_is_reached(path: Path) -> None:
    with Recorder(path) as recorder:
        recorder.write([Record("/rover/mode", 0, 0, b"not JSON")])

    log = LogFile(path)
    entries = log.entries()

    with pytest.raises(LogError, match=r"/rover/mode at 0\.0 s: expected a ModeEntry, found"):
        next(entries)


def test_the_last_record_of_each_topic_is_found_wherever_in_the_file_it_lies(
    run: Any, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("recording", "file.packing"):
        monkeypatch.setattr(f"farside.logs.{module}._CHUNK_BYTE", 1000)
    run.start().goal(2, "at:A")
    for t_s in range(1, 30):
        run.stand(t_s, "at:D").hear(t_s, "at:D", since_s=t_s - 1)
    log = LogFile(run.log(path))
    assert len(log.index.blocks) > 5

    for time_ns in map(to_ns, (0, 1.5, 2, 17, 99)):
        last = {record.topic: record for record in log.records(end_ns=time_ns, pictures=True)}
        found = log.latest_each(time_ns)
        assert {record.topic: record for record in found} == last
        assert len(found) == len(last)
        assert found == sorted(found, key=lambda record: record.log_time_ns)
        for topic in (TRUTH_POSE, ROVER_GOAL):
            assert log.latest(topic, time_ns) == last.get(topic.name)


def test_an_unknown_topic_is_refused_by_name() -> None:
    with pytest.raises(LogError, match="unknown topic /rover/arm"):
        decode(Record("/rover/arm", 0, 0, b"{}"))


@pytest.mark.parametrize(
    ("row", "reason"), [("#AA#", "a second place 'A'"), ("#oo#", "a map without a place")]
)
def test_a_map_that_no_yard_has_is_refused_as_it_is_read(row: str, reason: str) -> None:
    payload = f'{{"rows": ["####", "{row}", "####"], "cell_m": 1.0}}'
    with pytest.raises(LogError, match=rf"/truth/yard at 0\.0 s: expected a Yard.*{reason}"):
        decode(Record("/truth/yard", 0, 0, payload.encode()))


def test_a_position_that_no_yard_has_is_refused_as_it_is_read() -> None:
    pose = Pose(1e300, 0.0, 0.0, 0.0, "at:A", 1.0)
    with pytest.raises(LogError, match=r"/truth/pose at 0\.0 s: expected a Pose, found: .*x_m"):
        decode(Record("/truth/pose", 0, 0, msgspec.json.encode(pose)))


# --- files that are not logs -------------------------------------------------------------------


def test_a_missing_log_is_refused_by_name(path: Path) -> None:
    with pytest.raises(LogError, match=rf"the log {path} cannot be read: No such file"):
        LogFile(path)


def test_a_folder_is_not_a_log(tmp_path: Path) -> None:
    with pytest.raises(LogError, match="cannot be read: Is a directory"):
        LogFile(tmp_path)


@pytest.mark.parametrize("content", [b"", b"hello", b"\x89MCAP1\r\n and more"])
def test_a_file_of_another_format_is_not_a_log(path: Path, content: bytes) -> None:
    path.write_bytes(content)

    with pytest.raises(LogError, match="it is not an MCAP file"):
        LogFile(path)


def test_an_mcap_file_of_another_program_is_not_a_log(path: Path) -> None:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(library="rosbag2 1.0")
        writer.finish()

    with pytest.raises(LogError, match=r"is not a Farside log: it was written by rosbag2 1\.0"):
        LogFile(path)


# --- rare topics in a large log ----------------------------------------------------------------


@pytest.fixture
def large(run: Any, path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A log that counts as large: poses are frequent in it, and all else is rare."""
    monkeypatch.setattr(packing, "_CHUNK_BYTE", 300)
    monkeypatch.setattr(packing, "_LARGE_CHUNKS", 2)
    monkeypatch.setattr(sparse, "_LEAST_BYTE", 600)
    monkeypatch.setattr(sparse, "_CHUNK_BYTE", 200)
    run.start()
    for second in range(1, 30):
        run.stand(second, "at:A")
        if second % 7 == 0:
            run.note(second, Silence(silent=second % 2 == 0)).goal(second, "at:B")
    return Path(run.log(path, window=2))


@given(data=st.data())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
def test_rare_topics_of_a_large_log_are_read_from_their_copies_alike(
    large: Path, data: st.DataObject
) -> None:
    log = LogFile(large)
    topics: list[Topic[Any]] = [GROUND_SILENCE, ROVER_GOAL, ROVER_MODE, TRUTH_POSE, ROVER_STUCK]
    wanted = data.draw(st.lists(st.sampled_from(topics), unique=True))
    start, end = data.draw(st.tuples(st.integers(0, 31), st.integers(0, 31)))
    names = {topic.name for topic in wanted}

    found = list(log.records(wanted, start_ns=to_ns(start), end_ns=to_ns(end)))

    assert found == [
        record
        for record in log.records()
        if record.topic in names and to_ns(start) <= record.log_time_ns <= to_ns(end)
    ]


def test_copies_of_rare_messages_spare_the_log_itself(large: Path) -> None:
    """The chunks of the log may be gone: only the copies are read."""
    log = LogFile(large)
    goals = list(log.records([ROVER_GOAL]))
    content = bytearray(large.read_bytes())
    for block in log.index.blocks:
        content[block.offset : block.offset + block.length] = bytes(block.length)
    large.write_bytes(content)

    emptied = LogFile(large)

    assert len(goals) == 4
    assert list(emptied.records([ROVER_GOAL])) == goals
    assert not emptied.damage
    assert list(emptied.records([ROVER_GOAL, TRUTH_POSE])) == []
    assert emptied.damage


def test_without_the_copies_of_rare_messages_the_log_itself_is_read(large: Path) -> None:
    log = LogFile(large)
    goals = list(log.records([ROVER_GOAL]))
    assert len(log.index.sparse) > 1
    for block in log.index.sparse:
        content = bytearray(large.read_bytes())
        content[block.offset + block.length - 3] ^= 1
        damaged = large.with_name("damaged.mcap")
        damaged.write_bytes(content)

        assert list(LogFile(damaged).records([ROVER_GOAL])) == goals


def test_the_copies_are_no_attachment_of_the_run(large: Path) -> None:
    assert not LogFile(large).attachments
    assert not LogFile(large).metadata
    recovered = recover(LogFile(large))
    assert list(LogFile(recovered.path).records()) == list(LogFile(large).records())
