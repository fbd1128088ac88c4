"""Presets and profiles: what a table overrides, and what is refused."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

from farside.link.profile import layers
from farside.link.profile.config import (
    Trace,
)
from farside.link.profile.layers import LinkConfigError, merged, preset_names, with_preset
from farside.link.profile.profile import load_profile
from farside.node import Direction

DAY_S = 86400.0


@pytest.fixture
def presets(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., None]:
    """A folder whose TOML files are the presets, in place of those that come with Farside."""
    folder = tmp_path / "presets"
    folder.mkdir()
    found: dict[str, Path] = {}
    monkeypatch.setattr(layers, "_presets", lambda: found)

    def add(name: str, text: str) -> None:
        found[name] = folder / f"{name}.toml"
        found[name].write_text(text)

    return add


def test_tables_merge_key_by_key_and_arrays_as_a_whole() -> None:
    assert merged(
        {"up": {"a": 1, "b": 2}, "list": [1, 2], "c": 3}, {"up": {"b": 4}, "list": [5], "d": 6}
    ) == {"up": {"a": 1, "b": 4}, "list": [5], "c": 3, "d": 6}


def test_models_of_different_kinds_are_not_mixed() -> None:
    below = {"loss": {"model": "four-state", "p13": 0.1}}
    assert merged(below, {"loss": {"model": "gilbert-elliott", "p": 0.2}})["loss"] == {
        "model": "gilbert-elliott",
        "p": 0.2,
    }
    assert merged(below, {"loss": {"p13": 0.3}})["loss"] == {"model": "four-state", "p13": 0.3}
    assert merged(below, {"loss": 0.1})["loss"] == 0.1


def test_a_table_overrides_the_preset_it_names(presets: Callable[..., None]) -> None:
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
def test_a_key_replaces_the_alternatives_to_it_in_the_preset(
    presets: Callable[..., None], own: dict[str, Any], expected: dict[str, Any]
) -> None:
    presets("tin", "[up]\ndelay_s = 1\nrate_bit_s = 8\nloss = 0.1")
    assert with_preset({"preset": "tin", **own}) == {"down": {}} | expected


@pytest.mark.parametrize(
    ("own", "is_left"),
    [
        ({"ephemeris": {"epoch": "2022-01-01"}}, True),
        ({"up": {"loss": 0.1}}, True),
        ({"up": {"delay_s": 1}}, False),
        ({"contacts": {}}, True),
    ],
)
def test_other_delays_replace_the_ephemeris_of_a_preset(
    presets: Callable[..., None], own: Mapping[str, Mapping[str, str | float]], is_left: bool
) -> None:
    presets("far", '[ephemeris]\nbody = "mars"\nepoch = "2021-02-18"')
    table = with_preset({"preset": "far", **own})
    assert ("ephemeris" in table) is is_left
    if "ephemeris" in own:
        assert table["ephemeris"] == {"body": "mars", "epoch": "2022-01-01"}


def test_a_start_replaces_the_epoch_of_a_preset_and_one_file_of_an_ephemeris_the_other(
    presets: Callable[..., None],
) -> None:
    presets("far", '[ephemeris]\nkernel = "a.bsp"\nbody = 4\nepoch = "2021-02-18"')
    horizons = {"horizons": "table.txt"}
    table = with_preset({"preset": "far", "start": "2026-01-01", "ephemeris": horizons})
    assert table["start"] == "2026-01-01"
    assert table["ephemeris"] == {"body": 4, "horizons": "table.txt"}

    presets("dated", 'start = "2026-01-01"\n[ephemeris]\nbody = "mars"')
    epoch = {"epoch": "2021-02-18"}
    table = with_preset({"preset": "dated", "ephemeris": epoch})
    assert "start" not in table
    assert table["ephemeris"] == {"body": "mars", "epoch": "2021-02-18"}


def test_a_table_without_a_preset_is_left_to_the_schema() -> None:
    assert with_preset({"up": 3}) == {"up": 3}
    assert with_preset({"preset": 3}) == {"preset": 3}


def test_an_unknown_preset_is_refused_with_a_list_of_the_known_ones(
    presets: Callable[..., None],
) -> None:
    presets("moon", "")
    presets("tether", "")
    with pytest.raises(LinkConfigError) as refusal:
        with_preset({"preset": "Mooon"})
    assert str(refusal.value) == (
        'preset: expected the name of a preset (moon, tether), found "Mooon"; did you mean moon?'
    )


def test_a_profile_is_a_file_with_the_link_at_its_top(
    tmp_path: Path, presets: Callable[..., None]
) -> None:
    presets("tin", "[up]\ndelay_s = 1\n[down]\ndelay_s = 1")
    (tmp_path / "up.trace").write_text("7\n")
    profile = tmp_path / "mine.toml"
    profile.write_text('preset = "tin"\n[up]\nrate_trace = {file = "up.trace"}\n')
    link = load_profile(profile, 10.0)
    assert (link.preset, link.up.delay_s) == (None, 1)
    assert link.up.rate_trace == Trace(times_ms=(7,))


def test_a_profile_may_be_the_name_of_a_preset_but_a_file_comes_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, presets: Callable[..., None]
) -> None:
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
        (
            "[up]\ndelay_s = 3",
            ": down: expected one of delay_s, delay_table, delay_trace, ",
        ),
        ('preset = "ton"', ": preset: expected the name of a preset (tin), found "),
        ("preset = 3", ": preset: expected "),
    ],
)
def test_an_invalid_profile_is_refused_with_file_and_key(
    tmp_path: Path, presets: Callable[..., None], text: str, words: str
) -> None:
    presets("tin", "")
    profile = tmp_path / "mine.toml"
    profile.write_text(text)
    with pytest.raises(LinkConfigError) as refusal:
        load_profile(profile, 10.0)
    assert all(line.startswith(str(profile)) for line in str(refusal.value).splitlines())
    assert words in str(refusal.value)


@pytest.mark.parametrize("source", ["mooon", "no/such.toml", "x" * 5000, "\0", "."])
def test_a_profile_that_is_not_there_is_refused(presets: Callable[..., None], source: str) -> None:
    presets("moon", "")
    with pytest.raises(LinkConfigError) as refusal:
        load_profile(source, 10.0)
    assert ("did you mean moon?" in str(refusal.value)) is (source == "mooon")


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_that_comes_with_farside_is_a_link(name: str) -> None:
    pytest.importorskip("astropy")
    link = load_profile(name, DAY_S)
    assert link.ephemeris is None
    for direction in Direction:
        assert link.way(direction).delay_s is not None or link.way(direction).delay_table
