"""The ground's records hold only what the ground could know then."""

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

from hypothesis import given, settings
from hypothesis import strategies as st

from farside.missions import MissionFile, load_mission
from farside.missions.build import build_node
from farside.missions.crew.crew import InProcessCrew
from farside.node import Frame, Node, Record, Role, Step, to_ns

DURATION_S = 240.0
CHANGES: dict[str, dict[str, object]] = {
    "blackout": {"link.blackouts": [{"start_s": 90.0, "end_s": 170.0}]},
    "tether": {},
    "teach": {},
}


class Listener:
    """A node that keeps the frames that it was handed, and what it said."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self.frames: list[Frame] = []
        self.records: list[Record] = []

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        self.frames += arrivals
        step = self._node.advance(until_ns, arrivals)
        self.records += step.records
        return step


class Heard(NamedTuple):
    """A mission, the frames that its ground was handed, and what it recorded."""

    mission: MissionFile
    frames: tuple[Frame, ...]
    records: tuple[Record, ...]


@cache
def heard(name: str) -> Heard:
    """What the ground of a mission was handed, and what it recorded."""
    changes = {"duration_s": DURATION_S, "expect": [], **CHANGES[name]}
    mission = load_mission(name, changes).mission
    rover, link, ground = (build_node(role, mission) for role in Role)
    listener = Listener(ground)
    crew = InProcessCrew(rover, link, listener)
    now_ns, end_ns = 0, to_ns(DURATION_S)
    while now_ns < end_ns:
        now_ns = min(now_ns + mission.window_ns, end_ns)
        crew.advance(now_ns)
    assert not crew.lost_processes
    return Heard(mission, tuple(listener.frames), tuple(listener.records))


@settings(max_examples=12, deadline=None)
@given(name=st.sampled_from(sorted(CHANGES)), until_s=st.floats(1.0, DURATION_S))
def test_what_arrives_later_changes_nothing_that_was_recorded_before(
    name: str, until_s: float
) -> None:
    """A ground that is handed nothing but the frames that had arrived by then says the same."""
    run, until_ns = heard(name), to_ns(until_s)
    known = [frame for frame in run.frames if frame.time_ns < until_ns]
    alone = build_node(Role.GROUND, run.mission).advance(until_ns, known)

    before = [record for record in run.records if record.log_time_ns < until_ns]
    assert [record for record in alone.records if record.log_time_ns < until_ns] == before
    assert any(record.topic == "/ground/belief" for record in before) or until_s < 10


@settings(max_examples=5, deadline=None)
@given(name=st.sampled_from(sorted(CHANGES)))
def test_what_never_arrived_was_never_known(name: str) -> None:
    """Without a single frame the ground knows nothing of the rover, whatever the rover did."""
    run = heard(name)
    alone = build_node(Role.GROUND, run.mission).advance(to_ns(60.0), ())

    told = {record.topic for record in alone.records}
    assert not told & {"/ground/belief", "/ground/prediction", "/ground/telemetry", "/ground/event"}
