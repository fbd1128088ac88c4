"""What a caller gives, checked where it is given, in words that say what was expected and found."""

import math
from collections.abc import Mapping
from numbers import Real
from reprlib import Repr
from typing import TypeVar

_T = TypeVar("_T")

_SHORT = Repr()
_SHORT.maxstring = _SHORT.maxother = 80


def shown(found: object) -> str:
    """Anything, as a message tells it: with its quotes, and no longer than a line."""
    return _SHORT.repr(found)


def given(kind: type[_T], what: str, found: object) -> _T:
    """What was given, if it is of this class.

    Raises:
        TypeError: if it is not.
    """
    if not isinstance(found, kind):
        raise TypeError(f"{what}: expected {kind.__name__}, found {shown(found)}")
    return found


def name(what: str, found: object) -> str:
    """A name that was given.

    Raises:
        TypeError: if it is no string.
    """
    if not isinstance(found, str):
        raise TypeError(f"{what}: expected a name, found {shown(found)}")
    return found


def number(found: object, what: str, *about: object) -> float:
    """A number that was given, of whatever kind; a truth value is none.

    Args:
        found: what was given.
        what: its name in a message, with `{}` for each of `about`.
        about: what the name tells of.

    Raises:
        TypeError: if it is no number.
        ValueError: if it is too great for a float.
    """
    if isinstance(found, bool) or not isinstance(found, Real):
        raise TypeError(f"{told(what, about)}: expected a number, found {shown(found)}")
    try:
        return float(found)
    except OverflowError as error:
        raise ValueError(
            f"{told(what, about)}: expected a number below 1e308, found {shown(found)}"
        ) from error


def finite(found: object, what: str, *about: object) -> float:
    """A finite number that was given; see `number`.

    Raises:
        TypeError: if it is no number.
        ValueError: if it is not finite.
    """
    much = number(found, what, *about)
    if not math.isfinite(much):
        raise ValueError(f"{told(what, about)}: expected a finite number, found {much}")
    return much


def told(what: str, about: tuple[object, ...]) -> str:
    """The name of what was given, as a message tells it; see `number`."""
    return what.format(*map(shown, about))


def costs(found: object) -> dict[str, float]:
    """Costs by the names of actions, as they were given.

    Raises:
        TypeError: if they are no mapping of names to numbers.
        ValueError: if a cost is not finite and above 0. With a free action, an endless walk would
            cost no more than a short one.
    """
    if not isinstance(found, Mapping):
        raise TypeError(f"action costs: expected a cost by name, found {shown(found)}")
    return {name("an action", action): cost(action, much) for action, much in found.items()}


def cost(action: str, found: object) -> float:
    """The cost of an action, as it was given; see `costs`."""
    much = number(found, "cost of action {}", action)
    if not 0.0 < much < math.inf:
        raise ValueError(f"cost of action {shown(action)}: expected above 0, found {much}")
    return much
