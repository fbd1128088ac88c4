"""The guided exercise: a step is ticked when the ground knows that it was really done."""

from collections.abc import Iterable

import pytest
from ground_stories import told
from noting import command_sent, logged, said_of

from farside.console.exercise import Exercise
from farside.control import CommandStage, Failsafe, Mode, ModeCause, Verdict
from farside.logs import LogEntry
from farside.messages import (
    Approve,
    Drive,
    GoalReached,
    LinkBack,
    ModeChanged,
    Order,
    Override,
    SetGoal,
    SetMode,
    Telemetry,
)
from farside.node import to_ns, to_s
from farside.topics import ShadowEntry, Silence

BEGUN, DONE, FAILED = CommandStage.BEGUN, CommandStage.DONE, CommandStage.FAILED
A, B = SetGoal(("at:A",), 1.0), SetGoal(("at:B",), 2.0)


class Pupil:
    """A person who does the exercise."""

    def __init__(self) -> None:
        self.exercise = Exercise(lost_after_s=30.0)
        self.t_s = 0.0
        self._sent = 0

    @property
    def ticked(self) -> set[str]:
        return {row.text.partition(":")[0] for row in self.exercise.rows() if row.done}

    def how(self, step: str) -> str:
        return next(row.how for row in self.exercise.rows() if row.text.startswith(step))

    def hears(self, *entries: LogEntry) -> None:
        for entry in entries:
            self.exercise.take(entry)

    def orders(self, order: Order, end: CommandStage = DONE, *, so_s: float | None = None) -> None:
        """An order is sent, and its end is known three seconds later."""
        self._sent += 1
        number, sent_ns, known_ns = self._sent, to_ns(self.t_s), to_ns(self.t_s + 3)
        self.t_s += 3
        self.hears(
            logged(sent_ns, command_sent(number, order)),
            logged(known_ns, said_of(number, end, Verdict.ON_TIME, so_s=so_s)),
        )

    def is_heard_at(self, *places: str) -> None:
        for place in places:
            here = Telemetry(
                0, (place,), 0.0, 0.0, 0.0, 0.9, Mode.GUIDED, Failsafe.NOMINAL, None, (), 0
            )
            self.hears(logged(to_ns(self.t_s), here))

    def has_taught(self, hypotheses: int) -> None:
        self.hears(logged(to_ns(self.t_s), ShadowEntry(1, 7, True, None, 9, hypotheses, 1)))

    def hears_nothing(self, from_s: float, until_s: float) -> None:
        self.hears(logged(to_ns(from_s), Silence(silent=True)))
        self.hears(logged(to_ns(until_s), Silence(silent=False)))

    def is_told_that_the_link_is_back(self, t_s: float = 985) -> None:
        self.hears(told(t_s, t_s - 3, LinkBack(to_ns(360), 44, 0, (("at:B",), ("at:C",)))))


@pytest.fixture
def pupil() -> Pupil:
    return Pupil()


def test_three_drives_count_once_they_are_known_to_be_done(pupil: Pupil) -> None:
    for order, end in ((Drive("N"), DONE), (Drive("N"), FAILED), (Drive("W"), DONE)):
        pupil.orders(order, end)
    assert not pupil.ticked
    assert pupil.how("Drive").endswith("Done so far: 2 of 3.")

    pupil.hears(logged(to_ns(20), command_sent(9, Drive("W"))))
    assert not pupil.ticked
    pupil.hears(logged(to_ns(24), said_of(9, DONE, Verdict.LATE)))
    assert pupil.ticked == {"Drive the rover 3 moves"}


def test_what_may_be_done_by_now_but_is_not_known_to_be_does_not_count(pupil: Pupil) -> None:
    for number in (1, 2, 3):
        pupil.hears(
            logged(to_ns(1), command_sent(number, Drive("N"))),
            logged(to_ns(5), said_of(number, DONE, Verdict.UNKNOWN)),
        )
    assert not pupil.ticked


def test_the_delay_is_seen_when_word_of_a_beginning_comes_before_that_of_the_end(
    pupil: Pupil,
) -> None:
    def word(number: int, stage: CommandStage, t_s: float) -> LogEntry:
        return logged(to_ns(t_s), said_of(number, stage, Verdict.ON_TIME))

    for number in (1, 2):
        pupil.hears(logged(to_ns(1), command_sent(number, Drive("N"))))
    pupil.hears(word(1, BEGUN, 5), word(1, DONE, 5))
    assert not pupil.ticked
    pupil.hears(word(2, BEGUN, 5), word(2, DONE, 8))
    assert pupil.ticked == {"See the delay"}


def test_it_is_taught_when_all_places_were_visited_and_the_last_is_home(pupil: Pupil) -> None:
    pupil.has_taught(12)
    pupil.is_heard_at("at:D", "at:A", "at:C")
    assert "Still to visit: B, then D." in pupil.how("Teach")
    pupil.is_heard_at("at:D", "at:B")
    assert pupil.how("Teach").endswith("Now back to D.")
    assert not pupil.ticked

    pupil.is_heard_at("at:D")
    assert pupil.ticked == {"Teach it the ways"}


def test_places_alone_do_not_teach(pupil: Pupil) -> None:
    pupil.is_heard_at("at:A", "at:B", "at:C", "at:D")
    pupil.has_taught(11)
    assert not pupil.ticked
    pupil.has_taught(12)
    assert pupil.ticked


@pytest.mark.parametrize("orders", [(SetMode(Mode.SHARED), A), (A, SetMode(Mode.SHARED))])
def test_mode_shared_and_goal_a_let_it_propose_in_either_order(
    pupil: Pupil, orders: Iterable[Order]
) -> None:
    for order in orders:
        assert not pupil.ticked
        pupil.orders(order)
    assert pupil.ticked == {"Let it propose"}


def test_another_mode_or_goal_does_not(pupil: Pupil) -> None:
    for order in (SetMode(Mode.AUTONOMOUS), A, SetGoal(("at:7,7",), 1.0)):
        pupil.orders(order)
    assert not pupil.ticked


@pytest.mark.parametrize(
    ("order", "step"), [(Approve(3), "Consent"), (Override(4, "E"), "Override it once")]
)
def test_a_proposal_is_answered_when_the_action_is_done(
    pupil: Pupil, order: Order, step: str
) -> None:
    pupil.orders(order, CommandStage.REFUSED)
    assert not pupil.ticked
    pupil.orders(order)
    assert pupil.ticked == {step}


def test_a_is_reached_when_the_rover_says_so(pupil: Pupil) -> None:
    pupil.hears(told(400, 399, GoalReached(("at:7,7",))))
    assert not pupil.ticked
    pupil.hears(told(538, 537, GoalReached(("at:A",))))
    assert pupil.ticked == {"Bring it to A"}


def test_letting_go_takes_goal_b_on_board_before_the_rover_goes_silent(pupil: Pupil) -> None:
    pupil.orders(B, so_s=602)
    assert not pupil.ticked
    pupil.hears(logged(to_ns(629), Silence(silent=True)))
    assert pupil.ticked == {"Give it goal B, and let go"}


def test_word_that_b_was_set_in_time_may_come_after_the_silence(pupil: Pupil) -> None:
    pupil.hears(logged(to_ns(619), command_sent(1, B)))
    pupil.hears_nothing(629, 640)
    assert not pupil.ticked
    pupil.hears(logged(to_ns(985), said_of(1, DONE, Verdict.ON_TIME, so_s=620)))
    assert pupil.ticked == {"Give it goal B, and let go"}


def test_a_goal_b_that_came_too_late_or_was_reached_too_early_is_told_so(pupil: Pupil) -> None:
    early = Pupil()
    early.orders(B, so_s=500)
    early.hears(told(600, 598, GoalReached(("at:B",))))
    for one in (early, pupil):
        one.hears_nothing(629, 981)
    pupil.orders(B, so_s=990)

    for one in (early, pupil):
        assert one.ticked == {"Lose the link"}
        assert "start the mission again" in one.how("Give it goal B")


def test_what_was_missed_holds_nobody_up(pupil: Pupil) -> None:
    pupil.hears_nothing(629, 981)

    assert [row.text for row in pupil.exercise.rows() if row.missed] == [
        "Give it goal B, and let go"
    ]


def test_nothing_is_asked_of_a_rover_that_is_silent(pupil: Pupil) -> None:
    pupil.hears(logged(to_ns(620), Silence(silent=True)))
    assert "has to wait" in pupil.how("Let it propose")
    assert "Order nothing now" in pupil.how("Lose the link")

    pupil.hears(logged(to_ns(981), Silence(silent=False)))
    assert "choose SHARED" in pupil.how("Let it propose")


def test_a_time_that_is_over_is_not_asked_for(pupil: Pupil) -> None:
    assert "before the clock shows 0:09:50" in pupil.how("Bring it to A")
    pupil.t_s = 600
    pupil.is_heard_at("at:C")
    assert "0:09:50" not in pupil.how("Bring it to A")


def test_time_slows_down_for_a_step_until_it_is_done(pupil: Pupil) -> None:
    assert [to_s(at_ns) for at_ns, _ in pupil.exercise.moments()] == [450, 600]

    pupil.is_heard_at("at:A", "at:B", "at:C", "at:D")
    pupil.has_taught(12)

    assert [to_s(at_ns) for at_ns, _ in pupil.exercise.moments()] == [600]


def test_the_link_is_lost_only_after_as_long_a_silence_as_the_rover_waits(pupil: Pupil) -> None:
    assert "after 30 s of silence it goes on alone" in pupil.how("Lose")
    pupil.hears_nothing(100, 129)
    pupil.hears(logged(to_ns(200), Silence(silent=False, expected=True)))
    pupil.hears_nothing(300, 310)
    pupil.has_taught(3)
    assert not pupil.ticked

    pupil.hears(logged(to_ns(629), Silence(silent=True)))
    pupil.t_s = 659
    pupil.has_taught(4)
    assert pupil.ticked == {"Lose the link"}


def test_what_happened_is_read_only_after_the_link_is_back(pupil: Pupil) -> None:
    pupil.exercise.acknowledged()
    pupil.exercise.read()
    pupil.is_told_that_the_link_is_back()
    pupil.exercise.read()
    assert not pupil.ticked
    pupil.exercise.acknowledged()
    assert pupil.ticked == {"Read what happened"}


@pytest.mark.parametrize("why", [ModeCause.OPERATOR, ModeCause.TAKEN_OVER])
def test_who_drives_is_taken_over_when_the_rover_confirms_it(pupil: Pupil, why: ModeCause) -> None:
    pupil.hears(told(5, 4, ModeChanged(Mode.GUIDED, why)))
    pupil.is_told_that_the_link_is_back()
    pupil.orders(SetMode(Mode.GUIDED))
    assert not pupil.ticked
    pupil.hears(told(988, 987, ModeChanged(Mode.GUIDED, why)))
    assert pupil.ticked == {"Take over again"}


def test_the_shipped_script_does_all_of_it_but_the_reading(
    pupil: Pupil, known: list[LogEntry]
) -> None:
    order: list[str] = []
    for entry in known:
        pupil.hears(entry)
        order += sorted(pupil.ticked - {*order})

    assert order == [
        "See the delay",
        "Drive the rover 3 moves",
        "Teach it the ways",
        "Let it propose",
        "Consent",
        "Override it once",
        "Bring it to A",
        "Give it goal B, and let go",
        "Lose the link",
        "Take over again",
    ]
