"""Checks a class of one's own against the protocol that it is to have, by making one of it."""

import inspect
from collections.abc import Callable, Iterator

import numpy as np

from farside.ground.operators.operator import Operator
from farside.missions.extensions.finding import find_class, said
from farside.missions.extensions.kinds import CONTROLLER, ExtensionError, Kind
from farside.missions.extensions.making import make_controller, make_operator
from farside.missions.schema import MissionFile
from farside.places import ACTIONS
from farside.rover.controller import Controller
from farside.settings import Options
from farside.validation import Problem, did_you_mean

_ABSENT = object()


def checked(
    kind: Kind, name: str, options: Options, mission: MissionFile, given: type | None
) -> type:
    """The class of one's own that a mission is to be run with.

    Args:
        kind: what it is to be.
        name: as the mission names it.
        options: what it is made with.
        mission: gives what it is made with beside.
        given: the class itself, if it need not be found.

    Raises:
        ExtensionError: if there is no such class, it lacks something, or none can be made of it.
    """
    found = find_class(kind, name) if given is None else given
    protocol = Controller if kind is CONTROLLER else Operator
    _check_methods(kind, name, found, protocol)
    _check_options(kind, name, found, options)
    rng = np.random.default_rng(0)
    try:
        if kind is CONTROLLER:
            costs = dict.fromkeys(ACTIONS, mission.rover.drive.move_cost_s)
            made: object = make_controller(found, costs, rng, options)
        else:
            made = make_operator(found, mission.world.chart(), rng, options)
    except (Exception, SystemExit) as error:
        text = f"expected a {kind.what} made by {_call(kind, name)}, found {said(error)}"
        raise ExtensionError(Problem(kind.key, text)) from error
    _check_made(kind, name, made, protocol)
    return found


def _call(kind: Kind, name: str) -> str:
    return f"{name}({kind.first}, *, rng, OPTIONS)"


def _members(protocol: type) -> Iterator[tuple[str, object]]:
    for name, member in vars(protocol).items():
        if name[0] != "_" and (isinstance(member, property) or inspect.isfunction(member)):
            yield name, member


def _check_methods(kind: Kind, name: str, found: type, protocol: type) -> None:
    """Before anything is called: what is no controller or operator at all is left alone."""
    abstract: frozenset[str] = getattr(found, "__abstractmethods__", frozenset())
    passes_on = hasattr(found, "__getattr__")
    missing = [
        member
        for member, what in _members(protocol)
        if member in abstract
        or not (isinstance(what, property) or passes_on or callable(getattr(found, member, None)))
    ]
    if missing:
        raise _lacking(kind, name, protocol, missing)


def _lacking(kind: Kind, name: str, protocol: type, missing: list[str]) -> ExtensionError:
    members = ", ".join(member for member, _ in _members(protocol))
    hint = "" if kind.base is None else f", or derive it from {kind.base}"
    return ExtensionError(
        Problem(
            kind.key,
            f"expected a class with {members}, found {name} without {', '.join(missing)}: "
            f"define what is missing{hint}",
        )
    )


def _check_options(kind: Kind, name: str, found: type, options: Options) -> None:
    try:
        signature = inspect.signature(found)
    except ValueError:  # written in C
        return
    taken = signature.parameters.values()
    names = [
        taking.name
        for taking in list(taken)[1:]
        if taking.kind in {taking.KEYWORD_ONLY, taking.POSITIONAL_OR_KEYWORD}
        and taking.name != "rng"
    ]
    if not any(taking.kind is taking.VAR_KEYWORD for taking in taken):
        for option in options:
            if option not in names:
                known = f"one of the options {', '.join(names)}" if names else "no options"
                text = f"expected {known} of {name}, found {option}{did_you_mean(option, names)}"
                raise ExtensionError(Problem((*kind.options_key, option), text))
    try:
        signature.bind(None, rng=None, **options)
    except TypeError as error:
        text = (
            f"expected a class made by {_call(kind, name)}, found {name}{signature}: {error}; "
            f"options stand in [{kind.options_key[0]}.{kind.options_key[1]}]"
        )
        raise ExtensionError(Problem(kind.key, text)) from error


def _check_made(kind: Kind, name: str, made: object, protocol: type) -> None:
    missing = [member for member, _ in _members(protocol) if not _has(made, member)]
    if missing:
        raise _lacking(kind, name, protocol, missing)
    for member, what in _members(protocol):
        if not isinstance(what, property):
            _check_call(kind, name, member, getattr(made, member), what)


def _has(made: object, member: str) -> bool:
    # Nothing is asked of it yet: what it would answer is the matter of its tests.
    found = inspect.getattr_static(made, member, _ABSENT) is not _ABSENT
    return found or (hasattr(type(made), "__getattr__") and hasattr(made, member))


def _check_call(
    kind: Kind, name: str, member: str, method: Callable[..., object], protocol: object
) -> None:
    """Whether a method can be called as the protocol calls it, with all that it may be given."""
    if not inspect.isfunction(protocol):
        return
    wanted = inspect.signature(protocol)
    taken = [
        taking.replace(annotation=taking.empty) for taking in list(wanted.parameters.values())[1:]
    ]
    by_place = [None for taking in taken if taking.kind is not taking.KEYWORD_ONLY]
    by_name = {taking.name: None for taking in taken if taking.kind is taking.KEYWORD_ONLY}
    try:
        signature = inspect.signature(method)
    except ValueError:  # written in C
        return
    try:
        signature.bind(*by_place, **by_name)
    except TypeError as error:
        call = wanted.replace(parameters=taken, return_annotation=wanted.empty)
        text = f"expected {name}.{member}{call}, found {member}{signature}: {error}"
        raise ExtensionError(Problem(kind.key, text)) from error
