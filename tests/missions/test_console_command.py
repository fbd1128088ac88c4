"""`farside console` on a machine that lacks what it needs."""

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from farside.missions import load_mission
from farside.missions.commands.console.console import has_exercise
from farside.missions.loading import shipped_missions

Farside = Callable[..., tuple[int, str, str]]


def without(monkeypatch: pytest.MonkeyPatch, library: str) -> None:
    """As if a library were not installed."""
    for name in [*sys.modules] if library == "nicegui" else []:
        if name.startswith("farside.console.page") or name.split(".")[0] == library:
            monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, library, None)


@pytest.mark.parametrize(
    ("library", "options", "told"),
    [
        ("nicegui", (), "expected nicegui for the page, found no nicegui: pip install"),
        ("sdl2", ("--stick",), "a stick needs PySDL2, which is not installed: pip install"),
    ],
)
def test_what_is_not_installed_is_named_with_how_to_get_it(
    monkeypatch: pytest.MonkeyPatch,
    farside: Farside,
    library: str,
    options: tuple[str, ...],
    told: str,
) -> None:
    without(monkeypatch, library)

    status, out, error = farside("console", "blackout", *options)

    assert (status, out) == (2, "")
    assert told in " ".join(error.split())
    assert "farside[console]" in error


@pytest.mark.parametrize(
    ("mission", "set_", "has"),
    [
        ("blackout", (), True),
        ("mars-relay", (), False),
        ("blackout", ("link.blackouts=[]",), False),
    ],
)
def test_the_exercise_is_that_of_the_shipped_mission_as_it_is(
    mission: str, set_: tuple[str, ...], has: bool
) -> None:
    loaded = load_mission(mission, (*set_, 'ground.operator="queued"'))

    assert has_exercise(loaded) is has


def test_another_mission_of_that_name_has_no_exercise(tmp_path: Path) -> None:
    text = shipped_missions()["blackout"].read_text(encoding="utf-8")
    own = tmp_path / "blackout.toml"
    own.write_text(text.replace("start_s = 620.0", "start_s = 700.0"), encoding="utf-8")

    assert not has_exercise(load_mission(own, ('ground.operator="queued"',)))
