"""JavaScript in tests: pinned npm packages, installed once a machine, outside the repository.

All test processes share the folder: the first to need it installs, the others wait for a lock.
"""

import fcntl
import hashlib
import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

PACKAGES = {
    "@mcap/core": "2.2.2",
    "ajv": "8.20.0",
    "fzstd": "0.1.1",
    "protobufjs": "8.8.1",
}
"""What scripts may import, each with its exact version."""

_INSTALL_S = 300
_RUN_S = 120


def run_script(script: str, *arguments: str | Path) -> str:
    """What an ES module prints, run by Node where it can import any of `PACKAGES`.

    A test that calls it is skipped where there is no npm.

    Args:
        script: the module's text.
        arguments: what it finds in `process.argv.slice(2)`.

    Raises:
        AssertionError: if the packages cannot be installed, or the script fails; with its words.
    """
    ended = subprocess.run(  # noqa: S603
        [_program("node"), "--input-type=module", "-", *map(str, arguments)],
        input=script,
        cwd=packages(),
        capture_output=True,
        text=True,
        check=False,
        timeout=_RUN_S,
    )
    assert ended.returncode == 0, f"node ended with {ended.returncode}:\n{ended.stderr}"
    return ended.stdout


def packages() -> Path:
    """The folder in which `PACKAGES` are installed, under `node_modules`.

    Raises:
        AssertionError: if they cannot be installed; with npm's words.
    """
    npm = _program("npm")
    _program("node")
    home = _cache()
    home.mkdir(parents=True, exist_ok=True)
    pins = json.dumps(PACKAGES, sort_keys=True)
    folder = home / f"npm-{hashlib.sha256(pins.encode()).hexdigest()[:12]}"
    with (home / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not folder.exists():
            _install(npm, home / "new", folder)
    return folder


def _install(npm: str, scratch: Path, folder: Path) -> None:
    """Install into `scratch` and rename it, so that a folder of this name is always whole."""
    shutil.rmtree(scratch, ignore_errors=True)  # of a process that was killed
    scratch.mkdir()
    try:
        (scratch / "package.json").write_text(json.dumps({"private": True}))
        ended = subprocess.run(  # noqa: S603
            [
                npm,
                "install",
                "--ignore-scripts",
                "--no-audit",
                "--no-fund",
                "--no-package-lock",
                *(f"{name}@{version}" for name, version in PACKAGES.items()),
            ],
            cwd=scratch,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
            timeout=_INSTALL_S,
        )
        assert ended.returncode == 0, f"npm cannot install {PACKAGES}:\n{ended.stderr}"
        scratch.rename(folder)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _cache() -> Path:
    """The user's cache folder for these tests."""
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "farside-tests"


def _program(name: str) -> str:
    found = shutil.which(name)
    if found is None:
        pytest.skip(f"expected {name} on this machine, found none")
    return found
