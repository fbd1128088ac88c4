"""Expectations judged on small handmade runs."""

from collections.abc import Sequence

import msgspec
import pytest
from noting import command_sent, records_of, view_of

from farside.control import Chooser, CommandStage, Mode, ModeCause
from farside.frames import Fate, FrameFate, LinkOutage, OutageReason
from farside.logs import RunView
from farside.messages import Drive
from farside.missions.expectations import judge
from farside.missions.schema import (
    AutonomyExpected,
    ChargeExpected,
    NoCrossingExpected,
    ObedienceExpected,
    ReachedExpected,
)
from farside.node import Direction, to_ns
from farside.topics import (
    ActionStarted,
    CommandEntry,
    CommandSent,
    GoalChange,
    GoalEntry,
    GoalSource,
    ModeEntry,
    Pose,
    Yard,
)

UP, DOWN = Direction.UP, Direction.DOWN
GOAL = ("at:A",)


def run(*entries: tuple[float, msgspec.Struct]) -> RunView:
    """A run of 100 s with these messages, each with its log time."""
    start = [
        (0.0, Yard(("####", "#A.#", "####"), 1.0)),
        (0.0, ModeEntry(Mode.GUIDED, ModeCause.START)),
        (0.0, _pose("at:2,1")),
    ]
    messages = [*start, *entries, (100.0, _pose("at:2,1"))]
    return view_of(records_of(sorted(messages, key=lambda e: e[0])))


def _pose(place: str) -> Pose:
    return Pose(0.0, 0.0, 0.0, 0.0, place, 1.0)


def outage(
    start_s: int, end_s: int, directions: tuple[Direction, ...] = (UP, DOWN)
) -> list[tuple[int, LinkOutage]]:
    return [
        (t_s, LinkOutage(direction, down=down, reason=OutageReason.BLACKOUT))
        for direction in directions
        for t_s, down in ((start_s, True), (end_s, False))
    ]


def goal_reached(t_s: int, truly: str = "at:A") -> list[tuple[float, GoalEntry | Pose]]:
    return [
        (1.0, GoalEntry(GOAL, GoalChange.SET, 1.0, GoalSource.OPERATOR)),
        (t_s, _pose(truly)),
        (t_s, GoalEntry(GOAL, GoalChange.REACHED, 1.0, GoalSource.OPERATOR)),
    ]


def test_a_goal_reached_is_met() -> None:
    assert judge(ReachedExpected(place="A"), run(*goal_reached(50))).met


def test_a_goal_never_reached_is_not_met() -> None:
    judgement = judge(ReachedExpected(place="A"), run())
    assert (judgement.met, judgement.detail) == (False, "never reached as a goal")


def test_a_goal_reached_by_the_estimate_alone_is_not_met() -> None:
    assert not judge(ReachedExpected(place="A"), run(*goal_reached(50, truly="at:2,1"))).met


@pytest.mark.parametrize(("outages", "met"), [((UP, DOWN), True), ((UP,), False), ((), False)])
def test_reached_in_a_blackout_needs_both_directions_down(
    outages: tuple[Direction, ...], met: bool
) -> None:
    view = run(*outage(40, 60, outages), *goal_reached(50))
    assert judge(ReachedExpected(place="A", in_blackout=True), view).met is met


def alone(t_s: int, why: ModeCause = ModeCause.LINK_LOST) -> tuple[int, ModeEntry]:
    return (t_s, ModeEntry(Mode.AUTONOMOUS, why))


@pytest.mark.parametrize(
    ("events", "met", "detail"),
    [
        ([*outage(40, 90), alone(65)], True, "taken at 65.0 s"),
        ([*outage(40, 90), alone(76)], False, "taken without a loss at 76.0 s"),
        ([*outage(40, 90), alone(39)], False, "taken without a loss at 39.0 s"),
        ([*outage(40, 90)], False, "not taken after losses at 40.0 s"),
        ([*outage(40, 60)], True, "not taken"),
        ([*outage(40, 90, (DOWN,)), alone(65)], False, "taken without a loss at 65.0 s"),
        ([alone(20, ModeCause.OPERATOR)], True, "not taken"),
        ([], True, "not taken"),
    ],
)
def test_autonomy_follows_a_loss_of_the_uplink_in_time_and_nothing_else(
    events: Sequence[tuple[float, msgspec.Struct]], met: bool, detail: str
) -> None:
    judgement = judge(AutonomyExpected(within_s=35), run(*events))
    assert (judgement.met, judgement.detail) == (met, detail)


def charge(t_s: float, battery: float) -> tuple[float, Pose]:
    return (t_s, Pose(0.0, 0.0, 0.0, 0.0, "at:2,1", battery))


@pytest.mark.parametrize(
    ("at_least", "events", "met", "detail"),
    [
        (0.0, [], True, "least charge 1 at 0.0 s"),
        (0.0, [charge(40, 0.0), charge(50, 0.0)], False, "least charge 0 at 40.0 s"),
        (0.2, [charge(40, 0.2)], True, "least charge 0.2 at 40.0 s"),
        (0.2, [charge(40, 0.19)], False, "least charge 0.19 at 40.0 s"),
    ],
)
def test_the_charge_never_falls_below_what_is_expected(
    at_least: float, events: Sequence[tuple[float, msgspec.Struct]], met: bool, detail: str
) -> None:
    judgement = judge(ChargeExpected(at_least=at_least), run(*events))
    assert (judgement.met, judgement.detail) == (met, detail)


def sent(t_s: int, number: int, action: str = "N") -> tuple[float, CommandSent]:
    return (t_s, command_sent(number, Drive(action)))


def begun(
    t_s: float, number: int, action: str = "N"
) -> list[tuple[float, CommandEntry | ActionStarted]]:
    """A command to drive is taken and begins."""
    stages = (CommandStage.TAKEN, CommandStage.WAITING, CommandStage.BEGUN)
    return [
        *((t_s, CommandEntry(number, stage, Drive(action))) for stage in stages),
        (t_s, ActionStarted(action, Chooser.GUIDED, number, None)),
    ]


def ended(
    t_s: float, number: int, stage: CommandStage, why: str | None = None
) -> tuple[float, CommandEntry]:
    return (t_s, CommandEntry(number, stage, Drive("N"), why))


def refused(t_s: float, number: int) -> list[tuple[float, CommandEntry]]:
    """A command to drive is taken and refused."""
    why = "the battery is flat"
    return [
        ended(t_s, number, CommandStage.TAKEN),
        ended(t_s, number, CommandStage.REFUSED, why),
    ]


DONE = CommandStage.DONE


@pytest.mark.parametrize(
    ("events", "met"),
    [
        ([sent(1, 1), *begun(3, 1), ended(7, 1, DONE)], True),
        ([sent(1, 1), *begun(3, 1)], True),
        ([sent(1, 1), *refused(3, 1)], True),
        (begun(3, 1), False),
        ([sent(5, 1), *begun(3, 1)], False),
        ([sent(1, 1), *begun(3, 1, "S")], False),
        ([sent(1, 1), *begun(3, 1), *begun(4, 1)], False),
        ([sent(1, 1), *refused(3, 1), begun(3, 1)[-1]], False),
        ([sent(1, 1), begun(3, 1)[-1]], False),
    ],
)
def test_only_commands_that_were_sent_may_be_obeyed(
    events: Sequence[tuple[float, msgspec.Struct]], met: bool
) -> None:
    assert judge(ObedienceExpected(), run(*events)).met is met


def test_obedience_says_how_the_commands_ended() -> None:
    orders = [sent(1, number) for number in (1, 2, 3, 4)]
    done = [*begun(3, 1), ended(7, 1, DONE), *begun(8, 2), ended(9, 2, DONE)]
    judgement = judge(ObedienceExpected(), run(*orders, *done, *refused(10, 3), *refused(11, 4)))
    assert (judgement.met, judgement.detail) == (True, "4 sent, 2 done, 2 refused")


def test_obedience_tells_the_first_surprise_and_when_it_was() -> None:
    judgement = judge(ObedienceExpected(), run(*begun(3, 1)))
    assert (judgement.met, judgement.detail) == (
        False,
        "command 1 taken, though nobody gave it, at 3.0 s",
    )


def arrived(
    direction: Direction, sent_s: int, sent_end_s: float, arrival_s: float
) -> tuple[float, FrameFate]:
    return (
        arrival_s,
        FrameFate(
            direction=direction,
            sequence=0,
            size_byte=10,
            queued_ns=to_ns(sent_s),
            sent_ns=to_ns(sent_s),
            sent_end_ns=to_ns(sent_end_s),
            arrival_ns=to_ns(arrival_s),
            fate=Fate.DELIVERED,
        ),
    )


@pytest.mark.parametrize(
    ("frame", "met"),
    [
        (arrived(UP, 38, 38.5, 39.9), True),
        (arrived(UP, 39, 39.5, 40.5), False),
        (arrived(UP, 58, 58.5, 59.9), False),
        (arrived(UP, 59, 59.5, 60.5), True),
        (arrived(DOWN, 39, 39.9, 41.5), True),
        (arrived(DOWN, 39, 40.1, 41.5), False),
        (arrived(DOWN, 59, 60.1, 61.5), False),
        (arrived(DOWN, 60, 60.1, 61.5), True),
    ],
)
def test_no_frame_may_pass_the_rovers_end_in_an_outage(
    frame: tuple[float, FrameFate], met: bool
) -> None:
    assert judge(NoCrossingExpected(), run(*outage(40, 60), frame)).met is met
