"""`farside console` on a machine that lacks what it needs."""

import sys
from collections.abc import Callable

import pytest

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
