"""Tables of a mission file, and the types of values in them."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated

import msgspec
from msgspec import Meta

NonNegative = Annotated[float, Meta(ge=0)]
Positive = Annotated[float, Meta(gt=0)]
Fraction = Annotated[float, Meta(ge=0, le=1)]
Count = Annotated[int, Meta(ge=1)]

PlaceName = Annotated[str, Meta(extra={"names": "place"})]
"""The name of a place on the map, such as `A` or `3,4`; see `farside.validation.named`."""

ActionName = Annotated[str, Meta(extra={"names": "action"})]
"""The name of an action of the rover, such as `N`; see `farside.validation.named`."""

Plain = bool | int | float | str

Options = dict[
    Annotated[str, Meta(pattern=r"^[A-Za-z_][A-Za-z0-9_]*\Z")], Plain | tuple[Plain, ...]
]
"""Options for code of one's own, passed on as keyword arguments: values, or arrays of them."""


class Section(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of the mission file. Unknown keys are refused."""


def expect_growing(name: str, times: Sequence[float], *, may_repeat: bool = False) -> None:
    """Refuse times that are out of order.

    Args:
        name: of the key that they are in.
        times: in any unit.
        may_repeat: whether one may be as the one before.

    Raises:
        ValueError: if one is not later than the one before; says which, with its neighbours.
    """
    for index, (earlier, later) in enumerate(pairwise(times), start=1):
        if later < earlier or (later == earlier and not may_repeat):
            words = "do not fall" if may_repeat else "grow"
            after = "".join(f" and before {time:.15g}" for time in times[index + 1 : index + 2])
            raise ValueError(
                f"{name}: expected times that {words}, "
                f"found {later:.15g} at index {index}, after {earlier:.15g}{after}"
            )
