"""Following a log while it is written: every record once, wherever the writer happens to be."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from farside.logs import LogFile, Recorder
from farside.logs.file.following import followed
from farside.logs.moments import Moments
from farside.logs.playing import Player
from farside.node import Record, to_ns

_TOPICS = ("/ground/silence", "/rover/mode", "/truth/pose")
_WINDOW_S = 4

windows = st.lists(
    st.lists(
        st.tuples(st.integers(0, _WINDOW_S - 1), st.sampled_from(_TOPICS), st.integers(0, 300)),
        max_size=12,
    ),
    min_size=1,
    max_size=4,
)
"""In each window the second, the topic and the length of each record."""


def _window(number: int, drawn: list[tuple[int, str, int]]) -> list[Record]:
    """As the conductor writes one: what happens where it ends is of the next one."""
    times = ((to_ns(number * _WINDOW_S + second), topic, size) for second, topic, size in drawn)
    records = [Record(topic, ns, ns, b"x" * size) for ns, topic, size in times]
    return sorted(records, key=lambda record: record.log_time_ns)


class Growing(NamedTuple):
    """A log of which a reader sees ever more.

    Attributes:
        path: where it is read.
        records: all that it will hold.
        unfinished: all bytes of it before it was packed.
        finished: the same log, packed.
        begun_byte: how much of it a reader needs to see what it is.
    """

    path: Path
    records: list[Record]
    unfinished: bytes
    finished: bytes
    begun_byte: int

    @classmethod
    def of(cls, folder: Path, drawn: list[list[tuple[int, str, int]]]) -> "Growing":
        written, path = folder / "written.mcap", folder / "growing.mcap"
        for old in (written, path):
            old.unlink(missing_ok=True)
        recorder = Recorder(written)
        begun_byte = written.stat().st_size
        records = []
        for number, window in enumerate(drawn):
            records += _window(number, window)
            recorder.write(_window(number, window))
            recorder.flush()
        unfinished = written.read_bytes()
        recorder.close()
        return cls(path, records, unfinished, written.read_bytes(), begun_byte)

    def grow(self, shares: list[float]) -> Iterator[None]:
        """Let the reader see more, as far as each share of it; at last the packed log."""
        rest_byte = len(self.unfinished) - self.begun_byte
        for share in sorted(shares):
            self.path.write_bytes(self.unfinished[: self.begun_byte + int(share * rest_byte)])
            yield
        packed = self.path.with_suffix(".packed")
        packed.write_bytes(self.finished)
        packed.replace(self.path)
        yield


@pytest.fixture
def small_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A window of some length has several chunks, of which a reader may see the first only."""
    monkeypatch.setattr("farside.logs.recording._CHUNK_BYTE", 250)


shares = st.lists(st.floats(0, 1), min_size=1, max_size=8)
law = settings(max_examples=50, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.usefixtures("small_chunks")
@law
@given(drawn=windows, shares=shares)
def test_whoever_follows_a_log_gets_every_record_once(
    tmp_path: Path, drawn: list[list[tuple[int, str, int]]], shares: list[float]
) -> None:
    log = Growing.of(tmp_path, drawn)
    growth = log.grow(shares)
    next(growth)

    assert list(followed(LogFile(log.path), None, lambda _: next(growth))) == log.records


@pytest.mark.usefixtures("small_chunks")
@law
@given(drawn=windows, shares=shares)
def test_whoever_plays_a_log_that_grows_gets_every_record_once(
    tmp_path: Path, drawn: list[list[tuple[int, str, int]]], shares: list[float]
) -> None:
    log = Growing.of(tmp_path, drawn)
    growth = log.grow(shares)
    next(growth)
    file = LogFile(log.path)
    player = Player(file, speed=float("inf"))
    assert player.advance(0).jumped
    shown = list(file.records(end_ns=player.now_ns))

    played = list(player.advance(1).records)
    for _ in growth:
        file.refresh()
        played += player.advance(1).records

    assert shown + played == log.records


def test_of_a_log_that_was_empty_when_it_was_opened_the_first_moment_is_seen_later(
    run: Any, path: Path
) -> None:
    recorder = Recorder(path)
    log = LogFile(path)
    moments = Moments(log)
    assert moments.at(0).chart is None

    recorder.write(run.start().stand(20, "at:A").records)
    recorder.flush()
    log.refresh()

    assert moments.at(0).chart is not None
    assert moments.at(to_ns(20)).chart is not None
    recorder.close()
