"""What a mission may name code of one's own for, and the words about it; imports nothing of it."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from farside.missions.schema import MissionFile
from farside.settings import Options
from farside.validation import Key, Problem, shown

if TYPE_CHECKING:
    from farside.ground.operators.operator import Operator
    from farside.rover.controller import Controller


class Kind(NamedTuple):
    """Something that a mission takes by name.

    Attributes:
        what: the word for it, and its key in the mission file.
        table: the table of that key.
        group: the group of entry points that installed ones stand in.
        built_in: the names that Farside brings, each with what it is set by.
        first: what one is made with beside `rng` and the options, as it is written in Python.
        base: the class to derive one from, if there is one.
    """

    what: str
    table: str
    group: str
    built_in: Mapping[str, str]
    first: str
    base: str | None

    @property
    def key(self) -> Key:
        """The key that names one."""
        return (self.table, self.what)

    @property
    def options_key(self) -> Key:
        """The key of the options that it is made with."""
        return (self.table, f"{self.what}_options")


CONTROLLER = Kind(
    "controller",
    "rover",
    "farside.controllers",
    {"dem": "[rover.dem]", "queued": "nothing"},
    "action_costs",
    "farside.rover.PlainController",
)
OPERATOR = Kind(
    "operator",
    "ground",
    "farside.operators",
    {
        "scripted": "[[ground.script]]",
        "guide": "[ground.guide]",
        "supervisor": "[ground.supervisor]",
        "recorded": "[ground.recorded]",
        "queued": "nothing",
        "absent": "nothing",
    },
    "chart",
    None,
)


class Extensions(NamedTuple):
    """Code of one's own that a run takes.

    Attributes:
        controller, operator: the class; `None` for what is built in, or is still to be found by
            its name in the mission.
        path: the folders to find it in, in order; empty where there is nothing to find.
        local: whether a class was given in place of its name, which only this process knows.
    """

    controller: "type[Controller] | None" = None
    operator: "type[Operator] | None" = None
    path: tuple[str, ...] = ()
    local: bool = False


NONE = Extensions()
"""No code of one's own."""


class ExtensionError(Exception):
    """Code of one's own cannot be had; `problem` says why, and what to do."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem.text)
        self.problem = problem


def named_in(mission: MissionFile) -> Iterator[tuple[Kind, str, Options]]:
    """What a mission names of each kind, with the options for it."""
    yield CONTROLLER, mission.rover.controller, mission.rover.controller_options
    yield OPERATOR, mission.ground.operator, mission.ground.operator_options


def own(mission: MissionFile) -> bool:
    """Whether a mission names any code of one's own."""
    return any(name not in kind.built_in for kind, name, _ in named_in(mission))


def idle_options(mission: MissionFile) -> Iterator[Problem]:
    """Options for what is built in, which takes none."""
    for kind, name, options in named_in(mission):
        if name in kind.built_in and options:
            text = (
                f"expected none with {kind.what} = {shown(name)}, which {kind.built_in[name]} sets"
            )
            yield Problem(kind.options_key, f"{text}, found {', '.join(options)}")


def search_path(folder: Path) -> tuple[str, ...]:
    """Where code of one's own is looked for: `sys.path`, the mission's folder, the current folder.

    In this order, so that no file beside a mission takes the place of a library.
    """
    entries = [*(str(Path(entry).absolute()) for entry in sys.path)]
    entries += [str(folder.absolute()), str(Path.cwd())]
    return tuple(dict.fromkeys(entries))


@contextmanager
def searching(path: Sequence[str]) -> Iterator[None]:
    """Import from these folders too, after those that Python looks in anyway."""
    added = [entry for entry in path if entry not in sys.path]
    sys.path.extend(added)
    try:
        yield
    finally:
        for entry in added:
            with suppress(ValueError):  # whatever else changes `sys.path`
                sys.path.remove(entry)
