"""Processes that are stopped, and connections that say nothing: told, and no reason to hang."""

import os
import signal
import socket
from collections.abc import Sequence
from contextlib import ExitStack

import pytest

from farside.missions.crew.crew import CrewError, Patience
from farside.missions.crew.network import join, open_router
from farside.missions.crew.processes import ProcessCrew
from farside.missions.schema import MissionFile
from farside.node import Role
from tests.processes.conftest import Family, Voyage

pytestmark = pytest.mark.processes


@pytest.mark.parametrize("stopped", Role)
def test_a_stopped_process_is_named_and_waited_for(
    stopped: Role, mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    told: list[tuple[list[Role], float]] = []

    def tell(roles: Sequence[Role], waited_s: float) -> None:
        told.append((list(roles), waited_s))
        if list(roles) == [stopped]:
            os.kill(family.roles()[stopped], signal.SIGCONT)

    with ProcessCrew(mission, Patience(tell_s=0.0), tell) as crew:
        journey = voyage(crew, mission)
        journey.window()
        told.clear()
        os.kill(family.roles()[stopped], signal.SIGSTOP)
        journey.window()
        assert [stopped] in [roles for roles, _ in told]
        assert all(waited_s >= 0 for _, waited_s in told)
        assert crew.lost_processes == ()


def test_nobody_is_told_of_a_wait_shorter_than_the_patience(
    mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    told: list[object] = []
    with ProcessCrew(mission, Patience(tell_s=3600.0), lambda *wait: told.append(wait)) as crew:
        voyage(crew, mission).to_the_end()
    assert told == []


def test_a_run_is_given_up_when_its_patience_ends(
    mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    with ProcessCrew(mission) as crew:
        journey = voyage(crew, mission)
        journey.window()
        for pid in family.pids():
            os.kill(pid, signal.SIGSTOP)
        crew._patience = Patience(give_up_s=0.0)
        with pytest.raises(CrewError, match=r"^the rover process was not ready after 0 s at 1\.28"):
            journey.window()


def test_connections_that_say_nothing_keep_no_role_from_joining() -> None:
    with open_router() as router, ExitStack() as stack:
        host, _, port = router.tickets[Role.ROVER].locator.removeprefix("tcp/").rpartition(":")
        for _ in range(150):
            stack.enter_context(socket.create_connection((host, int(port))))
        for ticket in router.tickets.values():
            stack.enter_context(join(ticket))
