"""A crew with a process each for rover, link and ground, over Zenoh."""

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from queue import Empty
from typing import IO, Self, cast

import msgspec

from farside.acts import Act
from farside.ground.view.view import Focus, GroundView
from farside.missions.crew.barrier import Advance, Briefing, Complaint, Look, Seen, WindowReport
from farside.missions.crew.checks import (
    ConductError,
    check_number,
    check_records,
    check_window,
    decoded,
)
from farside.missions.crew.crew import Crew, CrewError, LostProcess, Patience
from farside.missions.crew.network import advance_key, frame_sources, open_router, report_key
from farside.missions.schema import MissionFile
from farside.node import Record, Role

# Wall-clock seconds: between checks that the processes are alive; for all of them to start, even on
# an overloaded machine; for a process to exit by itself before it is killed.
_POLL_S = 0.05
_START_S = 60.0
_END_S = 2.0

_LAST_WORDS_BYTE = 65536
_PATIENT = Patience()
_REPORTERS = {report_key(role): role for role in Role}
_SIGNALS = {number.value: number.name for number in signal.Signals}

_encode = msgspec.msgpack.Encoder().encode
_message = msgspec.msgpack.Decoder(WindowReport | Complaint | Seen).decode

_Message = WindowReport | Seen

_Reports = dict[Role, list[Record]]


class ProcessCrew(Crew):
    """A crew in processes of their own, which run from `__enter__` to `close`.

    If the process of ground or link is lost, the others go on without it. A process that publishes
    what it must not is killed, and lost. No process outlives this one, however it ends: see
    `farside.missions.crew.worker`.

    Args:
        mission: the mission, with its seed.
        patience: how long to wait for a process that does not answer, such as one that is stopped.
        tell_waiting: called with the roles that are waited for, and for how many wall-clock
            seconds so far, whenever the patience says so.
        path: see `Briefing`.
    """

    def __init__(
        self,
        mission: MissionFile,
        patience: Patience = _PATIENT,
        tell_waiting: Callable[[Sequence[Role], float], None] = lambda _roles, _waited_s: None,
        *,
        path: tuple[str, ...] = (),
    ) -> None:
        self._mission, self._path = mission, path
        self._patience = patience
        self._tell_waiting = tell_waiting
        self._resources = ExitStack()
        self._children: dict[Role, _Child] = {}
        self._lost: list[LostProcess] = []
        self._now_ns = 0
        self._advance: Advance | None = None
        self._looks = 0

    def __enter__(self) -> Self:
        """Start router and processes, and wait until all three have joined.

        Raises:
            CrewError: if a process cannot start, ends, or is not ready within a minute.
            InfrastructureError: if the router cannot start.
        """
        try:
            self._start()
        except BaseException:
            self.close()
            raise
        return self

    def _start(self) -> None:
        self._router = self._resources.enter_context(open_router())
        for role in Role:
            try:
                self._children[role] = self._resources.enter_context(_child(role))
            except OSError as error:
                how = f"could not be started ({error.strerror})"
                raise CrewError(LostProcess(role, 0, how, "")) from error
        for role, child in self._children.items():
            child.brief(Briefing(self._router.tickets[role], self._mission, self._path))
        self._reports(0, until_ns=0)

    @property
    def lost_processes(self) -> Sequence[LostProcess]:
        """See `Crew.lost_processes`."""
        return tuple(self._lost)

    def advance(self, until_ns: int, acts: Sequence[Act] = ()) -> list[Record]:
        """See `Crew.advance`."""
        window = 0 if self._advance is None else self._advance.window + 1
        lost = tuple(lost.role for lost in self._lost)
        self._send(Advance(window, until_ns, lost, tuple(acts)))
        reports = self._reports(window + 1, until_ns)
        self._now_ns = until_ns
        return [record for role in Role if role in reports for record in reports[role]]

    def look(self, focus: Focus) -> GroundView | None:
        """See `Crew.look`; to be called between windows."""
        if Role.GROUND not in self._children:
            return None
        self._looks += 1
        self._router.publish(advance_key(Role.GROUND), _encode(Look(self._looks, focus)))
        seen: list[Seen] = []

        def take(role: Role, message: _Message) -> None:
            if not isinstance(message, Seen) or role is not Role.GROUND:
                raise ConductError("sent a message that nobody waits for")
            check_number(message.number, self._looks)
            seen.append(message)

        self._collect(lambda: [] if seen else [Role.GROUND], take, self._patience.give_up_s)
        return seen[0].view if seen else None

    def close(self) -> None:
        """End the processes, by force if necessary, and the router."""
        self._resources.close()

    def _send(self, advance: Advance) -> None:
        self._advance = advance
        without = msgspec.structs.replace(advance, acts=())
        for role in self._children:
            told = advance if role is Role.GROUND else without
            self._router.publish(advance_key(role), _encode(told))

    def _reports(self, window: int, until_ns: int) -> _Reports:
        """The records of every live role, once all of them are ready for `window`."""
        reports: _Reports = {}

        def take(role: Role, message: _Message) -> None:
            if isinstance(message, Seen):
                raise ConductError("sent a view that nobody asked for")
            check_window(message.window, window, twice=role in reports)
            check_records(message.records, role, self._now_ns, until_ns)
            reports[role] = message.records

        give_up_s = self._patience.give_up_s if window else _START_S
        self._collect(lambda: [role for role in Role if role not in reports], take, give_up_s)
        return reports

    def _collect(
        self,
        missing: Callable[[], list[Role]],
        take: Callable[[Role, _Message], None],
        give_up_s: float,
    ) -> None:
        """Take what the live roles send, until none of those that are `missing` is alive.

        Args:
            missing: the roles that have not answered yet.
            take: takes a message of a role; raises `ConductError` where it must not be sent.
            give_up_s: wall-clock seconds after which to give up.
        """
        watchdog = _Watchdog(self._patience._replace(give_up_s=give_up_s), self._tell_waiting)
        while late := [role for role in missing() if role in self._children]:
            try:
                key, payload = self._router.inbox.get(timeout=_POLL_S)
            except Empty:
                self._check(late, watchdog)
                continue
            if (role := _REPORTERS[key]) in self._children:
                try:
                    message = decoded(_message, payload)
                    if isinstance(message, Complaint):
                        self._take_complaint(role, message)
                    else:
                        take(role, message)
                except ConductError as error:
                    self._lose(role, str(error))

    def _take_complaint(self, role: Role, complaint: Complaint) -> None:
        if complaint.about not in frame_sources(role).values():
            raise ConductError(f"complained about the {complaint.about}, which sends it nothing")
        if complaint.about in self._children:
            self._lose(complaint.about, f"misled the {role}: it {complaint.what}")

    def _check(self, late: list[Role], watchdog: "_Watchdog") -> None:
        """Look for processes that ended, or do not answer, among those that are late."""
        for role in late:
            if (how := self._children[role].how_it_ended()) is not None:
                self._lose(role, how)
        silent = self._silent(late)
        if silent and watchdog.gives_up(silent):
            raise CrewError(self._end(silent[0], f"was not ready after {watchdog.waited_s:.0f} s"))

    def _silent(self, late: Sequence[Role]) -> list[Role]:
        """The live roles that are late through their own doing."""
        alive = [role for role in late if role in self._children]
        # Once started, the link waits for the frames of rover and ground, and is late with them.
        ends: list[Role] = [role for role in alive if role is not Role.LINK]
        return alive if self._advance is None or not ends else ends

    def _lose(self, role: Role, how: str) -> None:
        """Go on without a process, if the run can."""
        lost = self._end(role, how)
        if self._advance is None or role is Role.ROVER:
            raise CrewError(lost)
        self._lost.append(lost)
        self._send(msgspec.structs.replace(self._advance, absent=(*self._advance.absent, role)))

    def _end(self, role: Role, how: str) -> LostProcess:
        child = self._children.pop(role)
        child.kill()
        return LostProcess(role, self._now_ns, how, child.last_words())


class _Watchdog:
    """Measures one wait, and says so when it is long."""

    def __init__(self, patience: Patience, tell: Callable[[Sequence[Role], float], None]) -> None:
        self._patience, self._tell = patience, tell
        self._since_s = time.monotonic()
        self._tell_at_s = patience.tell_s

    @property
    def waited_s(self) -> float:
        return time.monotonic() - self._since_s

    def gives_up(self, silent: Sequence[Role]) -> bool:
        """Whether to wait no longer for `silent`; tells of them when it is time."""
        waited_s = self.waited_s
        if waited_s >= self._tell_at_s:
            self._tell(silent, waited_s)
            self._tell_at_s = waited_s + self._patience.tell_s
        return waited_s >= self._patience.give_up_s


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

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()
        self._process.wait()

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
            self.kill()


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
