"""The crew of a run: its three nodes, advanced together window by window."""

from collections.abc import Sequence
from typing import Protocol, Self

import msgspec

from farside.node import Direction, Frame, Node, Record, Role, to_s

_RECEIVER = {Direction.UP: Role.ROVER, Direction.DOWN: Role.GROUND}


class LostProcess(msgspec.Struct, frozen=True):
    """A role's process that ended before the run.

    Attributes:
        role: the role of the process.
        time_ns: start of the first window without it.
        how: how it ended, such as "was ended by SIGKILL".
        last_words: the tail of its output, with the traceback if there was one.
    """

    role: Role
    time_ns: int
    how: str
    last_words: str

    def __str__(self) -> str:
        ended = f"the {self.role} process {self.how} at {to_s(self.time_ns):g} s of simulated time"
        return f"{ended}; its last words:\n{self.last_words}" if self.last_words else ended


class CrewError(Exception):
    """The run cannot start, or cannot go on, without the process that was lost.

    Attributes:
        lost: the process.
    """

    def __init__(self, lost: LostProcess) -> None:
        super().__init__(str(lost))
        self.lost = lost


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

    def advance(self, until_ns: int) -> list[Record]:
        """Advance all three nodes up to, not including, `until_ns`.

        Args:
            until_ns: end of the window; not before the end of the previous one, and no further
                ahead than the shortest delay of the link or, if longer, one tick.

        Returns:
            the records of the window: the rover's, then the link's, then the ground's.

        Raises:
            CrewError: if the rover's process is lost. For the others see `lost_processes`.
        """
        ...

    def close(self) -> None:
        """End everything that was started for the crew. Closing again does nothing."""
        ...


class InProcessCrew(Crew):
    """A crew in this process. Exceptions in a node propagate to the caller."""

    def __init__(self, rover: Node, link: Node, ground: Node) -> None:
        self._rover, self._link, self._ground = rover, link, ground
        self._arrivals = by_receiver([])

    @property
    def lost_processes(self) -> Sequence[LostProcess]:
        """Always empty."""
        return ()

    def advance(self, until_ns: int) -> list[Record]:
        """See `Crew.advance`."""
        rover = self._rover.advance(until_ns, self._arrivals[Role.ROVER])
        ground = self._ground.advance(until_ns, self._arrivals[Role.GROUND])
        link = self._link.advance(until_ns, rover.frames + ground.frames)
        self._arrivals = by_receiver(link.frames)
        return rover.records + link.records + ground.records

    def close(self) -> None:
        """Does nothing: nothing was started."""


def by_receiver(frames: Sequence[Frame]) -> dict[Role, list[Frame]]:
    """The frames that the link delivers, grouped by receiver, in unchanged order."""
    grouped: dict[Role, list[Frame]] = {role: [] for role in _RECEIVER.values()}
    for frame in frames:
        grouped[_RECEIVER[frame.direction]].append(frame)
    return grouped
