"""The battery: a small machine, told step by step."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.node import to_ns
from farside.rover.battery import Battery
from farside.rover.config import BatteryConfig

SMALL = BatteryConfig(capacity_j=1000.0, idle_w=1.0, drive_w=9.0, charge_w=101.0, low=0.2)


def test_standing_drains_and_driving_drains_more() -> None:
    battery = Battery(SMALL)
    battery.flow(to_ns(100), driving=False, docked=False)
    assert battery.charge == pytest.approx(0.9)
    battery.flow(to_ns(110), driving=True, docked=False)
    assert battery.charge == pytest.approx(0.8)


def test_the_dock_charges_to_the_brim_and_no_further() -> None:
    battery = Battery(BatteryConfig(capacity_j=1000.0, initial=0.5, idle_w=1.0, charge_w=101.0))
    battery.flow(to_ns(4), driving=False, docked=True)
    assert battery.charge == pytest.approx(0.9)
    battery.flow(to_ns(100), driving=False, docked=True)
    assert battery.charge == 1.0


def test_low_stays_on_until_charged() -> None:
    battery = Battery(SMALL)
    battery.flow(to_ns(810), driving=False, docked=False)
    assert battery.low
    battery.flow(to_ns(814), driving=False, docked=True)
    assert battery.charge == pytest.approx(0.59)
    assert battery.low
    battery.flow(to_ns(818), driving=False, docked=True)
    assert not battery.low


def test_the_wish_to_charge_grows_as_the_battery_empties() -> None:
    battery = Battery(SMALL)
    urgencies = []
    for second in range(0, 1100, 100):
        battery.flow(to_ns(second), driving=False, docked=False)
        urgencies.append(battery.urgency)
    assert urgencies == sorted(urgencies)
    assert urgencies[0] == 0
    assert urgencies[-1] == SMALL.charge_priority
    assert battery.empty


@given(st.lists(st.tuples(st.integers(0, 500), st.booleans(), st.booleans()), max_size=30))
def test_charge_stays_between_empty_and_full(stretches: Sequence[tuple[int, bool, bool]]) -> None:
    battery, now_s = Battery(SMALL), 0
    for duration_s, driving, docked in stretches:
        now_s += duration_s
        battery.flow(to_ns(now_s), driving=driving, docked=docked)
        assert 0 <= battery.charge <= 1
