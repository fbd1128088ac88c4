"""Stories of commands at the desk: dues, verdicts, what can be taken back, and what is held."""

from typing import Any

from farside.acts import Act, Discard, Planned
from farside.control import CommandStage, Mode, TakeBackChance, Verdict
from farside.frames import OutageReason
from farside.ground.commands.desk import CommandDesk
from farside.link import Blackout, LinkConfig, OneWay
from farside.messages import (
    Command,
    CommandReached,
    Drive,
    Meant,
    SetGoal,
    SetMode,
    TakeBack,
    When,
)
from farside.node import Journal, to_ns, to_s
from farside.topics import GROUND_HELD, GROUND_LIFE, HeldEntry, HeldFate, LifeEntry
from tests.ground.conftest import make_desk, telemetry

TAKEN, BEGUN, DONE = CommandStage.TAKEN, CommandStage.BEGUN, CommandStage.DONE
MOON = LinkConfig(up=OneWay(delay_s=10.0), down=OneWay(delay_s=10.0))


class Scene:
    """A desk ten light seconds from the rover, asked tick by tick."""

    def __init__(self, link: LinkConfig = MOON, **options: Any) -> None:
        self.journal = Journal()
        self.desk: CommandDesk = make_desk(
            link, **{"valid_ns": to_ns(100), **options}, journal=self.journal
        )
        self.said: list[LifeEntry] = []
        self.held: list[HeldEntry] = []

    def give(self, t_s: float, *acts: Act) -> list[Command]:
        commands = [one for act in acts for one in self.desk.give(act, to_ns(t_s))]
        self._read()
        return commands

    def reach(self, t_s: float, number: int, stage: CommandStage, so_s: float) -> None:
        """Word of a stage arrives; it is an end that is not done if it is none of the three."""
        why = None if stage in {TAKEN, BEGUN, DONE} else "for a reason"
        self.desk.learn_stage(CommandReached(number, stage, why), to_ns(so_s), to_ns(t_s))
        self._read()

    def look(self, t_s: float, *, silent: bool = False) -> list[Command]:
        released = self.desk.follow(to_ns(t_s), silent=silent)
        self._read()
        return released

    def _read(self) -> None:
        for record in self.journal.take():
            if record.topic == GROUND_LIFE.name:
                self.said.append(GROUND_LIFE.decode(record.payload))
            elif record.topic == GROUND_HELD.name:
                self.held.append(GROUND_HELD.decode(record.payload))

    @property
    def verdicts(self) -> list[tuple[int, CommandStage | None, Verdict]]:
        return [(one.number, one.stage, one.verdict) for one in self.said if one.verdict]

    def dues(self, number: int) -> list[float]:
        """When the stages of a command are expected, in seconds."""
        life = self.desk.life(number)
        return [to_s(due.expected_ns) for due in life.dues]

    def chance(self, number: int, t_s: float) -> tuple[TakeBackChance, float | None]:
        chance, until_ns = self.desk.take_back(number, to_ns(t_s))
        return chance, None if until_ns is None else to_s(until_ns)


# --- dues and verdicts ------------------------------------------------------------------------


def test_a_drive_is_due_a_light_time_later_and_done_after_a_move() -> None:
    scene = Scene()
    scene.give(5, Drive("N"), Drive("N"), SetGoal(("at:B",), 1.0))
    assert scene.dues(1) == [15, 15, 17]
    assert scene.dues(2) == [15, 17, 19], "behind the first"
    assert scene.dues(3) == [15, 15], "at once"
    due = scene.desk.life(1).dues[0]
    assert (to_s(due.due_ns), to_s(due.told_due_ns)) == (16, 31), (
        "with a margin, and there is light"
    )


def test_on_a_slow_link_it_is_due_behind_what_is_queued() -> None:
    slow = OneWay(delay_s=10.0, rate_bit_s=1_000)
    scene = Scene(LinkConfig(up=slow, down=slow))
    commands = scene.give(0, Drive("N"), Drive("N"))
    first, second = scene.dues(1)[0], scene.dues(2)[0]
    assert 10.5 < first < 12
    assert second - first > 0.5
    assert [command.expires_ns for command in commands] == [
        to_ns(first) + to_ns(100),
        to_ns(second) + to_ns(100),
    ]


def test_word_in_time_and_word_of_being_late() -> None:
    scene = Scene()
    scene.give(0, Drive("N"))
    scene.reach(20.0, 1, BEGUN, so_s=10.0)
    scene.reach(29.0, 1, DONE, so_s=19.0)
    assert scene.verdicts == [
        (1, TAKEN, Verdict.ON_TIME),
        (1, BEGUN, Verdict.ON_TIME),
        (1, DONE, Verdict.UNKNOWN),
        (1, DONE, Verdict.LATE),
    ], "that it was taken follows from its having begun"
    assert [one.so_ns for one in scene.said] == [to_ns(10), to_ns(10), None, to_ns(19)]


def test_what_is_due_is_unknown_until_word_is_due_and_then_overdue() -> None:
    scene = Scene()
    scene.give(0, SetMode(Mode.SHARED))
    for t_s in (10.9, 11.0, 11.1, 25.9, 26.0, 26.1):
        scene.look(t_s)
    assert scene.verdicts == [
        (1, TAKEN, Verdict.UNKNOWN),
        (1, DONE, Verdict.UNKNOWN),
        (1, TAKEN, Verdict.OVERDUE),
        (1, DONE, Verdict.OVERDUE),
    ]
    scene.reach(40, 1, CommandStage.EXPIRED, so_s=30)
    assert scene.verdicts[4:] == [
        (1, TAKEN, Verdict.LATE),
        (1, CommandStage.EXPIRED, Verdict.LATE),
    ]
    assert scene.said[-1].why == "for a reason"


def test_telemetry_tells_by_when_a_stage_was_so_and_the_event_when() -> None:
    scene = Scene()
    scene.give(0, Drive("N"))
    scene.desk.learn(telemetry(10.5, begun=1), to_ns(21))
    scene.look(30)
    assert scene.verdicts[:2] == [(1, TAKEN, Verdict.ON_TIME), (1, BEGUN, Verdict.ON_TIME)]
    assert [one.so_ns for one in scene.said[:2]] == [None, None]
    scene.reach(31, 1, BEGUN, so_s=10.04)
    exact = [one for one in scene.said if one.so_ns is not None]
    assert [one.so_ns for one in exact] == [to_ns(10.04)] * 2


def test_what_telemetry_calls_over_is_not_overdue() -> None:
    scene = Scene()
    scene.give(0, Drive("N"))
    scene.desk.learn(telemetry(40, commands_done=1), to_ns(50))
    scene.look(60)
    assert [verdict for _, _, verdict in scene.verdicts] == []


def test_moves_are_expected_to_take_what_they_took() -> None:
    scene = Scene()
    for number in range(1, 60):
        scene.give(100 * number, Drive("N"))
        scene.reach(100 * number + 20, number, BEGUN, so_s=100 * number + 10)
        scene.reach(100 * number + 25, number, DONE, so_s=100 * number + 15)
    scene.give(6000, Drive("N"))
    (life,) = scene.desk.foreseen.values()
    assert 4.8 < to_s(life.done_ns - life.begun_ns) <= 5


def test_lives_that_are_over_are_forgotten_in_the_end() -> None:
    scene = Scene()
    for number in range(1, 1200):
        scene.give(0, SetMode(Mode.SHARED))
        scene.reach(20, number, DONE, so_s=10)
    assert scene.desk.life(1) is None
    assert scene.desk.life(1199) is not None
    assert scene.desk.live == ()


# --- sequences --------------------------------------------------------------------------------


def test_a_sequence_follows_step_by_step_and_expires_behind_what_it_follows() -> None:
    scene = Scene()
    first, second, third = scene.give(
        0,
        Drive("N"),
        Planned(Drive("N"), follows=True),
        Planned(SetMode(Mode.SHARED), follows=True, at_ns=to_ns(60)),
    )
    assert (first.when, second.when) == (None, When(after=1))
    assert third.when == When(after=2, at_ns=to_ns(60))
    assert second.meant == Meant(Mode.GUIDED, after=1)
    assert [to_s(one.expires_ns) for one in (first, second, third)] == [110, 112, 160]
    assert scene.dues(3) == [10, 60]


def test_what_waits_on_board_changes_the_mode_only_for_what_waits_too() -> None:
    scene = Scene()
    scene.give(0, Planned(SetMode(Mode.SHARED), at_ns=to_ns(60)))
    now, later = scene.give(0, Drive("N"), Planned(Drive("N"), follows=True))
    assert (now.meant.mode, later.meant.mode) == (Mode.GUIDED, Mode.SHARED)


def test_without_anything_before_it_nothing_is_followed() -> None:
    scene = Scene()
    assert scene.give(0, Planned(Drive("N"), follows=True))[0].when is None


def test_review_says_what_would_be_and_gives_nothing() -> None:
    scene = Scene()
    scene.give(0, Drive("N"))
    plan = [
        Planned(Drive("N"), follows=True, link_up=True),
        Planned(Drive("N"), follows=True, at_ns=to_ns(60)),
    ]
    reviewed = scene.desk.review(plan, to_ns(1))
    assert scene.desk.last_given == 1
    assert scene.desk.held == {}
    assert [one.number for one in reviewed] == [2, 3]
    given = scene.give(1, *plan)
    assert [one.when for one in reviewed] == [one.when for one in given]
    assert [one.expires_ns for one in reviewed] == [one.expires_ns for one in given]
    for one in reviewed:
        assert one.dues == scene.desk.life(one.number).dues
        chance = scene.desk.take_back(one.number, to_ns(1))
        assert (one.take_back, one.take_back_until_ns) == chance


# --- to take back -----------------------------------------------------------------------------


def test_one_that_begins_when_it_comes_may_be_too_late_to_take_back() -> None:
    scene = Scene()
    assert scene.chance(1, 0) == (TakeBackChance.HERE, None)
    scene.give(0, Drive("N"))
    assert scene.chance(1, 0) == (TakeBackChance.OPEN, None)
    scene.reach(20, 1, BEGUN, so_s=10)
    assert scene.chance(1, 20) == (TakeBackChance.TOO_LATE, None)


def test_one_that_waits_for_its_time_can_be_taken_back_until_a_light_time_before() -> None:
    scene = Scene()
    scene.give(0, Planned(Drive("N"), at_ns=to_ns(60)))
    assert scene.chance(1, 0) == (TakeBackChance.SURE, 49), "with a margin of a second"
    scene.look(49.0)
    assert scene.chance(1, 49.0) == (TakeBackChance.SURE, 49)
    scene.look(49.04)
    assert scene.chance(1, 49.04) == (TakeBackChance.OPEN, None)
    chances = [one.take_back for one in scene.said if one.verdict is not Verdict.UNKNOWN]
    assert chances[0] is TakeBackChance.SURE
    assert TakeBackChance.OPEN in chances[1:]


def test_what_follows_on_a_move_begins_a_least_move_later() -> None:
    scene = Scene(least_s=1.0)
    scene.give(0, Planned(Drive("N"), at_ns=to_ns(60)), Drive("N"), Drive("N"))
    assert [scene.chance(n, 0)[1] for n in (1, 2, 3)] == [49, 50, 51]
    scene.reach(80, 1, BEGUN, so_s=65)
    assert scene.chance(3, 40)[1] == 56, "the first is known to have begun later"


def test_a_slow_or_closed_uplink_leaves_less_time() -> None:
    link = LinkConfig(
        up=OneWay(delay_s=10.0, rate_bit_s=1_000),
        down=OneWay(delay_s=10.0),
        blackouts=(Blackout(start_s=40.0, end_s=58.0, reason=OutageReason.PASS),),
    )
    scene = Scene(link)
    scene.give(0, Planned(Drive("N"), at_ns=to_ns(60)))
    until_s = scene.chance(1, 0)[1]
    assert 25 < until_s < 30, "to be there before the gap, and it takes a while to leave"


def test_what_is_queued_since_may_use_up_the_time_and_that_is_said() -> None:
    slow = OneWay(delay_s=10.0, rate_bit_s=100)
    scene = Scene(LinkConfig(up=slow, down=slow))
    scene.give(0, Planned(Drive("N"), at_ns=to_ns(60)))
    assert scene.chance(1, 0)[0] is TakeBackChance.SURE
    scene.give(0, *[SetGoal(("at:B",), 1.0)] * 5)
    assert scene.chance(1, 0)[0] is TakeBackChance.OPEN
    assert [one.take_back for one in scene.said if one.number == 1][-1] is TakeBackChance.OPEN


# --- held at the ground -----------------------------------------------------------------------


def flapping() -> LinkConfig:
    """Up for 10 s from 20, 40 and 60 s on, as seen at the rover; there is no delay."""
    spans = ((0, 20), (30, 40), (50, 60), (70, 1000))
    blackouts = tuple(Blackout(start_s=a, end_s=b, reason=OutageReason.PASS) for a, b in spans)
    return LinkConfig(up=OneWay(delay_s=0.0), down=OneWay(delay_s=0.0), blackouts=blackouts)


def test_a_sequence_waits_for_the_link_and_stays_together() -> None:
    scene = Scene(flapping())
    held = scene.give(1, Planned(Drive("N"), link_up=True), Planned(Drive("E"), follows=True))
    assert held == []
    assert scene.give(2, SetMode(Mode.SHARED))[0].number == 1, "this one is not held"
    assert scene.look(19) == []
    assert scene.look(20, silent=True) == [], "by the plan it is open, and nobody is heard"
    released = scene.look(21)
    assert [one.number for one in released] == [2, 3]
    assert [one.when for one in released] == [None, When(after=2)]
    assert scene.look(22) == []
    assert [(one.number, one.fate, one.commands) for one in scene.held] == [
        (1, HeldFate.HELD, ()),
        (1, HeldFate.HELD, ()),
        (1, HeldFate.RELEASED, (2, 3)),
    ]


def test_on_a_flapping_link_each_sequence_leaves_once_and_in_order() -> None:
    scene = Scene(flapping())
    released: list[tuple[int, int]] = []
    for t_s in range(80):
        released += [(t_s, one.number) for one in scene.look(t_s)]
        if t_s in {5, 15, 35, 55, 62}:
            given = scene.give(t_s, Planned(SetGoal(("at:B",), 1.0), link_up=True))
            released += [(t_s, one.number) for one in given]
    assert released == [(20, 1), (20, 2), (40, 3), (60, 4), (62, 5)]
    assert scene.desk.held == {}


def test_a_foreseen_gap_makes_nothing_expire() -> None:
    scene = Scene(flapping(), valid_ns=to_ns(2))
    waits = scene.give(31, Drive("N"))[0]
    assert to_s(waits.expires_ns) == 42, "it can leave when the link opens at 40 s"


def test_what_is_held_can_be_given_up_and_nothing_of_it_is_sent() -> None:
    scene = Scene(flapping())
    scene.give(0, SetMode(Mode.SHARED))
    scene.give(1, Planned(Drive("N"), link_up=True), Planned(Drive("N"), follows=True))
    assert scene.give(2, Discard(1), Discard(7)) == []
    after = scene.give(3, Planned(Drive("S"), follows=True))[0]
    assert (after.number, after.when) == (2, When(after=1)), "the last that was given"
    assert scene.look(21) == []
    assert [one.fate for one in scene.held][-1] is HeldFate.GIVEN_UP


def test_to_take_back_is_a_command_like_any_other() -> None:
    scene = Scene()
    scene.give(0, Planned(Drive("N"), at_ns=to_ns(60)), TakeBack(1))
    assert scene.dues(2) == [10, 10]
    scene.reach(20, 1, CommandStage.WITHDRAWN, so_s=10)
    assert scene.chance(1, 20) == (TakeBackChance.TOO_LATE, None)
