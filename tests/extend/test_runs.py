"""Missions flown by a controller, and led by an operator, of one's own."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import msgspec
import pytest
from caller import Caller
from numpy.random import Generator
from pathfinder import Pathfinder

from farside.dem import Choice
from farside.ground import Situation
from farside.logs import LogFile
from farside.messages import Order
from farside.missions import MissionError, Rehearsal, load_mission, run_mission
from farside.missions.extensions.finding import find_class
from farside.missions.extensions.kinds import CONTROLLER, search_path, searching
from farside.places import Chart
from farside.rover import PlainController
from farside.topics import ROVER_ACTION_STARTED, OperatorEntry

HERE = Path(__file__).parent
HELPERS = HERE.parent / "helpers"
RELAY = HERE / "relay.toml"

SHORT = ("--set", "duration_s=60", "--set", "expect=[]")

Mission = Callable[[str | Path], Rehearsal]


def farside(
    *arguments: str | Path, cwd: Path, path: Sequence[Path] = (), ends: int = 0
) -> Mapping[str, object]:
    """The result of `farside run`, as from a command on the path: no folder but `path` is known."""
    root = HERE.parents[1]
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-P", "-m", "farside", "run", *arguments, "--json"],
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, [*path, root]))},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == ends, done.stderr
    result: Mapping[str, object] = json.loads(done.stdout) if done.stdout else {}
    return result


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a mission, and the modules that it names beside it."""
    folder = tmp_path / "far"
    folder.mkdir()
    for file in (RELAY, HELPERS / "pathfinder.py", HELPERS / "caller.py"):
        shutil.copy(file, folder)
    return folder


@pytest.fixture(scope="module")
def begun(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The digest of the first minute of the mission, in which the rover drives."""
    loaded = load_mission(RELAY, {"duration_s": 60.0, "expect": []})
    run = run_mission(loaded, in_process=True, out=tmp_path_factory.mktemp("begun"))
    assert len(run.entries(ROVER_ACTION_STARTED)) > 5
    return run.digest


# --- by name ----------------------------------------------------------------------------------


@pytest.mark.processes
def test_a_run_is_the_same_in_one_process_and_in_four(tmp_path: Path) -> None:
    loaded = load_mission(RELAY)
    alone = run_mission(loaded, in_process=True, out=tmp_path)
    assert alone.result.outcome == "success"
    assert run_mission(loaded, out=tmp_path).digest == alone.digest


@pytest.mark.processes
def test_modules_are_found_beside_the_mission_from_any_folder(
    folder: Path, tmp_path: Path, begun: str
) -> None:
    alone = farside(folder / "relay.toml", *SHORT, "--in-process", cwd=tmp_path)
    apart = farside("far/relay.toml", *SHORT, cwd=tmp_path)
    assert [alone["digest"], apart["digest"]] == [begun, begun]


@pytest.mark.processes
def test_modules_are_found_in_the_current_folder(folder: Path, tmp_path: Path, begun: str) -> None:
    mission = shutil.move(folder / "relay.toml", tmp_path)
    alone = farside(mission, *SHORT, "--in-process", cwd=folder)
    apart = farside(mission, *SHORT, cwd=folder)
    assert [alone["digest"], apart["digest"]] == [begun, begun]


@pytest.mark.processes
def test_the_path_of_python_comes_first_in_every_process(
    folder: Path, tmp_path: Path, begun: str
) -> None:
    """A library's module, and beside the mission one of the same name that would never move."""
    (folder / "pathfinder.py").rename(tmp_path / "pathfinder.py")
    text = (tmp_path / "pathfinder.py").read_text()
    (folder / "pathfinder.py").write_text(text.replace("self.goals and", "False and"))
    (folder / "json.py").write_text("raise RuntimeError('not the standard library')")
    alone = farside("relay.toml", *SHORT, "--in-process", cwd=folder, path=[tmp_path])
    apart = farside("relay.toml", *SHORT, cwd=folder, path=[tmp_path])
    assert [alone["digest"], apart["digest"]] == [begun, begun]


@pytest.mark.processes
def test_a_controller_that_fails_in_flight_is_named(folder: Path, tmp_path: Path) -> None:
    text = (folder / "pathfinder.py").read_text()
    (folder / "pathfinder.py").write_text(text.replace("seen = {self.tokens}", "seen = 1 / 0"))
    alone = farside("far/relay.toml", "--in-process", cwd=tmp_path, ends=3)
    apart = farside("far/relay.toml", cwd=tmp_path, ends=3)
    assert alone["digest"] == apart["digest"]
    assert alone["outcome"] == "aborted"


def test_what_a_controller_imports_in_flight_is_found_too(folder: Path, tmp_path: Path) -> None:
    text = (folder / "pathfinder.py").read_text()
    late = text.replace(
        '"""The first move of the shortest way that it remembers."""', "import late_one"
    )
    (folder / "late_pathfinder.py").write_text(late)
    (folder / "late_one.py").write_text("")
    before = list(sys.path)
    mission = Rehearsal(folder / "relay.toml", tmp_path)
    assert mission.controller("late_pathfinder:Pathfinder").run().result.outcome == "success"
    assert sys.path == before


def test_the_folders_are_searched_in_this_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.path", ["", "/usr/lib/one"])
    monkeypatch.chdir(tmp_path)
    assert search_path(Path("far")) == (str(tmp_path), "/usr/lib/one", str(tmp_path / "far"))


def installed(folder: Path, project: str, module: str) -> Path:
    """A project installed into `folder` that has a controller of the name `pathfinder`."""
    information = folder / f"{project}-1.0.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text(f"Name: {project}\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(
        f"[farside.controllers]\npathfinder = {module}:Pathfinder\n"
    )
    shutil.copy(HELPERS / "pathfinder.py", folder / f"{module}.py")
    return folder


@pytest.mark.processes
def test_an_installed_controller_goes_by_its_name(folder: Path, tmp_path: Path, begun: str) -> None:
    site = installed(tmp_path / "site", "ways", "ways_of_mine")
    named = ("relay.toml", "--set", "rover.controller=pathfinder", *SHORT)
    alone = farside(*named, "--in-process", cwd=folder, path=[site])
    apart = farside(*named, cwd=folder, path=[site])
    assert [alone["digest"], apart["digest"]] == [begun, begun]


def test_a_name_that_two_projects_install_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(installed(tmp_path, "ways", "ways_of_mine"))
    monkeypatch.syspath_prepend(installed(tmp_path, "paths", "paths_of_others"))
    with pytest.raises(MissionError) as refused:
        load_mission(RELAY, {"rover.controller": "pathfinder"})
    assert (
        'expected one controller of that name, found "pathfinder" installed 2 times, as '
        "paths_of_others:Pathfinder and ways_of_mine:Pathfinder: name one of these"
    ) in str(refused.value)


def test_a_class_may_stand_inside_another(tmp_path: Path) -> None:
    (tmp_path / "nested.py").write_text("class Outer:\n    class Inner: ...")
    with searching([str(tmp_path)]):
        assert find_class(CONTROLLER, "nested:Outer.Inner").__qualname__ == "Outer.Inner"


# --- from a test ------------------------------------------------------------------------------


def test_a_class_of_the_test_flies_the_rover(mission: Mission) -> None:
    """It holds to the mission's own expectations: it learned the ways from the tour."""
    run = mission("blackout").controller(Pathfinder, explores=False).run()
    assert run.result.outcome == "success"
    assert run.mode_at(700) == "autonomous"


def test_a_class_defined_within_a_test(mission: Mission) -> None:
    """The log says which class it was."""

    class Wanderer(PlainController):
        def choose(self, *, explore: bool = True) -> Choice | None:
            if not (self.goals and explore):
                return None
            action = self.actions[self.rng.integers(len(self.actions))]
            return Choice(action, goal=self.goals[0].tokens)

    rehearsal = mission("blackout").set("duration_s", 700.0).controller(Wanderer)
    run = rehearsal.run()
    assert rehearsal.run().digest == run.digest
    assert rehearsal.with_seed(2).run().digest != run.digest
    said = LogFile(run.log).attachments["mission.json"].data
    assert msgspec.json.decode(said)["rover"]["controller"] == (
        f"{__name__}:test_a_class_defined_within_a_test.<locals>.Wanderer"
    )


def test_a_controller_that_chooses_what_no_rover_can_do_ends_the_run(mission: Mission) -> None:
    class Flier(PlainController):
        def choose(self, *, explore: bool = True) -> Choice | None:
            return Choice("up") if explore else None

    (lost,) = mission(RELAY).controller(Flier).run().lost_processes
    assert lost.role == "rover"
    assert lost.last_words.endswith(
        "ValueError: expected the controller to choose one of N, E, S, W, found 'up'"
    )


def test_an_operator_of_the_test_leads(mission: Mission) -> None:
    asked: list[int] = []

    class Silent:
        progress = OperatorEntry(0, 0, None)

        def __init__(self, chart: Chart, *, rng: Generator) -> None:
            asked.append(len(chart.places))
            self._rng = rng

        def act(self, situation: Situation) -> Sequence[Order]:
            asked.append(situation.now_ns)
            return ()

    run = mission("blackout").set("duration_s", 10.0).operator(Silent).run()
    assert run.lost_processes == ()
    assert asked[:2] == [74, 74]  # made to be checked, and for the run
    assert len(asked[2:]) == 250


def test_by_name_and_with_options(mission: Mission) -> None:
    rehearsal = mission(RELAY).operator("caller:Caller", places=["B"])
    assert rehearsal.run().result.operator.of == 1
    by_class = rehearsal.operator(Caller, places=["B"]).run()
    assert by_class.digest == rehearsal.run().digest
    with pytest.raises(MissionError, match="expected places on the map, found Z"):
        rehearsal.operator(Caller, places=["Z"]).run()


def test_an_operator_has_a_random_stream_of_its_own(mission: Mission) -> None:
    """Another thinks for other times, and the rover's wheels slip as before."""
    hasty = mission(RELAY).operator(Caller, places=["A"], think_s=1.0).run()
    slow = mission(RELAY).operator(Caller, places=["A"], think_s=30.0).run()
    first = mission(RELAY).operator(Caller, places=["A"], think_s=1.0).with_seed(2).run()
    assert len({run.digest for run in (hasty, slow, first)}) == 3


def test_a_class_in_place_of_a_name_stays_in_this_process(tmp_path: Path) -> None:
    loaded = load_mission("blackout", controller=Pathfinder)
    with pytest.raises(ValueError, match="name it in the mission as module:Class"):
        run_mission(loaded, out=tmp_path)


def test_a_class_that_is_no_controller_is_refused(mission: Mission) -> None:
    with pytest.raises(MissionError, match="without sense, choose, perform"):
        mission("blackout").set("rover.controller", dict).run()
