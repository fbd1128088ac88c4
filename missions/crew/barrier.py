"""The barrier between windows: the messages of launcher and roles, and a role's side of it.

In each window the launcher sends `Advance` to all three roles. Rover and ground wait for the link's
`Frames` for the window, advance, and send `Frames` to the link and a `WindowReport` to the
launcher. The link waits for the frames of both, advances, and sends the `Frames` for the next
window before its own `WindowReport`. Once all have reported, the launcher starts the next window.
Before it does, it may send the ground alone a `Look`, which the ground answers with `Seen`.
This module uses neither Zenoh nor processes.

A role that is sent frames that cannot be right sends the launcher a `Complaint`, ignores the sender
from then on, and waits for the `Advance` in which the sender is absent.
"""

from collections.abc import Iterator

import msgspec

from farside.acts import Act
from farside.ground.view.view import Focus, GroundView
from farside.missions.crew.checks import ConductError, check_frames, check_window, decoded
from farside.missions.crew.crew import CanBeLookedAt, by_receiver, hand_over
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
    """What the launcher sends a new process, as one line of JSON on its standard input.

    Attributes:
        ticket: lets the process join.
        mission: the mission, with its seed.
        path: the folders to import from, in order, where the mission names code of one's own: each
            process must find the same. Otherwise empty.
    """

    ticket: Ticket
    mission: MissionFile
    path: tuple[str, ...] = ()


class Advance(msgspec.Struct, frozen=True, array_like=True, tag=True):
    """Advance through `window`, up to `until_ns`, without waiting for frames of `absent` roles.

    Sent again with more absent roles when a process is lost while others wait for it. Only the
    ground is sent `acts`: what is ordered from outside at the start of the window.
    """

    window: int
    until_ns: int
    absent: tuple[Role, ...] = ()
    acts: tuple[Act, ...] = ()


class Look(msgspec.Struct, frozen=True, array_like=True, tag=True):
    """Say what can be known at the end of the last window, to the ground; `number` counts looks."""

    number: int
    focus: Focus


class Seen(msgspec.Struct, frozen=True, array_like=True, tag=True):
    """The answer to the `Look` of this number; `None` if the node cannot be looked at."""

    number: int
    view: GroundView | None


class Frames(msgspec.Struct, frozen=True, array_like=True):
    """The frames that the receiver takes in `window`."""

    window: int
    frames: list[Frame]


class WindowReport(msgspec.Struct, frozen=True, array_like=True, tag=True):
    """The role is ready for `window`; `records` are those since its previous report.

    The report for window 0 says that the role has joined the run.
    """

    window: int
    records: list[Record]


class Complaint(msgspec.Struct, frozen=True, array_like=True, tag=True):
    """Role `about` sent this role something that it must not send; `what` it did."""

    about: Role
    what: str


_encode = msgspec.msgpack.Encoder().encode
_told = msgspec.msgpack.Decoder(Advance | Look).decode
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
        self._window, self._now_ns, self._before_ns = 0, 0, 0
        self._advance = Advance(-1, 0)
        self._unread: list[tuple[Role, bytes]] = []
        # No frames are under way before the first window.
        self._frames: dict[Role, list[Frame]] = {} if role is Role.LINK else {Role.LINK: []}
        self._ignored: set[Role] = set()

    def report(self, records: list[Record]) -> Sample:
        """The report that the role is ready for its next window; the first, that it has joined."""
        return self._to_launcher(WindowReport(self._window, records))

    def take(self, sample: Sample) -> list[Sample]:
        """Take a sample and, once everything that the window needs is there, advance the node.

        Returns:
            the samples to send: none while something is missing, except complaints.

        Raises:
            msgspec.DecodeError: if the launcher sends what is neither `Advance` nor `Look`.
        """
        key, payload = sample
        if key == advance_key(self._role):
            told = _told(payload)
            if isinstance(told, Look):
                return [self._to_launcher(self._seen(told))]
            self._advance = told
        else:
            self._unread.append((self._sources[key], payload))
        if self._advance.window != self._window:
            return []
        complaints = self._read()
        if any(sender not in self._frames for sender in self._awaited()):
            return complaints
        return complaints + self._advance_node()

    def _seen(self, look: Look) -> Seen:
        node = self._node
        return Seen(look.number, node.look(look.focus) if isinstance(node, CanBeLookedAt) else None)

    def _read(self) -> list[Sample]:
        """Read the frames received for the window; complaints about those that are wrong."""
        complaints = []
        for sender, payload in self._unread:
            if sender in self._ignored:
                continue
            try:
                self._frames[sender] = self._checked(sender, payload)
            except ConductError as error:
                self._ignored.add(sender)
                complaints.append(self._to_launcher(Complaint(sender, str(error))))
        self._unread.clear()
        return complaints

    def _checked(self, sender: Role, payload: bytes) -> list[Frame]:
        sent = decoded(_frames, payload)
        check_window(sent.window, self._window, twice=sender in self._frames)
        check_frames(
            sent.frames,
            sender,
            self._role,
            self._now_ns,
            self._advance.until_ns,
            before_ns=self._before_ns,
        )
        return sent.frames

    def _awaited(self) -> Iterator[Role]:
        return (role for role in self._sources.values() if role not in self._advance.absent)

    def _advance_node(self) -> list[Sample]:
        arrivals = [
            frame for sender in self._sources.values() for frame in self._frames.get(sender, ())
        ]
        hand_over(self._advance.acts, self._node)
        step = self._node.advance(self._advance.until_ns, arrivals)
        self._frames.clear()
        self._before_ns, self._now_ns = self._now_ns, self._advance.until_ns
        window, self._window = self._window, self._window + 1
        if self._role is Role.LINK:
            outgoing = [
                (in_key(end), _encode(Frames(self._window, frames)))
                for end, frames in by_receiver(step.frames).items()
            ]
        else:
            outgoing = [(out_key(self._role), _encode(Frames(window, step.frames)))]
        return [*outgoing, self.report(step.records)]

    def _to_launcher(self, message: WindowReport | Complaint | Seen) -> Sample:
        return report_key(self._role), _encode(message)
