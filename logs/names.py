"""Names that callers give to queries on a run, looked up."""

from enum import StrEnum
from typing import TypeVar

from farside.validation import did_you_mean, shown

E = TypeVar("E", bound=StrEnum)


def member_of(what: str, name: str, kind: type[E]) -> E:
    """The member of an enumeration with this value.

    Raises:
        ValueError: if there is none. The message names the nearest one.
    """
    if name in (known := [member.value for member in kind]):
        return kind(name)
    raise ValueError(
        f"expected the {what} to be one of {', '.join(known)}, found {shown(name)}"
        f"{did_you_mean(name, known)}"
    )
