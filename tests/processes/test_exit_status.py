"""Whatever fails, `farside run` ends with the documented status and one line for people."""

import os
import resource
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from farside.logs import LogFile
from farside.node import Role

pytestmark = pytest.mark.processes

SETTINGS = ("--set", "duration_s=100", "--set", "expect=[]")
LOG = "blackout-seed1-1.mcap"

# Read by every Python process at its start, ours and those of the crew.
SABOTAGE = """
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import PathFinder


class Saboteur(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name != MODULE:
            return None
        spec = PathFinder.find_spec(name, path)
        load = spec.loader.exec_module

        def exec_module(module):
            load(module)
            sabotage(module)

        spec.loader.exec_module = exec_module
        return spec


sys.meta_path.insert(0, Saboteur())
"""

RAISING = """
MODULE = "farside.{role}.node"

def sabotage(module):
    advance = module.{kind}.advance

    def raising(self, until_ns, arrivals):
        if until_ns > 50_000_000_000:
            raise ValueError("the wheels came off")
        return advance(self, until_ns, arrivals)

    module.{kind}.advance = raising
"""

BROKEN_HERE = """
MODULE = "farside.missions.run"

def sabotage(module):
    def raising(*_):
        raise KeyError("no such thing")

    module.describe = raising
"""

PORT_TAKEN = """
MODULE = "farside.missions.crew.network"

def sabotage(module):
    import socket

    taken = socket.create_server(("127.0.0.1", 0))
    module._ADDRESS = "tcp/127.0.0.1:%d" % taken.getsockname()[1]
    module._taken = taken
"""

UNIMPORTABLE = """
MODULE = "farside.missions.commands.main"

def sabotage(module):
    raise ImportError("failed to map segment from shared object")
"""


@pytest.fixture
def out(tmp_path: Path) -> Path:
    """The folder for logs."""
    return tmp_path / "runs"


def run(
    out: Path, *options: str, limits: dict[int, int] | None = None, sabotage: str = "", **env: str
) -> subprocess.CompletedProcess[str]:
    """`farside run` to its end, with limits of the system, and with a fault put into it."""
    folder = out.parent / "sabotage"
    folder.mkdir(exist_ok=True)
    (folder / "sitecustomize.py").write_text(SABOTAGE + sabotage if sabotage else "")

    def limit() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        for number, value in (limits or {}).items():
            resource.setrlimit(number, (value, value))

    return subprocess.run(  # noqa: S603 - our own command
        [sys.executable, "-m", "farside", "run", "blackout", *SETTINGS, "--out", out, *options],
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=limit,
        env=os.environ | {"PYTHONPATH": str(folder)} | env,
    )


def assert_ended_in_words(done: subprocess.CompletedProcess[str], status: int, words: str) -> None:
    assert done.returncode == status, done.stderr
    assert "Traceback" not in done.stderr
    assert "panicked" not in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("farside: ")
    assert words in done.stderr


@pytest.mark.parametrize("files", [8, 12, 20, 30])
def test_too_few_open_files(files: int, out: Path) -> None:
    done = run(out, limits={resource.RLIMIT_NOFILE: files})
    assert_ended_in_words(done, 3, "Too many open files; raise the limit with `ulimit -n`")
    assert not out.exists()


@pytest.mark.parametrize("space_byte", [800_000_000, 400_000_000, 200_000_000, 150_000_000])
def test_too_little_memory(space_byte: int, out: Path) -> None:
    done = run(out, limits={resource.RLIMIT_AS: space_byte})
    assert_ended_in_words(done, 3, "")


def test_few_open_files_suffice_in_one_process(out: Path) -> None:
    assert run(out, "--in-process", limits={resource.RLIMIT_NOFILE: 8}).returncode == 0


def test_a_port_that_cannot_be_listened_on(out: Path) -> None:
    assert_ended_in_words(run(out, sabotage=PORT_TAKEN), 3, "the run's network cannot start: ")


@pytest.mark.parametrize("options", [["--in-process"], []], ids=["one process", "four"])
def test_a_disk_that_fills_up_leaves_what_fitted(options: Sequence[str], out: Path) -> None:
    done = run(out, *options, limits={resource.RLIMIT_FSIZE: 200_000})
    assert_ended_in_words(done, 3, f"{out / LOG} cannot be written: File too large")
    assert list(LogFile(out / LOG).records())


def test_a_full_disk_takes_no_log_and_leaves_none(out: Path) -> None:
    done = run(out, "--in-process", limits={resource.RLIMIT_FSIZE: 100})
    assert_ended_in_words(done, 3, f"{out / LOG} cannot be written: File too large")
    assert list(out.iterdir()) == []


def test_a_disk_that_is_full_at_the_start_of_the_network(out: Path) -> None:
    done = run(out, limits={resource.RLIMIT_FSIZE: 10})
    assert_ended_in_words(done, 3, "the run's network cannot start: File too large")


@pytest.mark.parametrize("options", [["--in-process"], []], ids=["one process", "four"])
def test_a_folder_that_cannot_be_made(options: Sequence[str], out: Path) -> None:
    out.write_text("a file")
    assert_ended_in_words(run(out, *options), 2, f"{out}: expected a folder for logs")


@pytest.mark.parametrize("options", [["--in-process"], []], ids=["one process", "four"])
@pytest.mark.parametrize(("role", "kind"), [("rover", "Rover"), ("ground", "Ground")])
def test_a_node_that_raises(role: Role, kind: str, options: Sequence[str], out: Path) -> None:
    done = run(out, *options, sabotage=RAISING.format(role=role, kind=kind))
    assert_ended_in_words(done, 3, "s of simulated time: ValueError: the wheels came off; the log")
    assert str(out / LOG) in done.stderr
    assert f"the {role} " in done.stderr
    left = LogFile(out / LOG)
    assert left.complete
    assert b"in raising" in left.attachments[f"{role}-last-words.txt"].data


def test_the_same_node_raises_with_the_same_digest_in_one_process_and_in_four(out: Path) -> None:
    sabotage = RAISING.format(role="ground", kind="Ground")
    logs = [out / "blackout-seed1-1.mcap", out / "blackout-seed1-2.mcap"]
    run(out, "--in-process", sabotage=sabotage)
    run(out, sabotage=sabotage)
    one, four = (LogFile(log).digest() for log in logs)
    assert one == four


@pytest.mark.parametrize("options", [["--in-process"], []], ids=["one process", "four"])
@pytest.mark.parametrize("fault", [BROKEN_HERE, UNIMPORTABLE], ids=["running", "starting"])
def test_a_fault_of_our_own(fault: str, options: Sequence[str], out: Path) -> None:
    done = run(out, *options, sabotage=fault)
    assert_ended_in_words(done, 3, "a fault of Farside itself, not of its input: ")


@pytest.mark.parametrize(
    "fault", [BROKEN_HERE, RAISING.format(role="rover", kind="Rover")], ids=["launcher", "rover"]
)
def test_developers_see_the_traceback(fault: str, out: Path) -> None:
    done = run(out, sabotage=fault, FARSIDE_TRACEBACK="1")
    assert done.returncode == 3
    assert "Traceback (most recent call last):" in done.stderr
    assert "in raising" in done.stderr


DAMAGE = """
MODULE = "farside.missions.conductor"

def sabotage(module):
    run = module.Conductor.run

    def damaging(self):
        run(self)
        path = self._recorder.path
        {damage}

    module.Conductor.run = damaging
"""


@pytest.mark.parametrize("options", [["--in-process"], []], ids=["one process", "four"])
@pytest.mark.parametrize(
    ("damage", "words"),
    [
        ("path.unlink()", "was deleted or replaced while it was written"),
        ("path.rename(path.parent / 'other')", "was deleted or replaced while it was written"),
        ("path.open('r+').truncate(1000)", "was cut short while it was written"),
    ],
)
def test_a_log_that_somebody_took_away(
    damage: str, words: str, options: Sequence[str], out: Path
) -> None:
    done = run(out, *options, sabotage=DAMAGE.format(damage=damage))
    assert_ended_in_words(done, 3, f"the log {out / LOG} {words}")
