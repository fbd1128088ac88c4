"""One door: what a link is told by a file, a preset, `--set`, a mission or the control query."""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from farside.link.emulator.control import read_change
from farside.link.profile.config import LinkConfig, OneWay
from farside.link.profile.ephemeris import Ephemeris
from farside.link.profile.impairments import Jitter
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.plans.times import Window
from farside.link.profile.profile import Profile
from farside.missions.assignments import as_layer, read_assignments
from farside.missions.loading import MissionError, load_mission
from farside.node import to_ns

BELOW = {"preset": "earth-geo", "down": {"lifetime_s": 9}}
"""What is said before; the preset has a jitter down, and rates and delays both ways."""

DURATION_S = 600.0
PLAN = "a range +0 +600 1 2 20\na contact +10 +50 1 2 125\na contact +10 +50 2 1 250\n"
BURSTS = {"model": "gilbert-elliott", "p": 0.1, "r": 0.3}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """With a contact plan and a trace in it."""
    (tmp_path / "relay.rc").write_text(PLAN)
    (tmp_path / "lte.trace").write_text("0\n4\n9\n")
    return tmp_path


def toml(table: Mapping[str, Any]) -> str:
    return "\n".join(f"{key} = {inline(value)}" for key, value in table.items())


def inline(value: object) -> str:
    match value:
        case dict():
            return "{" + ", ".join(f"{key} = {inline(one)}" for key, one in value.items()) + "}"
        case list():
            return "[" + ", ".join(map(inline, value)) + "]"
        case _:
            return json.dumps(value)


def by_file(folder: Path, said: Mapping[str, Any]) -> LinkConfig:
    """What a profile says over its preset."""
    table = {**said, "down": {"lifetime_s": 9, **said.get("down", {})}}
    path = folder / "own.toml"
    path.write_text(toml({"preset": "earth-geo", **table}))
    return Profile.read(path).resolved(Window.of(DURATION_S))


def by_set(folder: Path, said: Mapping[str, Any]) -> LinkConfig:
    link = Profile(BELOW, folder)
    for assignment in read_assignments(dict(leaves(said))):
        link = link.changed(as_layer(assignment, link.table))
    return link.resolved(Window.of(DURATION_S))


def by_control(folder: Path, said: Mapping[str, Any]) -> LinkConfig:
    change = read_change(json.dumps(said).encode())
    return Profile(BELOW, folder).changed(change.layer).resolved(Window.of(DURATION_S))


def by_mission(folder: Path, said: Mapping[str, Any]) -> LinkConfig:
    table = {**said, "down": {"lifetime_s": 9, **said.get("down", {})}}
    return mission_link(folder, {"preset": "earth-geo", **table}, {})


def by_set_in_a_mission(folder: Path, said: Mapping[str, Any]) -> LinkConfig:
    return mission_link(folder, BELOW, {f"link.{key}": value for key, value in leaves(said)})


DOORS = [by_file, by_set, by_control, by_mission, by_set_in_a_mission]


def leaves(table: Mapping[str, Any], *path: str) -> Iterator[tuple[str, Any]]:
    """The values in a table by dotted key."""
    for key, value in table.items():
        if isinstance(value, dict):
            yield from leaves(value, *path, key)
        else:
            yield ".".join((*path, key)), value


def mission_link(folder: Path, link: Mapping[str, Any], made: Mapping[str, Any]) -> LinkConfig:
    path = folder / "yard.toml"
    mission = {
        "name": "yard",
        "duration_s": DURATION_S,
        "world": {"map": "####\n#..#\n####\n"},
        "rover": {"start": "1,1"},
        "link": link,
    }
    path.write_text(toml(mission))
    try:
        return load_mission(path, made).mission.link
    except MissionError as error:
        lines = [line.partition(" (with ")[0] for line in str(error).splitlines()]
        words = "\n".join(line.replace(f"{path}: link.", "") for line in lines)
        raise ValueError(words) from error


@pytest.mark.parametrize("door", DOORS[1:])
@pytest.mark.parametrize(
    "said",
    [
        {"down": {"loss": 0.25, "duplicate": 1}},
        {"down": {"loss": BURSTS}},
        {"down": {"jitter": {"correlation": 0.5}}},
        {"up": {"jitter": {"spread_s": 0.1}}},
        {"down": {"delay_table": [{"t_s": 0, "delay_s": 1}, {"t_s": 9, "delay_s": 2}]}},
        {"down": {"rate_table": [{"t_s": 0, "rate_bit_s": 5}]}},
        {"down": {"rate_trace": {"file": "lte.trace"}}},
        {"down": {"rate_trace": {"times_ms": [0, 4, 9], "at_end": "end"}}},
        {"passes": {"length_s": 10, "period_s": 40}},
        {"contacts": {"file": "relay.rc", "ground": 1, "rover": 2}},
        {"blackouts": [{"start_s": 1, "end_s": 2, "direction": "up"}]},
        {"changes": [{"at_s": 5, "rate_bit_s": 7}]},
        {"ephemeris": {"body": "moon", "epoch": "2026-01-01"}},
        {"mtu_byte": 200, "store_byte": 7, "seed": 5},
    ],
    ids=str,
)
def test_a_link_is_the_same_whichever_way_it_is_told(
    folder: Path, door: Any, said: dict[str, Any]
) -> None:
    if "ephemeris" in said:
        pytest.importorskip("astropy")
    link = by_file(folder, said)
    assert link != by_file(folder, {})
    assert door(folder, said) == link


@pytest.mark.parametrize("door", DOORS[1:])
@pytest.mark.parametrize(
    ("said", "words"),
    [
        ({"preset": "moom"}, "preset: expected the name of a preset ("),
        ({"down": {"loss": 2}}, "down.loss: expected a number >= 0 and <= 1, found 2"),
        ({"down": {"lost": 1}}, "down.lost: expected one of the keys delay_s, "),
        ({"left": {"loss": 1}}, "left: expected one of the keys up, down, "),
        ({"up": 3}, "up: expected a table, found 3"),
        ({"down": {"loss": {"model": "gilbert", "p": 1}}}, "down.loss.model: expected one of "),
        (
            {"down": {"rate_trace": {"file": "no.trace"}}},
            "down.rate_trace.file: expected a file, found: ",
        ),
        (
            {"down": {"rate_trace": {"times_ms": [9, 4, 12]}}},
            (
                "down.rate_trace: times_ms: expected times that do not fall, "
                "found 4 at index 1, after 9 and before 12"
            ),
        ),
        (
            {"down": {"rate_trace": {"times_ms": [0, 0]}}},
            "down.rate_trace: times_ms: expected a last time above 0 ms, found 0",
        ),
        ({"down": {"rate_trace": {"at_end": "end"}}}, "expected either file or times_ms, found ne"),
        (
            {"down": {"delay_s": 1, "delay_table": [{"t_s": 0, "delay_s": 1}]}},
            "expected one of del",
        ),
        (
            {"down": {"rate_bit_s": 10**30}},
            "expected a whole number >= 1 and <= 9.22337e+18, found",
        ),
        ({"down": {"overhead_byte": 10**9}}, "expected a whole number >= 0 and <= 65535, found"),
        ({"up": {"delay_s": 1e300}}, "up.delay_s: expected a number >= 0 and <= 1e+09, found 1e+3"),
        ({"up": {"jitter": {"spread_s": 1, "correlation": 1}}}, "a number > -1 and < 1, found 1"),
        ({"up": {"lifetime_s": 1e300}}, "lifetime_s: expected a number > 0 and <= 1e+09, found 1e"),
        (
            {"up": {"jitter": {"spread_s": 1e300}}},
            "up.jitter.spread_s: expected a number > 0 and <",
        ),
        (
            {"up": {"reorder": {"share": 1, "hold_s": 1e300}}},
            "up.reorder.hold_s: expected a number",
        ),
        (
            {"up": {"delay_table": [{"t_s": 0, "delay_s": 1e300}]}},
            "up.delay_table.0.delay_s: expected a number >= 0 and <= 1e+09, found 1e+300",
        ),
        (
            {"up": {"delay_table": [{"t_s": 1e300, "delay_s": 1}]}},
            "up.delay_table.0.t_s: expected a number >= 0 and <= 1e+09, found 1e+300",
        ),
        ({"blackouts": [{"start_s": 9, "end_s": 1}]}, "blackouts.0: expected a blackout that ends"),
        ({"passes": {"length_s": 1e-6, "period_s": 1e-5}}, "period_s: expected a number >= 0.001"),
        (
            {"contacts": {"file": "relay.rc", "ground": 1, "rover": 3}},
            "expected contacts between 1 and 3, ",
        ),
        ({"ephemeris": {"body": "marz", "epoch": "2026-01-01"}}, "ephemeris"),
    ],
    ids=str,
)
def test_a_link_is_refused_in_the_same_words_whichever_way_it_is_told(
    folder: Path, door: Any, said: dict[str, Any], words: str
) -> None:
    """`--set` sets one key after another, so the last of two alternatives stands."""
    if door in {by_set, by_set_in_a_mission} and "delay_table" in said.get("down", {}):
        return
    refusals = []
    for each in (by_file, door):
        with pytest.raises(ValueError, match=r"\w") as refusal:
            each(folder, said)
        refusals.append(str(refusal.value).replace(f"{folder / 'own.toml'}: ", ""))
    assert words in refusals[0]
    assert refusals[1] == refusals[0]


def test_what_is_said_later_replaces_the_alternatives_to_it() -> None:
    table = [{"t_s": 0, "delay_s": 3}]
    link = Profile({"preset": "moon", "ephemeris": {"body": "mars", "epoch": "2026-01-01"}})
    link = link.changed({"up": {"delay_s": 1}, "down": {"delay_table": table}})
    assert [link.resolved(Window.of(9)).up.delay_s, link.resolved(Window.of(9)).down.delay_s] == [
        1,
        None,
    ]
    link = link.changed({"down": {"delay_s": 2, "rate_bit_s": 3}})
    link = link.changed(
        {"down": {"rate_table": [{"t_s": 0, "rate_bit_s": 5}], "delay_table": None}}
    )
    down = link.resolved(Window.of(9)).down
    assert (down.delay_s, down.delay_table, down.rate_bit_s) == (2, (), None)


def test_what_is_removed_stays_so_whatever_the_preset_has() -> None:
    link = Profile({"preset": "earth-geo"}).changed({"down": {"jitter": None, "loss": None}})
    assert link.resolved(Window.of(9)).down.jitter is None
    link = link.changed({"down": {"jitter": {"spread_s": 1}}})
    assert link.resolved(Window.of(9)).down == link.changed({}).resolved(Window.of(9)).down
    assert link.resolved(Window.of(9)).down.jitter == Jitter(spread_s=1)
    with pytest.raises(
        LinkConfigError, match=r"spread_s: expected a number > 0, found no such key"
    ):
        link.changed({"down": {"jitter": None}}).changed(
            {"down": {"jitter": {"correlation": 0.5}}}
        ).resolved(Window.of(9))


def test_a_table_of_another_model_does_not_mix_with_what_was_before() -> None:
    link = Profile({"down": {"delay_s": 0, "loss": BURSTS}, "up": {"delay_s": 0}})
    link = link.changed({"down": {"loss": 0.5}}).changed({"down": {"loss": BURSTS | {"p": 0.2}}})
    link = link.changed({"down": {"loss": {"model": "four-state", "p13": 0.1}}})
    with pytest.raises(LinkConfigError, match=r"loss\.r: expected a number .*found no such key"):
        link.changed({"down": {"loss": {"model": "gilbert-elliott", "p": 0.1}}}).resolved(
            Window.of(9)
        )


def test_another_preset_leaves_what_was_said_of_its_own() -> None:
    link = Profile({"preset": "earth-geo", "down": {"loss": 0.5}}).changed({"preset": "perfect"})
    resolved = link.resolved(Window.of(9))
    assert (resolved.up, resolved.down) == (OneWay(delay_s=0.0), OneWay(delay_s=0.0, loss=0.5))


def test_what_is_said_now_goes_before_the_changes_that_have_taken_place() -> None:
    """Those to come take place; of those before, what is not said anew stays."""
    changes = [
        {"at_s": 30, "loss": 0.3},
        {"at_s": 10, "loss": 0.1, "corrupt": 0.1},
        {"at_s": 20, "direction": "down", "rate_bit_s": 800, "corrupt": 0.2},
    ]
    way = {"delay_s": 0, "rate_table": [{"t_s": 0, "rate_bit_s": 5}]}
    link = Profile({"up": way, "down": way, "changes": changes})
    said = {"up": {"loss": 0.9}, "down": {"rate_table": [{"t_s": 0, "rate_bit_s": 7}]}}
    later = link.changed(said, now_ns=to_ns(25)).resolved(Window.of(60))
    assert [
        (one.at_s, str(one.direction), one.loss, one.corrupt, one.rate_bit_s)
        for one in later.changes
    ] == [
        (10, "up", None, 0.1, None),
        (20, "down", 0.1, 0.2, None),
        (30, "both", 0.3, None, None),
    ]


def test_a_file_is_read_once_and_again_when_it_is_named_anew(folder: Path) -> None:
    trace = {"down": {"rate_trace": {"file": "lte.trace"}}}
    link = Profile(BELOW, folder).changed(trace)
    before = link.resolved(Window.of(9))
    (folder / "lte.trace").write_text("1\n")
    assert link.resolved(Window.of(99)) == before
    assert link.changed({"up": {"loss": 0.5}}).resolved(Window.of(9)).down == before.down
    assert link.changed(trace).resolved(Window.of(9)).down != before.down


def test_a_link_made_in_python_can_be_changed_too() -> None:
    config = LinkConfig(
        up=OneWay(loss=0.5), blackouts=Profile(BELOW).resolved(Window.of(9)).blackouts
    )
    link = Profile.of(config)
    assert link.resolved(Window.of(9)) == config
    assert link.changed({"up": {"loss": None}}).resolved(Window.of(9)) == LinkConfig()
    assert link.changed({"preset": "perfect"}).resolved(Window.of(9)).up == OneWay(
        delay_s=0.0, loss=0.5
    )


def test_a_date_may_be_one_of_toml() -> None:
    """`--set start=2026-01-01`, or unquoted in a file."""
    link = Profile({"preset": "moon"})
    for text in ("ephemeris={body='moon', epoch=2026-01-01}", "start=2026-01-01T00:00:00Z"):
        [made] = read_assignments([text])
        link = link.changed(as_layer(made, link.table))
    described = link.checked()
    assert described.start == "2026-01-01T00:00:00+00:00"
    assert described.ephemeris == Ephemeris(body="moon")


def test_set_removes_a_key_as_a_change_does() -> None:
    link = Profile({"preset": "moon", "down": {"jitter": {"spread_s": 1.0}}})
    for made in read_assignments(["down.jitter=null", "up.rate_bit_s=null"]):
        link = link.changed(as_layer(made, link.table))
    described = link.checked()
    assert described.down.jitter is None
    assert described.up.rate_bit_s is None
    assert described.down.rate_bit_s is not None


def test_messages_do_not_grow_with_what_they_are_about() -> None:
    points = [{"t_s": n, "delay_s": 1} for n in range(30_000)]
    points[20_000]["t_s"] = 7
    tables: list[dict[str, Any]] = [
        {"down": {"delay_table": points}},
        {"down": {"delay_table": [{"t_s": 0, "delay_s": 1}] * 200_000}},
        {"down": {"rate_trace": {"times_ms": [5, *range(90_000)]}}},
        {"blackouts": [{"start_s": 2, "end_s": 1}] * 9000},
        {"a" * 10**6: 1},
        {"é" * 10**6: 1},
        {"down": {f"k{n}": 1 for n in range(10**4)}},
        {"down": {"drop": "n" * 10**6}},
        {"preset": "m" * 10**6},
        {"contacts": {"file": "f" * 10**6, "ground": 1, "rover": 2}},
        {"down": {"rate_bit_s": 10**5000}},
        {"ephemeris": {"body": -74, "epoch": "2026-01-01", "kernel": "k" * 10**6}},
        {"changes": {"a" * 10**6: {}}},
    ]
    told = []
    for table in tables:
        with pytest.raises(LinkConfigError) as refusal:
            Profile({"preset": "moon"}, source="s" * 10**6).changed(table).resolved(Window.of(9))
        told.append(str(refusal.value))
    assert told[0].endswith(
        "s…: down: delay_table: expected times that grow, "
        "found 7 at index 20000, after 19999 and before 20001"
    )
    assert "delay_table: expected at most 100000 entries, found 200000" in told[1]
    assert max(len(line) for words in told for line in words.splitlines()) < 1000
    assert max(len(words.splitlines()) for words in told) == 101
