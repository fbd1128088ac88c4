"""Finds a class of one's own by its name: an entry point's, or `module:Class`."""

import importlib
import sys
import traceback
from importlib.machinery import PathFinder
from importlib.metadata import entry_points
from pathlib import Path
from types import ModuleType

from farside.missions.extensions.kinds import ExtensionError, Kind
from farside.validation import Problem, did_you_mean, one_line, shown

_MOST = 300


def find_class(kind: Kind, name: str) -> type:
    """The class that a mission names.

    Args:
        kind: what it is to be.
        name: of an entry point, or `module:Class`, where the class may be inside another.

    Raises:
        ExtensionError: if there is none, or its module cannot be imported.
    """
    module_name, colon, attribute = name.partition(":")
    if not colon:
        module_name, attribute = _installed(kind, name)
    parts = attribute.split(".")
    if not all(part.isidentifier() for part in (*module_name.split("."), *parts)):
        raise _refused(kind, "expected module:Class, such as walker:Walker", shown(name))
    module = _imported(kind, module_name)
    found: object = module
    for number, part in enumerate(parts):
        if not hasattr(found, part):
            where = ".".join((module_name, *parts[:number]))
            near = did_you_mean(part, (known for known in dir(found) if known[0] != "_"))
            text = f"no {part} in {where}{_of_file(module)}{near}"
            raise _refused(kind, "expected the name of a class", text)
        found = getattr(found, part)
    if not isinstance(found, type):
        a = f"{attribute} in {module_name}{_of_file(module)} to be a {type(found).__name__}"
        raise _refused(kind, "expected the name of a class", a)
    return found


def said(error: BaseException) -> str:
    """The last line of an error, and where it was raised."""
    last = traceback.format_exception_only(error)[-1].strip()
    where = ""
    if isinstance(error, SyntaxError) and error.filename:
        where = f" ({one_line(error.filename, _MOST)}, line {error.lineno})"
    else:
        frames = traceback.extract_tb(error.__traceback__)
        own = [frame for frame in frames if not _is_ours(frame.filename)]
        if own:
            where = f" ({one_line(own[-1].filename, _MOST)}, line {own[-1].lineno})"
    return one_line(last, _MOST) + where


def _is_ours(file: str) -> bool:
    return file.startswith(("<frozen", str(Path(__file__).parent))) or file == importlib.__file__


def _refused(kind: Kind, expected: str, found: str) -> ExtensionError:
    return ExtensionError(Problem(kind.key, f"{expected}, found {found}"))


def _installed(kind: Kind, name: str) -> tuple[str, str]:
    """Module and class of an entry point."""
    installed = entry_points(group=kind.group)
    values = sorted({entry.value for entry in installed.select(name=name)})
    if len(values) == 1:
        entry = next(iter(installed.select(name=name)))
        return entry.module, entry.attr
    if values:
        both = " and ".join(values)
        text = f"{shown(name)} installed {len(values)} times, as {both}: name one of these"
        raise _refused(kind, f"expected one {kind.what} of that name", text)
    known = [*kind.built_in, *sorted(entry.name for entry in installed)]
    choices = ", ".join(map(shown, known))
    expected = f"expected {choices}, or module:Class from your own code"
    raise _refused(kind, expected, shown(name) + did_you_mean(name, known))


def _imported(kind: Kind, name: str) -> ModuleType:
    top = name.partition(".")[0]
    if top == "__main__":
        expected = "expected a module that every process of a run can import"
        raise _refused(kind, expected, "__main__: put the class into a file of its own")
    _refuse_namesake(kind, top)
    importlib.invalidate_caches()
    try:
        return importlib.import_module(name)
    except ModuleNotFoundError as error:
        if error.name is None or not f"{name}.".startswith(f"{error.name}."):
            raise _broken(kind, name, error) from error
        expected = "expected a module on Python's path, or beside the mission, or in this folder"
        file = f"{name.replace('.', '/')}.py"
        raise _refused(kind, expected, f"no {error.name}: put {file} there") from error
    except (Exception, SystemExit) as error:
        raise _broken(kind, name, error) from error


def _broken(kind: Kind, name: str, error: BaseException) -> ExtensionError:
    expected = "expected a module that can be imported"
    return _refused(kind, expected, f"{name} to end in {said(error)}: correct it there")


def _refuse_namesake(kind: Kind, top: str) -> None:
    """Refuse a module in whose place another one of its name is loaded already."""
    loaded = getattr(sys.modules.get(top), "__file__", None)
    spec = PathFinder.find_spec(top, sys.path)
    if loaded is None or spec is None or spec.origin is None or not Path(spec.origin).is_file():
        return
    if Path(loaded).resolve() != Path(spec.origin).resolve():
        text = f"{loaded} in use by that name: give one of them another"
        raise _refused(kind, f"expected module {top} to be {spec.origin}", text)


def _of_file(module: ModuleType) -> str:
    file = getattr(module, "__file__", None)
    return f" ({one_line(file, _MOST)})" if isinstance(file, str) else ""
