"""Public names of a package that are imported when they are first asked for.

A mission file is checked without physics, cryptography or numpy; a child process plays one role; a
test session merely has Farside installed. None of them should pay for all of it.
"""

import sys
from collections.abc import Callable, Mapping
from importlib import import_module


def lazily(package: str, homes: Mapping[str, str]) -> Callable[[str], object]:
    """The `__getattr__` of a package, which imports a name from the module that is its home.

    Args:
        package: the package's `__name__`.
        homes: the module of each public name, below the package. No name may be that of a module
            of the package, which would take its place once it was imported.
    """

    def find(name: str) -> object:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f"{package}.{homes[name]}"), name)
        setattr(sys.modules[package], name, value)
        return value

    return find
