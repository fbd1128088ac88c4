"""A role's own process: `python -m farside.missions.crew.worker ROLE`, started by `ProcessCrew`.

Standard input brings the briefing and then stays open for as long as the launcher lives. Its end
ends this process at once, so that nothing is left behind however the launcher ended.
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
    """Take the briefing, join the run and play the role until the launcher is gone."""
    # Ctrl-C is for the launcher, which ends its processes in order.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    faulthandler.enable()
    if line := sys.stdin.buffer.readline():
        threading.Thread(target=_leave_with_launcher, daemon=True).start()
        _play(msgspec.json.decode(line, type=Briefing))


def _play(briefing: Briefing) -> None:
    role = briefing.ticket.role
    party = Party(role, build_node(role, briefing.mission))
    with join(briefing.ticket) as exchange:
        exchange.say(*party.report([]))
        while True:
            for said in party.hear(exchange.inbox.get()):
                exchange.say(*said)


def _leave_with_launcher() -> None:
    # Past the buffer of sys.stdin, whose lock an ordinary exit would wait for.
    os.read(sys.stdin.fileno(), 1)
    # Whatever the main thread is doing is for nobody now.
    os._exit(0)


if __name__ == "__main__":
    main()
