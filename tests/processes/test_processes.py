"""A crew of real processes: the same records, and every way to lose a process."""

import os
import signal
from collections.abc import Iterable, Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path

import msgspec
import pytest
from relayed import hop, relayed

from farside.missions import MissionFile, load_mission
from farside.missions.build import build_node
from farside.missions.crew import processes
from farside.missions.crew.crew import CrewError, InProcessCrew
from farside.missions.crew.network import advance_key
from farside.missions.crew.processes import ProcessCrew
from farside.node import Record, Role, to_ns
from tests.processes.conftest import Family, Voyage

pytestmark = pytest.mark.processes

LISTENING, UNCONNECTED = "0A", "07"
OPEN_STATES = {"tcp": LISTENING, "tcp6": LISTENING, "udp": UNCONNECTED, "udp6": UNCONNECTED}
LOOPBACK = "0100007F"


def recorders(windows: Iterable[list[Record]]) -> set[str]:
    """The first parts of all topics: who recorded something."""
    return {record.topic.split("/")[1] for record in chain(*windows)}


def executable(path: Path, *lines: str) -> str:
    """A shell script to run in place of Python."""
    path.write_text("\n".join(["#!/bin/sh", *lines]))
    path.chmod(0o700)
    return str(path)


def sockets(pid: int) -> Iterator[str]:
    """The inodes of the sockets that a process has open."""
    for handle in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(FileNotFoundError):
            yield str(handle.readlink()).removeprefix("socket:")


def open_sockets(pid: int) -> list[str]:
    """The addresses, in the kernel's hexadecimal, at which a process accepts traffic."""
    inodes = set(sockets(pid))
    addresses = []
    for table, open_state in OPEN_STATES.items():
        for line in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]:
            _, local, _, state, *_, inode = line.split()[:10]
            if state == open_state and f"[{inode}]" in inodes:
                addresses.append(local.split(":")[0])
    return addresses


def test_processes_make_the_same_records_as_plain_calls(
    mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    alone = InProcessCrew(*(build_node(role, mission) for role in Role))
    expected = voyage(alone, mission).to_the_end()
    assert recorders(expected) == {"truth", "rover", "link", "ground"}
    with ProcessCrew(mission) as crew:
        assert voyage(crew, mission).to_the_end() == expected
        assert crew.lost_processes == ()


def test_on_a_link_without_delay_processes_do_the_same_too(
    voyage: type[Voyage], family: Family
) -> None:
    """A window is one tick then, and what is sent in it has arrived before it is over."""
    here = {"link.up.delay_s": 0.0, "link.down.delay_s": 0.0, "duration_s": 4.0}
    mission = load_mission("blackout", {**here, "link.blackouts": [], "expect": []}).mission
    alone = InProcessCrew(*(build_node(role, mission) for role in Role))
    expected = voyage(alone, mission).to_the_end()
    with ProcessCrew(mission) as crew:
        assert voyage(crew, mission).to_the_end() == expected
        assert crew.lost_processes == ()


def test_by_way_of_other_nodes_processes_do_the_same_too(
    voyage: type[Voyage], family: Family
) -> None:
    """Frames are under way at an orbiter for whole windows of 2 s, and wait there for a contact."""
    hops = [
        hop(0, 20, 1, 5, 16_000, 1.5),
        hop(3, 20, 5, 9, 16_000, 0.5),
        hop(0, 6, 9, 5, 16_000, 0.5),
        hop(4, 20, 5, 1, 16_000, 1.5),
    ]
    blackout = load_mission("blackout").mission
    link = relayed(hops, blackouts=())
    mission = msgspec.structs.replace(blackout, duration_s=12.0, link=link, expect=())
    assert mission.window_ns == to_ns(2.0)
    alone = InProcessCrew(*(build_node(role, mission) for role in Role))
    expected = voyage(alone, mission).to_the_end()
    assert any(record.topic == "/link/hop" for record in chain(*expected))
    with ProcessCrew(mission) as crew:
        assert voyage(crew, mission).to_the_end() == expected


def test_each_role_is_a_process_with_the_role_as_an_argument_of_its_own(
    mission: MissionFile, family: Family
) -> None:
    with ProcessCrew(mission):
        assert family.roles().keys() == set(Role)
        assert len(family.pids()) == len(Role)
    assert family.pids() == []


def test_only_the_launcher_listens_and_on_loopback_only(
    mission: MissionFile, family: Family
) -> None:
    assert open_sockets(os.getpid()) == []
    with ProcessCrew(mission):
        assert open_sockets(os.getpid()) == [LOOPBACK]
        assert [open_sockets(pid) for pid in family.pids()] == [[], [], []]


def test_no_password_is_in_a_command_line_or_an_environment(
    mission: MissionFile, family: Family
) -> None:
    with ProcessCrew(mission) as crew:
        passwords = [ticket.password for ticket in crew._router.tickets.values()]
        for role, pid in family.roles().items():
            process = Path(f"/proc/{pid}")
            shown = (process / "cmdline").read_text() + (process / "environ").read_text()
            assert role in shown
            assert not any(password in shown for password in passwords)


def test_no_temporary_file_exists_during_or_after_a_run(
    mission: MissionFile,
    voyage: type[Voyage],
    family: Family,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with ProcessCrew(mission) as crew:
        voyage(crew, mission).window()
        assert list(tmp_path.iterdir()) == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("lost", [Role.GROUND, Role.LINK])
def test_the_run_goes_on_when_a_process_is_killed(
    lost: Role, mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    with ProcessCrew(mission) as crew:
        journey = voyage(crew, mission)
        journey.window()
        last_ns = journey.now_ns
        os.kill(family.roles()[lost], signal.SIGKILL)
        rest = journey.to_the_end()
        [lost_process] = crew.lost_processes
    assert (lost_process.role, lost_process.how, lost_process.time_ns) == (
        lost,
        "was ended by SIGKILL",
        last_ns,
    )
    assert recorders(rest) == {"truth", "rover", "link", "ground"} - {lost}


def test_the_rover_goes_on_when_link_and_ground_are_killed(
    mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    with ProcessCrew(mission) as crew:
        for role in (Role.GROUND, Role.LINK):
            os.kill(family.roles()[role], signal.SIGKILL)
        assert recorders(voyage(crew, mission).to_the_end()) == {"truth", "rover"}
        assert {process.role for process in crew.lost_processes} == {Role.GROUND, Role.LINK}


def test_a_killed_rover_ends_the_run_and_is_named(
    mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    with ProcessCrew(mission) as crew:
        journey = voyage(crew, mission)
        journey.window()
        os.kill(family.roles()[Role.ROVER], signal.SIGKILL)
        with pytest.raises(CrewError, match=r"^the rover process was ended by SIGKILL at 1\.28 s"):
            journey.window()


def test_a_process_that_fails_leaves_its_traceback(
    mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    with ProcessCrew(mission) as crew:
        crew._router.publish(advance_key(Role.GROUND), b"nonsense")
        voyage(crew, mission).window()
        [lost_process] = crew.lost_processes
    assert (lost_process.role, lost_process.how) == (Role.GROUND, "exited with status 1")
    assert lost_process.last_words.startswith("Traceback")
    assert "msgspec." in lost_process.last_words.splitlines()[-1]


def test_a_process_that_cannot_start_is_named_with_its_last_words(
    mission: MissionFile, family: Family, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    refusing = executable(tmp_path / "python", "echo no such luck >&2", "exit 3")
    monkeypatch.setattr("sys.executable", refusing)
    with pytest.raises(CrewError, match=r"exited with status 3 at 0 s .*: no such luck"):
        ProcessCrew(mission).__enter__()


def test_a_process_that_is_not_ready_in_time_is_killed(
    mission: MissionFile, family: Family, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    hanging = executable(tmp_path / "python", "exec tail -f /dev/null")
    monkeypatch.setattr("sys.executable", hanging)
    monkeypatch.setattr(processes, "_START_S", 0.0)
    monkeypatch.setattr(processes, "_END_S", 0.0)
    with pytest.raises(CrewError, match="the rover process was not ready after 0 s"):
        ProcessCrew(mission).__enter__()


def test_a_process_that_hangs_is_killed_on_close(
    mission: MissionFile, family: Family, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "_END_S", 0.0)
    with ProcessCrew(mission):
        for pid in family.pids():
            os.kill(pid, signal.SIGSTOP)
    assert family.pids() == []


def test_a_crew_can_be_closed_twice(mission: MissionFile, family: Family) -> None:
    with ProcessCrew(mission) as crew:
        crew.close()
        crew.close()
    assert family.pids() == []


def test_the_processes_ignore_ctrl_c(
    mission: MissionFile, voyage: type[Voyage], family: Family
) -> None:
    with ProcessCrew(mission) as crew:
        for pid in family.pids():
            os.kill(pid, signal.SIGINT)
        voyage(crew, mission).to_the_end()
        assert crew.lost_processes == ()
