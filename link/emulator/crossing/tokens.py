"""Liveliness tokens of one side: declared on the other side one light time later.

Whose a token is Zenoh does not say, and of several with one key it tells as if they were one. So
the relay declares one only while no program of that side has declared the same key, and takes none
back that it has declared itself. Whatever Zenoh does not tell is found when the tokens are counted.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

import zenoh

from farside.link.emulator.crossing.presence import Announcement, Presence
from farside.node import to_ns

COUNT_NS = to_ns(2.0)
"""How often the tokens of a side are counted (project default)."""

_ECHO_NS = to_ns(1.0)
"""How long Zenoh may still tell of a token of the relay's own (project default; milliseconds)."""


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
        presence: what programs of the near side have declared, and what the far side knows of it.
        declared: the relay's own tokens on the far side, by key.
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
        self.presence = Presence()
        self.declared: dict[str, zenoh.LivelinessToken] = {}
        self._opposite = self
        self._subscribers: list[zenoh.Subscriber[None]] = []
        self._undeclared_ns: dict[str, int] = {}
        self._counted_ns = 0
        self._missing: set[str] = set()
        self._told: set[str] = set()

    def begin(self, opposite: "Tokens") -> None:
        """Take tokens from now on; those that `opposite` has declared here are not taken."""
        self._opposite = opposite
        for number, key in enumerate(self._keys):
            listener = partial(self._listen, self._keys[:number])
            # Kept, because it ends with the object.
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
        if self._opposite.owns(key, time_ns):
            return
        self._told.add(key)
        announcement = self.presence.change(key, present=present)
        if announcement is not None:
            is_latest = partial(self.presence.is_latest, announcement)
            self._announcer.announce(time_ns, announcement, is_latest)
        self._opposite.settle(key, time_ns)

    def arrive(self, announcement: Announcement, time_ns: int) -> None:
        """Word of a token arrived on the far side."""
        if self.presence.arrive(announcement):
            self.settle(announcement.key, time_ns)
            self._tell(announcement.key, announcement.present)

    def settle(self, key: str, time_ns: int) -> None:
        """Have a token of the relay's own on the far side if there has to be one."""
        is_wanted = key in self.presence.known and key not in self._opposite.presence.here
        if is_wanted and key not in self.declared:
            self.declared[key] = self._far.liveliness().declare_token(key)
        elif not is_wanted and key in self.declared:
            self.declared.pop(key).undeclare()
            self._undeclared_ns[key] = time_ns

    def owns(self, key: str, time_ns: int) -> bool:
        """Whether a token on the far side is the relay's own, or was a moment ago."""
        return key in self.declared or time_ns < self._undeclared_ns.get(key, -_ECHO_NS) + _ECHO_NS

    def count(self, now_ns: int) -> None:
        """Look for tokens of which nothing was told, or that are gone, if it is time."""
        if now_ns < self._counted_ns + COUNT_NS:
            return
        self._counted_ns = now_ns
        for name, time_ns in list(self._undeclared_ns.items()):
            if time_ns + _ECHO_NS <= now_ns:
                del self._undeclared_ns[name]
        self._told.clear()
        found: set[str] = set()
        left = len(self._keys)

        def add(one: set[str], time_ns: int) -> None:
            nonlocal left
            found.update(one)
            left -= 1
            if not left:
                self._compare(found, time_ns)

        for key in self._keys:
            self._find(key, add)

    def _compare(self, found: set[str], time_ns: int) -> None:
        # What has vanished meanwhile may have been found before it did.
        for key in sorted(found - self.presence.here - self._told):
            self._change(time_ns, key, present=True)
        missing = self.presence.here - found
        # One that appears meanwhile may be missed once.
        for key in missing & self._missing:
            self._change(time_ns, key, present=False)
        self._missing = missing

    def _find(self, key: zenoh.KeyExpr | str, tell: Callable[[set[str], int], None]) -> None:
        """Have all tokens of a key told, the relay's own among them."""
        found: set[str] = set()

        def add(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                found.add(str(reply.ok.key_expr))

        def end() -> None:
            self._announcer.later(partial(tell, found))

        callback = _direct(add, end)
        self._near.liveliness().get(key, callback)


def _direct(
    take: Callable[[zenoh.Reply], None], end: Callable[[], None]
) -> "zenoh.handlers.Callback[zenoh.Reply]":
    return zenoh.handlers.Callback(take, end, indirect=False)
