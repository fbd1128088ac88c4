"""What live objects hold, down to the last attribute, so that two of them can be compared."""

from collections import deque
from collections.abc import Iterator
from types import FunctionType, GeneratorType, MethodType

import msgspec
from numpy.random import Generator


def insides(root: object) -> dict[str, str]:
    """All that an object of Farside's holds, by the path that leads there.

    What is reached by several paths counts once, by the shortest one. Of what others made, such as
    the bodies of the physics, only the type counts.
    """
    held: dict[str, str] = {}
    seen: dict[int, object] = {}
    coming = deque([(root, "")])
    while coming:
        one, path = coming.popleft()
        parts = _parts(one)
        if parts is None:
            held[path] = _leaf(one)
        elif id(one) in seen:
            continue
        elif not isinstance(one, tuple):  # equal constants may be one and the same
            seen[id(one)] = one  # kept, lest another one gets its id
        coming += [(part, f"{path}{name}") for name, part in parts or ()]
    return held


def _parts(one: object) -> list[tuple[str, object]] | None:  # noqa: PLR0911 - a kind each
    """What an object consists of; `None` where that does not matter."""
    match one:
        case str() | bytes() | frozenset() | set() | msgspec.Struct() | Generator():
            return None
        case dict():
            return [(f"[{key!r}]", value) for key, value in one.items()]
        case list() | tuple() | deque():
            return [("#", len(one)), *((f"[{at}]", value) for at, value in enumerate(one))]
        case MethodType():
            return [("", one.__self__)]
        case FunctionType():
            return [
                (f"<{at}>", cell.cell_contents) for at, cell in enumerate(one.__closure__ or ())
            ]
        case GeneratorType():
            return [("()", dict(one.gi_frame.f_locals) if one.gi_frame else None)]
        case _ if type(one).__module__.startswith("farside."):
            return [(f".{name}", getattr(one, name)) for name in _names(one)]
        case _:
            return None


def _names(one: object) -> Iterator[str]:
    yield from getattr(one, "__dict__", ())
    for kind in type(one).__mro__:
        slots = getattr(kind, "__slots__", ())
        for name in (slots,) if isinstance(slots, str) else slots:
            if hasattr(one, name):
                yield name


def _leaf(one: object) -> str:
    match one:
        case Generator():
            return repr(one.bit_generator.state)
        case set() | frozenset():
            return repr(sorted(map(repr, one)))
        case None | bool() | int() | float() | str() | bytes() | msgspec.Struct():
            return repr(one)
        case _:
            return type(one).__name__
