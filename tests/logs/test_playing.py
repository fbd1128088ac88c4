"""Playing a log, as wall time passes: forwards, backwards, round and round."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from farside.logs import LogFile
from farside.logs.playing import Played, Player
from farside.node import Record, to_ns, to_s
from farside.topics import TRUTH_POSE

END_S = 10


@pytest.fixture
def log(run: Any, path: Path) -> LogFile:
    """A log with a pose at every full second from 0 to 10, and little else."""
    run.start()
    for t_s in range(1, END_S + 1):
        run.stand(t_s, "at:D")
    return LogFile(run.log(path))


def _seconds(played: Played) -> list[float]:
    return [to_s(record.log_time_ns) for record in played.records]


def test_play_brings_what_is_due_as_wall_time_passes(log: LogFile) -> None:
    player = Player(log, [TRUTH_POSE], speed=2.0)
    assert player.advance(0).jumped

    assert _seconds(player.advance(1.0)) == [1, 2]
    assert _seconds(player.advance(0.25)) == []
    assert _seconds(player.advance(0.25)) == [3]
    player.set_speed(4.0)
    assert _seconds(player.advance(1.0)) == [4, 5, 6, 7]


def test_pause_stops_time_and_play_goes_on_from_there(log: LogFile) -> None:
    player = Player(log, [TRUTH_POSE])
    player.advance(1.0)
    player.pause()
    assert _seconds(player.advance(5.0)) == []

    player.play()
    assert _seconds(player.advance(1.0)) == [2]


def test_what_is_not_taken_comes_with_the_next_stretch(log: LogFile) -> None:
    player = Player(log, [TRUTH_POSE])
    player.advance(0)
    played = player.advance(2.0)
    assert to_s(next(played.records).log_time_ns) == 1
    assert _seconds(player.advance(1.0)) == [2, 3]


def test_a_seek_is_a_jump_and_play_goes_on_behind_it(log: LogFile) -> None:
    player = Player(log, [TRUTH_POSE], start_ns=to_ns(7))
    player.advance(0)
    player.seek(to_ns(3))

    played = player.advance(0)
    assert played.jumped
    assert _seconds(played) == []
    assert _seconds(player.advance(1.0)) == [4]


@pytest.mark.parametrize(("to_s_", "reached_s"), [(-5, 0), (99, END_S)])
def test_a_seek_beyond_the_log_ends_where_the_log_does(
    log: LogFile, to_s_: float, reached_s: float
) -> None:
    player = Player(log)
    player.seek(to_ns(to_s_))
    assert player.now_ns == to_ns(reached_s)


@pytest.mark.parametrize("speed", [1e5, 1e308, math.inf])
def test_at_any_speed_it_stops_at_the_end(log: LogFile, speed: float) -> None:
    player = Player(log, [TRUTH_POSE], speed=speed)
    player.advance(0)
    assert _seconds(player.advance(0)) == []
    assert _seconds(player.advance(0.001)) == list(range(1, END_S + 1))
    assert player.at_end
    assert _seconds(player.advance(1.0)) == []


def test_backwards_each_stretch_is_a_jump_down_to_the_beginning(log: LogFile) -> None:
    player = Player(log, start_ns=to_ns(3))
    player.reverse()
    reached = []
    for _ in range(4):
        played = player.advance(1.0)
        reached.append((played.jumped, to_s(player.now_ns)))
    assert reached == [(True, 2), (True, 1), (True, 0), (True, 0)]
    assert player.at_end


def test_a_loop_plays_its_end_and_jumps_to_its_beginning(log: LogFile) -> None:
    player = Player(log, [TRUTH_POSE], start_ns=to_ns(2))
    player.loop(to_ns(2), to_ns(4))
    player.advance(0)

    assert _seconds(player.advance(9.0)) == [3, 4]
    again = player.advance(1.0)
    assert (again.jumped, player.now_ns) == (True, to_ns(2))
    assert _seconds(player.advance(1.0)) == [3]
    player.unloop()
    assert _seconds(player.advance(9.0)) == [4, 5, 6, 7, 8, 9, 10]


def test_backwards_a_loop_jumps_from_its_beginning_to_its_end(log: LogFile) -> None:
    player = Player(log, start_ns=to_ns(4))
    player.loop(to_ns(2), to_ns(4))
    player.reverse()
    reached = []
    for _ in range(4):
        player.advance(1.0)
        reached.append(to_s(player.now_ns))
    assert reached == [3, 2, 4, 3]


def test_from_behind_its_loop_it_plays_to_the_end_of_the_log_and_then_into_it(
    log: LogFile,
) -> None:
    player = Player(log, start_ns=to_ns(9))
    player.loop(to_ns(2), to_ns(4))
    player.advance(5.0)
    assert player.now_ns == to_ns(END_S)
    player.advance(1.0)
    assert player.now_ns == to_ns(2)


@pytest.mark.parametrize("speed", [0.0, -1.0, math.nan])
def test_a_speed_that_is_none_is_refused(log: LogFile, speed: float) -> None:
    with pytest.raises(ValueError, match="expected a speed above 0"):
        Player(log, speed=speed)


def test_a_loop_that_ends_before_it_begins_is_refused(log: LogFile) -> None:
    with pytest.raises(ValueError, match="ends after it begins"):
        Player(log).loop(to_ns(4), to_ns(4))


class _Growing:
    """The first part of a log, as long as a test lets it be."""

    def __init__(self, log: LogFile, end_s: float) -> None:
        self._log = log
        self.end_ns = to_ns(end_s)

    @property
    def there_until_ns(self) -> int:
        return self.end_ns

    def records(
        self, topics: Any = None, *, start_ns: int = 0, end_ns: int = to_ns(END_S)
    ) -> Iterator[Record]:
        return self._log.records(topics, start_ns=start_ns, end_ns=min(end_ns, self.end_ns))


def test_at_the_head_of_a_growing_log_it_waits_and_goes_on_as_the_log_grows(log: LogFile) -> None:
    growing = _Growing(log, 2)
    player = Player(growing, [TRUTH_POSE])
    player.advance(0)
    assert _seconds(player.advance(5.0)) == [1, 2]
    assert player.at_end

    growing.end_ns = to_ns(6)
    assert _seconds(player.advance(1.0)) == [3]
    growing.end_ns = to_ns(9)
    assert _seconds(player.advance(9.0)) == [4, 5, 6, 7, 8, 9]


_ACTS = st.lists(
    st.one_of(
        st.tuples(st.just("advance"), st.floats(0, 3)),
        st.tuples(st.just("seek"), st.floats(-1, 12)),
        st.tuples(st.just("grow"), st.floats(0, 4)),
        st.tuples(st.sampled_from(["pause", "play", "reverse"]), st.just(0.0)),
    ),
    max_size=30,
)


@given(acts=_ACTS)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])  # the log is only read
def test_between_two_jumps_every_record_comes_once_and_none_before_its_time(
    log: LogFile, acts: list[tuple[str, float]]
) -> None:
    growing = _Growing(log, 1)
    player = Player(growing, speed=1.0)
    came: list[Record] = []
    since_ns = 0
    for act, value in acts:
        match act:
            case "seek":
                player.seek(to_ns(value))
            case "grow":
                growing.end_ns = min(growing.end_ns + to_ns(value), log.end_ns)
            case "advance":
                played = player.advance(value)
                if played.jumped:
                    came, since_ns = [], player.now_ns
                came += played.records
                assert came == list(log.records(start_ns=since_ns + 1, end_ns=player.now_ns))
                assert player.now_ns <= growing.end_ns
            case _:
                getattr(player, act)()
