"""From what is written of a link to plain tables: presets, files, passes and ephemerides."""

from datetime import UTC, datetime, timedelta

import msgspec
import pytest

from farside.link.profile import resolve
from farside.link.profile.config import (
    Affected,
    AtEnd,
    LinkChange,
    LinkConfig,
    OutageReason,
    Trace,
)
from farside.link.profile.impairments import GilbertElliott
from farside.link.profile.resolve import (
    LinkConfigError,
    load_profile,
    merged,
    preset_names,
    resolve_link,
    with_preset,
)
from farside.link.profile.schedule import outages_of
from farside.node import Direction, to_ns

DAY_S = 86400.0
NEAR = {"up": {"delay_s": 1.0}, "down": {"delay_s": 1.0}}
PLAN = """
a range +0 +100 1 2 20
a contact +10 +50 1 2 125
a contact +10 +50 2 1 250
"""


def resolved(folder, duration_s=100.0, **tables):
    """The link that these tables make, resolved."""
    config = msgspec.convert(tables, LinkConfig)
    return resolve_link(config, folder=folder, duration_s=duration_s)


def refusal_of(folder, duration_s=100.0, **tables):
    """In which words these tables are refused."""
    with pytest.raises(LinkConfigError) as refusal:
        resolved(folder, duration_s, **tables)
    return str(refusal.value)


def outages(link, direction):
    return [
        (one.start_s, one.end_s, one.reason)
        for one in link.blackouts
        if one.direction.includes(direction)
    ]


@pytest.fixture
def presets(tmp_path, monkeypatch):
    """A folder whose TOML files are the presets, in place of those that come with Farside."""
    folder = tmp_path / "presets"
    folder.mkdir()
    found = {}
    monkeypatch.setattr(resolve, "_presets", lambda: found)

    def add(name, text):
        found[name] = folder / f"{name}.toml"
        found[name].write_text(text)

    return add


# --- files


def test_a_trace_is_read_beside_the_file_that_names_it(tmp_path):
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
def test_a_trace_that_cannot_be_read_is_told_by_its_key(tmp_path, trace, words):
    (tmp_path / "bad.trace").write_text("0\nx\n")
    (tmp_path / "raw.trace").write_bytes(b"0\n\xff\n")
    up = {"delay_s": 1, "rate_trace": trace}
    assert words in refusal_of(tmp_path, up=up, down={"delay_s": 1})


def test_a_contact_plan_gives_delays_rates_and_outages(tmp_path):
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


def test_a_plan_whose_name_ends_in_json_is_one_of_hdtn(tmp_path):
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
            "relay: expected contacts from 1 to 3",
        ),
        (
            {"contacts": {"file": "relay", "ground": 1, "rover": 2}, "up": {"rate_bit_s": 9}},
            "up.rate_bit_s: expected the rate from contacts or from rate_bit_s, found both",
        ),
    ],
)
def test_a_plan_that_does_not_fit_the_link_is_told_by_its_key(tmp_path, tables, words):
    (tmp_path / "relay").write_text(PLAN)
    assert words in refusal_of(tmp_path, **tables)


# --- one delay for each direction


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"down": {"delay_s": 1}}, "up: expected one of delay_s, delay_table, ephemeris and "),
        ({"up": {"delay_s": 0}}, "down: expected one of delay_s, delay_table, ephemeris and "),
        (
            NEAR | {"ephemeris": {"body": "mars", "epoch": "2021-02-18"}},
            (
                "up: expected one of delay_s, delay_table, ephemeris and contacts, "
                "found up.delay_s and ephemeris"
            ),
        ),
        (
            {
                "contacts": {"file": "relay", "ground": 1, "rover": 2},
                "ephemeris": {"body": "mars", "epoch": "2021-02-18"},
            },
            "found ephemeris and contacts",
        ),
    ],
)
def test_each_direction_has_one_delay(tmp_path, tables, words):
    assert words in refusal_of(tmp_path, **tables)


def test_a_link_of_plain_tables_stays_as_it_is(tmp_path):
    link = resolved(tmp_path, **NEAR, seed=3, blackouts=[{"start_s": 1, "end_s": 2}])
    assert link == msgspec.convert(
        NEAR | {"seed": 3, "blackouts": [{"start_s": 1, "end_s": 2}]}, LinkConfig
    )


def test_a_preset_that_nobody_put_in_is_refused(tmp_path):
    words = refusal_of(tmp_path, preset="moon", **NEAR)
    assert words == 'preset: expected none left to read, found "moon"'


# --- passes


def test_between_passes_the_link_is_out(tmp_path):
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


def test_a_run_that_ends_before_the_first_pass_is_out_all_the_time(tmp_path):
    link = resolved(tmp_path, **NEAR, passes={"first_s": 500, "length_s": 10, "period_s": 40})
    assert outages(link, Direction.UP) == [(0, 100, OutageReason.PASS)]


def test_more_passes_than_any_mission_has_are_refused(tmp_path):
    passes = {"length_s": 1e-6, "period_s": 1e-5}
    words = refusal_of(tmp_path, **NEAR, passes=passes)
    assert words == "passes.period_s: expected 100000 passes at most in 100 s, found 10000000"


# --- ephemeris


@pytest.fixture
def mars():
    """Thirty days about the conjunction of August 2019; out from 27 August to 7 September."""
    pytest.importorskip("astropy")
    return {"body": "mars", "epoch": "2019-08-20T00:00:00Z", "conjunction_deg": 2.2}


def test_an_ephemeris_gives_both_delays(tmp_path, mars):
    ephemeris = mars | {"epoch": "2019-08-28T00:00:00Z", "conjunction_deg": 0}
    link = resolved(tmp_path, 3600.0, ephemeris=ephemeris)
    assert link.ephemeris is None
    assert link.up.delay_table[0].delay_s == pytest.approx(1335, abs=0.1)
    assert link.down.delay_table[0].delay_s == pytest.approx(1335, abs=0.1)
    assert (link.blackouts, link.changes) == ((), ())


def test_at_conjunction_commands_are_out_and_the_downlink_is_worse(tmp_path, mars):
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


def loss_at(link, time_s, direction):
    """The loss in force once the changes up to a time have taken place."""
    one_way = link.way(direction)
    for change in link.changes:
        if change.at_s <= time_s and change.direction.includes(direction):
            one_way = change.applied_to(one_way)
    return one_way.loss


def test_other_changes_go_on_through_a_conjunction(tmp_path, mars):
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


def test_a_downlink_that_is_worse_anyway_stays_so_at_conjunction(tmp_path, mars):
    link = resolved(tmp_path, 30 * DAY_S, ephemeris=mars, down={"loss": 0.9})
    assert {loss_at(link, day * DAY_S, Direction.DOWN) for day in range(30)} == {0.9}


def test_an_ephemeris_of_no_body_is_told_by_its_key(tmp_path):
    words = refusal_of(tmp_path, ephemeris={"body": "marz", "epoch": "2021-02-18"})
    assert words.startswith("ephemeris: ")
    assert "mars" in words


# --- presets and profiles


def test_tables_merge_key_by_key_and_arrays_as_a_whole():
    assert merged(
        {"up": {"a": 1, "b": 2}, "list": [1, 2], "c": 3}, {"up": {"b": 4}, "list": [5], "d": 6}
    ) == {"up": {"a": 1, "b": 4}, "list": [5], "c": 3, "d": 6}


def test_models_of_different_kinds_are_not_mixed():
    below = {"loss": {"model": "four-state", "p13": 0.1}}
    assert merged(below, {"loss": {"model": "gilbert-elliott", "p": 0.2}})["loss"] == {
        "model": "gilbert-elliott",
        "p": 0.2,
    }
    assert merged(below, {"loss": {"p13": 0.3}})["loss"] == {"model": "four-state", "p13": 0.3}
    assert merged(below, {"loss": 0.1})["loss"] == 0.1


def test_a_table_wins_over_the_preset_it_names(presets):
    presets("tin", "seed = 1\n[up]\ndelay_s = 1\nrate_bit_s = 8\n[down]\ndelay_s = 1")
    assert with_preset({"preset": "tin", "up": {"delay_s": 2}}) == {
        "seed": 1,
        "up": {"delay_s": 2, "rate_bit_s": 8},
        "down": {"delay_s": 1},
    }


@pytest.mark.parametrize(
    ("own", "expected"),
    [
        ({"up": {"delay_table": []}}, {"up": {"rate_bit_s": 8, "loss": 0.1, "delay_table": []}}),
        ({"up": {"rate_trace": {}}}, {"up": {"delay_s": 1, "loss": 0.1, "rate_trace": {}}}),
        ({"ephemeris": {}}, {"up": {"rate_bit_s": 8, "loss": 0.1}, "ephemeris": {}}),
        ({"contacts": {}}, {"up": {"loss": 0.1}, "contacts": {}}),
        ({"up": 3}, {"up": 3}),
    ],
)
def test_what_is_said_in_another_way_replaces_what_the_preset_says(presets, own, expected):
    presets("tin", "[up]\ndelay_s = 1\nrate_bit_s = 8\nloss = 0.1")
    assert with_preset({"preset": "tin", **own}) == {"down": {}} | expected


@pytest.mark.parametrize(
    ("own", "is_left"),
    [
        ({"ephemeris": {"epoch": "2022-01-01"}}, True),
        ({"up": {"loss": 0.1}}, True),
        ({"up": {"delay_s": 1}}, False),
        ({"contacts": {}}, False),
    ],
)
def test_the_ephemeris_of_a_preset_goes_where_other_delays_come(presets, own, is_left):
    presets("far", '[ephemeris]\nbody = "mars"\nepoch = "2021-02-18"')
    table = with_preset({"preset": "far", **own})
    assert ("ephemeris" in table) is is_left
    if "ephemeris" in own:
        assert table["ephemeris"] == {"body": "mars", "epoch": "2022-01-01"}


def test_a_table_without_a_preset_is_left_to_the_schema():
    assert with_preset({"up": 3}) == {"up": 3}
    assert with_preset({"preset": 3}) == {"preset": 3}


def test_an_unknown_preset_is_told_with_the_known_ones(presets):
    presets("moon", "")
    presets("tether", "")
    with pytest.raises(LinkConfigError) as refusal:
        with_preset({"preset": "Mooon"})
    assert str(refusal.value) == (
        'preset: expected the name of a preset (moon, tether), found "Mooon"; did you mean moon?'
    )


def test_a_profile_is_a_file_with_the_link_at_its_top(tmp_path, presets):
    presets("tin", "[up]\ndelay_s = 1\n[down]\ndelay_s = 1")
    (tmp_path / "up.trace").write_text("7\n")
    profile = tmp_path / "mine.toml"
    profile.write_text('preset = "tin"\n[up]\nrate_trace = {file = "up.trace"}\n')
    link = load_profile(profile, 10.0)
    assert (link.preset, link.up.delay_s) == (None, 1)
    assert link.up.rate_trace == Trace(times_ms=(7,))


def test_a_profile_may_be_the_name_of_a_preset_but_a_file_comes_first(
    tmp_path, monkeypatch, presets
):
    presets("tin", "[up]\ndelay_s = 1\n[down]\ndelay_s = 1")
    monkeypatch.chdir(tmp_path)
    assert load_profile("tin", 10.0).up.delay_s == 1
    (tmp_path / "tin").write_text("[up]\ndelay_s = 2\n[down]\ndelay_s = 2")
    assert load_profile("tin", 10.0).up.delay_s == 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("up = ", ": expected TOML, found: "),
        ("[up]\ndelays = 3\nloss = 7", ": up.delays: expected one of the keys delay_s, "),
        ("[up]\ndelays = 3\nloss = 7", ": up.loss: expected "),
        ("[up]\ndelay_s = 3", ": down: expected one of delay_s, delay_table, ephemeris and"),
        ('preset = "ton"', ": preset: expected the name of a preset (tin), found "),
        ("preset = 3", ": preset: expected "),
    ],
)
def test_a_bad_profile_is_refused_by_file_and_key(tmp_path, presets, text, words):
    presets("tin", "")
    profile = tmp_path / "mine.toml"
    profile.write_text(text)
    with pytest.raises(LinkConfigError) as refusal:
        load_profile(profile, 10.0)
    assert all(line.startswith(str(profile)) for line in str(refusal.value).splitlines())
    assert words in str(refusal.value)


@pytest.mark.parametrize("source", ["mooon", "no/such.toml", "x" * 5000, "\0", "."])
def test_a_profile_that_is_not_there_is_refused(presets, source):
    presets("moon", "")
    with pytest.raises(LinkConfigError) as refusal:
        load_profile(source, 10.0)
    assert ("did you mean moon?" in str(refusal.value)) is (source == "mooon")


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_that_comes_with_farside_is_a_link(name):
    pytest.importorskip("astropy")
    link = load_profile(name, DAY_S)
    assert link.ephemeris is None
    for direction in Direction:
        assert link.way(direction).delay_s is not None or link.way(direction).delay_table
