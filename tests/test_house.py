"""The house rules that neither ruff, mypy nor import-linter checks; imports are import-linter's."""

import ast
import re
import tomllib
from collections import Counter
from collections.abc import Iterator
from importlib import import_module, metadata
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
ROOMS = sorted(link.name for link in (ROOT / "farside").iterdir() if link.is_symlink())
PACKAGES = ["farside", *(f"farside.{room}" for room in ROOMS), "farside.dem.lab"]
# By the folders at the root: on Python 3.11 `rglob` does not follow links.
MODULES = sorted(
    module for room in ("farside", *ROOMS, "tests") for module in (ROOT / room).rglob("*.py")
)
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PROJECT = PYPROJECT["project"]
LINES = 400
CONSTRAINTS = (ROOT / "constraints.txt").read_text()


def tree(module: Path) -> ast.Module:
    return ast.parse(module.read_text(encoding="utf-8"), str(module))


def offered(package: str) -> dict[str, str]:
    """The public names that a package's `__init__` takes from Farside's modules, with those."""
    init = ROOT / package.replace(".", "/") / "__init__.py"
    return {
        alias.asname or alias.name: node.module
        for node in ast.walk(tree(init))
        if isinstance(node, ast.ImportFrom)
        and node.module
        and node.module.startswith("farside.")
        and node.module != "farside.lazily"
        for alias in node.names
    }


def documented(module: str) -> Iterator[str]:
    """The names defined in a module with words on them: a docstring, or a string right below."""
    body = tree(ROOT / f"{module.replace('.', '/')}.py").body
    for node, below in zip(body, [*body[1:], None], strict=True):
        match node, below:
            case ((ast.ClassDef() | ast.FunctionDef()), _):
                if ast.get_docstring(node):
                    yield node.name
            case (
                ast.Assign(targets=[ast.Name(id=name)]) | ast.AnnAssign(target=ast.Name(id=name)),
                ast.Expr(value=ast.Constant(value=str())),
            ):
                yield name


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_says_exactly_what_it_offers(package: str) -> None:
    names = getattr(import_module(package), "__all__", [])

    assert len(names) == len(set(names))
    assert set(names) == offered(package).keys()
    assert all(
        getattr(import_module(package), name) is getattr(import_module(module), name)
        for name, module in offered(package).items()
    )


@pytest.mark.parametrize("package", PACKAGES)
def test_every_public_name_is_documented(package: str) -> None:
    bare = [name for name, module in offered(package).items() if name not in documented(module)]

    assert not bare


def test_no_module_is_too_long() -> None:
    lengths = {module: len(module.read_text().splitlines()) for module in MODULES}
    assert not {str(module): length for module, length in lengths.items() if length > LINES}


def test_no_folder_has_more_than_a_dozen_modules_without_parts() -> None:
    modules = Counter(
        module.parent
        for module in MODULES
        if ROOT / "tests" not in module.parents and module.name != "__init__.py"
    )
    assert not {str(folder): count for folder, count in modules.items() if count > 12}


def test_ruff_bans_the_bare_name_of_every_room() -> None:
    banned = PYPROJECT["tool"]["ruff"]["lint"]["flake8-tidy-imports"]["banned-api"]
    assert sorted(banned) == ROOMS


def test_the_house_has_the_rooms_that_people_look_for() -> None:
    assert ROOMS == ["console", "dem", "ground", "link", "logs", "missions", "rover"]
    assert all((ROOT / room / "__init__.py").is_file() for room in ROOMS)


def test_the_installed_version_is_that_of_the_project() -> None:
    assert metadata.version("farside") == PROJECT["version"]


def test_constraints_are_exact_versions_and_nothing_else() -> None:
    lines = [line for line in CONSTRAINTS.splitlines() if not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+==[0-9.]+", line) for line in lines)


def test_constraints_pin_all_that_the_project_asks_for() -> None:
    asked = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["dev"]]
    names = {re.split(r"[<>=]", requirement)[0] for requirement in asked}
    assert names <= set(re.findall(r"^([^#=]+)==", CONSTRAINTS, re.MULTILINE))
