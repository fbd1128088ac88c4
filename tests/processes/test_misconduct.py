"""A role that publishes on its own keys what it must not: its own error, and nobody else's."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

import msgspec
import pytest

from farside.missions import load_mission
from farside.missions.crew.barrier import Complaint, WindowReport
from farside.missions.crew.crew import CrewError
from farside.missions.crew.network import in_key, join, out_key, report_key
from farside.missions.crew.processes import ProcessCrew
from farside.missions.schema import MissionFile
from farside.node import Record, Role
from tests.processes.conftest import Family, Voyage

pytestmark = pytest.mark.processes

encode = msgspec.msgpack.encode
WINDOW_NS = load_mission("blackout").mission.window_ns


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


REPORTS: dict[str, tuple[Callable[[Role, int], bytes], str]] = {
    "garbage": (lambda *_: b"\xc1", "cannot be decoded"),
    "100 MB": (lambda *_: bytes(100_000_000), "cannot be decoded"),
    "another type": (lambda *_: encode(["WindowReport", "one", []]), "cannot be decoded"),
    "a past window": (lambda *_: encode(WindowReport(0, [])), "window 0 in window"),
    "a future window": (lambda *_: encode(WindowReport(10**6, [])), "window 1000000 in window"),
    "an unknown topic": (
        lambda _, window: encode(WindowReport(window, [Record("/no/such", 0, 0, b"{}")])),
        "not one of its topics",
    ),
    "no record of the topic": (
        lambda role, window: encode(
            WindowReport(window, [Record(f"/{role}/frame", (window - 1) * WINDOW_NS, 0, b"[]")])
        ),
        "cannot be decoded",
    ),
    "a false accusation": (lambda role, _: encode(Complaint(role, "is a liar")), "complained"),
}


@pytest.mark.parametrize(("payload", "words"), REPORTS.values(), ids=REPORTS)
def test_a_wrong_report_is_the_error_of_its_role(
    payload: Callable[..., bytes],
    words: str,
    mission: MissionFile,
    voyage: type[Voyage],
    family: Family,
) -> None:
    """One role after another, the rover last: without it there is no run."""
    with ExitStack() as stack:
        crew = stack.enter_context(ProcessCrew(mission))
        journey = voyage(crew, mission)
        for role in (Role.GROUND, Role.LINK, Role.ROVER):
            journey.window()
            rogue = stack.enter_context(join(crew._router.tickets[role]))
            rogue.publish(report_key(role), payload(role, journey.now_ns // WINDOW_NS + 1))
            inbox = crew._router.inbox
            inbox.put(inbox.get())  # it is there before the report of the process itself
            if role is Role.ROVER:
                with pytest.raises(CrewError, match=f"^the rover process .*{words}"):
                    journey.window()
            else:
                journey.window()
                assert crew.lost_processes[-1].role is role
                assert words in str(crew.lost_processes[-1])


FRAMES = {"garbage": b"\xc1", "100 MB": bytes(100_000_000)}
"""What else frames can be wrong in is tried without processes: `tests/missions/test_crew.py`."""


@pytest.mark.parametrize("payload", FRAMES.values(), ids=FRAMES)
@pytest.mark.parametrize(
    "sender",
    [
        (Role.ROVER, out_key(Role.ROVER), Role.LINK),
        (Role.GROUND, out_key(Role.GROUND), Role.LINK),
        (Role.LINK, in_key(Role.ROVER), Role.ROVER),
        (Role.LINK, in_key(Role.GROUND), Role.GROUND),
    ],
)
def test_wrong_frames_are_the_error_of_their_sender(
    sender: tuple[Role, str, Role],
    payload: bytes,
    mission: MissionFile,
    voyage: type[Voyage],
    family: Family,
) -> None:
    role, key, receiver = sender
    with run_with_rogue(mission, voyage, role) as (crew, journey, publish):
        publish(key, payload)
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
