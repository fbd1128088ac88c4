"""The tables that a link is described in, one over the other, before they are checked.

A table lies over another as a JSON merge patch (RFC 7396): key by key, arrays as a whole, and
`None` removes what is below, so JSON's `null` does. Besides, a key replaces its alternatives, and a
table of one `model` that of another. A preset, the file that names it, `--set` and what the control
query says lie over one another in this order.
"""

from collections.abc import Callable, Mapping
from datetime import date
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from farside.files import parse_toml, read_text
from farside.link.profile.config import DELAY_KEYS, EPHEMERIS_FILES, RATE_KEYS
from farside.validation import (
    MAX_PROBLEMS,
    Problem,
    did_you_mean,
    dotted,
    one_line,
    shown,
    shown_path,
)

_SOURCE_LENGTH = 300


class LinkConfigError(ValueError):
    """The description of a link is invalid. Its text is for people, one line per problem.

    Attributes:
        problems: what is wrong, by key from the top of the link's table.
        source: the profile as it was named; empty for the table of a mission.
    """

    def __init__(self, *problems: Problem, source: str = "") -> None:
        self.problems = problems
        self.source = source
        shown_source = one_line(source, _SOURCE_LENGTH)
        lines = [
            ": ".join(part for part in (shown_source, dotted(key), text) if part)
            for key, text in problems[:MAX_PROBLEMS]
        ]
        if len(problems) > MAX_PROBLEMS:
            lines.append(f"no more than the first {MAX_PROBLEMS} problems are told")
        super().__init__("\n".join(lines))


def preset_names() -> list[str]:
    """Names of the profiles that come with Farside."""
    return sorted(_presets())


def with_preset(table: Mapping[str, Any]) -> dict[str, Any]:
    """A `[link]` table laid over the preset that it names, before either is checked.

    Returns:
        the table without the key `preset`, unless that is no string, and without what is removed.

    Raises:
        LinkConfigError: if there is no such preset.
    """
    name = table.get("preset")
    if not isinstance(name, str):
        return _plain(table)
    preset = _presets().get(name)
    if preset is None:
        raise refused(("preset",), _no_such_preset(name, "the name of a preset"))
    own = {key: value for key, value in table.items() if key != "preset"}
    return _plain(laid_over(_toml(preset.read_text("utf-8"), ("preset",)), own))


def laid_over(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """`above` laid over `below`, both as they are written.

    What is removed leaves a mark, which `with_preset` minds: a preset does not bring it back.
    """
    return merged(_without_replaced(below, above), above)


class _Whole(dict[str, Any]):
    """A table that has replaced what was there, so that nothing of a preset shows through it."""


def merged(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """`below` overridden by `above`: tables key by key, all else as a whole.

    Tables of different models are not mixed: if `above` names another, its table stands alone.
    """
    result = dict(below)
    for key, value in above.items():
        match below.get(key), value:
            case dict(), _Whole():
                result[key] = value
            case dict(old), dict(new) if _are_of_one_model(old, new):
                result[key] = type(old)(merged(old, new))
            case _, dict(new) if key in below:
                result[key] = _Whole(new)
            case _:
                result[key] = value
    return result


def _plain(table: Mapping[str, Any]) -> dict[str, Any]:
    """`table` without marks, and dates as text, which TOML's own need not be."""
    return {
        key: _plain(value)
        if isinstance(value, dict)
        else value.isoformat()
        if isinstance(value, date)
        else value
        for key, value in table.items()
        if value is not None
    }


def profile_table(source: str | Path) -> dict[str, Any]:
    """The table of a profile, unchecked: of a TOML file, or one that names a preset.

    Raises:
        LinkConfigError: if there is neither, or the file is not TOML.
    """
    path, name = Path(source), str(source)
    if name in _presets() and not path.is_file():
        return {"preset": name}
    try:
        return _toml(text_at(path, ()), ())
    except LinkConfigError as error:
        if isinstance(error.__cause__, FileNotFoundError):
            expected = "a profile file or the name of a preset"
            raise refused((), _no_such_preset(name, expected)) from error
        raise


def _presets() -> dict[str, Traversable]:
    folder = resources.files("farside.link.profile") / "presets"
    return {
        file.name.removesuffix(".toml"): file
        for file in (folder.iterdir() if folder.is_dir() else ())
        if file.name.endswith(".toml")
    }


def _no_such_preset(name: str, expected: str) -> str:
    names = preset_names()
    hint = did_you_mean(Path(name).stem, names)
    return f"expected {expected} ({', '.join(names)}), found {shown(name)}{hint}"


def refused(key: tuple[str, ...], text: str) -> LinkConfigError:
    """The error about one key of the link's table."""
    return LinkConfigError(Problem(key, text))


def text_at(path: Path, key: tuple[str, ...], read: Callable[[Path], str] = read_text) -> str:
    """The text of a file that `key` names, by `read`.

    Raises:
        LinkConfigError: if it cannot be read.
    """
    try:
        return read(path)
    except OSError as error:
        why = f"expected a file, found: {shown_path(str(path))}: {error.strerror}"
        raise refused(key, why) from error
    except ValueError as error:  # what it holds, or a path that can be none
        raise refused(key, f"{error}: {shown_path(str(path))}") from error


def _toml(text: str, key: tuple[str, ...]) -> dict[str, Any]:
    try:
        return parse_toml(text)
    except ValueError as error:
        raise refused(key, f"expected TOML, found: {error}") from error


def alternatives_to(given: set[str]) -> set[str]:
    """The keys of a direction that are alternatives to some that are given, these included."""
    return {key for keys in (DELAY_KEYS, RATE_KEYS) if given.intersection(keys) for key in keys}


def _without_replaced(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """`below` without the tables and keys to which `above` gives an alternative."""
    given = _given(above)
    given_ways = {way: _given(_table(above.get(way))) for way in ("up", "down")}
    left = _without_dates(below, above)
    if any(keys.intersection(DELAY_KEYS) for keys in given_ways.values()):
        left.pop("ephemeris", None)
    dropped = {
        *(DELAY_KEYS if given.intersection({"ephemeris", "contacts", "routing"}) else ()),
        *(RATE_KEYS if given.intersection({"contacts", "routing"}) else ()),
    }
    for way, keys in given_ways.items():
        if isinstance(table := below.get(way, {}), dict):
            replaced = (dropped | alternatives_to(keys)) - keys
            left[way] = type(table)({key: table[key] for key in table if key not in replaced})
    return left


def _without_dates(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """`below` without the date and the file of an ephemeris to which `above` gives another."""
    left, orbit = dict(below), _given(_table(above.get("ephemeris")))
    dropped = {key for one in EPHEMERIS_FILES if one in orbit for key in EPHEMERIS_FILES} - orbit
    if "epoch" in orbit:
        left.pop("start", None)
    if "start" in _given(above):
        dropped.add("epoch")
    if isinstance(table := left.get("ephemeris"), dict):
        kept = {key: value for key, value in table.items() if key not in dropped}
        left["ephemeris"] = type(table)(kept)
    return left


def _given(table: Mapping[str, Any]) -> set[str]:
    return {key for key, value in table.items() if value is not None}


def _are_of_one_model(preset: Mapping[str, Any], own: Mapping[str, Any]) -> bool:
    return "model" not in own or own["model"] == preset.get("model")


def _table(value: object) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}
