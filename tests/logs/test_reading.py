"""Reading a log by topic and time, and the errors that name what is wrong."""

from pathlib import Path
from typing import Any

import msgspec
import pytest
from mcap.writer import Writer

from farside.control import Mode, ModeCause
from farside.logs import LogEntry, LogError, LogFile, Recorder, decode
from farside.node import Record, to_ns
from farside.topics import ROVER_GOAL, TRUTH_POSE, ModeEntry, Pose, Silence


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
