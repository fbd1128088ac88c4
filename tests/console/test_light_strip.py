"""The light strip's data: words, gaps and beginnings about now, as the ground knows them."""

from collections.abc import Iterable, Iterator

import pytest
from ground_stories import seen, way
from noting import command_sent, logged, said_of

from farside.console.screen.screen import Strip, StripWord
from farside.console.strip import StripOf
from farside.control import CommandStage, Failsafe, Mode, TakeBackChance, Verdict
from farside.frames import Carried, FrameEvent, FrameStage
from farside.ground.view.view import GroundView
from farside.logs import LogEntry, Picture
from farside.logs.known import KnownCommands
from farside.messages import Drive, SetMode, Telemetry
from farside.node import Direction, to_ns, to_s
from farside.topics import GROUND_FRAME, GROUND_TELEMETRY, Silence

UP, DOWN = Direction.UP, Direction.DOWN
TAKEN, BEGUN, DONE = CommandStage.TAKEN, CommandStage.BEGUN, CommandStage.DONE


class Ground:
    """A ground that sends and hears, and its strip."""

    def __init__(self) -> None:
        self.strip_of = StripOf()
        self.commands = KnownCommands()
        self._frames = 0

    def notes(self, *entries: LogEntry) -> None:
        for entry in entries:
            self.strip_of.take(entry)
            self.commands.apply(entry.message, entry.log_time_ns)

    def sends(self, t_s: float, kind: str, number: int | None = None, attempt: int = 1) -> None:
        self._frame(t_s, UP, FrameStage.MADE, Carried(kind, number, attempt=attempt))

    def hears(
        self, t_s: float, kind: str, number: int | None = None, *, so_s: float | None = None
    ) -> None:
        made_ns = None if so_s is None else to_ns(so_s)
        self._frame(t_s, DOWN, FrameStage.USED, Carried(kind, number, made_ns))

    def measures(self, t_s: float, so_s: float) -> None:
        """Telemetry comes in, and shows how long light takes."""
        heard = Telemetry(
            to_ns(so_s), (), 0.0, 0.0, 0.0, 0.9, Mode.GUIDED, Failsafe.NOMINAL, None, (), 0
        )
        self.notes(LogEntry(to_ns(t_s), to_ns(so_s), GROUND_TELEMETRY.name, heard))

    def _frame(self, t_s: float, direction: Direction, stage: FrameStage, what: Carried) -> None:
        self._frames += 1
        event = FrameEvent(direction, self._frames, stage, 40, what.kind, carries=(what,))
        self.notes(LogEntry(to_ns(t_s), to_ns(t_s), GROUND_FRAME.name, event))

    def strip(self, t_s: float, view: GroundView | None = None) -> Strip:
        return self.strip_of.strip(to_ns(t_s), view or seen(t_s), self.commands)


@pytest.fixture
def ground() -> Ground:
    return Ground()


def seconds(times: Iterable[tuple[int, ...]]) -> list[tuple[float, ...]]:
    return [tuple(to_s(t_ns) for t_ns in some) for some in times]


def drawn(words: Iterable[StripWord]) -> Iterator[tuple[str, str, float, float]]:
    for word in words:
        yield word.direction, word.what, to_s(word.sent_ns), to_s(word.arrives_ns)


def test_now_stands_at_two_thirds_of_its_width(ground: Ground) -> None:
    strip = ground.strip(100)
    assert (to_s(strip.from_ns), to_s(strip.until_ns)) == (60, 120)


def test_with_a_long_light_time_it_covers_three_of_them(ground: Ground) -> None:
    strip = ground.strip(10_000, seen(10_000, way(1200), way(1200)))
    assert (to_s(strip.from_ns), to_s(strip.until_ns)) == (10_000 - 3600, 10_000 + 1800)


def test_before_the_first_view_light_takes_as_long_as_telemetry_took(ground: Ground) -> None:
    ground.measures(700, so_s=100)
    ground.sends(700, "heartbeat")
    strip = ground.strip_of.strip(to_ns(700), None, ground.commands)

    assert to_s(strip.from_ns) == 700 - 3 * 600
    assert list(drawn(strip.words)) == [("up", "heartbeat", 700, 1300)]


def test_words_go_up_and_down_and_the_newest_heard_says_what_is_known(ground: Ground) -> None:
    ground.hears(98.5, "telemetry", so_s=97.2)
    ground.hears(99, "event", 4)
    ground.sends(99.5, "heartbeat")
    strip = ground.strip(100)

    assert list(drawn(strip.words)) == [
        ("down", "telemetry", 97.2, 98.5),
        ("down", "event 4", 97.7, 99),
        ("up", "heartbeat", 99.5, 100.78),
    ]
    assert [word.routine for word in strip.words] == [True, False, True]
    assert to_s(strip.known_ns) == 97.7


def test_a_command_is_labelled_and_arrives_when_its_plan_says(ground: Ground) -> None:
    """The plan counts the queue and the rate; of what is sent again there is no plan."""
    ground.notes(logged(to_ns(99), command_sent(7, Drive("N"), due_s={TAKEN: 102.5, BEGUN: 103})))
    ground.sends(99, "command", 7)
    ground.sends(104, "command", 7, attempt=2)
    first, again = ground.strip(105).words

    assert (first.label, to_s(first.arrives_ns)) == ("7", 102.5)
    assert (again.label, to_s(again.arrives_ns)) == ("", 105.28)


def test_words_leave_to_the_left_only_when_they_have_arrived(ground: Ground) -> None:
    ground.sends(58, "command", 1)
    ground.sends(59, "command", 2)
    assert [word.label for word in ground.strip(100).words] == ["2"]
    assert not ground.strip(101).words


def test_what_begins_and_what_can_be_taken_back_is_that_on_the_way(ground: Ground) -> None:
    can = TakeBackChance.SURE
    ground.notes(
        logged(to_ns(99), command_sent(7, Drive("N"), due_s={TAKEN: 101, BEGUN: 103, DONE: 106})),
        logged(to_ns(99), command_sent(8, SetMode(Mode.SHARED), due_s={TAKEN: 101, DONE: 101.5})),
        logged(to_ns(99), command_sent(9, Drive("E"), due_s={TAKEN: 101, BEGUN: 1000})),
        logged(to_ns(99), said_of(7, take_back=can, until_s=101.6)),
        logged(to_ns(99), said_of(8, take_back=TakeBackChance.OPEN, until_s=101.6)),
        logged(to_ns(99), said_of(9, take_back=can, until_s=99.5)),
    )
    strip = ground.strip(100)
    assert strip.begins == ((7, to_ns(103)), (8, to_ns(101.5)))
    assert strip.take_backs == ((7, to_ns(101.6)),)

    ground.notes(
        logged(to_ns(104), said_of(7, BEGUN, Verdict.ON_TIME, so_s=102.8)),
        logged(to_ns(104), said_of(8, DONE, Verdict.ON_TIME, so_s=101.4)),
    )
    strip = ground.strip(104)
    assert strip.begins == ((7, to_ns(102.8)),)
    assert not strip.take_backs


def test_a_silence_is_a_gap_from_when_word_was_due_until_now_and_then_to_its_end(
    ground: Ground,
) -> None:
    ground.notes(logged(to_ns(95), Silence(silent=True)))
    assert seconds(ground.strip(97).gaps) == [(95, 97)]
    assert seconds(ground.strip(100, seen(100, silent_since_s=90)).gaps) == [(90, 100)]

    ground.notes(logged(to_ns(102), Silence(silent=False)))
    assert seconds(ground.strip(110).gaps) == [(90, 102)]
    assert not ground.strip(142).gaps


def test_a_gap_by_plan_is_drawn_before_it_comes_and_at_the_very_times_of_the_plan(
    ground: Ground,
) -> None:
    before = way(changes_s=110)
    closed = way(is_open=False, changes_s=118)
    assert seconds(ground.strip(100, seen(100, before, before)).gaps) == [(110, 120)]
    assert seconds(ground.strip(115, seen(115, closed, closed)).gaps) == [(110, 118)]
    assert seconds(ground.strip(125).gaps) == [(110, 118)]


def test_gaps_that_overlap_are_one_and_one_without_end_goes_on(ground: Ground) -> None:
    up, down = way(is_open=False), way(is_open=False, changes_s=105)
    assert seconds(ground.strip(100, seen(100, up, down)).gaps) == [(100, 120)]
    later = seen(110, way(is_open=False, changes_s=112), way(), silent_since_s=95)
    assert seconds(ground.strip(110, later).gaps) == [(95, 112)]


def test_at_a_long_light_time_routine_words_are_thinned_and_no_other_is(ground: Ground) -> None:
    far = seen(0, way(1200), way(1200))
    ground.strip(0, far)
    for t_s in range(1, 3600):
        ground.sends(t_s, "heartbeat")
        ground.hears(t_s, "telemetry", so_s=t_s - 1200)
        if t_s % 36 == 0:
            ground.sends(t_s, "command", t_s)
    words = ground.strip(3600, far).words

    assert [word.label for word in words if word.label] == [str(t_s) for t_s in range(36, 3600, 36)]
    routine = [to_s(word.sent_ns) for word in words if word.routine and word.direction is UP]
    assert routine == list(range(1, 3600, 36))
    assert len(words) <= 400


def test_however_much_is_said_it_stays_small_and_the_newest_stand(ground: Ground) -> None:
    for number in range(3000):
        ground.sends(70 + number / 100, "command", number)
        ground.sends(70 + number / 100, "heartbeat")
    words = ground.strip(100).words

    assert len(words) <= 400
    labels = [int(word.label) for word in words if word.label]
    assert labels == list(range(2600, 3000))


def test_what_is_routine_gives_way_to_what_is_not(ground: Ground) -> None:
    for number in range(350):
        ground.sends(90 + number / 100, "heartbeat")
        ground.sends(90 + number / 100, "command", number)
    for number in range(72):
        ground.sends(94 + number / 2, "heartbeat")
    words = ground.strip(130).words

    assert sum(not word.routine for word in words) == 350
    assert [to_s(word.sent_ns) for word in words if word.routine] == [
        94 + number / 2 for number in range(22, 72)
    ]


def test_in_a_whole_blackout_each_of_its_moments_fits_and_is_in_order(
    known: list[LogEntry],
) -> None:
    strip_of, picture = StripOf(), Picture(as_ground=True)
    dark: list[bool] = []
    for at, entry in enumerate(known):
        strip_of.take(entry)
        picture.apply(entry)
        if at % 50:
            continue
        strip = strip_of.strip(entry.log_time_ns, None, picture.commands)
        assert strip.known_ns <= entry.log_time_ns
        assert len(strip.words) <= 400
        sent = [word.sent_ns for word in strip.words]
        assert sent == sorted(sent)
        assert all(word.arrives_ns >= strip.from_ns for word in strip.words)
        if 670 < to_s(entry.log_time_ns) < 980:
            dark.append(strip.gaps == ((strip.from_ns, entry.log_time_ns),))
    assert dark
    assert all(dark)
