"""The crew of a run: its three nodes, advanced together window by window."""

import math
from collections.abc import Sequence
from traceback import format_exception
from typing import NamedTuple, Protocol, Self, runtime_checkable

import msgspec

from farside.acts import Act
from farside.ground.view.view import Focus, GroundView
from farside.node import Direction, Frame, Node, Record, Role, Step, to_s

_RECEIVER = {Direction.UP: Role.ROVER, Direction.DOWN: Role.GROUND}
_SHOWN_LENGTH = 300


class LostProcess(msgspec.Struct, frozen=True):
    """A role's process, or its node where all run in one process, that ended before the run.

    Attributes:
        role: the role.
        time_ns: start of the first window without it.
        how: how it ended, such as "was ended by SIGKILL".
        last_words: the tail of its output, with the traceback if there was one.
        kind: "process" or "node".
    """

    role: Role
    time_ns: int
    how: str
    last_words: str
    kind: str = "process"

    @classmethod
    def of_node(cls, role: Role, time_ns: int, error: Exception) -> Self:
        """A node that raised `error` in this process."""
        return cls(role, time_ns, "failed", "".join(format_exception(error)).strip(), "node")

    def __str__(self) -> str:
        when = f"at {to_s(self.time_ns):g} s of simulated time"
        ended = f"the {self.role} {self.kind} {self.how} {when}"
        last_line = self.last_words.rpartition("\n")[2]
        return f"{ended}: {_printable(last_line)}" if last_line else ended


class InfrastructureError(Exception):
    """Something that a run depends on failed: a process, the network, the disk."""


class CrewError(InfrastructureError):
    """The run cannot start, or cannot go on, without the process that was lost.

    Attributes:
        lost: the process.
    """

    def __init__(self, lost: LostProcess) -> None:
        super().__init__(str(lost))
        self.lost = lost


class Patience(NamedTuple):
    """How long a run waits for a process that does not answer. All times are wall-clock seconds.

    Attributes:
        tell_s: tell the user after so long, and again each time it has passed (project default).
        give_up_s: end the run after so long. Starting is not counted: it may take a minute.
    """

    tell_s: float = 10.0
    give_up_s: float = math.inf


@runtime_checkable
class TakesOrders(Protocol):
    """A node that takes orders from outside, as the ground does."""

    def order(self, acts: Sequence[Act]) -> None:
        """Have these given on the first tick of the window that is advanced through next."""
        ...


@runtime_checkable
class CanBeLookedAt(Protocol):
    """A node that says what a person there can know, as the ground does."""

    def look(self, focus: Focus) -> GroundView:
        """What can be known at the node's present; looking changes nothing."""
        ...


def hand_over(acts: Sequence[Act], node: Node) -> None:
    """Hand orders from outside to the ground's node, before it advances.

    Raises:
        TypeError: if there are any, and the node takes none.
    """
    if not acts:
        return
    if not isinstance(node, TakesOrders):
        raise TypeError(f"expected a node that takes orders, found {type(node).__name__}")
    node.order(acts)


class Crew(Protocol):
    """Rover, link and ground, wherever they run. A context manager that closes the crew on exit.

    In each window rover and ground advance side by side, with the frames that the link delivered at
    the end of the previous window. The link then takes the frames that both sent.
    """

    def __enter__(self) -> Self:
        """Start the crew, at time 0."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the crew."""
        self.close()

    @property
    def lost_processes(self) -> Sequence[LostProcess]:
        """The processes that the run has gone on without, in order of loss."""
        ...

    def advance(self, until_ns: int, acts: Sequence[Act] = ()) -> list[Record]:
        """Advance all three nodes up to, not including, `until_ns`.

        Args:
            until_ns: end of the window; not before the end of the previous one, and no further
                ahead than the shortest delay of the link or, if longer, one tick.
            acts: what is ordered from outside at the start of the window, for the ground.

        Returns:
            the records of the window: the rover's, then the link's, then the ground's.

        Raises:
            CrewError: if the rover's process is lost, or one does not answer for as long as the
                crew's patience lasts. For the others see `lost_processes`.
        """
        ...

    def look(self, focus: Focus) -> GroundView | None:
        """What a person at the ground can know by the end of the last window; it changes nothing.

        `None` where the ground is lost, or its node cannot be looked at.

        Args:
            focus: what the person looks at.

        Raises:
            CrewError: if the ground does not answer for as long as the crew's patience lasts.
        """
        ...

    def close(self) -> None:
        """End everything that was started for the crew. Closing again does nothing."""
        ...


class InProcessCrew(Crew):
    """A crew in this process. A node that raises is lost, as its process would be."""

    def __init__(self, rover: Node, link: Node, ground: Node) -> None:
        self._nodes = {Role.ROVER: rover, Role.LINK: link, Role.GROUND: ground}
        self._arrivals = by_receiver([])
        self._lost: list[LostProcess] = []
        self._now_ns = 0

    @property
    def lost_processes(self) -> Sequence[LostProcess]:
        """See `Crew.lost_processes`."""
        return tuple(self._lost)

    def advance(self, until_ns: int, acts: Sequence[Act] = ()) -> list[Record]:
        """See `Crew.advance`."""
        rover = self._step(Role.ROVER, until_ns, self._arrivals[Role.ROVER])
        ground = self._step(Role.GROUND, until_ns, self._arrivals[Role.GROUND], acts)
        link = self._step(Role.LINK, until_ns, rover.frames + ground.frames)
        self._arrivals = by_receiver(link.frames)
        self._now_ns = until_ns
        return rover.records + link.records + ground.records

    def _step(
        self, role: Role, until_ns: int, arrivals: Sequence[Frame], acts: Sequence[Act] = ()
    ) -> Step:
        if role in self._nodes:
            try:
                hand_over(acts, self._nodes[role])
                return self._nodes[role].advance(until_ns, arrivals)
            except Exception as error:  # noqa: BLE001 - any exception is the end of the node
                self._lose(LostProcess.of_node(role, self._now_ns, error), error)
        return Step([], [])

    def look(self, focus: Focus) -> GroundView | None:
        """See `Crew.look`."""
        ground = self._nodes.get(Role.GROUND)
        if not isinstance(ground, CanBeLookedAt):
            return None
        try:
            return ground.look(focus)
        except Exception as error:  # noqa: BLE001 - any exception is the end of the node
            self._lose(LostProcess.of_node(Role.GROUND, self._now_ns, error), error)
            return None

    def _lose(self, lost: LostProcess, error: Exception) -> None:
        """Go on without a node, if the run can."""
        del self._nodes[lost.role]
        if lost.role is Role.ROVER:
            raise CrewError(lost) from error
        self._lost.append(lost)

    def close(self) -> None:
        """Does nothing: nothing was started."""


def by_receiver(frames: Sequence[Frame]) -> dict[Role, list[Frame]]:
    """The frames that the link delivers, grouped by receiver, in unchanged order."""
    grouped: dict[Role, list[Frame]] = {role: [] for role in _RECEIVER.values()}
    for frame in frames:
        grouped[_RECEIVER[frame.direction]].append(frame)
    return grouped


def _printable(line: str) -> str:
    """`line` without control characters, which would reach the terminal; cut if it is long."""
    shown = "".join(c if c.isprintable() else repr(c)[1:-1] for c in line[:_SHOWN_LENGTH])
    return shown + "…" if len(line) > _SHOWN_LENGTH else shown
