"""A role that publishes on its own keys what it must not: its own error, and nobody else's."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import msgspec
import pytest

from farside.missions.crew.barrier import Complaint, Frames, WindowReport
from farside.missions.crew.crew import CrewError
from farside.missions.crew.network import in_key, join, out_key, report_key
from farside.missions.crew.processes import ProcessCrew
from farside.missions.schema import MissionFile
from farside.node import Direction, Frame, Record, Role
from tests.processes.conftest import Family, Voyage

pytestmark = pytest.mark.processes

encode = msgspec.msgpack.encode


@contextmanager
def run_with_rogue(
    mission: MissionFile, voyage: type[Voyage], role: Role
) -> Iterator[tuple[ProcessCrew, Voyage, Callable[[str, bytes], None]]]:
    """A run after its first window, and how `role` publishes beside what its process does."""
    with ExitStack() as stack:
        crew = stack.enter_context(ProcessCrew(mission))
        journey = voyage(crew, mission)
        journey.window()
        rogue = stack.enter_context(join(crew._router.tickets[role]))
        yield crew, journey, rogue.publish


REPORTS: dict[str, Callable[[Role], bytes]] = {
    "garbage": lambda _: b"\xc1",
    "100 MB": lambda _: bytes(100_000_000),
    "another type": lambda _: encode(["WindowReport", "one", []]),
    "a past window": lambda _: encode(WindowReport(0, [])),
    "a future window": lambda _: encode(WindowReport(10**6, [])),
    "an unknown topic": lambda _: encode(WindowReport(2, [Record("/no/such", 0, 0, b"{}")])),
    "no record of the topic": lambda role: encode(
        WindowReport(2, [Record(f"/{role}/frame", 1_280_000_000, 0, b"[]")])
    ),
    "a false accusation": lambda role: encode(Complaint(role, "is a liar")),
}


@pytest.mark.parametrize("payload", REPORTS.values(), ids=REPORTS)
@pytest.mark.parametrize("role", Role)
def test_a_wrong_report_is_the_error_of_its_role(
    role: Role,
    payload: Callable[..., bytes],
    mission: MissionFile,
    voyage: type[Voyage],
    family: Family,
) -> None:
    with run_with_rogue(mission, voyage, role) as (crew, journey, publish):
        publish(report_key(role), payload(role))
        if role is Role.ROVER:
            with pytest.raises(CrewError, match=r"^the rover process "):
                journey.to_the_end()
        else:
            journey.to_the_end()
            assert [lost.role for lost in crew.lost_processes] == [role]


FRAMES: dict[str, Callable[[Direction], bytes]] = {
    "garbage": lambda _: b"\xc1",
    "100 MB": lambda _: bytes(100_000_000),
    "a past window": lambda _: encode(Frames(0, [])),
    "a future window": lambda _: encode(Frames(10**6, [])),
    "the wrong way": lambda way: encode(Frames(1, [Frame(way.opposite, 0, 1_500_000_000, b"")])),
    "a frame of the past": lambda way: encode(Frames(1, [Frame(way, 0, 0, b"")])),
}


@pytest.mark.parametrize("payload", FRAMES.values(), ids=FRAMES)
@pytest.mark.parametrize(
    "sender",
    [
        (Role.ROVER, out_key(Role.ROVER), Direction.DOWN, Role.LINK),
        (Role.GROUND, out_key(Role.GROUND), Direction.UP, Role.LINK),
        (Role.LINK, in_key(Role.ROVER), Direction.UP, Role.ROVER),
        (Role.LINK, in_key(Role.GROUND), Direction.DOWN, Role.GROUND),
    ],
)
def test_wrong_frames_are_the_error_of_their_sender(
    sender: tuple[Role, str, Direction, Role],
    payload: Callable[..., bytes],
    mission: MissionFile,
    voyage: type[Voyage],
    family: Family,
) -> None:
    role, key, way, receiver = sender
    with run_with_rogue(mission, voyage, role) as (crew, journey, publish):
        publish(key, payload(way))
        words = f"the {role} process misled the {receiver}: it sent"
        if role is Role.ROVER:
            with pytest.raises(CrewError, match=f"^{words}"):
                journey.to_the_end()
        else:
            journey.to_the_end()
            [lost] = crew.lost_processes
            assert str(lost).startswith(words)


def test_a_process_that_misbehaves_is_ended_before_the_run_goes_on(
    mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    with run_with_rogue(mission, voyage, Role.GROUND) as (crew, journey, publish):
        pid = family.roles()[Role.GROUND]
        publish(report_key(Role.GROUND), b"\xc1")
        journey.to_the_end()
        assert crew.lost_processes
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
