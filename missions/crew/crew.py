"""The three nodes of a run, moved together from window to window."""

from collections.abc import Sequence
from typing import Protocol, Self

import msgspec

from farside.node import Direction, Frame, Node, Record, Role, to_s

_RECEIVER = {Direction.UP: Role.ROVER, Direction.DOWN: Role.GROUND}


class LostRole(msgspec.Struct, frozen=True):
    """The end of a role's process before the end of the run.

    Attributes:
        role: who is gone.
        time_ns: start of the first window without it.
        how: what happened to it, as in "was ended by SIGKILL".
        last_words: the tail of what it wrote to standard error, its traceback if it had one.
    """

    role: Role
    time_ns: int
    how: str
    last_words: str

    def __str__(self) -> str:
        told = f"the {self.role} process {self.how} at {to_s(self.time_ns):g} s of simulated time"
        return f"{told}; its last words:\n{self.last_words}" if self.last_words else told


class CrewError(Exception):
    """The run cannot start, or cannot go on, without the role that was lost.

    Attributes:
        loss: who was lost, and how.
    """

    def __init__(self, loss: LostRole) -> None:
        super().__init__(str(loss))
        self.loss = loss


class Crew(Protocol):
    """Rover, link and ground, wherever they run. A context manager that closes itself at its end.

    In a window rover and ground live side by side, with the frames that the link gave out at the
    end of the window before. The link then takes the frames that both sent in it.
    """

    def __enter__(self) -> Self:
        """Bring the crew to time 0."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the crew."""
        self.close()

    @property
    def losses(self) -> Sequence[LostRole]:
        """The roles that the run has gone on without, in order of loss."""
        ...

    def advance(self, until_ns: int) -> list[Record]:
        """Take all three from the present up to, not including, `until_ns`.

        Args:
            until_ns: end of the window, not before the end of the last one, and not further away
                than the shortest delay of the link (or one tick, if that is longer).

        Returns:
            the records of the window: the rover's, then the link's, then the ground's.

        Raises:
            CrewError: if the rover is lost. Link and ground may be lost: see `losses`.
        """
        ...

    def close(self) -> None:
        """End what was started for the crew. Does nothing the second time."""
        ...


class InProcessCrew(Crew):
    """A crew of plain calls. An exception in a node passes through."""

    def __init__(self, rover: Node, link: Node, ground: Node) -> None:
        self._rover, self._link, self._ground = rover, link, ground
        self._arrivals = by_receiver([])

    @property
    def losses(self) -> Sequence[LostRole]:
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
        """Nothing was started."""


def by_receiver(frames: Sequence[Frame]) -> dict[Role, list[Frame]]:
    """What the link gives out, sorted by who gets it, in unchanged order."""
    sorted_out: dict[Role, list[Frame]] = {role: [] for role in _RECEIVER.values()}
    for frame in frames:
        sorted_out[_RECEIVER[frame.direction]].append(frame)
    return sorted_out
