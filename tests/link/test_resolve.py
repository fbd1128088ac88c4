"""A link resolved to plain tables: files, passes and ephemerides."""

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import msgspec
import pytest

from farside.frames import OutageReason
from farside.link.profile.config import (
    Affected,
    AtEnd,
    LinkChange,
    LinkConfig,
    Trace,
)
from farside.link.profile.impairments import GilbertElliott, LossModel
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.plans.times import Window
from farside.link.profile.resolve import resolve_link
from farside.link.profile.schedule import outages_of
from farside.node import Direction, to_ns

DAY_S = 86400.0
NEAR: dict[str, Any] = {"up": {"delay_s": 1.0}, "down": {"delay_s": 1.0}}
PLAN = """
a range +0 +100 1 2 20
a contact +10 +50 1 2 125
a contact +10 +50 2 1 250
"""


def resolved(folder: Path, duration_s: float = 100.0, **tables: Any) -> LinkConfig:
    """The link that these tables make, resolved."""
    config = msgspec.convert(tables, LinkConfig)
    return resolve_link(config, folder=folder, window=Window.of(duration_s))


def refusal_of(folder: Path, duration_s: float = 100.0, **tables: Any) -> str:
    """The message with which these tables are refused."""
    with pytest.raises(LinkConfigError) as refusal:
        resolved(folder, duration_s, **tables)
    return str(refusal.value)


def outages(link: LinkConfig, direction: Direction) -> list[tuple[float, float, OutageReason]]:
    return [
        (one.start_s, one.end_s, one.reason)
        for one in link.blackouts
        if one.direction.includes(direction)
    ]


# --- files


def test_a_trace_is_read_relative_to_the_file_that_names_it(tmp_path: Path) -> None:
    (tmp_path / "lte.trace").write_text("0\n4\n4\n")
    trace = {"file": "lte.trace", "at_end": "end"}
    link = resolved(tmp_path, up={"delay_s": 1, "rate_trace": trace}, down={"delay_s": 1})
    assert link.up.rate_trace == Trace(times_ms=(0, 4, 4), at_end=AtEnd.END)


@pytest.mark.parametrize(
    ("trace", "words"),
    [
        ({"file": "no.trace"}, "up.rate_trace.file: expected a file, found: "),
        ({"file": "\0"}, "up.rate_trace.file: expected a path, found one"),
        ({"file": "."}, "expected a regular file, found a folder"),
        ({"file": "bad.trace"}, "bad.trace, line 2: expected a whole number of milliseconds"),
        (
            {"file": "raw.trace"},
            "up.rate_trace.file: expected text in UTF-8, found byte 0xff in",
        ),
        ({}, "up.rate_trace: expected either file or times_ms, found neither"),
        (
            {"file": "bad.trace", "times_ms": [1]},
            "up.rate_trace: expected either file or times_ms, found both",
        ),
    ],
)
def test_a_trace_that_cannot_be_read_is_refused_with_its_key(
    tmp_path: Path, trace: Mapping[str, str | Sequence[int]], words: str
) -> None:
    (tmp_path / "bad.trace").write_text("0\nx\n")
    (tmp_path / "raw.trace").write_bytes(b"0\n\xff\n")
    up = {"delay_s": 1, "rate_trace": trace}
    assert words in refusal_of(tmp_path, up=up, down={"delay_s": 1})


def test_a_contact_plan_gives_delays_rates_and_outages(tmp_path: Path) -> None:
    (tmp_path / "relay.ionrc").write_text(PLAN)
    contacts = {"file": "relay.ionrc", "ground": 1, "rover": 2}
    link = resolved(tmp_path, contacts=contacts, blackouts=[{"start_s": 20, "end_s": 30}])
    assert link.contacts is None
    assert (link.up.least_delay_ns, link.down.least_delay_ns) == (to_ns(20), to_ns(20))
    assert [step.rate_bit_s for step in (*link.up.rate_table, *link.down.rate_table)] == [
        1000,
        2000,
    ]
    given, contact = OutageReason.BLACKOUT, OutageReason.CONTACT
    assert outages(link, Direction.UP) == [(20, 30, given), (0, 30, contact), (70, 100, contact)]
    assert outages(link, Direction.DOWN) == [(20, 30, given), (0, 10, contact), (50, 100, contact)]


def test_a_plan_whose_name_ends_in_json_is_one_of_hdtn(tmp_path: Path) -> None:
    (tmp_path / "relay.JSON").write_text(PLAN)
    contacts = {"file": "relay.JSON", "ground": 1, "rover": 2}
    words = refusal_of(tmp_path, contacts=contacts)
    assert words.startswith("contacts.file: ")
    assert "relay.JSON, line 2: expected JSON, found the commands of an ION" in words


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"contacts": {"file": "no", "ground": 1, "rover": 2}}, "contacts.file: expected a file"),
        (
            {"contacts": {"file": "relay", "ground": 1, "rover": 3}},
            "relay: expected contacts between 1 and 3",
        ),
        (
            {"contacts": {"file": "relay", "ground": 1, "rover": 2}, "up": {"rate_bit_s": 9}},
            "up.rate_bit_s: expected the rate from contacts or from rate_bit_s, found both",
        ),
    ],
)
def test_a_plan_that_does_not_fit_the_link_is_refused_with_its_key(
    tmp_path: Path, tables: dict[str, Any], words: str
) -> None:
    (tmp_path / "relay").write_text(PLAN)
    assert words in refusal_of(tmp_path, **tables)


# --- one delay for each direction


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        (
            {"down": {"delay_s": 1}},
            "up: expected one of delay_s, delay_table, delay_trace, ",
        ),
        (
            {"up": {"delay_s": 0}},
            "down: expected one of delay_s, delay_table, delay_trace, ",
        ),
        (
            NEAR | {"ephemeris": {"body": "mars", "epoch": "2021-02-18"}},
            (
                "up: expected one of delay_s, delay_table, delay_trace, ephemeris and contacts, "
                "found up.delay_s and ephemeris"
            ),
        ),
    ],
)
def test_each_direction_has_one_delay(tmp_path: Path, tables: dict[str, Any], words: str) -> None:
    assert words in refusal_of(tmp_path, **tables)


def test_a_link_of_plain_tables_is_left_as_it_is(tmp_path: Path) -> None:
    link = resolved(tmp_path, **NEAR, seed=3, blackouts=[{"start_s": 1, "end_s": 2}])
    assert link == msgspec.convert(
        NEAR | {"seed": 3, "blackouts": [{"start_s": 1, "end_s": 2}]}, LinkConfig
    )


def test_a_preset_not_yet_merged_is_refused(tmp_path: Path) -> None:
    words = refusal_of(tmp_path, preset="moon", **NEAR)
    assert words == 'preset: expected none left to read, found "moon"'


# --- passes


def test_between_passes_the_link_is_out(tmp_path: Path) -> None:
    passes = {"first_s": 5, "length_s": 10, "period_s": 40, "direction": "down"}
    link = resolved(tmp_path, **NEAR, passes=passes)
    assert link.passes is None
    assert outages(link, Direction.UP) == []
    assert [(start_s, end_s) for start_s, end_s, _ in outages(link, Direction.DOWN)] == [
        (0, 5),
        (15, 45),
        (55, 85),
        (95, 100),
    ]
    assert {reason for *_, reason in outages(link, Direction.DOWN)} == {OutageReason.PASS}


def test_a_run_that_ends_before_the_first_pass_is_out_all_the_time(tmp_path: Path) -> None:
    link = resolved(tmp_path, **NEAR, passes={"first_s": 500, "length_s": 10, "period_s": 40})
    assert outages(link, Direction.UP) == [(0, 100, OutageReason.PASS)]


def test_more_passes_than_any_mission_has_are_refused(tmp_path: Path) -> None:
    passes = {"length_s": 1e-6, "period_s": 1e-3}
    words = refusal_of(tmp_path, 2000.0, **NEAR, passes=passes)
    assert words == "passes.period_s: expected 1000000 passes at most in 2000 s, found 2000000"


# --- ephemeris


@pytest.fixture
def mars() -> dict[str, float | str]:
    """Thirty days about the conjunction of August 2019; out from 27 August to 7 September."""
    pytest.importorskip("astropy")
    return {"body": "mars", "epoch": "2019-08-20T00:00:00Z", "conjunction_deg": 2.2}


def test_an_ephemeris_gives_both_delays(tmp_path: Path, mars: dict[str, float | str]) -> None:
    ephemeris = mars | {"epoch": "2019-08-28T00:00:00Z", "conjunction_deg": 0}
    link = resolved(tmp_path, 3600.0, ephemeris=ephemeris)
    assert link.ephemeris is None
    assert link.up.delay_table[0].delay_s == pytest.approx(1335, abs=0.1)
    assert link.down.delay_table[0].delay_s == pytest.approx(1335, abs=0.1)
    assert (link.blackouts, link.changes) == ((), ())


def test_at_conjunction_the_uplink_is_out_and_the_downlink_loses_more(
    tmp_path: Path, mars: dict[str, float | str]
) -> None:
    link = resolved(tmp_path, 30 * DAY_S, ephemeris=mars, down={"loss": 0.01})
    (outage,) = link.blackouts
    begin = datetime(2019, 8, 20, tzinfo=UTC) + timedelta(seconds=outage.start_s)
    assert (begin.month, begin.day) in {(8, 27), (8, 28)}
    assert (outage.direction, outage.reason) == (Affected.UP, OutageReason.CONJUNCTION)
    assert outages_of(link, Direction.DOWN) == ()
    assert link.changes == (
        LinkChange(at_s=outage.start_s, direction=Affected.DOWN, loss=0.5),
        LinkChange(at_s=outage.end_s, direction=Affected.DOWN, loss=0.01),
    )


def loss_at(link: LinkConfig, time_s: float, direction: Direction) -> LossModel:
    """The loss in force once the changes up to a time have taken place."""
    one_way = link.way(direction)
    for change in link.changes:
        if change.at_s <= time_s and change.direction.includes(direction):
            one_way = change.applied_to(one_way)
    return one_way.loss


def test_other_changes_go_on_through_a_conjunction(
    tmp_path: Path, mars: dict[str, float | str]
) -> None:
    burst = {"model": "gilbert-elliott", "p": 0.9, "r": 0.1}
    changes = [
        {"at_s": 12 * DAY_S, "loss": 0.2},
        {"at_s": 1 * DAY_S, "direction": "down", "loss": 0.1},
        {"at_s": 10 * DAY_S, "loss": burst},
        {"at_s": 13 * DAY_S, "direction": "up", "loss": 0.3},
        {"at_s": 13 * DAY_S, "rate_bit_s": 7},
    ]
    link = resolved(tmp_path, 30 * DAY_S, ephemeris=mars, changes=changes)
    worst = GilbertElliott(p=0.9, r=0.1)
    days = [0, 2, 9, 11, 12.5, 14, 29]
    down = [loss_at(link, day * DAY_S, Direction.DOWN) for day in days]
    assert down == [0.0, 0.1, 0.5, worst, 0.5, 0.5, 0.2]
    up = [loss_at(link, day * DAY_S, Direction.UP) for day in days]
    assert up == [0.0, 0.0, 0.0, worst, 0.2, 0.3, 0.3]


def test_a_downlink_that_already_loses_more_stays_so_at_conjunction(
    tmp_path: Path, mars: dict[str, float | str]
) -> None:
    link = resolved(tmp_path, 30 * DAY_S, ephemeris=mars, down={"loss": 0.9})
    assert {loss_at(link, day * DAY_S, Direction.DOWN) for day in range(30)} == {0.9}


def test_an_ephemeris_of_an_unknown_body_is_refused_with_its_key(tmp_path: Path) -> None:
    words = refusal_of(tmp_path, ephemeris={"body": "marz", "epoch": "2021-02-18"})
    assert words.startswith("ephemeris: ")
    assert "mars" in words
