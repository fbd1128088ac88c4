"""The line of text for each kind of event, and what has none."""

import msgspec
import pytest
from noting import logged

from farside.control import BatteryState, Failsafe, Mode, ModeCause
from farside.frames import LinkOutage, OutageReason
from farside.logs import time_text
from farside.logs.events import event_line
from farside.messages import (
    Approve,
    BatteryChanged,
    CommandRefused,
    Drive,
    Event,
    FailsafeChanged,
    GoalReached,
    Happening,
    ModeChanged,
    Override,
    SetGoal,
    SetMode,
    StuckChanged,
    WithdrawGoal,
)
from farside.node import Direction, to_ns
from farside.topics import (
    ActionEnded,
    BatteryEntry,
    CommandSent,
    CommandTaken,
    EventLearned,
    FailsafeEntry,
    GoalChange,
    GoalEntry,
    GoalSource,
    ModeEntry,
    Pose,
    Silence,
    StuckEntry,
)


@pytest.mark.parametrize(
    ("message", "line"),
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
        (ActionEnded("E", 4.06, blocked=True), "rover: E was blocked after 4.1 s"),
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
def test_the_line_of(message: msgspec.Struct, line: str) -> None:
    event = event_line(logged(0, message))

    assert event is not None
    assert f"{event.role}: {event.text}" == line


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
def test_the_ground_learns_of_an_event_with_its_time(what: Happening, text: str) -> None:
    event = event_line(logged(to_ns(400), EventLearned(Event(1, to_ns(83.25), what))))

    assert event is not None
    assert event.text == f"learns of 83.2 s: {text}"


@pytest.mark.parametrize(
    "message",
    [
        CommandTaken(7, Drive("N"), None),
        ActionEnded("E", 4.0, blocked=False),
        Pose(0.0, 0.0, 0.0, 0.0, "at:A", 1.0),
    ],
    ids=["an obeyed command", "an action that ended well", "a measurement"],
)
def test_no_line_for(message: msgspec.Struct) -> None:
    assert event_line(logged(0, message)) is None


def test_steps_of_a_tour_are_routine_and_changes_are_not() -> None:
    def is_routine(message: msgspec.Struct) -> bool:
        line = event_line(logged(0, message))
        assert line is not None
        return line.routine

    assert is_routine(CommandSent(1, Drive("N")))
    assert is_routine(CommandSent(1, Approve(1)))
    assert not is_routine(CommandSent(1, Override(1, "N")))
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
        CommandTaken(7, Drive(HOSTILE), HOSTILE),
        ActionEnded(HOSTILE, 4.0, blocked=True),
        CommandSent(7, SetGoal((HOSTILE,), 1.0)),
        EventLearned(Event(1, 0, CommandRefused(7, HOSTILE))),
    ],
    ids=lambda message: type(message).__name__,
)
def test_no_text_of_a_log_can_steer_a_terminal(message: msgspec.Struct) -> None:
    line = event_line(logged(0, message))

    assert line is not None
    assert line.text.isprintable()
    assert len(line.text) < 500
