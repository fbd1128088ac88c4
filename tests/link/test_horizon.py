"""Months on a clock: no schedule has an end that the link does not have."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from farside.frames import OutageReason
from farside.link.emulator import Delivery, Emulator, look_ahead
from farside.link.emulator.control import OutageState
from farside.link.emulator.renewing import Renewal
from farside.link.profile.plans.times import Window
from farside.link.profile.profile import Profile
from farside.node import NEVER_NS, Direction, to_ns

DAY_S = 86_400.0
HOUR_S = 3600.0
NEAR: dict[str, Any] = {"up": {"delay_s": 1.0}, "down": {"delay_s": 1.0}}
FIRST, SECOND = (0, 100), (700_000, 700_100)
PLAN = "".join(
    f"a contact +{begin} +{end} {a} {b} 125\n"
    for begin, end in (FIRST, SECOND)
    for a, b in ((1, 2), (2, 1))
)
RANGES = "a range +0 +800000 1 2 20\n"


def emulator(table: Mapping[str, Any], folder: Path = Path()) -> Emulator[None]:
    """The link that a table describes, as `farside link` begins with it."""
    return Emulator(look_ahead(Profile(table, folder)))


def outage_at(link: Emulator[None], day: float, direction: Direction) -> OutageState | None:
    """Why a direction is out on a day."""
    link.advance(to_ns(day * DAY_S))
    return link.state().way(direction).outage


def passed(
    link: Emulator[None], times_s: Sequence[float], step_s: float = DAY_S
) -> list[tuple[int, Direction]]:
    """When messages sent both ways at these times arrive."""
    arrived: list[Delivery[None]] = []
    until_s = step_s
    for time_s in times_s:
        while until_s <= time_s:
            arrived += link.advance(to_ns(until_s))
            until_s += step_s
        for direction in Direction:
            link.send(direction, to_ns(time_s), b"x" * 20, None)
    arrived += link.advance(to_ns(times_s[-1] + 12 * HOUR_S))
    return [(at_ns, direction) for at_ns, direction, _, _ in arrived]


# --- passes


def test_the_passes_of_mars_relay_go_on_on_day_8_and_after_three_months() -> None:
    link: Emulator[None] = Emulator(look_ahead(Profile.read("mars-relay")))
    for day in (8.0, 91.0):
        # The pass before, the gap, and the pass after it.
        begin_s = 600 + 22_193.811 * int((day * DAY_S - 600) / 22_193.811)
        assert outage_at(link, (begin_s + 240) / DAY_S, Direction.DOWN) is None
        outage = outage_at(link, (begin_s + 500) / DAY_S, Direction.DOWN)
        assert outage is not None
        assert outage.reason is OutageReason.PASS
        assert outage.left_s == pytest.approx(22_193.811 - 500, abs=1e-6)


def test_passes_every_second_are_no_more_trouble_than_four_a_day() -> None:
    link = emulator(NEAR | {"passes": {"length_s": 0.25, "period_s": 1.0}})
    arrived = passed(link, [0.125, 0.625, 9_000.125, 9_000.625, 30_000.2, 30_000.3])
    down = [at_ns for at_ns, direction in arrived if direction is Direction.DOWN]
    assert down == [to_ns(one) for one in (1.125, 9_001.125, 30_001.2)]


def test_a_gap_longer_than_what_is_looked_ahead_is_told_to_its_end() -> None:
    link = emulator(NEAR | {"passes": {"length_s": 60.0, "period_s": 30 * DAY_S}})
    outage = outage_at(link, 1, Direction.UP)
    assert outage == OutageState(OutageReason.PASS, 29 * DAY_S)


def test_a_century_without_a_message_takes_no_longer_than_a_day() -> None:
    link = emulator(NEAR | {"passes": {"length_s": 0.25, "period_s": 1.0}})
    century_s = 100 * 365.25 * DAY_S
    link.send(Direction.UP, to_ns(century_s) + to_ns(0.125), b"x", None)
    arrived = link.advance(to_ns(century_s) + to_ns(3))
    assert [at_ns for at_ns, *_ in arrived] == [to_ns(century_s) + to_ns(1.125)]
    link.advance(2**63 - 1)


# --- contacts


def test_contacts_on_the_ninth_day_take_place_and_after_the_last_there_is_none(
    tmp_path: Path,
) -> None:
    (tmp_path / "far.ionrc").write_text(RANGES + PLAN)
    link = emulator({"contacts": {"file": "far.ionrc", "ground": 1, "rover": 2}}, tmp_path)
    times_s = [50, 650_000, 700_050, 700_500, 100 * DAY_S]
    arrived = passed(link, times_s)
    assert sorted({at_ns for at_ns, _ in arrived}) == [to_ns(70.16), to_ns(700_070.16)]
    assert len(arrived) == 4
    for direction in Direction:
        assert link.state().way(direction).outage == OutageState(OutageReason.CONTACT, None)
    assert link.ahead.renew_ns == NEVER_NS


# --- ephemeris


@pytest.fixture
def conjunction() -> dict[str, Any]:
    """Mars a month before the conjunction of 2021, with everything that changes by itself."""
    pytest.importorskip("astropy")
    return {
        "up": {"loss": 0.1, "rate_bit_s": 500, "jitter": {"spread_s": 30_000.0}},
        "down": {"loss": {"model": "gilbert-elliott", "p": 0.1, "r": 0.3}, "rate_bit_s": 2000},
        "ephemeris": {"body": "mars", "epoch": "2021-09-10", "conjunction_deg": 2.2},
        "passes": {"length_s": 8 * HOUR_S, "period_s": 24.66 * HOUR_S},
        "blackouts": [{"start_s": 9 * DAY_S, "end_s": 9.5 * DAY_S}],
        "changes": [{"at_s": 24 * DAY_S, "loss": 0.7}],
    }


def test_four_weeks_in_windows_are_four_weeks_in_one_table(conjunction: dict[str, Any]) -> None:
    # Every message arrives at the very nanosecond: no seam shows.
    whole = Profile(conjunction).resolved(Window.of(29 * DAY_S))
    times_s = [number * 0.1237 * DAY_S for number in range(225)]
    assert passed(emulator(conjunction), times_s) == passed(Emulator(whole), times_s)


def test_what_is_ahead_does_not_grow(conjunction: dict[str, Any]) -> None:
    link = emulator(conjunction)
    sizes = []
    for day in (10, 40, 60):
        link.advance(to_ns(day * DAY_S))
        config = link.ahead.config
        sizes.append((len(config.up.delay_table), len(config.blackouts)))
    assert max(points for points, _ in sizes) <= 7 * 24 + 2
    assert max(outages for _, outages in sizes) <= 12
    assert len(link._channel._ways[Direction.UP]._outages._begins_ns) <= 12


def test_a_conjunction_that_outlasts_the_window_is_told_to_its_end(
    conjunction: dict[str, Any],
) -> None:
    link = emulator(conjunction | {"passes": None, "blackouts": []})
    first, later = (outage_at(link, day, Direction.UP) for day in (22, 30))
    assert first is not None
    assert later is not None
    assert first.reason is OutageReason.CONJUNCTION
    assert first.left_s is not None
    assert later.left_s == pytest.approx(first.left_s - 8 * DAY_S, abs=1e-6)


@pytest.mark.usefixtures("conjunction")
def test_where_the_ephemeris_ends_the_light_time_stays_and_both_are_known_beforehand() -> None:
    orbit = {"body": "mars", "epoch": "2099-12-20"}
    link = emulator({"ephemeris": orbit})
    end = link.ahead.light_end
    assert end is not None
    assert (round(end.at_s), end.date) == (12 * DAY_S, "2100-01-01T00:00:00Z")
    first, last, later = (
        [at_ns - to_ns(day * DAY_S) for at_ns, _ in passed(link, [day * DAY_S])]
        for day in (1, 12, 60)
    )
    assert last != pytest.approx(first, abs=1000)
    assert later == pytest.approx(last, abs=1000)


# --- control


def test_a_change_by_control_outlives_the_window_and_moves_no_schedule() -> None:
    link: Emulator[None] = Emulator(look_ahead(Profile.read("mars-relay")))
    link.advance(to_ns(DAY_S))
    link.control(b'{"down": {"loss": 0.25}}')
    link.control(b'{"up": {"out": true}}')
    link.advance(to_ns(30 * DAY_S))
    assert link.state().down.settings.loss == 0.25
    up, down = link.state().up.outage, link.state().down.outage
    assert up == OutageState(OutageReason.CONTROL, None)
    assert down is not None
    assert down.reason is OutageReason.PASS


def test_what_was_looked_up_before_a_change_is_not_gone_back_to() -> None:
    link: Emulator[None] = Emulator(look_ahead(Profile.read("mars-relay")))
    stale = look_ahead(link.ahead.profile, link.ahead.renew_ns)
    link.control(b'{"down": {"loss": 0.25}}')
    link.renew(stale)
    assert link.state().down.settings.loss == 0.25


# --- on a wall clock


def test_the_next_window_is_looked_up_in_the_background_once_half_of_this_one_is_over() -> None:
    link: Emulator[None] = Emulator(look_ahead(Profile.read("mars-relay")))
    said: list[str] = []
    renewal = Renewal(link, said.append)
    first = link.ahead
    renewal.step(first.renew_ns - 1)
    assert renewal._coming is None
    link.advance(first.renew_ns)
    while link.ahead is first:
        renewal.step(first.renew_ns)
    assert link.ahead.renew_ns > first.latest_ns
    assert said == []


@pytest.mark.usefixtures("conjunction")
def test_people_are_told_where_light_times_end_and_when_they_do() -> None:
    table = {"ephemeris": {"body": "mars", "epoch": "2099-12-30"}}
    link = emulator(table)
    said: list[str] = []
    renewal = Renewal(link, said.append)
    foretold = "light times are known until 2100-01-01T00:00:00Z; from then on they stay"
    for day in (0.5, 1.5, 2.5, 2.6):
        link.advance(to_ns(day * DAY_S))
        renewal.step(to_ns(day * DAY_S))
    ended = "the ephemeris has ended, 2100-01-01T00:00:00Z: light times stay as they are"
    assert said == [foretold, ended]
    link.control(b'{"ephemeris": {"epoch": "2026-01-01"}}')
    renewal.step(to_ns(3 * DAY_S))
    assert said[2:] == [foretold]


def test_a_failure_of_looking_ahead_is_raised_where_the_link_is_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "far.ionrc").write_text(RANGES + PLAN)
    contacts = {"file": "far.ionrc", "ground": 1, "rover": 2}
    link = emulator({"contacts": contacts, "passes": {"length_s": 1, "period_s": 9}}, tmp_path)
    renewal = Renewal(link, print)

    def fail(*_: object) -> None:
        raise MemoryError

    monkeypatch.setattr("farside.link.emulator.renewing.look_ahead", fail)
    renewal.step(link.ahead.renew_ns)
    while not renewal._coming.done():
        pass
    with pytest.raises(MemoryError):
        renewal.step(link.ahead.renew_ns)
