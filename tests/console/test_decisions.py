"""When time slows down by itself: at, or before, a moment that needs a decision."""

from collections.abc import Sequence

import msgspec
import pytest
from ground_stories import seen, told, way
from msgspec.structs import replace
from noting import command_sent, logged, said_of

from farside.console.decisions import Decisions
from farside.console.pacing import Pacing, Until
from farside.control import CommandStage, Mode, ModeCause, Verdict
from farside.logs import LogEntry, Picture
from farside.messages import CommandReached, Drive, GoalReached, ModeChanged, Proposal
from farside.node import to_ns
from farside.topics import BeliefEntry, Known, LearnedBy


class Watching:
    """Decisions beside the picture of the ground, at a speed."""

    def __init__(self, speed: float) -> None:
        self.pacing = Pacing(speed)
        self.picture = Picture(as_ground=True)
        self.decisions = Decisions(self.pacing)
        self.alarms = 0

    def hear(self, entries: Sequence[LogEntry], now_s: float) -> None:
        for entry in entries:
            self.picture.apply(entry)
            self.decisions.take(entry, self.picture)
        self.settle(now_s)

    def settle(self, now_s: float) -> None:
        self.decisions.settle(to_ns(now_s), self.picture, self.alarms)


def proposal(number: int, *, veto_window_s: float | None = None) -> msgspec.Struct:
    return Proposal(number, to_ns(9), ("at:B",), "E", (), veto_window_s=veto_window_s)


def believed(mode: Mode) -> LogEntry:
    return logged(0, BeliefEntry((), mode=Known(mode, 0, 0, LearnedBy.TELEMETRY)))


def test_a_proposal_slows_down_who_goes_too_fast_to_answer() -> None:
    watching = Watching(60)
    watching.hear([logged(to_ns(10), proposal(3))], 10)

    assert watching.pacing.speed == 1
    assert watching.pacing.slowed == "proposal 3 asks for your word"


def test_who_works_with_a_rover_that_waits_is_not_slowed_at_every_step() -> None:
    watching = Watching(10)
    watching.hear([logged(to_ns(10), proposal(3))], 10)

    assert watching.pacing.speed == 10


def test_where_silence_is_consent_every_proposal_slows_down() -> None:
    watching = Watching(10)
    watching.hear([logged(to_ns(10), proposal(3, veto_window_s=6.0))], 10)

    assert watching.pacing.speed == 1


def test_an_alarm_slows_down_at_any_speed() -> None:
    watching = Watching(2)
    watching.alarms = 1
    watching.settle(10)

    assert watching.pacing.slowed == "an alarm has come"


def test_a_rover_that_has_done_what_was_ordered_waits_for_the_next_word() -> None:
    watching = Watching(60)
    watching.hear([believed(Mode.GUIDED), logged(to_ns(1), command_sent(1, Drive("E")))], 1)
    assert watching.pacing.speed == 60

    done = said_of(1, CommandStage.DONE, Verdict.ON_TIME, due_s=5, so_s=4)
    watching.hear([logged(to_ns(6), done)], 6)

    assert watching.pacing.slowed == "all that was ordered is done"


def test_before_a_contact_ends_there_is_time_for_a_last_word() -> None:
    watching = Watching(60)
    watching.decisions.see(seen(100, up=way(changes_s=150)))

    assert watching.pacing.window_ns(to_ns(139.5)) == to_ns(0.5)
    watching.settle(139.9)
    assert watching.pacing.speed == 60
    watching.settle(140)
    assert watching.pacing.slowed == "contact ends in 10 s"


def test_a_warp_to_a_contact_ends_once_the_plan_has_no_further_one() -> None:
    watching = Watching(1)
    watching.pacing.warp(Until.CONTACT)
    watching.decisions.see(seen(100, up=way(changes_s=150)))
    assert watching.pacing.until is Until.CONTACT

    watching.decisions.see(seen(151))

    assert watching.pacing.slowed == "the contact plan has no further contact"


def test_it_slows_down_once_before_the_end_of_a_contact() -> None:
    watching = Watching(60)
    view = seen(100, up=way(changes_s=150))
    watching.decisions.see(view)
    watching.settle(140)
    watching.pacing.set_speed(60)

    watching.decisions.see(replace(view, now_ns=to_ns(140.1)))
    watching.settle(141)

    assert watching.pacing.speed == 60


def test_before_a_veto_comes_too_late_there_is_time_to_send_it() -> None:
    watching = Watching(5)
    watching.decisions.see(replace(seen(100), veto_until_ns=to_ns(130)))
    watching.settle(120)

    assert watching.pacing.slowed == "the veto window runs out in 10 s"


@pytest.mark.parametrize(
    ("what", "ends"),
    [
        (GoalReached(("at:B",)), True),
        (ModeChanged(Mode.AUTONOMOUS, ModeCause.LINK_LOST), True),
        (CommandReached(1, CommandStage.DONE), True),
        (CommandReached(1, CommandStage.BEGUN), False),
    ],
)
def test_a_warp_until_something_arrives_ends_with_news(what: msgspec.Struct, ends: bool) -> None:
    watching = Watching(1)
    watching.pacing.warp(Until.ARRIVAL)
    watching.hear([told(10, 9, what)], 10)  # type: ignore[arg-type]  # each is a happening

    assert (watching.pacing.until is None) is ends


def test_a_warp_to_the_next_contact_passes_the_end_of_this_one_and_stops_where_it_begins() -> None:
    watching = Watching(1)
    watching.pacing.warp(Until.CONTACT)
    watching.decisions.see(seen(100, up=way(changes_s=150)))
    watching.settle(145)
    assert watching.pacing.until is Until.CONTACT

    watching.decisions.see(seen(151, up=way(is_open=False, changes_s=900)))
    assert watching.pacing.window_ns(to_ns(899.5)) == to_ns(0.5)
    watching.settle(900)

    assert watching.pacing.slowed == "contact begins"
