"""A crew of processes: one each for rover, link and ground, over Zenoh."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from queue import Empty
from typing import IO, Self, cast

import msgspec

from farside.missions.crew.barrier import Advance, Briefing, WindowReport
from farside.missions.crew.crew import Crew, CrewError, LostRole
from farside.missions.crew.network import advance_key, open_router, report_key
from farside.missions.schema import MissionFile
from farside.node import Record, Role

# Wall-clock seconds: between two looks at who is alive; for all to be ready, on a machine far
# busier than it should be; for a process to end by itself before it is made to.
_LOOK_S = 0.05
_START_S = 60.0
_END_S = 2.0

_LAST_WORDS_BYTE = 8192
_REPORTERS = {report_key(role): role for role in Role}
_SIGNALS = {number.value: number.name for number in signal.Signals}

_encode = msgspec.msgpack.Encoder().encode
_report = msgspec.msgpack.Decoder(WindowReport).decode


class ProcessCrew(Crew):
    """The crew of a mission in processes of their own, which live from `__enter__` to `close`.

    Ground and link may be lost on the way: the others go on, and nothing comes from the lost one
    any more. No process outlives this one, however this one ends: see
    `farside.missions.crew.worker`.

    Args:
        mission: what to play, with the seed to play it by.
    """

    def __init__(self, mission: MissionFile) -> None:
        self._mission = mission
        self._resources = ExitStack()
        self._children: dict[Role, _Child] = {}
        self._losses: list[LostRole] = []
        self._now_ns = 0
        self._order: Advance | None = None

    def __enter__(self) -> Self:
        """Start router and processes, and wait until all three are ready.

        Raises:
            CrewError: if a process ends, or is not ready in a minute.
        """
        try:
            self._start()
        except BaseException:
            self.close()
            raise
        return self

    def _start(self) -> None:
        self._ready_by_s = time.monotonic() + _START_S
        self._router = self._resources.enter_context(open_router())
        for role in Role:
            self._children[role] = self._resources.enter_context(_child(role))
        for role, child in self._children.items():
            child.brief(Briefing(self._router.tickets[role], self._mission))
        self._reports(0)

    @property
    def losses(self) -> Sequence[LostRole]:
        """See `Crew.losses`."""
        return tuple(self._losses)

    def advance(self, until_ns: int) -> list[Record]:
        """See `Crew.advance`."""
        window = 0 if self._order is None else self._order.window + 1
        self._say(Advance(window, until_ns, tuple(loss.role for loss in self._losses)))
        reports = self._reports(window + 1)
        self._now_ns = until_ns
        return [record for role in Role if role in reports for record in reports[role]]

    def close(self) -> None:
        """End the processes, by force where need be, and the router."""
        self._resources.close()

    def _say(self, order: Advance) -> None:
        self._order = order
        for role in self._children:
            self._router.say(advance_key(role), _encode(order))

    def _reports(self, window: int) -> dict[Role, list[Record]]:
        """What the living recorded, once they are all ready for `window`."""
        reports: dict[Role, list[Record]] = {}
        while late := [role for role in self._children if role not in reports]:
            try:
                key, payload = self._router.inbox.get(timeout=_LOOK_S)
            except Empty:
                self._look_for(late)
                continue
            report = _report(payload)
            if report.window == window:
                reports[_REPORTERS[key]] = report.records
        return reports

    def _look_for(self, late: list[Role]) -> None:
        """See what became of those who keep the others waiting; go on without, where possible."""
        for role in late:
            if (how := self._children[role].how_it_ended()) is not None:
                self._lose(role, how)
            elif self._order is None and time.monotonic() > self._ready_by_s:
                self._lose(role, f"was not ready after {_START_S:g} s")

    def _lose(self, role: Role, how: str) -> None:
        loss = LostRole(role, self._now_ns, how, self._children.pop(role).last_words())
        if self._order is None or role is Role.ROVER:
            raise CrewError(loss)
        self._losses.append(loss)
        self._say(msgspec.structs.replace(self._order, absent=(*self._order.absent, role)))


class _Child:
    """A role's process. What it prints goes to a file without a name."""

    def __init__(self, process: subprocess.Popen[bytes], output: IO[bytes]) -> None:
        self._process, self._output = process, output
        self._leash = cast("IO[bytes]", process.stdin)

    def brief(self, briefing: Briefing) -> None:
        # That it ended already is found out, with the reason, when its report is waited for.
        with suppress(BrokenPipeError):
            self._leash.write(msgspec.json.encode(briefing) + b"\n")
            self._leash.flush()

    def how_it_ended(self) -> str | None:
        """What became of the process, `None` while it lives."""
        status = self._process.poll()
        if status is None or status >= 0:
            return None if status is None else f"exited with status {status}"
        return f"was ended by {_SIGNALS.get(-status, f'signal {-status}')}"

    def last_words(self) -> str:
        """The end of what it printed."""
        file = self._output.fileno()
        start = max(0, os.fstat(file).st_size - _LAST_WORDS_BYTE)
        return os.pread(file, _LAST_WORDS_BYTE, start).decode(errors="replace").strip()

    def end(self) -> None:
        """Let go of the leash, upon which the process ends itself; kill it where it does not."""
        try:
            with suppress(BrokenPipeError):
                self._leash.close()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(_END_S)
        finally:
            self._process.kill()
            self._process.wait()


@contextmanager
def _child(role: Role) -> Iterator[_Child]:
    # -P: the folder that the launcher was called in is no place to import from. A process group
    # of its own: Ctrl-C at the terminal reaches the launcher alone.
    command = [sys.executable, "-P", "-m", "farside.missions.crew.worker", role]
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(  # noqa: S603 - this very interpreter, on a module of ours
            command, stdin=subprocess.PIPE, stdout=output, stderr=output, process_group=0
        )
        child = _Child(process, output)
        try:
            yield child
        finally:
            child.end()
