"""The link between two nodes of a contact plan."""

from collections.abc import Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.link import Blackout
from farside.link.profile.config import Affected, DelayPoint, LinkConfig, OneWay, RateStep
from farside.link.profile.plans.contacts import (
    UNLIMITED_BIT_S,
    ContactPlanError,
    Plan,
    WayTables,
    gaps,
    link_tables,
)
from farside.link.profile.plans.hdtn import parse_hdtn
from farside.link.profile.plans.ion import parse_ion
from farside.link.profile.schedule import Schedule
from farside.node import Direction, to_ns

DATA = Path(__file__).parents[3] / "shared" / "data" / "links"
with_data = pytest.mark.skipif(not DATA.is_dir(), reason="needs ../shared/data")


def span(blackout: Blackout) -> tuple[float, float]:
    return blackout.start_s, blackout.end_s


def outages(plan: Plan, way: Affected, duration_s: int) -> list[tuple[float, float]]:
    """When one direction between ground 1 and rover 2 is out."""
    tables = link_tables(plan, ground=1, rover=2, duration_s=duration_s)
    return [span(blackout) for blackout in tables.blackouts if blackout.direction is way]


def both_ways(*contacts: tuple[int, int], rate: int = 1000) -> str:
    return "\n".join(
        f"a contact +{begin} +{end} {pair} {rate}"
        for begin, end in contacts
        for pair in ("1 2", "2 1")
    )


def test_the_uplink_goes_out_a_light_time_after_a_contact_and_the_downlink_at_once() -> None:
    plan = parse_ion(both_ways((100, 200), (300, 400)) + "\na range +0 +400 1 2 20", "plan")
    assert outages(plan, Affected.UP, 1000) == [(0, 120), (220, 320), (420, 1000)]
    assert outages(plan, Affected.DOWN, 1000) == [(0, 100), (200, 300), (400, 1000)]


@pytest.mark.parametrize("direction", Direction)
def test_a_frame_may_be_sent_when_the_contact_begins_and_not_after_it_ends(
    direction: Direction,
) -> None:
    plan = parse_ion(both_ways((100, 200), (300, 400)) + "\na range +0 +400 1 2 20", "plan")
    tables = link_tables(plan, 1, 2, 1000)
    schedule = Schedule(
        LinkConfig(
            up=OneWay(delay_table=tables.up.delay_table),
            down=OneWay(delay_table=tables.down.delay_table),
            blackouts=tables.blackouts,
        )
    )
    opens = [schedule.opens_ns(direction, to_ns(time_s)) for time_s in (0, 150, 199.9, 200, 350)]
    assert opens == [to_ns(time_s) for time_s in (100, 150, 199.9, 300, 350)]


def test_the_last_frame_of_a_contact_has_the_light_time_before_the_range_changes() -> None:
    plan = parse_ion(
        both_ways((100, 200), (200, 300)) + "\na range +0 +200 1 2 20\na range +200 +300 1 2 30",
        "plan",
    )
    assert outages(plan, Affected.UP, 1000) == [(0, 120), (220, 230), (330, 1000)]
    assert link_tables(plan, 1, 2, 1000).up.delay_table == (
        DelayPoint(t_s=0, delay_s=20),
        DelayPoint(t_s=200 - 1e-6, delay_s=20),
        DelayPoint(t_s=200, delay_s=30),
    )


def test_outside_ranges_the_light_time_is_the_last_known() -> None:
    plan = parse_ion(both_ways((0, 500)) + "\na range +10 +20 1 2 4\na range +50 +60 1 2 5", "plan")
    delays = link_tables(plan, 1, 2, 1000).down.delay_table
    assert [(point.t_s, point.delay_s) for point in delays] == [(0, 4), (50 - 1e-6, 4), (50, 5)]


def test_rates_change_when_contacts_begin() -> None:
    contacts = "".join(
        f"a contact +{begin} +{begin + 10} {pair} {rate}\n"
        for begin, rate in ((5, 10), (20, 10), (40, 30), (2000, 40))
        for pair in ("1 2", "2 1")
    )
    tables = link_tables(parse_ion(contacts + "a range +0 +9 1 2 1", "plan"), 1, 2, 1000)
    assert tables.up.rate_table == tables.down.rate_table
    assert tables.up.rate_table == (
        RateStep(t_s=0, rate_bit_s=80),
        RateStep(t_s=40, rate_bit_s=240),
    )


def test_of_entries_before_time_zero_only_those_still_in_force_count() -> None:
    text = "@ 2024/01/01-00:01:00\n@ 2024/01/01-00:00:00\n" + "".join(
        f"a contact +{begin} +{end} {pair} {rate}\n"
        for begin, end, rate in ((0, 10, 1), (20, 70, 2), (80, 90, 3))
        for pair in ("1 2", "2 1")
    )
    plan = parse_ion(text + "a range +0 +30 1 2 1\na range +30 +90 1 2 2", "plan")
    tables = link_tables(plan, 1, 2, 25)
    assert tables.down.delay_table == (DelayPoint(t_s=0, delay_s=2),)
    assert [(s.t_s, s.rate_bit_s) for s in tables.down.rate_table] == [(0, 16), (20, 24)]
    assert outages(plan, Affected.UP, 25) == [(12, 22)]


def test_for_nodes_without_contacts_the_error_lists_the_pairs_that_have_some() -> None:
    plan = parse_ion("a contact +0 +5 1 3 1\na contact +0 +5 3 2 1\na range +0 +5 1 3 1", "plan")
    with pytest.raises(ContactPlanError) as refusal:
        link_tables(plan, 1, 2, 100)
    assert str(refusal.value) == (
        "expected contacts from 1 to 2, without a relay between them, "
        "found those from 1 to 3, 3 to 2"
    )


@pytest.mark.parametrize(("ranges", "up_s", "down_s"), [("", 0, 0), ("a range +0 +9 2 1 4", 0, 4)])
def test_a_light_time_that_the_plan_does_not_tell_is_0(
    ranges: str, up_s: float, down_s: float
) -> None:
    """As both tools take it. In ION a range from a higher number says nothing of the way back."""
    tables = link_tables(parse_ion(f"{both_ways((7, 9))}\n{ranges}", "plan"), 1, 2, 100)
    assert tables.up.delay_table == (DelayPoint(t_s=0, delay_s=up_s),)
    assert tables.down.delay_table == (DelayPoint(t_s=0, delay_s=down_s),)


def test_a_direction_without_contacts_is_out_all_the_time() -> None:
    plan = parse_ion("a contact +0 +50 1 2 10\na range +0 +50 1 2 3", "plan")
    assert outages(plan, Affected.UP, 100) == [(0, 3), (53, 100)]
    assert outages(plan, Affected.DOWN, 100) == [(0, 100)]
    assert link_tables(plan, 1, 2, 100).down == WayTables((DelayPoint(t_s=0, delay_s=3),), ())


def test_an_unlimited_rate_is_no_cap() -> None:
    entry = '{"source": 1, "dest": 2, "startTime": %d, "endTime": %d, "rateBitsPerSec": %s}'
    free, capped = entry % (0, 10, 0), entry % (10, 20, 900)
    plan = parse_hdtn(f'{{"contacts": [{free}]}}', "plan")
    assert link_tables(plan, 1, 2, 100).up.rate_table == ()
    plan = parse_hdtn(f'{{"contacts": [{free}, {capped}]}}', "plan")
    rates = [step.rate_bit_s for step in link_tables(plan, 1, 2, 100).up.rate_table]
    assert rates == [UNLIMITED_BIT_S, 900]


@given(
    st.lists(st.integers(1, 50), min_size=2, max_size=20).filter(lambda n: len(n) % 2 == 0),
    st.lists(st.integers(0, 9), min_size=1, max_size=5),
    st.integers(0, 600),
)
def test_a_frame_reaches_the_rover_outside_outages_exactly_if_it_was_sent_in_a_contact(
    steps: Sequence[int], owlts: Sequence[int], sent: int
) -> None:
    """Ranges of 100 s that grow, as falling ones let frames of two contacts arrive at once."""
    times = [sum(steps[: n + 1]) for n in range(len(steps))]
    spans = list(zip(times[::2], times[1::2], strict=True))
    light = [sum(owlts[: n + 1]) for n in range(len(owlts))]
    ranges = "".join(
        f"a range +{100 * n} +{100 * n + 100} 1 2 {owlt}\n" for n, owlt in enumerate(light)
    )
    plan = parse_ion(f"{both_ways(*spans)}\n{ranges}", "plan")
    arrival = sent + light[min(sent // 100, len(light) - 1)]
    is_out = any(begin <= arrival < end for begin, end in outages(plan, Affected.UP, 10_000))
    assert is_out is not any(begin <= sent < end for begin, end in spans)


@given(st.lists(st.tuples(st.integers(-20, 120), st.integers(1, 30))), st.integers(1, 100))
def test_gaps_are_all_times_of_a_run_outside_the_spans(
    spans: Sequence[tuple[int, int]], duration: int
) -> None:
    closed = sorted((begin, begin + length) for begin, length in spans)
    found = list(gaps(closed, duration))
    assert all(begin < end for begin, end in found)
    for time in range(-25, 130):
        is_gap = any(begin <= time < end for begin, end in found)
        is_open = any(begin <= time < end for begin, end in closed)
        assert is_gap is (0 <= time < duration and not is_open)


# --- real plans


@with_data
def test_the_48_hour_mars_relay_plan_of_jpl_is_read_whole() -> None:
    text = (DATA / "ion_mars_relay_48h.ionrc").read_text("utf-8")
    plan = parse_ion(text, "ion_mars_relay_48h.ionrc")
    assert len(plan.contacts) == sum(line.startswith("a contact") for line in text.splitlines())
    assert len(plan.ranges) == 2 * 17
    assert {owlt.owlt_s for owlt in plan.ranges if {owlt.source, owlt.dest} & {2, 3, 4}} == {1, 324}
    # 24 cycles of two hours; the last contacts are those of orbiters 6 and 7 in the last half hour.
    assert plan.contacts[-1].end_s == 24 * 7200 - 1800 + 900


@with_data
def test_rover_9_of_jpl_hears_its_orbiter_20_s_after_the_contact_begins() -> None:
    text = (DATA / "ion_mars_relay_48h.ionrc").read_text("utf-8")
    tables = link_tables(parse_ion(text, "relay"), ground=5, rover=9, duration_s=48 * 3600)
    up = [span(one) for one in tables.blackouts if one.direction is Affected.UP]
    down = [span(one) for one in tables.blackouts if one.direction is Affected.DOWN]
    assert up[:3] == [(0, 20), (140, 1220), (1340, 7220)]
    assert down[:3] == [(120, 1200), (1320, 7200), (7320, 8400)]
    assert up[-1][1] == down[-1][1] == 48 * 3600
    assert tables.up.rate_table == (RateStep(t_s=0, rate_bit_s=8 * 16384),)
    assert tables.up.delay_table == (DelayPoint(t_s=0, delay_s=20),)


@with_data
def test_rover_9_of_jpl_has_no_direct_link_to_goldstone() -> None:
    text = (DATA / "ion_mars_relay_48h.ionrc").read_text("utf-8")
    with pytest.raises(ContactPlanError, match=r"from 2 to 9, without a relay .* 1 to 2, 1 to 3"):
        link_tables(parse_ion(text, "relay"), ground=2, rover=9, duration_s=3600)


@with_data
def test_the_tutorial_plan_of_hdtn_is_read_whole() -> None:
    plan = parse_hdtn((DATA / "hdtn_cgrTutorial.json").read_text("utf-8"), "hdtn_cgrTutorial.json")
    assert len(plan.contacts) == 16
    assert {contact.rate_bit_s for contact in plan.contacts} == {1_000_000}
    tables = link_tables(plan, ground=4, rover=5, duration_s=100)
    down = [span(one) for one in tables.blackouts if one.direction is Affected.DOWN]
    assert down[-1] == (60, 100)
