"""A crew with a process each for rover, link and ground, over Zenoh."""

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
from farside.missions.crew.crew import Crew, CrewError, LostProcess
from farside.missions.crew.network import advance_key, open_router, report_key
from farside.missions.schema import MissionFile
from farside.node import Record, Role

# Wall-clock seconds: between checks that the processes are alive; for all of them to start, even on
# an overloaded machine; for a process to exit by itself before it is killed.
_POLL_S = 0.05
_START_S = 60.0
_END_S = 2.0

_LAST_WORDS_BYTE = 8192
_REPORTERS = {report_key(role): role for role in Role}
_SIGNALS = {number.value: number.name for number in signal.Signals}

_encode = msgspec.msgpack.Encoder().encode
_report = msgspec.msgpack.Decoder(WindowReport).decode


class ProcessCrew(Crew):
    """A crew in processes of their own, which run from `__enter__` to `close`.

    If the process of ground or link is lost, the others go on without it. No process outlives this
    one, however it ends: see `farside.missions.crew.worker`.

    Args:
        mission: the mission, with its seed.
    """

    def __init__(self, mission: MissionFile) -> None:
        self._mission = mission
        self._resources = ExitStack()
        self._children: dict[Role, _Child] = {}
        self._lost: list[LostProcess] = []
        self._now_ns = 0
        self._advance: Advance | None = None

    def __enter__(self) -> Self:
        """Start router and processes, and wait until all three have joined.

        Raises:
            CrewError: if a process ends, or is not ready within a minute.
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
    def lost_processes(self) -> Sequence[LostProcess]:
        """See `Crew.lost_processes`."""
        return tuple(self._lost)

    def advance(self, until_ns: int) -> list[Record]:
        """See `Crew.advance`."""
        window = 0 if self._advance is None else self._advance.window + 1
        self._send(Advance(window, until_ns, tuple(lost.role for lost in self._lost)))
        reports = self._reports(window + 1)
        self._now_ns = until_ns
        return [record for role in Role if role in reports for record in reports[role]]

    def close(self) -> None:
        """End the processes, by force if necessary, and the router."""
        self._resources.close()

    def _send(self, advance: Advance) -> None:
        self._advance = advance
        for role in self._children:
            self._router.publish(advance_key(role), _encode(advance))

    def _reports(self, window: int) -> dict[Role, list[Record]]:
        """The records of every live role, once all of them are ready for `window`."""
        reports: dict[Role, list[Record]] = {}
        while late := [role for role in self._children if role not in reports]:
            try:
                key, payload = self._router.inbox.get(timeout=_POLL_S)
            except Empty:
                self._check(late)
                continue
            report = _report(payload)
            if report.window == window:
                reports[_REPORTERS[key]] = report.records
        return reports

    def _check(self, late: list[Role]) -> None:
        """Look for processes that ended among those that are late."""
        for role in late:
            if (how := self._children[role].how_it_ended()) is not None:
                self._lose(role, how)
            elif self._advance is None and time.monotonic() > self._ready_by_s:
                self._lose(role, f"was not ready after {_START_S:g} s")

    def _lose(self, role: Role, how: str) -> None:
        """Go on without a process, if the run can."""
        lost = LostProcess(role, self._now_ns, how, self._children.pop(role).last_words())
        if self._advance is None or role is Role.ROVER:
            raise CrewError(lost)
        self._lost.append(lost)
        self._send(msgspec.structs.replace(self._advance, absent=(*self._advance.absent, role)))


class _Child:
    """A role's process. Its output goes to an unnamed temporary file."""

    def __init__(self, process: subprocess.Popen[bytes], output: IO[bytes]) -> None:
        self._process, self._output = process, output
        self._leash = cast("IO[bytes]", process.stdin)

    def brief(self, briefing: Briefing) -> None:
        # If the process has ended already, waiting for its report finds out why.
        with suppress(BrokenPipeError):
            self._leash.write(msgspec.json.encode(briefing) + b"\n")
            self._leash.flush()

    def how_it_ended(self) -> str | None:
        """How the process ended; `None` while it runs."""
        status = self._process.poll()
        if status is None or status >= 0:
            return None if status is None else f"exited with status {status}"
        return f"was ended by {_SIGNALS.get(-status, f'signal {-status}')}"

    def last_words(self) -> str:
        """The tail of its output."""
        file = self._output.fileno()
        start = max(0, os.fstat(file).st_size - _LAST_WORDS_BYTE)
        return os.pread(file, _LAST_WORDS_BYTE, start).decode(errors="replace").strip()

    def end(self) -> None:
        """Close the leash, upon which the process exits; kill it if it does not."""
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
    # -P: import nothing from the folder in which the launcher was started. A process group of its
    # own: Ctrl-C at the terminal reaches the launcher alone.
    command = [sys.executable, "-P", "-m", "farside.missions.crew.worker", role]
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(  # noqa: S603 - this interpreter, on our own module
            command, stdin=subprocess.PIPE, stdout=output, stderr=output, process_group=0
        )
        child = _Child(process, output)
        try:
            yield child
        finally:
            child.end()
