"""A rover behind orbiters and ground stations: the 48-hour plan that comes with ION's own tests.

Rover 8 on Mars, orbiters 5, 6 and 7, stations 2, 3 and 4 of the Deep Space Network, and mission
control, node 1. The rover sees orbiter 6 for twenty minutes in every two hours, then 7 for as long;
the stations see them an hour later, one after the other, at 324 s of light time.
"""

from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

import pytest

from farside.control import CommandStage
from farside.frames import Fate, FrameHop
from farside.logs.file.reading import LogFile
from farside.logs.story.subjects import subject_of
from farside.logs.story.telling import story
from farside.missions import FinishedRun, Rehearsal
from farside.node import Direction, to_ns, to_s
from farside.topics import (
    GROUND_TELEMETRY,
    LINK_FRAME,
    LINK_HOP,
    ROVER_COMMAND,
    ROVER_FAILSAFE,
)

PLAN = Path(__file__).parents[3] / "shared" / "data" / "links" / "ion_mars_relay_48h.ionrc"
pytestmark = pytest.mark.skipif(not PLAN.is_file(), reason="needs ../shared/data")

CONTROL, ROVER, ORBITERS, STATIONS = 1, 8, {5, 6, 7}, {2, 3, 4}

MISSION = f"""
name = "relays"
duration_s = 7300.0
tick_s = 0.2

[world]
map = '''
####
#D.#
####
'''

[rover]
start = "D"

[ground]
heartbeat_s = 20.0

[[ground.script]]
do = "mode"
mode = "autonomous"

[link]
mtu_byte = 512

[link.contacts]
file = "{PLAN}"
ground = {CONTROL}
rover = {ROVER}
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("relays") / "relays.toml"
    path.write_text(MISSION)
    return path


@pytest.fixture
def run(path: Path, mission: Callable[[Path], Rehearsal]) -> FinishedRun:
    return mission(path).run()


def lives(run: FinishedRun) -> dict[tuple[Direction, int], list[FrameHop]]:
    found: defaultdict[tuple[Direction, int], list[FrameHop]] = defaultdict(list)
    for _, one in run.entries(LINK_HOP):
        found[one.direction, one.sequence].append(one)
    return found


def test_all_that_arrives_has_come_by_an_orbiter_and_a_station_in_326_s_of_light(
    run: FinishedRun,
) -> None:
    arrived = [f for _, f in run.entries(LINK_FRAME) if f.fate is Fate.DELIVERED]
    assert {f.direction for f in arrived} == set(Direction)
    hops = lives(run)
    for fate in arrived:
        first, second, third = hops[fate.direction, fate.sequence]
        middle = [ORBITERS, STATIONS]
        ends = [ROVER, CONTROL]
        if fate.direction is Direction.UP:
            middle, ends = middle[::-1], ends[::-1]
        assert first.node == ends[0]
        assert second.node in middle[0]
        assert third.node in middle[1]
        assert third.to == ends[1]
        light_ns = sum(
            (one.arrival_ns or 0) - (one.sent_end_ns or 0)
            for one in hops[fate.direction, fate.sequence]
        )
        assert light_ns == to_ns(1 + 324 + 1)


def test_telemetry_waits_in_the_orbiter_until_a_station_sees_it(run: FinishedRun) -> None:
    """What is made while the orbiter passes comes an hour and 325 s after the start, in a burst."""
    heard = [(t_s, to_s(one.time_ns)) for t_s, one in run.entries(GROUND_TELEMETRY)]
    first_s = heard[0][0]
    assert first_s == pytest.approx(3600 + 324 + 1, abs=0.3)
    assert heard[-1][0] < first_s + 60
    # Every second of the pass, by the one orbiter or the other.
    assert {made_s for _, made_s in heard} >= {float(second) for second in range(1200)}


def test_a_command_is_taken_when_the_orbiter_returns(run: FinishedRun) -> None:
    taken = [t_s for t_s, one in run.entries(ROVER_COMMAND) if one.stage is CommandStage.TAKEN]
    assert taken == [pytest.approx(7200 + 1, abs=0.3)]


def test_the_plan_explains_the_silence_so_nothing_is_taken_for_a_loss(run: FinishedRun) -> None:
    causes = {cause for _, one in run.entries(ROVER_FAILSAFE) for cause in one.causes}
    assert "link lost" not in causes
    assert "silence" not in causes


def test_the_story_of_a_command_tells_each_node_on_its_way(run: FinishedRun) -> None:
    told = "\n".join(line.text for line in story(LogFile(run.log), subject_of("command:1")).lines)
    assert "leaves in frame up:1" in told
    assert "is at node 3 after 1.00 s of light time, and leaves for node 6" in told
    assert "is at node 6 after 324.0 s of light time, and leaves for node 8" in told
    assert "arrives after 1.00 s of light time from node 6" in told
