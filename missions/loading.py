"""Loading a mission: the file read, assignments applied, everything checked, the link resolved."""

from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from importlib import resources
from importlib.resources.abc import Traversable
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import msgspec

from farside.dem.parameters import OWN_RULES
from farside.files import parse_toml, read_text
from farside.link.profile.layers import LinkConfigError, laid_over, with_preset
from farside.link.profile.plans.times import Window
from farside.link.profile.resolve import resolve_link
from farside.missions.assignments import (
    Assignment,
    as_layer,
    assign,
    origin_of,
    read_assignments,
)
from farside.missions.extensions.kinds import (
    CONTROLLER,
    NONE,
    OPERATOR,
    ExtensionError,
    Extensions,
    idle_options,
    named_in,
    own,
    search_path,
    searching,
)
from farside.missions.orders.recorded import RecordedError, with_recorded
from farside.missions.schema import MAX_TICKS, Change, MissionFile
from farside.places import ACTIONS, Cell, Chart, place_token
from farside.validation import (
    MAX_PROBLEMS,
    Key,
    Problem,
    did_you_mean,
    dotted,
    mismatches,
    named,
    shown,
)

if TYPE_CHECKING:
    from farside.ground.operators.operator import Operator
    from farside.rover.controller import Controller

_SCHEMA = msgspec.inspect.type_info(MissionFile)


class MissionError(Exception):
    """The mission cannot be loaded.

    The text, meant for people, has a line for each problem: the file, the dotted key, what was
    expected, what was found and, if an assignment set the key, which one.
    """


class LoadedMission(NamedTuple):
    """A mission and its source.

    Attributes:
        mission: the mission with assignments applied, checked, its link resolved: running it reads
            no more files and needs no ephemeris.
        text: the exact text of the mission file, without the assignments.
        source: path or name of the mission, as given to `load_mission`.
        overrides: dotted keys and values of the assignments, in order.
        extensions: the controller and operator of one's own that it names.
        files: the texts of the files that its link names, by that name.
        changes: what becomes of the mission during the run, in order of time.
        again: of a run that is lived again otherwise: what the log says of it.
    """

    mission: MissionFile
    text: str
    source: str
    overrides: tuple[tuple[str, object], ...] = ()
    extensions: Extensions = NONE
    files: Mapping[str, str] = {}
    changes: tuple[Change, ...] = ()
    again: Mapping[str, str] = {}

    @property
    def last(self) -> MissionFile:
        """The mission at the end of the run."""
        return self.changes[-1].mission if self.changes else self.mission


def load_mission(
    source: str | Path,
    assignments: Sequence[str] | Mapping[str, object] = (),
    seed: int | None = None,
    *,
    controller: "type[Controller] | None" = None,
    operator: "type[Operator] | None" = None,
) -> LoadedMission:
    """Read a mission file, apply the assignments, and check the result.

    A controller or operator of one's own is imported and made once, so that what is wrong with it
    is told now; so loading a mission runs the code that it names.

    Args:
        source: path of a TOML file, or name of a mission shipped with Farside. A file with that
            name takes precedence.
        assignments: `key=value` strings, or values by dotted key; see
            `farside.missions.assignments`. The last assignment to a key wins.
        seed: replaces the mission's seed.
        controller: a class in place of the one that the mission names, for a run in this process.
        operator: likewise.

    Raises:
        MissionError: if the file cannot be read or is not a valid mission. Nothing else is raised.
    """
    text = _read(source)
    try:
        made = read_assignments(assignments)
    except ValueError as error:
        raise MissionError(f"{source}: {error}") from error
    if seed is not None:
        made.append(Assignment(("seed",), seed, f"--seed {seed}"))
    return load_text(text, source, made, {}, controller=controller, operator=operator)


def load_text(
    text: str,
    source: str | Path,
    made: Sequence[Assignment],
    texts: dict[str, str],
    *,
    controller: "type[Controller] | None" = None,
    operator: "type[Operator] | None" = None,
) -> LoadedMission:
    """`load_mission` from the text of a mission file.

    Args:
        text: the text.
        source: where it is from: other files are looked for beside it.
        made: the assignments, the last one to a key wins.
        texts: of the files that the mission names, by that name, where they need not be read.
        controller: as in `load_mission`.
        operator: likewise.

    Raises:
        MissionError: as `load_mission`.
    """
    try:
        data = parse_toml(text)
    except ValueError as error:
        raise MissionError(f"{source}: expected TOML, found: {error}") from error
    made = list(made)
    for kind, given in ((CONTROLLER, controller), (OPERATOR, operator)):
        if given is not None:
            made.append(Assignment(kind.key, _label(given), f"a {kind.what} given from Python"))
    problems = chain(_apply(made, data), _insert_preset(data), _schema_problems(data))
    _refuse(problems, source, made)
    mission = msgspec.convert(data, MissionFile)
    _refuse(_inconsistencies(mission, data), source, made)
    folder = Path(source).parent
    try:
        link = resolve_link(
            mission.link, folder=folder, window=Window.of(mission.duration_s), texts=texts
        )
    except LinkConfigError as error:
        _refuse(_link_problems(error), source, made)
        raise
    try:
        mission = with_recorded(mission, folder)
    except RecordedError as error:
        _refuse([error.problem], source, made)
        raise
    try:
        extensions = _extensions(mission, folder, controller, operator)
    except ExtensionError as error:
        _refuse([error.problem], source, made)
        raise
    overrides = tuple((dotted(change.key), change.value) for change in made)
    mission = msgspec.structs.replace(mission, link=link)
    return LoadedMission(mission, text, str(source), overrides, extensions, texts)


def _label(given: type) -> str:
    return f"{given.__module__}:{given.__qualname__}"


def _extensions(
    mission: MissionFile,
    folder: Path,
    controller: "type[Controller] | None",
    operator: "type[Operator] | None",
) -> Extensions:
    """Find and check the code of one's own that a mission is to be run with."""
    if not own(mission):
        return NONE
    # Imports numpy and all that flies a rover, which no other mission needs to be checked.
    from farside.missions.extensions.checks import checked  # noqa: PLC0415

    path = search_path(folder)
    given = {CONTROLLER.what: controller, OPERATOR.what: operator}
    found: dict[str, Any] = {}
    with searching(path):
        for kind, name, options in named_in(mission):
            if name not in kind.built_in:
                found[kind.what] = checked(kind, name, options, mission, given[kind.what])
    local = controller is not None or operator is not None
    return Extensions(path=path, local=local, **found)


def _read(source: str | Path) -> str:
    try:
        return read_text(_find(source))
    except OSError as error:
        raise MissionError(f"{source}: expected a mission file, found: {error.strerror}") from error
    except ValueError as error:
        raise MissionError(f"{source}: {error}") from error


def _find(source: str | Path) -> Path | Traversable:
    """The file at the path `source` or, if there is none, the shipped mission of that name."""
    path, shipped = Path(source), shipped_missions()
    if not path.is_file() and str(source) in shipped:
        return shipped[str(source)]
    if path.exists():
        return path
    raise MissionError(
        f"{source}: expected a mission file or the name of a shipped mission "
        f"({', '.join(shipped)}), found neither{did_you_mean(path.stem, shipped)}"
    )


def shipped_missions() -> dict[str, Traversable]:
    """The mission files that come with Farside, by name."""
    files = resources.files("farside.missions").iterdir()
    return {
        file.name.removesuffix(".toml"): file
        for file in sorted(files, key=lambda file: file.name)
        if file.name.endswith(".toml")
    }


def _schema_problems(data: dict[str, Any]) -> Iterator[Problem]:
    # A generator, so that the schema is compared once assignments and preset are in.
    yield from mismatches(data, _SCHEMA)


def _apply(assignments: Sequence[Assignment], data: dict[str, Any]) -> Iterator[Problem]:
    for assignment in assignments:
        try:
            if assignment.key[:1] == ("link",) != assignment.key:
                _assign_to_link(assignment, data)
            else:
                assign(assignment, data)
        except ValueError as error:
            yield Problem(assignment.key, str(error))


def _assign_to_link(assignment: Assignment, data: dict[str, Any]) -> None:
    """Lay the assignment over the link's table, as `farside link` does."""
    link = data.get("link", {})
    if not isinstance(link, dict):
        assign(assignment, data)  # raises
        return
    data["link"] = laid_over(link, as_layer(assignment, data)["link"])


def _insert_preset(data: dict[str, Any]) -> Iterator[Problem]:
    """Fill in what the mission's link leaves to its preset."""
    if isinstance(link := data.get("link"), dict):
        try:
            data["link"] = with_preset(link)
        except LinkConfigError as error:
            yield from _link_problems(error)


def _link_problems(error: LinkConfigError) -> Iterator[Problem]:
    return (Problem(("link", *key), text) for key, text in error.problems)


def _refuse(
    problems: Iterable[Problem], source: str | Path, assignments: Sequence[Assignment]
) -> None:
    """Raise a `MissionError` if there are problems."""
    lines = []
    for problem in islice(problems, MAX_PROBLEMS):
        origin = origin_of(problem, assignments)
        lines.append(f"{source}: {dotted(problem.key)}: {problem.text}{origin}")
    if len(lines) == MAX_PROBLEMS:
        lines.append(f"{source}: no more than the first {MAX_PROBLEMS} problems are told")
    if lines:
        raise MissionError("\n".join(lines))


def _inconsistencies(mission: MissionFile, data: dict[str, object]) -> Iterator[Problem]:
    """Problems between tables that are each valid alone."""
    yield from idle_options(mission)
    for rule in OWN_RULES:
        # Of a table that is read, it is known no more what is said and what is a default.
        if mission.rover.dem.plain and _said(data, "rover", "dem", rule) is True:
            text = "expected false, or no such key, with plain = true, found true"
            yield Problem(("rover", "dem", rule), text)
    ground = mission.ground
    if ground.operator == "supervisor" and not ground.supervisor.goals:
        text = 'expected at least one goal for the operator "supervisor", found none'
        yield Problem(("ground", "supervisor", "goals"), text)
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


def _said(data: object, *key: str) -> object:
    """What is said at a key; `None` for nothing."""
    for part in key:
        data = data.get(part) if isinstance(data, dict) else None
    return data


def _misplaced(
    key: Key, place: str, start: str, chart: Chart, reachable: Container[Cell]
) -> Iterator[Problem]:
    """The problem with a place that is not on the chart or not reachable from the start."""
    cell = chart.places.get(place)
    if cell is None:
        letters = ", ".join(chart.named)
        names = f"{letters} or EAST,NORTH" if letters else "EAST,NORTH"
        hint = chart.like(place)
        yield Problem(key, f"expected a place on the map ({names}), found {shown(place)}{hint}")
    elif cell not in reachable:
        text = (
            f"expected a place reachable from the start, found {shown(place)}: "
            f"no way from {place_token(start)} to {place_token(place)}"
        )
        yield Problem(key, text)
