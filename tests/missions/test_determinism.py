"""The same mission and seed give the same run, however it is run."""

import json
import math
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import pytest
from noting import with_pictures
from short_life import SHORT as LIFE

from farside.logs import LogFile, Recorder, digest_of
from farside.missions import FinishedRun, load_mission, run_mission
from farside.missions.build import build_node
from farside.missions.conductor import Conductor, WallClock, Watcher
from farside.missions.crew.crew import InProcessCrew
from farside.missions.interrupts import Interrupts
from farside.node import Record, Role, to_ns

BAD = {
    f"link.{way}.{key}": value
    for way in ("up", "down")
    for key, value in {
        "loss": {"model": "gilbert-elliott", "p": 0.02, "r": 0.3},
        "jitter": {"spread_s": 0.3, "correlation": 0.5},
        "reorder": {"share": 0.05, "hold_s": 1.0},
        "duplicate": 0.05,
        "corrupt": 0.05,
    }.items()
}
SHORT = {"duration_s": 60.0, "link.blackouts": [{"start_s": 20.0, "end_s": 50.0}]}


def digest(tmp_path: Path, changes: Mapping[str, Any] | None = None, **how: Any) -> str:
    loaded = load_mission("blackout", changes or {})
    return run_mission(loaded, **{"in_process": True, "out": tmp_path, **how}).digest


@pytest.fixture(scope="module")
def reference(blackout: FinishedRun) -> str:
    """The digest of the whole shipped mission."""
    return blackout.digest


def test_a_second_run_in_one_process(reference: str, tmp_path: Path) -> None:
    assert digest(tmp_path) == reference


@pytest.mark.processes
def test_a_run_with_a_process_for_each_role(reference: str, tmp_path: Path) -> None:
    assert digest(tmp_path, in_process=False) == reference


def test_a_run_with_short_windows(reference: str, tmp_path: Path) -> None:
    assert digest(tmp_path, window_ns=to_ns(0.2)) == reference


@pytest.mark.parametrize("changes", [LIFE, LIFE | BAD], ids=["good link", "bad link"])
def test_a_run_with_windows_of_any_length(tmp_path: Path, changes: dict[str, Any]) -> None:
    """One tick, all of the light time, and a length that does not divide it."""
    digests = {digest(tmp_path, changes, window_ns=to_ns(window_s)) for window_s in (0.1, 0.3, 0.2)}
    assert digests == {digest(tmp_path, changes)}


@pytest.mark.parametrize("hash_seed", ["0", "4711"])
def test_a_run_under_any_hash_seed(reference: str, tmp_path: Path, hash_seed: str) -> None:
    command = [
        sys.executable,
        "-m",
        "farside",
        "run",
        "blackout",
        "--in-process",
    ]
    result = subprocess.run(  # noqa: S603
        [*command, "--json", "--out", str(tmp_path)],
        env={**os.environ, "PYTHONHASHSEED": hash_seed},
        capture_output=True,
        check=True,
    )
    assert json.loads(result.stdout)["digest"] == reference


def test_another_seed_is_another_run(tmp_path: Path) -> None:
    assert digest(tmp_path, {**SHORT, "seed": 2}) != digest(tmp_path, SHORT)


def test_the_digest_of_a_run_is_that_of_its_log(tmp_path: Path) -> None:
    run = run_mission(load_mission("blackout", SHORT), in_process=True, out=tmp_path)
    assert LogFile(run.log).digest() == run.digest


def test_a_paced_run_on_a_fake_clock(tmp_path: Path) -> None:
    """Pacing makes windows shorter and waits between them; here on a fake clock."""
    waited: list[float] = []
    loaded = load_mission("blackout", SHORT)
    mission = loaded.mission
    crew = InProcessCrew(*(build_node(role, mission) for role in Role))
    clock = WallClock(now=lambda: math.fsum(waited), sleep=waited.append)
    recorder = _Memory()
    Conductor(
        mission, crew, cast("Recorder", recorder), recorder, Interrupts(), pace=5.0, clock=clock
    ).run()
    assert math.fsum(waited) == pytest.approx(60.0 / 5.0)
    assert len(waited) > 100, "windows short enough to watch the run move"
    assert digest_of(with_pictures(recorder.records)) == digest(tmp_path, SHORT)


def test_the_highest_pace_is_none(tmp_path: Path) -> None:
    assert digest(tmp_path, SHORT, pace=1e308) == digest(tmp_path, SHORT)


@pytest.mark.processes
def test_a_paced_run_in_processes_on_the_real_clock(tmp_path: Path) -> None:
    changes = {**SHORT, "duration_s": 40.0}
    paced = digest(tmp_path, changes, in_process=False, pace=40.0)
    assert paced == digest(tmp_path, changes)


def test_two_runs_in_one_process_do_not_affect_each_other(tmp_path: Path) -> None:
    missions = [load_mission("blackout", SHORT, seed=seed).mission for seed in (1, 2)]
    crews = [InProcessCrew(*(build_node(role, m) for role in Role)) for m in missions]
    memories = [_Memory(), _Memory()]
    for until_ns in range(to_ns(1.0), to_ns(61.0), to_ns(1.0)):
        for crew, memory in zip(crews, memories, strict=True):
            memory.write(sorted(crew.advance(until_ns), key=lambda r: r.log_time_ns))
    for seed, memory in zip((1, 2), memories, strict=True):
        assert digest_of(with_pictures(memory.records)) == digest(tmp_path, {**SHORT, "seed": seed})


def test_the_seed_of_the_link_does_not_move_a_rock(tmp_path: Path) -> None:
    """Random streams are separate: on a link without loss, its seed changes nothing."""
    lossless = {**SHORT, "link.up.loss": 0.0, "link.down.loss": 0.0}
    other_link = digest(tmp_path, {**lossless, "link.seed": 99})
    assert other_link == digest(tmp_path, lossless)
    assert other_link != digest(tmp_path, {**lossless, "seed": 99})


class _Memory(Watcher):
    """A recorder and watcher that keeps the records in memory."""

    def __init__(self) -> None:
        self.records: list[Record] = []

    def write(self, records: Sequence[Record]) -> None:
        self.records += records

    def flush(self) -> None:
        pass

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        pass

    def wait(self, roles: Sequence[Role], waited_s: float) -> None:
        pass
