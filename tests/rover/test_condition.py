"""A rover that cannot go on says so: on board, in its events, and once for each change."""

import pickle
from collections.abc import Callable
from typing import Any

from farside.control import BatteryState, Failsafe
from farside.messages import BatteryChanged, Drive, Event, StuckChanged
from farside.node import Journal
from farside.rover.battery import Battery
from farside.rover.condition import Condition
from farside.rover.config import BatteryConfig
from farside.rover.events import EventQueue
from farside.topics import ROVER_BATTERY, ROVER_STUCK

# A battery that drains in 100 s while standing, and charges from empty to full in 10 s.
SMALL = {"capacity_j": 1000.0, "idle_w": 10.0, "drive_w": 0.0, "charge_w": 110.0}
# Walls on three sides of A; the rover is too wide to leave through the door in the east.
CELL = ("######", "#A.D.#", "######")


def told(events: list[Event], kind: type) -> list[Any]:
    return [event.what for event in events if isinstance(event.what, kind)]


def test_a_battery_that_runs_flat_is_told_as_low_and_then_as_flat(
    bench: Callable[..., Any],
) -> None:
    rover = bench(start="A", battery=SMALL)
    rover.run_s(130)

    states = [state.state for state in told(rover.events, BatteryChanged)]
    assert states == [BatteryState.LOW, BatteryState.FLAT]
    assert [entry.state for entry in rover.of(ROVER_BATTERY)] == [BatteryState.NOMINAL, *states]
    assert rover.of(ROVER_BATTERY)[-1].charge == 0.0


def test_charging_is_told_when_it_begins_and_when_the_battery_is_full(
    bench: Callable[..., Any],
) -> None:
    rover = bench(start="D", battery={**SMALL, "initial": 0.5})
    rover.run_s(20)

    charging, full = told(rover.events, BatteryChanged)
    assert charging == BatteryChanged(BatteryState.CHARGING, charging.charge)
    assert 0.5 <= charging.charge < 1.0
    assert full == BatteryChanged(BatteryState.NOMINAL, 1.0)


def test_a_rover_that_starts_flat_says_so(bench: Callable[..., Any]) -> None:
    rover = bench(start="A", battery={**SMALL, "initial": 0.0})
    rover.run_s(5)

    assert told(rover.events, BatteryChanged) == [BatteryChanged(BatteryState.FLAT, 0.0)]


def test_driving_through_the_dock_is_not_charging(bench: Callable[..., Any]) -> None:
    rover = bench(start="A", battery={"initial": 0.5})
    rover.order(Drive("S"))
    rover.order(Drive("S"))
    rover.do("E")

    assert "at:2,1" in rover.telemetry.tokens
    assert told(rover.events, BatteryChanged) == []


def test_a_rover_blocked_on_all_sides_is_stuck_until_it_moves_again(
    bench: Callable[..., Any],
) -> None:
    rover = bench(rows=CELL, start="A")
    rover.do("NWS")
    assert told(rover.events, StuckChanged) == []

    wedged = bench(rows=("#####", "#A#D#", "#####"), start="A")
    wedged.do("NWSE")
    assert told(wedged.events, StuckChanged) == [StuckChanged(stuck=True, moves=4)]
    assert [entry.stuck for entry in wedged.of(ROVER_STUCK)] == [False, True]


def test_a_rover_blocked_ten_times_in_a_row_is_stuck_and_free_when_it_moves(
    bench: Callable[..., Any],
) -> None:
    rover = bench(rows=CELL, start="A")
    rover.do("N" * 10, force=True)
    assert told(rover.events, StuckChanged) == [StuckChanged(stuck=True, moves=10)]

    rover.do("E")
    assert told(rover.events, StuckChanged)[1:] == [StuckChanged(stuck=False, moves=0)]


def test_a_rover_that_tries_all_but_the_way_out_is_not_stuck(bench: Callable[..., Any]) -> None:
    """As one that explores at random does where there are walls on three sides."""
    rover = bench(rows=CELL, start="A")
    rover.do("NWSSNWWNSWNS", force=True)
    assert told(rover.events, StuckChanged) == []
    assert rover.telemetry.failsafe is Failsafe.NOMINAL

    rover.do("E")
    assert "at:2,1" in rover.telemetry.tokens


def test_a_rover_that_stays_stuck_says_so_once_and_remembers_no_more_of_it() -> None:
    journal = Journal()
    events = EventQueue(journal)
    condition = Condition(Battery(BatteryConfig()), journal, events)
    for _ in range(1000):
        condition.moved("N", blocked=True)
    after_1000 = len(pickle.dumps(condition))
    for _ in range(1000):
        condition.moved("N", blocked=True)

    assert len(pickle.dumps(condition)) == after_1000
    assert [event.what for event in events.take()] == [StuckChanged(stuck=True, moves=10)]
