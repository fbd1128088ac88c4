"""What decides between success and failure, held against small made-up runs."""

import pytest
from noting import records_of

from farside.logs import RunView
from farside.messages import Chooser, Drive, Mode, ModeCause
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
    CommandSent,
    CommandTaken,
    Fate,
    FrameFate,
    GoalChange,
    GoalEntry,
    GoalSource,
    LinkOutage,
    ModeEntry,
    Pose,
    Yard,
)

UP, DOWN = Direction.UP, Direction.DOWN
GOAL = ("at:A",)


def run(*entries) -> RunView:
    """A run of 100 s with these (time, entry)."""
    start = [
        (0.0, Yard(("####", "#A.#", "####"), 1.0)),
        (0.0, ModeEntry(Mode.GUIDED, ModeCause.START)),
        (0.0, _pose("at:2,1")),
    ]
    told = [*start, *entries, (100.0, _pose("at:2,1"))]
    return RunView(records_of(sorted(told, key=lambda e: e[0])))


def _pose(place):
    return Pose(0.0, 0.0, 0.0, 0.0, place, 1.0)


def outage(start_s, end_s, directions=(UP, DOWN)):
    return [
        (t_s, LinkOutage(direction, down=down, reason="blackout"))
        for direction in directions
        for t_s, down in ((start_s, True), (end_s, False))
    ]


def goal_reached(t_s, truly="at:A"):
    return [
        (1.0, GoalEntry(GOAL, GoalChange.SET, 1.0, GoalSource.OPERATOR)),
        (t_s, _pose(truly)),
        (t_s, GoalEntry(GOAL, GoalChange.REACHED, 1.0, GoalSource.OPERATOR)),
    ]


def test_a_goal_reached_is_a_goal_reached():
    assert judge(ReachedExpected(place="A"), run(*goal_reached(50))).met


def test_a_goal_never_reached_is_not_met():
    judgement = judge(ReachedExpected(place="A"), run())
    assert (judgement.met, judgement.detail) == (False, "never reached as a goal")


def test_believing_to_be_there_is_not_enough():
    assert not judge(ReachedExpected(place="A"), run(*goal_reached(50, truly="at:2,1"))).met


@pytest.mark.parametrize(("outages", "met"), [((UP, DOWN), True), ((UP,), False), ((), False)])
def test_reached_in_a_blackout_means_with_both_ways_out(outages, met):
    story = run(*outage(40, 60, outages), *goal_reached(50))
    assert judge(ReachedExpected(place="A", in_blackout=True), story).met is met


def alone(t_s, why="link lost"):
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
        ([alone(20, "operator")], True, "not taken"),
        ([], True, "not taken"),
    ],
)
def test_autonomy_follows_a_loss_in_time_and_nothing_else(events, met, detail):
    judgement = judge(AutonomyExpected(within_s=35), run(*events))
    assert (judgement.met, judgement.detail) == (met, detail)


def charge(t_s, battery):
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
def test_the_charge_never_falls_below_what_is_expected(at_least, events, met, detail):
    judgement = judge(ChargeExpected(at_least=at_least), run(*events))
    assert (judgement.met, judgement.detail) == (met, detail)


def sent(t_s, number, action="N"):
    return (t_s, CommandSent(number, Drive(action)))


def taken(t_s, number, action="N", refused=None):
    return (t_s, CommandTaken(number, Drive(action), refused))


def begun(t_s, number):
    return (t_s, ActionStarted("N", Chooser.GUIDED, number, None))


@pytest.mark.parametrize(
    ("events", "met"),
    [
        ([sent(1, 1), taken(3, 1), begun(3, 1)], True),
        ([sent(1, 1), taken(3, 1, refused="it came too late")], True),
        ([taken(3, 1)], False),
        ([sent(5, 1), taken(3, 1)], False),
        ([sent(1, 1), taken(3, 1, "S")], False),
        ([sent(1, 1), taken(3, 1), taken(4, 1)], False),
        ([sent(1, 1), taken(3, 1, refused="it came too late"), begun(3, 1)], False),
        ([begun(3, 1)], False),
    ],
)
def test_only_what_was_sent_is_obeyed(events, met):
    assert judge(ObedienceExpected(), run(*events)).met is met


def arrived(direction, sent_s, sent_end_s, arrival_s):
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
def test_nothing_crosses_an_outage(frame, met):
    assert judge(NoCrossingExpected(), run(*outage(40, 60), frame)).met is met
