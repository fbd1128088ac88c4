"""Logs that were cut or damaged: what is readable is given, and what is missing is told.

The law, of every log and every damage to one byte: what is read was written, in this order; and
either all of it is read, or `LogFile.damage` says that something is missing.
"""

import struct
import zlib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.reader import make_reader

from farside.logs import LogError, LogFile, Recorder
from farside.logs.file import packing
from farside.logs.file.mcap_bytes import MAGIC, chunk_bytes, message_bytes
from farside.node import Record, to_ns
from farside.topics import ROVER_MODE, Silence

FOOTER_BYTE = 9 + 20
MISSION = b"seed = 1"


class Written(NamedTuple):
    """A log, and what was written to it: records by window."""

    content: bytes
    windows: list[list[Record]]
    flushed: list[int]
    """Where each window ends, after what stands before the first."""

    @property
    def records(self) -> list[Record]:
        return self.without()

    def without(self, *lost: int) -> list[Record]:
        """The records of all windows but these; a negative number counts from the last."""
        numbers = {number % len(self.windows) for number in lost}
        kept = (window for n, window in enumerate(self.windows) if n not in numbers)
        return [record for window in kept for record in window]


def write(run: Any, path: Path, *, finished: bool) -> Written:
    """Write a small log in four windows; it is left as a killed writer leaves it, or finished."""
    records = run.start().note(1, Silence(silent=False)).stand(2, "at:A").stand(3, "at:B").records
    windows = [records[:3], records[3:4], records[4:6], records[6:]]
    recorder, flushed = Recorder(path), []
    recorder.attach("mission.toml", "application/toml", MISSION)
    recorder.metadata("farside.run", {"mission": "small", "seed": "1"})
    recorder.flush()
    for window in ([], *windows):
        recorder.write(window)
        recorder.flush()
        flushed.append(path.stat().st_size - len(MAGIC) - FOOTER_BYTE - 13)
    content = path.read_bytes()
    recorder.close()
    return Written(path.read_bytes() if finished else content, windows, flushed)


@pytest.fixture
def killed(run: Any, path: Path) -> Written:
    return write(run, path, finished=False)


@pytest.fixture
def finished(run: Any, path: Path, monkeypatch: pytest.MonkeyPatch) -> Written:
    """A finished log with several chunks."""
    monkeypatch.setattr(packing, "_CHUNK_BYTE", 200)
    return write(run, path, finished=True)


def is_in_order(found: Iterable[object], written: Iterable[object]) -> bool:
    """Whether all of `found` is among `written`, in this order."""
    rest = iter(written)
    return all(one in rest for one in found)


def holds_what_was_written(path: Path, content: bytes, written: Written) -> bool:
    """Write these bytes and check the law; returns whether the file is a log at all."""
    path.write_bytes(content)
    try:
        log = LogFile(path)
    except LogError:
        return False
    found = list(log.records())
    assert is_in_order(found, written.records)
    assert log.attachments in ({}, {"mission.toml": ("application/toml", MISSION)})
    assert log.metadata in ({}, {"farside.run": {"mission": "small", "seed": "1"}})
    is_all = found == written.records and bool(log.attachments) and bool(log.metadata)
    assert is_all or log.damage
    return True


files = settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=150)


@pytest.mark.parametrize("kind", ["killed", "finished"])
def test_with_any_byte_changed_a_log_gives_what_is_readable_and_tells_of_the_rest(
    request: pytest.FixtureRequest, path: Path, kind: str
) -> None:
    written: Written = request.getfixturevalue(kind)

    @files
    @given(
        # Most bytes are schemas: near the end are the windows, or the chunks and their index.
        back=st.integers(1, len(written.content)) | st.integers(1, 3000),
        change=st.integers(1, 255),
    )
    def check(back: int, change: int) -> None:
        content = bytearray(written.content)
        content[-back] ^= change
        assert holds_what_was_written(path, bytes(content), written)

    check()


@pytest.mark.parametrize("kind", ["killed", "finished"])
def test_a_damaged_header_costs_nothing_but_itself(
    request: pytest.FixtureRequest, path: Path, kind: str
) -> None:
    written: Written = request.getfixturevalue(kind)
    for at in range(8 + 9 + 8 + len("farside 0.1.0")):
        for change in (0x01, 0x80):
            content = bytearray(written.content)
            content[at] ^= change
            assert holds_what_was_written(path, bytes(content), written)
            assert list(LogFile(path).records()) == written.records


@pytest.mark.parametrize("kind", ["killed", "finished"])
def test_cut_anywhere_a_log_gives_what_is_whole_before_the_cut(
    request: pytest.FixtureRequest, path: Path, kind: str
) -> None:
    written: Written = request.getfixturevalue(kind)

    @files
    @given(size=st.integers(0, len(written.content) - 1))
    def check(size: int) -> None:
        if not holds_what_was_written(path, written.content[:size], written):
            assert size < 100, "the header says whose log it is"

    check()


def test_a_log_cut_in_its_windows_gives_all_windows_before(killed: Written, path: Path) -> None:
    borders = {end + by for end in killed.flushed for by in (-1, 0, 1)}
    sizes = borders.union(range(killed.flushed[0], killed.flushed[-1], 11))
    for size in sorted(sizes - {killed.flushed[0] - 1, killed.flushed[-1] + 1}):
        path.write_bytes(killed.content[:size])

        log = LogFile(path)

        whole = sum(size >= end for end in killed.flushed[1:])
        assert list(log.records()) == killed.without(*range(whole, len(killed.windows)))
        assert log.damage[-1].startswith(f"bytes {killed.flushed[whole]} to {size}: ")


# --- what is told ------------------------------------------------------------------------------


def test_of_a_log_that_is_whole_no_damage_is_told(
    killed: Written, path: Path, tmp_path: Path
) -> None:
    path.write_bytes(killed.content)
    unfinished, log = LogFile(path), tmp_path / "whole.mcap"

    assert (list(unfinished.records()), unfinished.damage) == (killed.records, ())
    assert not unfinished.complete
    with Recorder(log) as recorder:
        recorder.write(killed.records)
    assert (list(LogFile(log).records()), LogFile(log).damage) == (killed.records, ())
    assert LogFile(log).complete


def test_a_damaged_window_is_told_with_its_bytes_and_its_times(killed: Written, path: Path) -> None:
    content = bytearray(killed.content)
    start, end = killed.flushed[2:4]
    content[end - 1] ^= 1
    path.write_bytes(content)

    log = LogFile(path)

    assert list(log.records()) == killed.without(2)
    [sentence] = log.damage
    assert sentence == (
        f"bytes {start} to {end}: a chunk whose contents are not what was written; "
        "messages from 1.0 s to 2.0 s are missing"
    )


def test_a_damaged_chunk_of_a_finished_log_is_told_once_it_is_reached(
    finished: Written, path: Path
) -> None:
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    last = summary.chunk_indexes[-1]
    content = bytearray(path.read_bytes())
    content[last.chunk_start_offset + last.chunk_length - 5] ^= 1
    path.write_bytes(content)

    log = LogFile(path)

    assert log.complete
    assert list(log.records([ROVER_MODE])), "the damage is not in its chunk"
    assert not log.damage
    assert list(log.records()) == finished.without(-1)
    [sentence] = log.damage
    end = last.chunk_start_offset + last.chunk_length
    assert sentence.startswith(f"bytes {last.chunk_start_offset} to {end}: ")
    assert sentence.endswith("messages from 3.0 s to 3.0 s are missing")


def test_behind_a_length_that_is_wrong_the_next_window_is_found(
    killed: Written, path: Path
) -> None:
    content = bytearray(killed.content)
    start, end = killed.flushed[2:4]
    content[start + 1] ^= 1
    path.write_bytes(content)

    log = LogFile(path)

    assert list(log.records()) == killed.without(2)
    assert log.damage == (
        f"bytes {start} to {end}: not what was written; messages from 0.0 s to 3.0 s are missing",
    )


def test_a_finished_log_without_its_index_is_read_through(finished: Written, path: Path) -> None:
    content = bytearray(finished.content)
    content[-len(MAGIC) - FOOTER_BYTE - 100] ^= 1
    path.write_bytes(content)

    log = LogFile(path)

    assert not log.complete
    assert list(log.records()) == finished.records
    [sentence] = log.damage
    assert sentence.endswith(f"to {len(content)}: not how a log ends; no message is missing")


def test_wrong_times_of_a_window_do_not_hide_its_messages(killed: Written, path: Path) -> None:
    """No checksum covers them; a query by time would pass over the window, and tell of nothing."""
    for start in killed.flushed[:-1]:
        for field in (9, 17):  # behind opcode and length of the chunk: its first and last time
            content = bytearray(killed.content)
            content[start + field + 7] ^= 0x10
            path.write_bytes(content)

            log = LogFile(path)

            assert list(log.records(start_ns=0, end_ns=to_ns(3))) == killed.records
            assert log.end_ns == to_ns(3)


def test_of_two_copies_of_the_channels_one_may_be_lost(killed: Written, path: Path) -> None:
    at = killed.content.index(b"\x28\xb5\x2f\xfd")  # where compressed data begin
    for copy in (at, killed.content.index(b"\x28\xb5\x2f\xfd", at + 1)):
        content = bytearray(killed.content)
        content[copy + 500] ^= 1
        path.write_bytes(content)

        log = LogFile(path)

        assert list(log.records()) == killed.records
        assert len(log.damage) == 1


# --- crafted files -----------------------------------------------------------------------------


def with_footer(content: bytes, summary: bytes) -> bytes:
    """A finished log whose summary is replaced, with a checksum that is right."""
    marks = FOOTER_BYTE + len(MAGIC)
    [start] = struct.unpack_from("<Q", content, len(content) - marks + 9)
    footer = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, 0)
    crc = struct.pack("<I", zlib.crc32(footer, zlib.crc32(summary)))
    return content[:start] + summary + footer + crc + MAGIC


def test_a_summary_that_has_one_attachment_read_over_and_over_is_not_believed(path: Path) -> None:
    with Recorder(path) as recorder:
        recorder.attach("large.bin", "application/octet-stream", bytes(1 << 20))
    content = path.read_bytes()
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    [index] = summary.attachment_indexes
    name, kind = b"large.bin", b"application/octet-stream"
    body = struct.pack("<QQQQQ", index.offset, index.length, 0, 0, 1 << 20)
    body += struct.pack("<I", len(name)) + name + struct.pack("<I", len(kind)) + kind
    entry = struct.pack("<BQ", Opcode.ATTACHMENT_INDEX, len(body)) + body

    for times, is_believed in ((1, True), (1000, False)):
        path.write_bytes(with_footer(content, entry * times))
        log = LogFile(path)
        assert log.complete is is_believed
        assert log.attachments["large.bin"].data == bytes(1 << 20)


def test_a_chunk_that_claims_all_memory_is_damage(killed: Written, path: Path) -> None:
    data = message_bytes([Record("/rover/mode", to_ns(9), to_ns(9), b"{}")], {"/rover/mode": 1})
    chunk = bytearray(chunk_bytes(data, to_ns(9), to_ns(9), compressed=True))
    struct.pack_into("<Q", chunk, 9 + 16, 1 << 60)
    path.write_bytes(killed.content[: killed.flushed[-1]] + bytes(chunk) + MAGIC)

    log = LogFile(path)

    assert list(log.records()) == killed.records
    assert any(f"a chunk of {1 << 60} bytes" in sentence for sentence in log.damage)
