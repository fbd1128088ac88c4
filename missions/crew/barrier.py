"""How launcher and roles keep step: their messages, and a role's side of the barrier.

A window goes like this. The launcher says `Advance` to all three. Rover and ground need the
link's `Frames` for this window, live through it, and say `Frames` to the link and a `WindowReport`
to the launcher. The link needs the frames of both, and says the `Frames` of the next window before
its `WindowReport`. With all reports in, the launcher goes on. No Zenoh and no process in here.
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

Said = tuple[str, bytes]
"""A message on its way: key and payload."""


class Briefing(msgspec.Struct, frozen=True):
    """What the launcher tells a new process, as one line of JSON on its standard input."""

    ticket: Ticket
    mission: MissionFile


class Advance(msgspec.Struct, frozen=True, array_like=True):
    """Live through a window, up to `until_ns`, and expect no frames from the `absent` roles.

    Said again with more absent roles when somebody is lost while others wait for it.
    """

    window: int
    until_ns: int
    absent: tuple[Role, ...] = ()


class Frames(msgspec.Struct, frozen=True, array_like=True):
    """The frames that the receiver takes in `window`."""

    window: int
    frames: list[Frame]


class WindowReport(msgspec.Struct, frozen=True, array_like=True):
    """The role is ready for `window` (0: it has joined), and recorded this since its last one."""

    window: int
    records: list[Record]


_encode = msgspec.msgpack.Encoder().encode
_advance = msgspec.msgpack.Decoder(Advance).decode
_frames = msgspec.msgpack.Decoder(Frames).decode


class Party:
    """A node at its place in the crew: hears messages and answers with messages."""

    def __init__(self, role: Role, node: Node) -> None:
        self._role, self._node = role, node
        self._sources = frame_sources(role)
        self._window = 0
        self._advance = Advance(-1, 0)
        # Nothing was sent before the first window.
        self._frames = {Role.LINK: Frames(0, [])}

    def report(self, records: list[Record]) -> Said:
        """Say that the node is ready for its next window; the first time, that it is there."""
        return report_key(self._role), _encode(WindowReport(self._window, records))

    def hear(self, said: Said) -> list[Said]:
        """Take a message; once all that the window needs is there, live through it.

        Raises:
            msgspec.DecodeError: if the payload is not what belongs on its key.
        """
        key, payload = said
        if key == advance_key(self._role):
            self._advance = _advance(payload)
        else:
            self._frames[self._sources[key]] = _frames(payload)
        arrivals = self._arrivals()
        return [] if arrivals is None else self._live(arrivals)

    def _arrivals(self) -> list[Frame] | None:
        """The frames for the window that is on, or `None` while something is missing."""
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

    def _live(self, arrivals: list[Frame]) -> list[Said]:
        step = self._node.advance(self._advance.until_ns, arrivals)
        window, self._window = self._window, self._window + 1
        if self._role is Role.LINK:
            given_out = [
                (in_key(end), _encode(Frames(self._window, frames)))
                for end, frames in by_receiver(step.frames).items()
            ]
        else:
            given_out = [(out_key(self._role), _encode(Frames(window, step.frames)))]
        return [*given_out, self.report(step.records)]
