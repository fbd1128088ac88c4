"""What is built holds what the folders hold, and a wheel is all that a mission needs."""

import json
import os
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest
from distributions import FOLDERS, ROOT, build, checkout, environment, install, members

from farside.missions import FinishedRun

pytestmark = pytest.mark.processes
NO_LINKS = (
    "Expected the symbolic link farside/dem -> ../dem, found none: this checkout was made without "
    "symbolic links. Clone again with `git clone -c core.symlinks=true`."
)


@pytest.fixture(scope="module")
def expected() -> list[str]:
    """The files that belong into a wheel, as the folders here hold them."""
    folders = {"farside": "farside"} | {name: f"farside/{name}" for name in FOLDERS}
    return sorted(
        f"{inside}/{path.relative_to(ROOT / folder)}"
        for folder, inside in folders.items()
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and not {"__pycache__", "runs"} & set(path.parts)
    )


def test_a_wheel_holds_what_the_folders_hold(
    used: Path, expected: list[str], tmp_path: Path
) -> None:
    build(used, tmp_path, "--wheel")

    assert members(next(tmp_path.glob("*.whl"))) == expected
    assert {"farside/py.typed", "farside/missions/blackout.toml"} < set(expected)


def test_an_sdist_gives_the_same_wheel(wheel: Path, expected: list[str]) -> None:
    assert members(wheel) == expected


def test_an_sdist_holds_what_a_wheel_is_built_from_and_the_documents(
    wheel: Path, expected: list[str]
) -> None:
    with tarfile.open(next(wheel.parent.glob("*.tar.gz"))) as archive:
        found = [name.partition("/")[2] for name in archive.getnames()]

    pages = [path for path in (ROOT / "docs").rglob("*") if path.is_file()]
    documents = [str(path.relative_to(ROOT)) for path in pages if path.suffix != ".pyc"]
    about = ["CHANGELOG.md", "LICENSE", "README.md", "pyproject.toml", "hatch_build.py"]
    made = ["PKG-INFO", ".gitignore"]
    assert sorted(found) == sorted([*expected, *documents, *about, *made])


def test_gymnasium_makes_a_mission_from_a_wheel(installed: Path, tmp_path: Path) -> None:
    """With nothing imported beforehand; a warning would be an error."""
    script = """
import gymnasium
env = gymnasium.make("farside.gymnasium:farside/teach-v0", overrides={"tick_s": 0.2})
env.reset()
print(env.step(0)[4]["action"])
"""
    command: list[str | Path] = [installed / "python", "-W", "error", "-c", script]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)  # noqa: S603
    assert (done.stdout, done.stderr) == ("N\n", "")


def test_a_wheel_runs_the_first_mission_from_any_folder(
    installed: Path, blackout: FinishedRun, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)

    def farside(*arguments: str) -> bytes:
        return subprocess.check_output([installed / "farside", *arguments])  # noqa: S603

    farside("check", "blackout")
    told = json.loads(farside("run", "blackout", "--in-process", "--json"))

    assert told["digest"] == blackout.digest
    assert (tmp_path / told["log"]).is_file()


@pytest.fixture(scope="module")
def without_links(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A checkout as `git -c core.symlinks=false clone` makes it."""
    return checkout(tmp_path_factory.mktemp("without-links") / "far side", links=False)


@pytest.mark.parametrize("target", ["mission", "test", "lint"])
def test_make_says_that_links_are_missing(without_links: Path, target: str) -> None:
    done = subprocess.run(  # noqa: S603
        ["make", target],  # noqa: S607
        cwd=without_links,
        env={"PATH": os.environ["PATH"]},  # without MAKEFLAGS of the `make test` that runs this
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert NO_LINKS in done.stderr


def test_import_says_that_links_are_missing(without_links: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "farside"],
        cwd=without_links,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1] == f"ImportError: {NO_LINKS}"


@pytest.mark.parametrize("how", ["plain", "editable"])
def test_pip_says_that_links_are_missing(without_links: Path, tmp_path: Path, how: str) -> None:
    option = ["--editable"] if how == "editable" else []
    done = install(environment(tmp_path), *option, without_links)

    assert done.returncode == 1
    assert NO_LINKS in [line.strip() for line in done.stderr.splitlines()]
