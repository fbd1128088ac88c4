"""Liveliness tokens of one side: declared on the other side one light time later.

A token that the relay itself has declared is never taken back. If a program of that side declares
the same key too, it is found when the relay's own is undeclared.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

import zenoh

from farside.link.emulator.crossing.presence import Announcement, Presence


class Announcer(Protocol):
    """The link and its loop, as tokens see them."""

    def announce(
        self, time_ns: int, announcement: Announcement, matters: Callable[[], bool]
    ) -> None:
        """Send an announcement through the link, until it arrives."""

    def later(self, task: Callable[[int], None]) -> None:
        """Have something done in the loop's own thread, with the present time."""


class Tokens:
    """Takes the tokens of one side, and declares them on the other when word of them arrives.

    Args:
        near, far: sessions with the two sides.
        keys: of which tokens cross.
        announcer: the link.
        changed: called when a token appears on the far side, or vanishes there.

    Attributes:
        declared: the tokens on the far side, by key.
    """

    def __init__(
        self,
        near: zenoh.Session,
        far: zenoh.Session,
        keys: Sequence[zenoh.KeyExpr],
        announcer: Announcer,
        changed: Callable[[str, bool], None],
    ) -> None:
        self._near, self._far, self._keys, self._announcer = near, far, keys, announcer
        self._tell = changed
        self._presence = Presence()
        self.declared: dict[str, zenoh.LivelinessToken] = {}
        self._opposite: Tokens | None = None
        self._subscribers: list[zenoh.Subscriber[None]] = []

    def begin(self, opposite: "Tokens") -> None:
        """Take tokens from now on; those that `opposite` has declared here are not taken."""
        self._opposite = opposite
        for number, key in enumerate(self._keys):
            listener = partial(self._listen, self._keys[:number])
            self._subscribers.append(
                self._near.liveliness().declare_subscriber(
                    key, zenoh.handlers.Callback(listener, indirect=False), history=True
                )
            )

    def _listen(self, earlier: Sequence[zenoh.KeyExpr], sample: zenoh.Sample) -> None:
        key = sample.key_expr
        if not any(other.intersects(key) for other in earlier):
            present = sample.kind == zenoh.SampleKind.PUT
            self._announcer.later(lambda time_ns: self._change(time_ns, str(key), present=present))

    def _change(self, time_ns: int, key: str, *, present: bool) -> None:
        if self._opposite is not None and key in self._opposite.declared:
            return
        announcement = self._presence.change(key, present=present)
        if announcement is not None:
            is_latest = partial(self._presence.is_latest, announcement)
            self._announcer.announce(time_ns, announcement, is_latest)

    def arrive(self, announcement: Announcement) -> None:
        """Word of a token arrived on the far side."""
        if not self._presence.arrive(announcement):
            return
        key = announcement.key
        if announcement.present:
            self.declared[key] = self._far.liveliness().declare_token(key)
        else:
            self.declared.pop(key).undeclare()
            if self._opposite is not None:
                self._opposite.look_for(key)
        self._tell(key, announcement.present)

    def look_for(self, key: str) -> None:
        """Find out whether the near side has a token of its own under a key."""
        if not any(one.intersects(key) for one in self._keys):
            return
        self._near.liveliness().get(
            key,
            lambda _: self._announcer.later(
                lambda time_ns: self._change(time_ns, key, present=True)
            ),
        )
