"""The barrier between windows: the messages of launcher and roles, and a role's side of it.

In each window the launcher sends `Advance` to all three roles. Rover and ground wait for the link's
`Frames` for the window, advance, and send `Frames` to the link and a `WindowReport` to the
launcher. The link waits for the frames of both, advances, and sends the `Frames` for the next
window before its own `WindowReport`. Once all have reported, the launcher starts the next window.
This module uses neither Zenoh nor processes.
"""

import msgspec

from farside.missions.crew.crew import by_receiver
from farside.missions.crew.network import (
    Ticket,
    advance_key,
    frame_sources,
    in_key,
    out_key,
    report_key,
)
from farside.missions.schema import MissionFile
from farside.node import Frame, Node, Record, Role

Sample = tuple[str, bytes]
"""A message on the run's network: Zenoh key and payload."""


class Briefing(msgspec.Struct, frozen=True):
    """What the launcher sends a new process, as one line of JSON on its standard input."""

    ticket: Ticket
    mission: MissionFile


class Advance(msgspec.Struct, frozen=True, array_like=True):
    """Advance through `window`, up to `until_ns`, without waiting for frames of `absent` roles.

    Sent again with more absent roles when a process is lost while others wait for it.
    """

    window: int
    until_ns: int
    absent: tuple[Role, ...] = ()


class Frames(msgspec.Struct, frozen=True, array_like=True):
    """The frames that the receiver takes in `window`."""

    window: int
    frames: list[Frame]


class WindowReport(msgspec.Struct, frozen=True, array_like=True):
    """The role is ready for `window`; `records` are those since its previous report.

    The report for window 0 says that the role has joined the run.
    """

    window: int
    records: list[Record]


_encode = msgspec.msgpack.Encoder().encode
_advance = msgspec.msgpack.Decoder(Advance).decode
_frames = msgspec.msgpack.Decoder(Frames).decode


class Party:
    """A role's side of the barrier: takes a sample and returns the samples to send.

    Args:
        role: the role.
        node: the node that plays it, at time 0.
    """

    def __init__(self, role: Role, node: Node) -> None:
        self._role, self._node = role, node
        self._sources = frame_sources(role)
        self._window = 0
        self._advance = Advance(-1, 0)
        # No frames are under way before the first window.
        self._frames = {Role.LINK: Frames(0, [])}

    def report(self, records: list[Record]) -> Sample:
        """The report that the role is ready for its next window; the first, that it has joined."""
        return report_key(self._role), _encode(WindowReport(self._window, records))

    def take(self, sample: Sample) -> list[Sample]:
        """Take a sample and, once everything that the window needs is there, advance the node.

        Returns:
            the samples to send: none while something is missing.

        Raises:
            msgspec.DecodeError: if the payload is not of the type that belongs on its key.
        """
        key, payload = sample
        if key == advance_key(self._role):
            self._advance = _advance(payload)
        else:
            self._frames[self._sources[key]] = _frames(payload)
        arrivals = self._arrivals()
        return [] if arrivals is None else self._advance_node(arrivals)

    def _arrivals(self) -> list[Frame] | None:
        """The frames to take in the current window; `None` while something is missing."""
        if self._advance.window != self._window:
            return None
        arrivals: list[Frame] = []
        for sender in self._sources.values():
            sent = self._frames.get(sender)
            if sent is not None and sent.window == self._window:
                arrivals += sent.frames
            elif sender not in self._advance.absent:
                return None
        return arrivals

    def _advance_node(self, arrivals: list[Frame]) -> list[Sample]:
        step = self._node.advance(self._advance.until_ns, arrivals)
        window, self._window = self._window, self._window + 1
        if self._role is Role.LINK:
            outgoing = [
                (in_key(end), _encode(Frames(self._window, frames)))
                for end, frames in by_receiver(step.frames).items()
            ]
        else:
            outgoing = [(out_key(self._role), _encode(Frames(window, step.frames)))]
        return [*outgoing, self.report(step.records)]
