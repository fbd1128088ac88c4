"""What an onlooker knows after each entry, and the story in words."""

from typing import Any

import msgspec
import pytest
from noting import logged

from farside.logs import LinkPicture, Picture, clock, decoded
from farside.messages import (
    Approve,
    BatteryChanged,
    BatteryState,
    Chooser,
    CommandRefused,
    Drive,
    Event,
    Failsafe,
    FailsafeChanged,
    GoalReached,
    Mode,
    ModeCause,
    ModeChanged,
    Override,
    Proposal,
    SetGoal,
    SetMode,
    StuckChanged,
    WithdrawGoal,
)
from farside.node import Direction, to_ns
from farside.topics import (
    ActionEnded,
    ActionStarted,
    BatteryEntry,
    CommandSent,
    CommandTaken,
    EventLearned,
    FailsafeEntry,
    Fate,
    GoalChange,
    GoalEntry,
    GoalSource,
    LinkOutage,
    ModeEntry,
    OutageReason,
    Pose,
    Silence,
    StuckEntry,
)


def picture_of(run: Any) -> Picture:
    picture = Picture()
    for record in run.records:
        picture.apply(decoded(record))
    return picture


def test_the_rover_marks_the_places_where_it_has_been(run: Any) -> None:
    picture = picture_of(run.start("at:D").stand(1, "at:4,1").stand(2, "at:C"))

    assert picture.visited == {"at:D", "at:4,1", "at:C"}
    assert picture.pose is not None
    assert picture.pose.place == "at:C"


def test_the_goal_list_keeps_its_top_goal_first(run: Any) -> None:
    run.start().goal(1, "at:A", priority=1.0).goal(2, "on_charge", priority=0.5)
    assert list(picture_of(run).goals) == [("at:A",), ("on_charge",)]

    run.goal(3, "on_charge", priority=1.5)
    assert list(picture_of(run).goals) == [("on_charge",), ("at:A",)]

    run.reach(4, "on_charge").goal(5, "at:A", change=GoalChange.WITHDRAWN)
    assert picture_of(run).goals == {}


def test_an_action_lasts_until_it_ends(run: Any) -> None:
    started = ActionStarted("N", Chooser.GUIDED, 1, None)

    assert picture_of(run.start().note(1, started)).action == started
    assert picture_of(run.note(3, ActionEnded("N", 2.0, blocked=False))).action is None


def test_a_proposal_stands_as_long_as_its_goal(run: Any) -> None:
    proposal = Proposal(1, 0, ("at:A",), "N", Chooser.GOAL_DIRECTED, ())
    run.start().goal(1, "at:A").goal(1, "at:B").note(2, proposal)

    assert picture_of(run.reach(3, "at:B")).proposal == proposal
    assert picture_of(run.reach(4, "at:A")).proposal is None


def test_each_direction_counts_its_own_frames(run: Any) -> None:
    run.start().frame(1, Direction.UP).frame(2, Direction.DOWN, Fate.LOST)
    run.frame(3, Direction.DOWN, Fate.OUTAGE).frame(4, Direction.DOWN)
    run.note(5, LinkOutage(Direction.UP, down=True, reason=OutageReason.BLACKOUT))

    assert picture_of(run).link == {
        Direction.UP: LinkPicture(down=True, delivered=1, lost=0),
        Direction.DOWN: LinkPicture(down=False, delivered=1, lost=2),
    }


def test_a_goal_that_is_set_again_with_a_new_priority_is_told_once(run: Any) -> None:
    run.goal(1, "on_charge", priority=0.1).goal(2, "on_charge", priority=0.2)
    run.reach(3, "on_charge").goal(4, "on_charge", priority=0.1)

    assert [line.text for line in picture_of(run).lines] == [
        "goal on_charge set (operator, priority 0.1)",
        "goal on_charge reached",
        "goal on_charge set (operator, priority 0.1)",
    ]


@pytest.mark.parametrize(
    ("entry", "line"),
    [
        (ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST), "rover: mode autonomous: link lost"),
        (FailsafeEntry(Failsafe.HOLD, 10.24), "rover: failsafe hold after 10.2 s of silence"),
        (FailsafeEntry(Failsafe.NOMINAL, 0.0), "rover: failsafe nominal"),
        (
            GoalEntry(("at:D", "on_charge"), GoalChange.SET, 2.5, GoalSource.INHERENT),
            "rover: goal at:D + on_charge set (inherent, priority 2.5)",
        ),
        (
            GoalEntry(("at:B",), GoalChange.REACHED, 1.0, GoalSource.OPERATOR),
            "rover: goal at:B reached",
        ),
        (
            CommandTaken(7, Drive("N"), "expired"),
            "rover: refuses command 7 (drive N): expired",
        ),
        (BatteryEntry(BatteryState.CHARGING, 0.254), "rover: battery charging, 25%"),
        (BatteryEntry(BatteryState.FLAT, 0.0), "rover: battery flat: the rover cannot move"),
        (StuckEntry(stuck=True, moves=4), "rover: stuck: the last 4 moves were blocked"),
        (ActionEnded("E", 4.06, blocked=True), "rover: E was blocked, after 4.1 s"),
        (
            LinkOutage(Direction.UP, down=True, reason=OutageReason.BLACKOUT),
            "link: uplink: blackout begins",
        ),
        (
            LinkOutage(Direction.DOWN, down=False, reason=OutageReason.PASS),
            "link: downlink: gap between passes ends",
        ),
        (CommandSent(7, Drive("N")), "ground: command 7: drive N"),
        (CommandSent(8, Approve(3)), "ground: command 8: approve proposal 3"),
        (CommandSent(9, Override(3, "E")), "ground: command 9: override proposal 3 with E"),
        (CommandSent(10, SetMode(Mode.SHARED)), "ground: command 10: mode shared"),
        (CommandSent(11, SetGoal(("at:A",), 1.0)), "ground: command 11: goal at:A, priority 1"),
        (CommandSent(12, WithdrawGoal(("at:A",))), "ground: command 12: withdraw goal at:A"),
        (Silence(silent=True), "ground: hears nothing from the rover"),
        (Silence(silent=False), "ground: hears the rover"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)  # fmt: skip
def test_an_entry_is_told_as(entry: msgspec.Struct, line: str) -> None:
    told = Picture().apply(logged(0, entry))

    assert told is not None
    assert f"{told.who}: {told.text}" == line


@pytest.mark.parametrize(
    ("what", "text"),
    [
        (ModeChanged(Mode.AUTONOMOUS, ModeCause.LINK_LOST), "mode autonomous: link lost"),
        (FailsafeChanged(Failsafe.LOST, to_ns(30)), "failsafe lost after 30.0 s of silence"),
        (GoalReached(("at:B",)), "goal at:B reached"),
        (BatteryChanged(BatteryState.LOW, 0.2489), "battery low, 25%"),
        (StuckChanged(stuck=False, moves=0), "moves again"),
        (CommandRefused(7, "expired"), "command 7 refused: expired"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_the_ground_learns_of_an_event_with_its_time(what: Any, text: str) -> None:
    told = Picture().apply(logged(to_ns(400), EventLearned(Event(1, to_ns(83.25), what))))

    assert told is not None
    assert told.text == f"learns of 0:01:23.2: {text}"


@pytest.mark.parametrize(
    "entry",
    [
        CommandTaken(7, Drive("N"), None),
        ActionEnded("E", 4.0, blocked=False),
        StuckEntry(stuck=False, moves=0),
        Pose(0.0, 0.0, 0.0, 0.0, "at:A", 1.0),
    ],
    ids=[
        "an obeyed command",
        "an action that ended well",
        "a rover free from the start",
        "a measurement",
    ],
)
def test_the_story_leaves_out(entry: msgspec.Struct) -> None:
    assert Picture().apply(logged(0, entry)) is None


HOSTILE = "\x1b]0;you\x07\x1b[2J\u202e\n" * 99


@pytest.mark.parametrize(
    "entry",
    [
        GoalEntry((HOSTILE,), GoalChange.SET, 1.0, GoalSource.OPERATOR),
        CommandTaken(7, Drive(HOSTILE), HOSTILE),
        ActionEnded(HOSTILE, 4.0, blocked=True),
        CommandSent(7, SetGoal((HOSTILE,), 1.0)),
        EventLearned(Event(1, 0, CommandRefused(7, HOSTILE))),
    ],
    ids=lambda entry: type(entry).__name__,
)
def test_no_text_of_a_log_can_steer_a_terminal(entry: msgspec.Struct) -> None:
    told = Picture().apply(logged(0, entry))

    assert told is not None
    assert told.text.isprintable()
    assert len(told.text) < 500


def test_steps_of_a_tour_are_routine_and_changes_are_not() -> None:
    def is_routine(entry: msgspec.Struct) -> bool:
        line = Picture().apply(logged(0, entry))
        assert line is not None
        return line.routine

    assert is_routine(CommandSent(1, Drive("N")))
    assert is_routine(CommandSent(1, Approve(1)))
    assert not is_routine(CommandSent(1, Override(1, "N")))
    assert not is_routine(ModeEntry(Mode.SHARED, ModeCause.OPERATOR))


@pytest.mark.parametrize(
    ("t_s", "text"),
    [(0, "0:00:00.0"), (59.99, "0:00:59.9"), (754.5, "0:12:34.5"), (36_000, "10:00:00.0")],
)
def test_the_clock_shows_hours_minutes_and_whole_tenths(t_s: float, text: str) -> None:
    assert clock(to_ns(t_s)) == text
