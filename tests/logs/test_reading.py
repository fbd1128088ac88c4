"""Reading whole, unfinished and damaged logs, and the errors that name what is wrong."""

import signal
import struct
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import MCAP0_MAGIC, Writer
from noting import with_pictures

from farside.control import Mode, ModeCause
from farside.logs import LogEntry, LogError, LogFile, Recorder, decode
from farside.logs.file import packing
from farside.logs.file.mcap_bytes import spans
from farside.node import Record, to_ns
from farside.topics import ModeEntry, Pose, Silence

hypothesis_with_files = settings(suppress_health_check=[HealthCheck.function_scoped_fixture])


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


# --- killed writers ----------------------------------------------------------------------------


class Killed(NamedTuple):
    """The log of a writer that was killed after its last flush."""

    content: bytes
    windows: list[list[Record]]
    sizes: list[int]
    """File size in bytes after opening and after each window."""


@pytest.fixture
def killed(run: Any, tmp_path: Path) -> Killed:
    records = run.start().note(1, Silence(silent=False)).stand(2, "at:A").stand(3, "at:B").records
    windows, path = [records[:4], records[4:6], records[6:]], tmp_path / "to be killed.mcap"
    with Recorder(path) as recorder:
        sizes = [path.stat().st_size]
        for window in windows:
            recorder.write(window)
            recorder.flush()
            sizes.append(path.stat().st_size)
        content = path.read_bytes()
    return Killed(content, windows, sizes)


@pytest.mark.processes
def test_a_log_whose_process_is_killed_holds_everything_up_to_the_last_flush(path: Path) -> None:
    program = (
        "import os, signal, sys; from pathlib import Path\n"
        "from farside.node import Record; from farside.logs import Recorder\n"
        "recorder = Recorder(Path(sys.argv[1]))\n"
        "recorder.attach('mission.toml', 'application/toml', b'seed = 1')\n"
        "recorder.write([Record('/rover/mode', 1, 1, b'{}')]); recorder.flush()\n"
        "recorder.write([Record('/rover/mode', 2, 2, b'{}')])\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )

    ended = subprocess.run([sys.executable, "-c", program, path], check=False)  # noqa: S603
    log = LogFile(path)

    assert ended.returncode == -signal.SIGKILL
    assert not log.complete
    assert [record.log_time_ns for record in log.records()] == [1]
    assert log.attachments["mission.toml"].data == b"seed = 1"


def test_a_log_truncated_in_its_last_chunk_gives_all_chunks_before(
    killed: Killed, path: Path
) -> None:
    first, second, last = killed.windows
    *_, start, end = killed.sizes

    found = []
    for size in range(start, end + 1):
        path.write_bytes(killed.content[:size])
        log = LogFile(path)
        assert not log.complete
        found.append(list(log.records()))

    # The last chunk counts as soon as it is whole, even if its index is truncated.
    without = found.count(first + second)
    assert found == [first + second] * without + [first + second + last] * (len(found) - without)
    assert 0 < without < len(found)


@pytest.mark.parametrize("missing", [1, 8, 9])
def test_a_log_is_complete_only_with_the_last_byte_of_its_footer(
    run: Any, path: Path, missing: int
) -> None:
    content = run.start().log(path).read_bytes()
    assert LogFile(path).complete

    path.write_bytes(content[:-missing])

    assert not LogFile(path).complete
    assert list(LogFile(path).records()) == run.records


@hypothesis_with_files
@given(share=st.floats(0, 1, exclude_max=True))
@example(share=0.0)
def test_a_log_truncated_anywhere_gives_its_first_records_or_is_refused(
    killed: Killed, path: Path, share: float
) -> None:
    path.write_bytes(killed.content[: int(share * len(killed.content))])

    try:
        log = LogFile(path)
    except LogError:
        assert share * len(killed.content) < killed.sizes[0]
        return
    found = list(log.records())
    assert not log.complete
    assert found == [record for window in killed.windows for record in window][: len(found)]


@hypothesis_with_files
@given(data=st.data())
def test_a_corrupt_byte_raises_nothing_but_log_errors(
    killed: Killed, path: Path, data: st.DataObject
) -> None:
    content = bytearray(killed.content)
    content[data.draw(st.integers(0, len(content) - 1))] ^= data.draw(st.integers(1, 255))
    path.write_bytes(content)

    with suppress(LogError):
        list(LogFile(path).entries())


def test_a_damaged_chunk_is_reported_after_the_records_before_it(
    run: Any, path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packing, "_CHUNK_BYTE", 100)
    run.start().stand(2, "at:A").stand(3, "at:B").log(path)
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    last = summary.chunk_indexes[-1]
    damaged = bytearray(path.read_bytes())
    damaged[last.chunk_start_offset + last.chunk_length - 5] ^= 1
    path.write_bytes(damaged)

    records, found = LogFile(path).records(pictures=True), list[Record]()
    with pytest.raises(LogError, match=rf"{path} is damaged at byte \d+"):
        found.extend(records)

    everything = with_pictures(run.records)
    assert found == everything[: len(found)]
    assert 0 < len(found) < len(everything)


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


def test_a_summary_that_has_one_attachment_read_over_and_over_is_damage(path: Path) -> None:
    with Recorder(path) as recorder:
        recorder.attach("large.bin", "application/octet-stream", bytes(1 << 20))
    content = path.read_bytes()
    marks_byte = 9 + 20 + len(MCAP0_MAGIC)  # the footer with its head, and the magic
    [start] = struct.unpack_from("<Q", content, len(content) - marks_byte + 9)
    with path.open("rb") as file:
        summary = list(spans(file, start, len(content) - marks_byte))
    [entry] = [
        content[span.offset - 9 : span.offset + span.length]
        for span in summary
        if span.opcode == Opcode.ATTACHMENT_INDEX
    ]
    footer = struct.pack("<BQQQI", Opcode.FOOTER, 20, start, 0, 0)

    path.write_bytes(content[:-marks_byte] + footer + MCAP0_MAGIC)
    assert LogFile(path).attachments["large.bin"].data == bytes(1 << 20)
    path.write_bytes(content[:-marks_byte] + entry * 1000 + footer + MCAP0_MAGIC)
    with pytest.raises(LogError, match="is damaged"):
        LogFile(path)
