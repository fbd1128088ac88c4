"""The tables that a link is described in, one over the other, before they are checked."""

from collections.abc import Mapping
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from farside.files import parse_toml, read_text
from farside.validation import Problem, did_you_mean, dotted, shown

DELAY_KEYS = ("delay_s", "delay_table")
"""The keys of a direction that give its delay, of which one at most may be there."""

RATE_KEYS = ("rate_bit_s", "rate_table", "rate_trace")
"""The keys of a direction that give its rate, of which one at most may be there."""


class LinkConfigError(ValueError):
    """The description of a link is invalid. Its text is for people, one line per problem.

    Attributes:
        problems: what is wrong, by key from the top of the link's table.
        source: the profile as it was named; empty for the table of a mission.
    """

    def __init__(self, *problems: Problem, source: str = "") -> None:
        self.problems = problems
        self.source = source
        lines = (
            ": ".join(part for part in (source, dotted(key), text) if part)
            for key, text in problems
        )
        super().__init__("\n".join(lines))


def preset_names() -> list[str]:
    """Names of the profiles that come with Farside."""
    return sorted(_presets())


def with_preset(table: Mapping[str, Any]) -> dict[str, Any]:
    """Merge a `[link]` table with the preset that it names, before either is checked.

    The table wins, key by key. A key also replaces the preset's alternatives to it: a `delay_s`
    replaces a `delay_table` or an ephemeris.

    Returns:
        the merged table without the key `preset`; the table as it was if `preset` is absent or not
        a string.

    Raises:
        LinkConfigError: if there is no such preset.
    """
    name = table.get("preset")
    if not isinstance(name, str):
        return dict(table)
    preset = _presets().get(name)
    if preset is None:
        raise refused(("preset",), _no_such_preset(name, "the name of a preset"))
    own = {key: value for key, value in table.items() if key != "preset"}
    return merged(_without_replaced(_toml(preset.read_text("utf-8"), ("preset",)), own), own)


def merged(preset: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """`preset` overridden by `own`: tables key by key, arrays as a whole.

    Tables of different models are not mixed: if `own` names another model, its table stands alone.
    """
    result = dict(preset)
    for key, value in own.items():
        match preset.get(key), value:
            case dict(below), dict(table) if _are_of_one_model(below, table):
                result[key] = merged(below, table)
            case _:
                result[key] = value
    return result


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


def text_at(path: Path, key: tuple[str, ...]) -> str:
    """The text of a file that `key` names.

    Raises:
        LinkConfigError: if it cannot be read.
    """
    try:
        return read_text(path)
    except OSError as error:
        why = f"expected a file, found: {shown(str(path))}: {error.strerror}"
        raise refused(key, why) from error
    except ValueError as error:  # what it holds, or a path that can be none
        raise refused(key, f"{error}: {shown(str(path))}") from error


def _toml(text: str, key: tuple[str, ...]) -> dict[str, Any]:
    try:
        return parse_toml(text)
    except ValueError as error:
        raise refused(key, f"expected TOML, found: {error}") from error


def _without_replaced(preset: Mapping[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    """`preset` without the tables and keys to which `own` gives an alternative."""
    own_ways = {way: set(_table(own.get(way))) for way in ("up", "down")}
    left = dict(preset)
    planned = "contacts" in own or "routing" in own
    if planned or any(keys.intersection(DELAY_KEYS) for keys in own_ways.values()):
        left.pop("ephemeris", None)
    dropped = {
        *(DELAY_KEYS if "ephemeris" in own or planned else ()),
        *(RATE_KEYS if planned else ()),
    }
    for way, own_keys in own_ways.items():
        replaced = set(dropped)
        for keys in (DELAY_KEYS, RATE_KEYS):
            if own_keys.intersection(keys):
                replaced.update(keys)
        left[way] = {
            key: value
            for key, value in _table(preset.get(way)).items()
            if key in own_keys or key not in replaced
        }
    return left


def _are_of_one_model(preset: Mapping[str, Any], own: Mapping[str, Any]) -> bool:
    return "model" not in own or own["model"] == preset.get("model")


def _table(value: object) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}
