"""Fixtures for all tests: Farside as others install it, and `pytester` for tests in documents."""

import os
from pathlib import Path

import pytest
from distributions import build, checkout, environment, install
from hypothesis import settings

from farside.missions import FinishedRun, load_mission, run_mission

pytest_plugins = ["pytester"]

# The user's terminal and tastes are none of the tests' business. Set before anything reads them,
# and for the processes that tests start as well.
for _name in ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR", "TTY_COMPATIBLE", "FARSIDE_TRACEBACK"):
    os.environ.pop(_name, None)
# Without bytecode each of the hundreds of processes that tests start would compile Farside anew.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
os.environ["TERM"] = "xterm-256color"

# How long an example takes depends on who else uses the machine, and no test asserts a wall time.
settings.register_profile("farside", deadline=None)
settings.load_profile("farside")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest tests first, so that no worker waits for them at the end.

    Beside them all that need an installed wheel: so one worker has them, and builds it once.
    """
    first = ("test_docs.py", "test_packaging.py")
    items.sort(key=lambda item: first.index(name) if (name := item.path.name) in first else 2)


@pytest.fixture(scope="session")
def blackout(tmp_path_factory: pytest.TempPathFactory) -> FinishedRun:
    """The shipped mission `blackout` as it is, run once for all who only read its log."""
    out = tmp_path_factory.mktemp("blackout")
    return run_mission(load_mission("blackout"), in_process=True, out=out)


DECOYS = (
    "logs/runs/x.mcap",
    "logs/runs/study/y.mcap",
    "rover/__pycache__/node.cpython-311.pyc",
    "tests/dem/__pycache__/plain.cpython-311.pyc",
)


@pytest.fixture(scope="session")
def used(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkout in which Farside has been run."""
    folder = checkout(tmp_path_factory.mktemp("used") / "far side")
    for decoy in DECOYS:
        path = folder / decoy
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("not for a package")
    return folder


@pytest.fixture(scope="session")
def wheel(used: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel from the sdist; the sdist lies beside it."""
    built = tmp_path_factory.mktemp("built")
    build(used, built)
    return next(built.glob("*.whl"))


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the commands where the wheel from the sdist has been installed."""
    python = environment(tmp_path_factory.mktemp("environment") / "far side")
    done = install(python, wheel)
    assert done.returncode == 0, done.stderr
    return python.parent
