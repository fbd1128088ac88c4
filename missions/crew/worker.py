"""The process of one role: `python -m farside.missions.crew.worker ROLE`, started by `ProcessCrew`.

Standard input carries the briefing and then stays open as a leash: when it closes, this process
exits at once, so that none is left behind, however the launcher ended.
"""

import faulthandler
import os
import signal
import sys
import threading

import msgspec

from farside.missions.build import build_node
from farside.missions.crew.barrier import Briefing, Party
from farside.missions.crew.network import join


def main() -> None:
    """Read the briefing, join the run and play the role until the launcher is gone."""
    # Ctrl-C is for the launcher, which then ends its processes in order.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    faulthandler.enable()
    if line := sys.stdin.buffer.readline():
        threading.Thread(target=_exit_with_launcher, daemon=True).start()
        _play(msgspec.json.decode(line, type=Briefing))


def _play(briefing: Briefing) -> None:
    role = briefing.ticket.role
    if briefing.path:
        sys.path[:] = briefing.path
    party = Party(role, build_node(role, briefing.mission))
    with join(briefing.ticket) as connection:
        connection.publish(*party.report([]))
        while True:
            for sample in party.take(connection.inbox.get()):
                connection.publish(*sample)


def _exit_with_launcher() -> None:
    # Not through sys.stdin, whose lock an ordinary exit would wait for.
    os.read(sys.stdin.fileno(), 1)
    # At once: nobody needs what the main thread is doing.
    os._exit(0)


if __name__ == "__main__":
    main()
