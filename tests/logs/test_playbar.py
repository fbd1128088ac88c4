"""What Foxglove's play bar asks for, and what a viewer gets to see."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from farside.logs import LogFile
from farside.logs.live.feeds import LogFeed, RunFeed
from farside.logs.live.playbar import BarState, PlayBar, Status, Tick
from farside.logs.playing import Player
from farside.node import Record, to_ns, to_s
from farside.topics import TOPICS

END_S = 10


@pytest.fixture
def log(run: Any, path: Path) -> LogFile:
    """A log with a pose at every full second, and two changes of the Goal List."""
    run.start().goal(2, "at:A").reach(6, "at:A")
    for t_s in range(1, END_S + 1):
        run.stand(t_s, "at:D")
    return LogFile(run.log(path))


@pytest.fixture
def heard(run: Any, path: Path) -> LogFile:
    """A log with a pose at every full second, which the ground hears of a second later."""
    run.start()
    for t_s in range(1, END_S):
        run.stand(t_s, "at:D").hear(t_s + 1, "at:D", since_s=t_s)
    return LogFile(run.log(path))


def _bar(log: LogFile, *, speed: float = 1.0, start_s: float = 0.0) -> PlayBar:
    feed = LogFeed(log)
    return PlayBar(Player(feed, speed=speed, start_ns=to_ns(start_s)), feed, feed.end_ns)


def _own(records: Iterable[Record]) -> list[Record]:
    """Without the pictures, which follow what they are made of."""
    return [record for record in records if record.topic in TOPICS]


def _shown(tick: Tick) -> list[tuple[str, float]]:
    return [(record.topic, to_s(record.log_time_ns)) for record in _own(tick.records)]


def _after_a_seek(bar: PlayBar) -> Tick:
    """What comes once the answer to the seek is surely through."""
    ticks = [bar.advance(0.0) for _ in range(3)]
    assert [tick.records for tick in ticks[:2]] == [[], []]
    return ticks[2]


def test_play_sends_what_is_due(log: LogFile) -> None:
    bar = _bar(log)
    bar.advance(0)
    assert _shown(bar.advance(2.0)) == [
        ("/truth/pose", 1),
        ("/rover/goal", 2),
        ("/truth/pose", 2),
    ]


def test_the_first_tick_and_every_seek_bring_the_last_message_of_each_topic(log: LogFile) -> None:
    bar = _bar(log, start_s=4.5)
    assert _shown(bar.advance(0)) == [
        ("/truth/yard", 0),
        ("/rover/mode", 0),
        ("/rover/failsafe", 0),
        ("/rover/goal", 2),
        ("/truth/pose", 4),
    ]

    assert bar.request(playing=True, speed=1.0, seek_ns=to_ns(1.5)) == BarState(
        Status.PLAYING, to_ns(1.5), 1.0, did_seek=True
    )
    assert _shown(_after_a_seek(bar))[-1] == ("/truth/pose", 1)


def test_while_an_answer_to_a_seek_is_on_its_way_no_time_passes(log: LogFile) -> None:
    bar = _bar(log)
    bar.advance(0)
    bar.request(playing=True, speed=1.0, seek_ns=to_ns(5))
    assert [bar.advance(1.0).time_ns for _ in range(3)] == [to_ns(5), to_ns(5), to_ns(6)]


def test_a_pause_stops_time_and_a_new_speed_acts_at_once(log: LogFile) -> None:
    bar = _bar(log)
    bar.advance(0)
    assert bar.request(playing=False, speed=1.0, seek_ns=None).status is Status.PAUSED
    assert _shown(bar.advance(5.0)) == []

    assert bar.request(playing=True, speed=3.0, seek_ns=None) == BarState(Status.PLAYING, 0, 3.0)
    assert _shown(bar.advance(1.0))[-1] == ("/truth/pose", 3)


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), float("inf")])
def test_a_speed_that_is_none_changes_nothing(log: LogFile, speed: float) -> None:
    assert _bar(log, speed=2.0).request(playing=True, speed=speed, seek_ns=None).speed == 2.0


def test_the_state_is_told_when_it_changes_and_not_again(log: LogFile) -> None:
    bar = _bar(log)
    told = [bar.advance(4.0).state for _ in range(5)]
    assert [None if state is None else state.status for state in told] == [
        Status.PLAYING,
        None,
        Status.ENDED,
        None,
        None,
    ]


def test_from_its_end_a_seek_plays_on(log: LogFile) -> None:
    bar = _bar(log, start_s=END_S)
    bar.advance(0)
    assert bar.state.status is Status.ENDED
    bar.request(playing=True, speed=1.0, seek_ns=0)
    _after_a_seek(bar)
    assert bar.advance(1.0).time_ns == to_ns(1)


def test_a_viewer_that_subscribes_late_gets_the_last_message_and_the_state(log: LogFile) -> None:
    bar = _bar(log)
    bar.advance(0)
    bar.advance(3.0)
    bar.subscribe("/rover/goal")

    tick = bar.advance(0.0)
    assert _shown(tick) == [("/rover/goal", 2)]
    assert tick.state.status is Status.PLAYING


def test_it_waits_for_the_first_viewer_where_it_is_told_to(log: LogFile) -> None:
    feed = LogFeed(log)
    bar = PlayBar(Player(feed), feed, feed.end_ns, waiting=True)
    assert _shown(bar.advance(5.0)) == []
    assert bar.state.status is Status.PAUSED

    bar.subscribe("/truth/pose")
    assert ("/truth/yard", 0) in _shown(bar.advance(0))
    assert bar.advance(1.0).time_ns == to_ns(1)


def test_of_very_many_messages_a_tick_sends_some_and_the_next_ones_the_rest(
    log: LogFile, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("farside.logs.live.playbar.MOST_AT_ONCE", 5)
    bar = _bar(log)
    bar.advance(0)
    due = list(log.records(start_ns=1, pictures=True))
    ticks = [bar.advance(9.0) for _ in range(len(due) // 5 + 1)]
    assert [len(tick.records) for tick in ticks[:-1]] == [5] * (len(due) // 5)
    assert [record for tick in ticks for record in tick.records] == due
    assert [tick.time_ns for tick in ticks[:-1]] == [
        due[4::5][n].log_time_ns for n in range(len(due) // 5)
    ]
    assert bar.state.status is Status.ENDED


_ASKED = st.lists(
    st.tuples(
        st.booleans(),
        st.floats(0.1, 30),
        st.one_of(st.none(), st.integers(-1, 11)),
        st.floats(0, 1),
    ),
    max_size=25,
)


@given(asked=_ASKED, known_s=st.integers(0, END_S))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])  # the log is only read
def test_as_ground_nothing_that_is_shown_was_unknown_to_it_then(
    heard: LogFile, asked: list[tuple[bool, float, int | None, float]], known_s: int
) -> None:
    ground = LogFeed(heard.as_ground(to_ns(known_s)))
    bar = PlayBar(Player(ground), ground, ground.end_ns)
    for playing, speed, seek_s, wall_s in asked:
        seek_ns = None if seek_s is None else max(0, to_ns(seek_s))
        answer = bar.request(playing=playing, speed=speed, seek_ns=seek_ns)
        assert answer.time_ns <= to_ns(known_s)
        for _ in range(3):
            tick = bar.advance(wall_s)
            assert tick.time_ns <= to_ns(known_s)
            for record in tick.records:
                assert record.topic.startswith("/ground/")
                assert record.log_time_ns <= tick.time_ns


# --- a run in progress --------------------------------------------------------------------------


class _Run:
    """A run that goes on, two seconds at a time, whenever the play bar lets it.

    As with the conductor, what happens where a window ends is of the next one.
    """

    def __init__(self, log: LogFile, *, speed: float = 1.0) -> None:
        self._log = log
        self.feed = RunFeed()
        self.feed.path = log.path
        self.bar = PlayBar(Player(self.feed, speed=speed), self.feed, to_ns(END_S))

    @property
    def reached_s(self) -> float:
        return to_s(self.feed.end_ns)

    def window(self) -> None:
        begin_ns, until_ns = self.feed.end_ns, self.feed.end_ns + to_ns(2)
        self.feed.extend(until_ns, list(self._log.records(start_ns=begin_ns, end_ns=until_ns - 1)))

    def tick(self, wall_s: float) -> list[Record]:
        """A tick of a server, and as many windows as it lets pass."""
        records = self.bar.advance(wall_s).records
        while self.bar.wants_more and self.reached_s < END_S:
            self.window()
            records += self.bar.advance(0).records
        return records


@pytest.fixture
def going(log: LogFile) -> _Run:
    going = _Run(log)
    going.window()
    going.tick(0)
    return going


def test_a_run_is_shown_as_its_log_will_be_pictures_included(going: _Run, log: LogFile) -> None:
    shown = [record for _ in range(20) for record in going.tick(0.5)]
    assert shown == list(log.records(start_ns=1, end_ns=to_ns(END_S) - 1, pictures=True))


def test_a_run_goes_on_when_playback_has_caught_up_with_it(going: _Run) -> None:
    assert [(going.tick(1.0) and None, going.reached_s)[1] for _ in range(5)] == [2, 4, 4, 6, 6]


def test_a_pause_holds_the_run(going: _Run) -> None:
    going.tick(1.5)
    going.bar.request(playing=False, speed=1.0, seek_ns=None)
    for _ in range(9):
        going.tick(9.0)
    assert (going.reached_s, going.bar.state.time_ns) == (2, to_ns(1.5))


def test_a_seek_back_replays_what_was_recorded_and_the_run_waits_for_it(
    going: _Run, log: LogFile
) -> None:
    going.tick(2.0)
    going.tick(2.0)
    assert going.reached_s == 6
    going.bar.request(playing=True, speed=1.0, seek_ns=to_ns(1.5))
    assert going.tick(0) == going.tick(0) == []
    back = going.tick(0)
    assert max(to_s(record.log_time_ns) for record in back) == 1

    again = going.tick(4.4)
    assert [to_s(record.log_time_ns) for record in _own(again)] == [2, 2, 3, 4, 5]
    assert again == list(log.records(start_ns=to_ns(1.5), end_ns=to_ns(5.9), pictures=True))
    assert going.reached_s == 6
    going.tick(0.2)
    assert going.reached_s == 8


def test_a_seek_ahead_makes_the_run_hurry_and_shows_nothing_of_the_way(going: _Run) -> None:
    answer = going.bar.request(playing=False, speed=1.0, seek_ns=to_ns(7))
    assert answer == BarState(Status.BUFFERING, to_ns(7), 1.0, did_seek=True)

    came = [record for _ in range(5) for record in going.tick(0)]
    assert (going.reached_s, going.bar.state.status) == (8, Status.PAUSED)
    assert len(came) == len({record.topic for record in came})
    assert max(to_s(record.log_time_ns) for record in came) == 7


def test_a_pause_ends_the_hurry_where_the_run_is(going: _Run) -> None:
    going.bar.request(playing=True, speed=1.0, seek_ns=to_ns(7))
    answer = going.bar.request(playing=False, speed=1.0, seek_ns=None)
    assert answer == BarState(Status.PAUSED, to_ns(2) - 1, 1.0, did_seek=True)
    for _ in range(5):
        going.tick(9.0)
    assert going.reached_s == 2


def test_a_run_that_ends_early_ends_the_hurry(going: _Run) -> None:
    going.bar.request(playing=True, speed=1.0, seek_ns=to_ns(9))
    going.feed.finish()
    going.feed.end_ns = to_ns(4)
    going.bar.finish()
    assert going.bar.state == BarState(Status.ENDED, to_ns(4), 1.0)


def test_over_it_plays_on_as_a_log(going: _Run) -> None:
    while going.reached_s < END_S:
        going.tick(1.0)
    going.feed.finish()
    going.bar.finish()
    going.tick(9.0)
    assert going.bar.state.status is Status.ENDED
    going.bar.request(playing=True, speed=1.0, seek_ns=to_ns(3))
    _after_a_seek(going.bar)
    assert _shown(going.bar.advance(1.0)) == [("/truth/pose", 4)]
