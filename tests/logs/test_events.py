"""The line of text for each kind of event, and what has none."""

import msgspec
import pytest
from noting import command_sent, failsafe_entry, logged, said_of

from farside.control import (
    BatteryState,
    Cause,
    CommandStage,
    Failsafe,
    Mode,
    ModeCause,
    OnLoss,
    Verdict,
)
from farside.frames import LinkOutage, OutageReason
from farside.logs import time_text
from farside.logs.events import event_line
from farside.messages import (
    Approve,
    BatteryChanged,
    CommandForced,
    CommandReached,
    CommandsMissing,
    Drive,
    Event,
    FailsafeChanged,
    GoalAside,
    GoalReached,
    Happening,
    LinkBack,
    ModeChanged,
    Order,
    Override,
    SetGoal,
    SetMode,
    SetOnLoss,
    StuckChanged,
    TakeBack,
    Veto,
    When,
    WithdrawGoal,
)
from farside.node import Direction, to_ns
from farside.topics import (
    ActionEnded,
    Answer,
    BatteryEntry,
    CommandEntry,
    EventLearned,
    FailsafeEntry,
    GoalChange,
    GoalEntry,
    GoalSource,
    HeldEntry,
    HeldFate,
    ModeEntry,
    OperatorEntry,
    PathReview,
    Pose,
    Review,
    ShadowEntry,
    Silence,
    StuckEntry,
)


def reviewed(*conflicts: str) -> PathReview:
    return PathReview(("at:B",), "E", (), 1.0, 9.0, conflicts=conflicts)


@pytest.mark.parametrize(
    ("message", "line"),
    [
        (ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST), "rover: mode autonomous: link lost"),
        (
            failsafe_entry(Failsafe.HOLD, 10.24),
            "rover: failsafe hold: nothing is heard, after 10.2 s of silence",
        ),
        (
            FailsafeEntry(Failsafe.HOLD, "nobody drives", (Cause.UNCONFIRMED,), 0.9, 30.0),
            "rover: failsafe hold: nobody drives",
        ),
        (
            failsafe_entry(Failsafe.ALONE, 30.0),
            "rover: failsafe alone: the link is lost, after 30.0 s of silence",
        ),
        (failsafe_entry(Failsafe.SAFE, 30.0), "rover: failsafe safe: the rover is stuck"),
        (failsafe_entry(), "rover: failsafe nominal: the link is up"),
        (
            GoalEntry(("at:D", "on_charge"), GoalChange.SET, 2.5, GoalSource.INHERENT),
            "rover: goal at:D + on_charge set (inherent, priority 2.5)",
        ),
        (
            GoalEntry(("at:B",), GoalChange.REACHED, 1.0, GoalSource.OPERATOR),
            "rover: goal at:B reached",
        ),
        (
            GoalEntry(("at:B",), GoalChange.WITHDRAWN, 1.0, GoalSource.MISSION),
            "rover: goal at:B withdrawn",
        ),
        (
            GoalEntry(("at:B",), GoalChange.SUSPENDED, 1.0, GoalSource.OPERATOR, "blocked"),
            "rover: goal at:B suspended: blocked",
        ),
        (
            GoalEntry(("at:B",), GoalChange.RECOVERED, 1.0, GoalSource.OPERATOR),
            "rover: goal at:B recovered",
        ),
        (
            CommandEntry(7, CommandStage.BEGUN, Drive("N", force=True), "N was blocked here"),
            (
                "rover: command 7 (drive N, forced) begins although N was blocked here, "
                "as the operator insists"
            ),
        ),
        (
            CommandEntry(7, CommandStage.FAILED, Drive("N"), "its move was blocked"),
            "rover: command 7 (drive N) failed: its move was blocked",
        ),
        (
            CommandEntry(7, CommandStage.REFUSED, Drive("N"), "the battery is flat"),
            "rover: command 7 (drive N) refused: the battery is flat",
        ),
        (
            CommandEntry(7, CommandStage.EXPIRED, Approve(3), "it came too late"),
            "rover: command 7 (approve proposal 3) expired: it came too late",
        ),
        (
            CommandEntry(7, CommandStage.WITHDRAWN, Drive("N"), "the operator took it back"),
            "rover: command 7 (drive N) withdrawn: the operator took it back",
        ),
        (
            CommandEntry(7, CommandStage.SUPERSEDED, Drive("N"), "command 8 changed the mode"),
            "rover: command 7 (drive N) superseded: command 8 changed the mode",
        ),
        (BatteryEntry(BatteryState.CHARGING, 0.254), "rover: battery charging, 25%"),
        (BatteryEntry(BatteryState.FLAT, 0.0), "rover: battery flat: the rover cannot move"),
        (StuckEntry(stuck=True, moves=4), "rover: stuck: the last 4 moves were blocked"),
        (ActionEnded("E", 4.06, blocked=True), "rover: E was blocked after 4.1 s"),
        (
            LinkOutage(Direction.UP, down=True, reason=OutageReason.BLACKOUT),
            "link: uplink: blackout begins",
        ),
        (
            LinkOutage(Direction.DOWN, down=False, reason=OutageReason.PASS),
            "link: downlink: gap between passes ends",
        ),
        (Silence(silent=True), "ground: hears nothing from the rover"),
        (Silence(silent=False), "ground: hears the rover"),
        (
            said_of(7, CommandStage.BEGUN, Verdict.LATE, due_s=4.0, so_s=6.5),
            "ground: command 7 began late, 2.5 s after it was due",
        ),
        (
            said_of(7, CommandStage.DONE, Verdict.LATE, due_s=4.0, so_s=4.04),
            "ground: command 7 done late, less than 0.1 s after it was due",
        ),
        (
            said_of(7, CommandStage.DONE, Verdict.OVERDUE, due_s=4.0),
            "ground: command 7 overdue: should have been done by 4.0 s, no word",
        ),
        (
            HeldEntry(1, (Drive("E"), Drive("N")), HeldFate.HELD),
            "ground: holds until the link is up: drive E, then drive N",
        ),
        (
            HeldEntry(1, (Drive("E"), Drive("N")), HeldFate.RELEASED, (7, 8)),
            "ground: sends what it held, as commands 7, 8: drive E, then drive N",
        ),
        (
            HeldEntry(1, (Drive("E"),), HeldFate.RELEASED, (7,)),
            "ground: sends what it held, as command 7: drive E",
        ),
        (
            HeldEntry(1, (Drive("E"),), HeldFate.GIVEN_UP),
            "ground: gives up what it held: drive E",
        ),
        (
            ShadowEntry(4, 1, in_step=False, why="update 3 is missing", signs=1, hypotheses=1,
                        cycles=0),
            "ground: the shadow of the model is out of step: update 3 is missing",
        ),
        (
            ShadowEntry(4, 1, in_step=True, why=None, signs=1, hypotheses=1, cycles=0),
            "ground: the shadow of the model is in step",
        ),
        (
            Review(14, "E", Answer.APPROVED, reviewed("the rover is elsewhere by now")),
            "ground: approves proposal 14 (E), although the rover is elsewhere by now",
        ),
        (
            Review(14, "E", Answer.VETOED, reviewed("it is old", "it is dear")),
            "ground: vetoes proposal 14 (E): it is old; it is dear",
        ),
        (
            OperatorEntry(1, 3, "x", ("goal B: nothing was proposed", "goal A: its cost is high")),
            "ground: gives up goal A: its cost is high",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_the_line_of(message: msgspec.Struct, line: str) -> None:
    event = event_line(logged(0, message))

    assert event is not None
    assert f"{event.role}: {event.text}" == line


@pytest.mark.parametrize(
    ("order", "text"),
    [
        (Drive("N"), "drive N"),
        (Drive("N", force=True), "drive N, forced"),
        (Approve(3), "approve proposal 3"),
        (Override(3, "E"), "override proposal 3 with E"),
        (Override(3, "E", force=True), "override proposal 3 with E, forced"),
        (Veto(3), "veto proposal 3"),
        (SetMode(Mode.SHARED), "mode shared"),
        (SetGoal(("at:A",), 1.0), "goal at:A, priority 1"),
        (WithdrawGoal(("at:A",)), "withdraw goal at:A"),
        (TakeBack(6), "take back command 6"),
        (SetOnLoss(OnLoss.HOLD), "hold on loss of the link"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_the_ground_gives_a_command(order: Order, text: str) -> None:
    event = event_line(logged(0, command_sent(7, order)))

    assert event is not None
    assert f"{event.role}: {event.text}" == f"ground: command 7: {text}"


@pytest.mark.parametrize(
    ("when", "text"),
    [
        (When(after=6), "drive N, after command 6"),
        (When(at_ns=to_ns(60)), "drive N, not before 60.0 s"),
        (When(6, to_ns(60)), "drive N, after command 6, not before 60.0 s"),
    ],
)
def test_a_command_says_what_it_waits_for(when: When, text: str) -> None:
    event = event_line(logged(0, command_sent(7, Drive("N"), when=when)))

    assert event is not None
    assert event.text == f"command 7: {text}"


@pytest.mark.parametrize(
    ("what", "text"),
    [
        (ModeChanged(Mode.AUTONOMOUS, ModeCause.LINK_LOST), "mode autonomous: link lost"),
        (
            FailsafeChanged(Failsafe.ALONE, "the link is lost", to_ns(30)),
            "failsafe alone: the link is lost, after 30.0 s of silence",
        ),
        (
            FailsafeChanged(Failsafe.NOMINAL, "the link is up", 0),
            "failsafe nominal: the link is up",
        ),
        (
            LinkBack(to_ns(412), 3, 1, (("at:A",), ("at:B",))),
            "the link is back after 412.0 s; meanwhile 3 moves (1 blocked), and reached at:A, at:B",
        ),
        (LinkBack(to_ns(35), 1, 0, ()), "the link is back after 35.0 s; meanwhile 1 move"),
        (LinkBack(to_ns(35), 0, 0, ()), "the link is back after 35.0 s; meanwhile no moves"),
        (GoalAside(("at:B",), "unreachable"), "goal at:B put aside: unreachable"),
        (GoalAside(("at:B",), None), "goal at:B taken up again"),
        (GoalReached(("at:B",)), "goal at:B reached"),
        (BatteryChanged(BatteryState.LOW, 0.2489), "battery low, 25%"),
        (StuckChanged(stuck=False, moves=0), "moves again"),
        (StuckChanged(stuck=True, moves=4), "stuck: the last 4 moves were blocked"),
        (
            CommandReached(7, CommandStage.REFUSED, "the battery is flat"),
            "command 7 refused: the battery is flat",
        ),
        (
            CommandReached(7, CommandStage.SUPERSEDED, "the link was lost before it began"),
            "command 7 superseded: the link was lost before it began",
        ),
        (
            CommandForced(7, "N was blocked here just now"),
            "command 7 begins although N was blocked here just now, as the operator insists",
        ),
        (
            CommandsMissing(missing=True, last=9),
            "commands up to 9 do not arrive, though the ground is heard",
        ),
        (CommandsMissing(missing=False, last=9), "commands up to 9 have arrived after all"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_the_ground_learns_of_an_event_with_its_time(what: Happening, text: str) -> None:
    event = event_line(logged(to_ns(400), EventLearned(Event(1, to_ns(83.25), what))))

    assert event is not None
    assert event.text == f"learns of 83.2 s: {text}"


@pytest.mark.parametrize(
    "message",
    [
        CommandEntry(7, CommandStage.TAKEN, Drive("N")),
        CommandEntry(7, CommandStage.WAITING, Drive("N")),
        CommandEntry(7, CommandStage.BEGUN, Drive("N")),
        CommandEntry(7, CommandStage.DONE, Drive("N")),
        ActionEnded("E", 4.0, blocked=False),
        Pose(0.0, 0.0, 0.0, 0.0, "at:A", 1.0),
        said_of(7, CommandStage.BEGUN, Verdict.UNKNOWN, due_s=4.0),
        said_of(7),
        Review(14, "E", Answer.APPROVED, reviewed()),
        OperatorEntry(1, 3, "goal B"),
    ],
    ids=[
        "taken",
        "waiting",
        "begun",
        "done",
        "an action that ended well",
        "a measurement",
        "a verdict that says nothing",
        "a chance to take back",
        "a proposal that nothing speaks against",
        "an operator who gives nothing up",
    ],
)
def test_no_line_for(message: msgspec.Struct) -> None:
    assert event_line(logged(0, message)) is None


def test_steps_of_a_tour_are_routine_and_changes_are_not() -> None:
    def is_routine(message: msgspec.Struct) -> bool:
        line = event_line(logged(0, message))
        assert line is not None
        return line.routine

    assert is_routine(command_sent(1, Drive("N")))
    assert is_routine(command_sent(1, Approve(1)))
    assert is_routine(CommandEntry(1, CommandStage.FAILED, Drive("N"), "its move was blocked"))
    assert not is_routine(command_sent(1, Drive("N", force=True)))
    assert not is_routine(command_sent(1, Override(1, "N")))
    assert not is_routine(command_sent(1, Veto(1)))
    assert not is_routine(CommandEntry(1, CommandStage.REFUSED, Drive("N"), "the battery is flat"))
    assert not is_routine(ModeEntry(Mode.SHARED, ModeCause.OPERATOR))


@pytest.mark.parametrize(
    ("t_s", "text"),
    [(0, "0.0 s"), (59.99, "59.9 s"), (754.5, "754.5 s"), (36_000, "36000.0 s")],
)
def test_times_are_hours_minutes_and_seconds_cut_to_tenths(t_s: float, text: str) -> None:
    assert time_text(to_ns(t_s)) == text


def test_a_rover_free_from_the_start_is_no_event() -> None:
    assert event_line(logged(0, StuckEntry(stuck=False, moves=0))) is None


HOSTILE = "\x1b]0;you\x07\x1b[2J\u202e\n" * 99


@pytest.mark.parametrize(
    "message",
    [
        GoalEntry((HOSTILE,), GoalChange.SET, 1.0, GoalSource.OPERATOR),
        FailsafeEntry(Failsafe.HOLD, HOSTILE, (), 0.0, 0.0),
        CommandEntry(7, CommandStage.REFUSED, Drive(HOSTILE), HOSTILE),
        ActionEnded(HOSTILE, 4.0, blocked=True),
        command_sent(7, SetGoal((HOSTILE,), 1.0)),
        EventLearned(Event(1, 0, CommandReached(7, CommandStage.REFUSED, HOSTILE))),
        EventLearned(Event(1, 0, LinkBack(0, 0, 0, ((HOSTILE,),)))),
        HeldEntry(1, (Drive(HOSTILE),), HeldFate.HELD),
        Review(14, HOSTILE, Answer.VETOED, reviewed(HOSTILE)),
        OperatorEntry(1, 3, None, (HOSTILE,)),
    ],
    ids=lambda message: type(message).__name__,
)
def test_no_text_of_a_log_can_steer_a_terminal(message: msgspec.Struct) -> None:
    line = event_line(logged(0, message))

    assert line is not None
    assert line.text.isprintable()
    assert len(line.text) < 500
