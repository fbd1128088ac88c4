"""Looking at the ground while it runs in a process of its own, over Zenoh."""

import os
import signal

import msgspec
import pytest

from farside.ground.view.view import Focus
from farside.missions.build import build_node
from farside.missions.crew.barrier import Seen
from farside.missions.crew.crew import InProcessCrew
from farside.missions.crew.network import report_key
from farside.missions.schema import MissionFile
from farside.node import Role
from tests.processes.conftest import Family, Voyage
from tests.processes.test_misconduct import run_with_rogue

pytestmark = pytest.mark.processes


def test_what_is_seen_over_zenoh_is_what_is_seen_in_one_process_until_the_ground_is_lost(
    mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    """Looks change no record, and whoever misbehaves at them is lost as ever.

    A view that nobody asked for is the error of who sent it. The rover goes on without a ground
    that died while it was looked at.
    """
    alone = voyage(InProcessCrew(*(build_node(role, mission) for role in Role)), mission)
    alone.window()
    with run_with_rogue(mission, voyage, Role.LINK) as (crew, apart, publish):
        for window in range(20):
            assert apart.window() == alone.window()
            if window % 3 == 0:
                seen = crew.look(Focus(heat=True))
                assert seen == alone.crew.look(Focus(heat=True))
                assert seen is not None
                assert seen.now_ns == apart.now_ns
        assert crew.lost_processes == ()

        publish(report_key(Role.LINK), msgspec.msgpack.encode(Seen(7, None)))
        while not crew.lost_processes:
            apart.window()
        [link] = crew.lost_processes
        assert (link.role, link.how) == (Role.LINK, "sent a view that nobody asked for")

        os.kill(family.roles()[Role.GROUND], signal.SIGKILL)
        assert crew.look(Focus()) is None
        ground = crew.lost_processes[-1]
        assert (ground.role, ground.how) == (Role.GROUND, "was ended by SIGKILL")
        assert ground.time_ns == apart.now_ns
        assert crew.look(Focus()) is None
        assert {record.topic.split("/")[1] for record in apart.window()} == {"truth", "rover"}
