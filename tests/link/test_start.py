"""When a link starts, and contact plans beside other light times."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from farside.frames import OutageReason
from farside.link.emulator import Emulator, look_ahead
from farside.link.profile.config import LinkConfig
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.plans.times import FOREVER_S, Window
from farside.link.profile.profile import Profile
from farside.link.profile.schedule import Delay, outages_of
from farside.node import Direction, to_ns, to_s

DAY_S = 86_400.0
HOUR_S = 3600.0
DATED = """
a range 2026/11/28-00:00:00 2026/12/28-00:00:00 1 2 10
a contact 2026/11/28-06:00:00 2026/11/28-07:00:00 1 2 1000
a contact 2026/11/28-06:00:00 2026/11/28-07:00:00 2 1 2000
a contact 2026/11/29-06:00:00 2026/11/29-07:00:00 1 2 3000
a contact 2026/11/29-06:00:00 2026/11/29-07:00:00 2 1 4000
"""
UNDATED = "a contact +3600 +7200 1 2 125\na contact +3600 +7200 2 1 125\n"
CONTACTS = {"file": "plan.ionrc", "ground": 1, "rover": 2}
MARS = {"body": "mars"}


def profile(folder: Path, plan: str, **tables: Any) -> Profile:
    """A link with a plan."""
    (folder / "plan.ionrc").write_text(plan)
    return Profile({"contacts": CONTACTS, **tables}, folder)


def whole(link: Profile, days: float = 3.0) -> LinkConfig:
    """Its tables for a mission."""
    return link.resolved(Window.of(days * DAY_S))


def refusal(link: Profile) -> str:
    """Why it is refused."""
    with pytest.raises(LinkConfigError) as error:
        whole(link)
    return str(error.value)


def open_s(link: LinkConfig, direction: Direction) -> list[tuple[float, float]]:
    """Between which times a direction is in service."""
    outages = outages_of(link, direction)
    ends_s = [to_s(one.end_ns) for one in outages]
    return list(zip(ends_s, [to_s(one.begin_ns) for one in outages[1:]], strict=False))


# --- a plan with dates


def test_a_plan_with_dates_is_counted_from_the_date_at_which_the_link_starts(
    tmp_path: Path,
) -> None:
    link = whole(profile(tmp_path, DATED, start="2026-11-28T05:30:00Z"))
    assert open_s(link, Direction.DOWN) == [(1800, 5400), (88_200, 91_800)]
    # The uplink is out at the rover's end: one light time later.
    assert open_s(link, Direction.UP) == [(1810, 5410), (88_210, 91_810)]
    assert link.start is None


def test_without_a_start_it_begins_at_its_own_first_date(tmp_path: Path) -> None:
    first = whole(profile(tmp_path, DATED))
    assert first == whole(profile(tmp_path, DATED, start="2026-11-28T00:00:00Z"))


def test_a_link_may_start_in_the_middle_of_a_contact(tmp_path: Path) -> None:
    link = whole(profile(tmp_path, DATED, start="2026-11-28T07:30:00+01:00"))
    assert outages_of(link, Direction.DOWN)[0].begin_ns == to_ns(1800)
    assert [step.rate_bit_s for step in link.down.rate_table] == [16_000, 32_000]


def test_after_its_last_contact_there_is_none_whenever_it_starts(tmp_path: Path) -> None:
    link: Emulator[None] = Emulator(
        look_ahead(profile(tmp_path, DATED, start="2026-12-24T00:00:00Z"))
    )
    link.advance(to_ns(400 * DAY_S))
    for direction in Direction:
        outage = link.state().way(direction).outage
        assert outage is not None
        assert (outage.reason, outage.left_s) == (OutageReason.CONTACT, None)


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"start": "2026-11-28"}, "start: expected a contact plan with dates, found none in "),
        ({"start": "soon"}, "start: expected a date and time in ISO 8601 with Z or an offset"),
        (
            {"start": "2026-11-28", "ephemeris": MARS | {"epoch": "2026-11-28"}},
            "start: expected a date here or in ephemeris.epoch, found both",
        ),
        ({"ephemeris": MARS}, "ephemeris.epoch: expected a date here, or as start of the link"),
    ],
)
def test_a_start_that_starts_nothing_or_is_told_twice_is_refused(
    tmp_path: Path, tables: dict[str, Any], words: str
) -> None:
    assert words in refusal(profile(tmp_path, UNDATED, **tables))


def test_a_start_without_plan_and_ephemeris_is_refused() -> None:
    near = {"up": {"delay_s": 1}, "down": {"delay_s": 1}}
    words = refusal(Profile(near | {"start": "2026-11-28"}))
    assert words == (
        "start: expected an ephemeris or a contact plan that it is the start of, found neither"
    )


# --- light time from the one, outages from the other


@pytest.fixture
def _astropy() -> None:
    pytest.importorskip("astropy")


@pytest.mark.usefixtures("_astropy")
def test_an_epoch_is_a_start_and_a_plan_with_dates_is_an_epoch(tmp_path: Path) -> None:
    started = whole(profile(tmp_path, DATED, ephemeris=MARS, start="2026-11-28T00:00:00Z"))
    epoch = MARS | {"epoch": "2026-11-28T00:00:00Z"}
    assert whole(profile(tmp_path, DATED, ephemeris=epoch)) == started
    assert whole(profile(tmp_path, DATED, ephemeris=MARS)) == started


@pytest.mark.usefixtures("_astropy")
@pytest.mark.parametrize("plan", [DATED, DATED.replace("a range", "# a range")])
def test_beside_an_ephemeris_a_plan_gives_outages_and_rates(tmp_path: Path, plan: str) -> None:
    link = whole(profile(tmp_path, plan, ephemeris=MARS, start="2026-11-28T00:00:00Z"))
    alone = Profile({"ephemeris": MARS, "start": "2026-11-28T00:00:00Z"})
    assert link.up.delay_table == whole(alone).up.delay_table
    assert [step.rate_bit_s for step in link.up.rate_table] == [8000, 24_000]
    (first, after), *_ = open_s(link, Direction.UP)
    light = Delay(link.up)
    # What leaves the ground within the contact arrives within it.
    assert to_ns(first) == pytest.approx(to_ns(6 * HOUR_S) + light.at(to_ns(6 * HOUR_S)), abs=1000)
    assert to_ns(after) == pytest.approx(to_ns(7 * HOUR_S) + light.at(to_ns(7 * HOUR_S)), abs=1000)
    assert open_s(link, Direction.DOWN)[0] == (6 * HOUR_S, 7 * HOUR_S)


@pytest.mark.usefixtures("_astropy")
def test_a_plan_without_dates_begins_where_the_ephemeris_does(tmp_path: Path) -> None:
    link = whole(profile(tmp_path, UNDATED, ephemeris=MARS, start="2026-11-28T00:00:00Z"))
    assert open_s(link, Direction.DOWN)[0] == (3600, 7200)


def test_a_delay_of_the_link_itself_counts_before_the_ranges_of_a_plan(tmp_path: Path) -> None:
    ways = {"up": {"delay_s": 3.0}, "down": {"delay_s": 4.0}}
    link = whole(profile(tmp_path, DATED, **ways))
    assert (link.up.delay_s, link.down.delay_s) == (3.0, 4.0)
    assert not link.up.delay_table
    assert open_s(link, Direction.UP)[0] == (6 * HOUR_S + 3, 7 * HOUR_S + 3)
    only_up = whole(profile(tmp_path, DATED, up={"delay_s": 3.0}))
    assert (only_up.up.delay_s, only_up.down.least_delay_ns) == (3.0, to_ns(10))


def daily_contacts(days: Sequence[int]) -> str:
    return "".join(
        f"a contact +{day * 86_400 + 100} +{day * 86_400 + 4000} {a} {b} 1000\n"
        for day in days
        for a, b in ((1, 2), (2, 1))
    )


@pytest.mark.usefixtures("_astropy")
def test_weeks_of_contacts_beside_an_ephemeris_in_windows_are_those_of_one_table(
    tmp_path: Path,
) -> None:
    orbit = MARS | {"epoch": "2021-09-10", "conjunction_deg": 2.2}
    days = [0, 1, 5, 9, *range(14, 22, 2), 40]
    described = profile(tmp_path, daily_contacts(days), ephemeris=orbit)
    windows: Emulator[None] = Emulator(look_ahead(described))
    one: Emulator[None] = Emulator(whole(described, days=45.0))
    arrived: list[list[int]] = [[], []]
    rng = np.random.default_rng(3)
    for day in range(22):
        for offset_s in sorted(rng.uniform(0, 5000, 4)):
            for number, link in enumerate((windows, one)):
                for direction in Direction:
                    link.send(direction, to_ns(day * DAY_S + offset_s), b"x", None)
                arrived[number] += [
                    at_ns for at_ns, *_ in link.advance(to_ns(day * DAY_S + offset_s) + 1)
                ]
    assert arrived[0] == arrived[1]
    assert len(arrived[0]) > 20
    for direction in Direction:
        counters = [link.state().way(direction).counters for link in (windows, one)]
        assert counters[0] == counters[1]


def test_the_gap_before_a_contact_beyond_the_window_is_told_to_its_end(tmp_path: Path) -> None:
    pytest.importorskip("astropy")
    orbit = MARS | {"epoch": "2021-09-10"}
    described = profile(tmp_path, daily_contacts([0, 60]), ephemeris=orbit)
    link: Emulator[None] = Emulator(look_ahead(described))
    ends_s = []
    for day in (1, 10, 40, 59):
        link.advance(to_ns(day * DAY_S))
        outage = link.state().up.outage
        assert outage is not None
        assert outage.left_s is not None
        ends_s.append(day * DAY_S + outage.left_s)
    assert np.ptp(ends_s) < 1e-5
    arrives_s = 60 * DAY_S + 100 + to_s(link.ahead.config.up.greatest_delay_ns)
    assert ends_s[0] == pytest.approx(arrives_s, abs=10)
    assert FOREVER_S > 100 * 365 * DAY_S
