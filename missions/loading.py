"""From a mission file to a checked mission, or to one message that says what is wrong with it."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from importlib import resources
from importlib.resources.abc import Traversable
from itertools import chain, islice
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from farside.files import parse_toml, read_text
from farside.link.profile.resolve import LinkConfigError, resolve_link, with_preset
from farside.missions.overrides import Assignment, put, read_overrides
from farside.missions.schema import MAX_TICKS, MissionFile
from farside.places import ACTIONS, Cell, Chart, place_token
from farside.validation import Key, Problem, did_you_mean, dotted, mismatches, named, shown

_SCHEMA = msgspec.inspect.type_info(MissionFile)


MAX_PROBLEMS = 100
"""The most problems of one mission that are told at once."""


class MissionError(Exception):
    """No mission can be made of the input.

    Its text is for people, a line a problem: the file, the key as one writes it for `--set`, what
    was expected, what was found and, where an override set it, which one.
    """


class LoadedMission(NamedTuple):
    """A mission and where it came from.

    Attributes:
        mission: the mission, overrides applied, checked, its link resolved: no file is read, and
            no ephemeris asked, once it runs.
        text: the mission file to the letter, without the overrides.
        source: the path, or the name of a shipped mission, as it was asked for.
    """

    mission: MissionFile
    text: str
    source: str


def load_mission(
    source: str | Path,
    overrides: Sequence[str] | Mapping[str, object] = (),
    seed: int | None = None,
) -> LoadedMission:
    """Read a mission file, put the overrides in, and check all of it.

    Args:
        source: path of a TOML file, or the name of a mission shipped with Farside. A file of that
            name comes first.
        overrides: texts `key=value` with a dotted key, numbers entering arrays from 0, and a TOML
            value or a bare word; or the values themselves by dotted key. Later ones win.
        seed: the seed of the run, in place of the mission's own.

    Raises:
        MissionError: if the file cannot be read, or is no mission. Nothing else is raised.
    """
    text = _read(source)
    try:
        data = parse_toml(text)
    except ValueError as error:
        raise MissionError(f"{source}: expected TOML, found: {error}") from error
    try:
        changes = read_overrides(overrides)
    except ValueError as error:
        raise MissionError(f"{source}: {error}") from error
    if seed is not None:
        changes.append(Assignment(("seed",), seed, f"--seed {seed}"))
    problems = chain(_put_in(changes, data), _preset_in(data), _unlike_schema(data))
    _refuse(problems, source, changes)
    mission = msgspec.convert(data, MissionFile)
    _refuse(_contradictions(mission, data), source, changes)
    try:
        link = resolve_link(mission.link, folder=Path(source).parent, duration_s=mission.duration_s)
    except LinkConfigError as error:
        _refuse(_of_link(error), source, changes)
        raise
    return LoadedMission(msgspec.structs.replace(mission, link=link), text, str(source))


def _read(source: str | Path) -> str:
    try:
        return read_text(_find(source))
    except OSError as error:
        raise MissionError(f"{source}: expected a mission file, found: {error.strerror}") from error
    except ValueError as error:
        raise MissionError(f"{source}: {error}") from error


def _find(source: str | Path) -> Path | Traversable:
    """The file at the path `source`, before the shipped mission of that name."""
    path, shipped = Path(source), _shipped()
    if not path.is_file() and str(source) in shipped:
        return shipped[str(source)]
    if path.exists():
        return path
    raise MissionError(
        f"{source}: expected a mission file or the name of a shipped mission "
        f"({', '.join(shipped)}), found neither{did_you_mean(path.stem, shipped)}"
    )


def _shipped() -> dict[str, Traversable]:
    """The mission files inside the package, by name."""
    files = resources.files("farside.missions").iterdir()
    return {
        file.name.removesuffix(".toml"): file
        for file in sorted(files, key=lambda file: file.name)
        if file.name.endswith(".toml")
    }


def _unlike_schema(data: dict[str, Any]) -> Iterator[Problem]:
    yield from mismatches(data, _SCHEMA)


def _put_in(changes: Sequence[Assignment], data: dict[str, Any]) -> Iterator[Problem]:
    for change in changes:
        try:
            put(change, data)
        except ValueError as error:
            yield Problem(change.key, str(error))


def _preset_in(data: dict[str, Any]) -> Iterator[Problem]:
    """Put the preset that the link names under what the mission says of it."""
    if isinstance(link := data.get("link"), dict):
        try:
            data["link"] = with_preset(link)
        except LinkConfigError as error:
            yield from _of_link(error)


def _of_link(error: LinkConfigError) -> Iterator[Problem]:
    return (Problem(("link", *key), text) for key, text in error.problems)


def _refuse(problems: Iterable[Problem], source: str | Path, changes: Sequence[Assignment]) -> None:
    lines = []
    for problem in islice(problems, MAX_PROBLEMS):
        origins = [change.origin for change in changes if change.touches(problem.key)]
        with_origin = f" (with {origins[-1]})" if origins else ""
        lines.append(f"{source}: {dotted(problem.key)}: {problem.text}{with_origin}")
    if len(lines) == MAX_PROBLEMS:
        lines.append(f"{source}: no more than the first {MAX_PROBLEMS} problems are told")
    if lines:
        raise MissionError("\n".join(lines))


def _contradictions(mission: MissionFile, data: dict[str, object]) -> Iterator[Problem]:
    """What is right in each table by itself, and wrong with the others."""
    if mission.duration_s < mission.tick_s:
        text = f"expected at least tick_s = {mission.tick_s:g}, found {mission.duration_s:g}"
        yield Problem(("duration_s",), text)
    if mission.duration_s / mission.tick_s > MAX_TICKS:
        most_s = MAX_TICKS * mission.tick_s
        text = f"expected at most {most_s:g} s in ticks of {mission.tick_s:g} s"
        yield Problem(("duration_s",), f"{text}, found {mission.duration_s:g}")
    chart = mission.world.chart()
    start = chart.places.get(mission.rover.start)
    reachable = chart.places.values() if start is None else chart.reachable(start)
    for key, place in named("place", data, _SCHEMA):
        yield from _misplaced(key, place, mission.rover.start, chart, reachable)
    for key, action in named("action", data, _SCHEMA):
        if action not in ACTIONS:
            expected = "one of " + ", ".join(map(shown, ACTIONS))
            hint = did_you_mean(action, ACTIONS)
            yield Problem(key, f"expected {expected}, found {shown(action)}{hint}")


def _misplaced(
    key: Key, place: str, start: str, chart: Chart, reachable: Container[Cell]
) -> Iterator[Problem]:
    """The problem with a place that is not on the chart, or cut off from the start."""
    cell = chart.places.get(place)
    if cell is None:
        letters = ", ".join(chart.named)
        names = f"{letters} or EAST,NORTH" if letters else "EAST,NORTH"
        hint = chart.like(place)
        yield Problem(key, f"expected a place on the map ({names}), found {shown(place)}{hint}")
    elif cell not in reachable:
        text = (
            f"expected a place that the start leads to, found {shown(place)}: "
            f"no way from {place_token(start)} to {place_token(place)}"
        )
        yield Problem(key, text)
