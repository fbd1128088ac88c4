"""The pytest plugin: a `mission` fixture for tests that script blackouts.

def test_the_rover_goes_on_alone(mission):
    run = mission("blackout").with_seed(5).blackout(start_s=620, duration_s=300).run()
    assert run.mode_at(700) == "autonomous"
    assert run.reached("at:B")

A test that fails tells of the runs that it made; `--farside-logs DIR` keeps their logs there.
"""

import re
import zlib
from collections.abc import Callable, Generator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from farside.missions.run import FinishedRun
    from farside.missions.testing.rehearsal import Rehearsal

# Asserts in there are to say what they found, as in a test's own module.
pytest.register_assert_rewrite("farside.missions.testing.contracts")

_LONGEST = 150
"""How long the name of a test's folder may be, in bytes, before it is cut (project default)."""

_RUNS = pytest.StashKey[list["FinishedRun"]]()


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add `--farside-logs`."""
    parser.getgroup("farside").addoption(
        "--farside-logs",
        metavar="DIR",
        help="keep the logs of all missions that tests run there, in a folder for each test",
    )


@pytest.fixture
def mission(request: pytest.FixtureRequest) -> "Callable[[str | Path], Rehearsal]":
    """Rehearsals of missions in simulated time.

    Call it with the path of a mission file, from the folder of the test file, or with the name of a
    shipped mission, to get a `farside.missions.Rehearsal`. The logs of its runs go to the test's
    `tmp_path`, or where `--farside-logs` says.
    """
    # Every test session of every user who has Farside installed imports this module.
    from farside.missions.testing.rehearsal import Rehearsal, find_mission  # noqa: PLC0415

    runs = request.node.stash.setdefault(_RUNS, [])
    kept = request.config.getoption("--farside-logs")
    if kept is None:
        out = request.getfixturevalue("tmp_path")
    else:
        out = request.config.invocation_params.dir / kept / _folder_name(request.node.nodeid)
    return lambda source: Rehearsal(
        find_mission(source, request.path.parent), out, when_over=runs.append
    )


def _folder_name(test: str) -> str:
    """A name of its own for every test, which any file system takes."""
    name = re.sub(r"[^\w.-]+", "-", test).strip("-")
    _, _, case = test.partition("[")
    if len(name.encode()) <= _LONGEST and re.fullmatch(r"[\w.-]*\]?", case):
        return name
    cut = name.encode()[:_LONGEST].decode(errors="ignore").strip("-")
    return f"{cut}-{zlib.crc32(test.encode()):08x}"


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item,
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Have a failing test tell of its runs."""
    report = yield
    runs = item.stash.get(_RUNS, []) if report.failed else []
    for number, run in enumerate(runs, start=1):
        title = f"farside run {number} of {len(runs)}" if len(runs) > 1 else "farside run"
        report.sections.append((title, _told(run)))
    return report


def _told(run: "FinishedRun") -> str:
    from farside.logs import LogError  # noqa: PLC0415
    from farside.missions.testing.telling import told_of  # noqa: PLC0415

    try:
        return told_of(run)
    except LogError as error:
        return f"{run!r}\nno more can be told: {error}"
