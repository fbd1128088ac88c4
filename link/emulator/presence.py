"""Which liveliness tokens of one side are there, as the other side knows it.

A state, not a row of events: what was lost on the way is told again until the other side knows it.
Without clock and Zenoh. Times are nanoseconds since the start.
"""

import msgspec

from farside.node import to_ns

AGAIN_NS = to_ns(1.0)
"""How long after it was lost an announcement is made again, if the link is in service by then
(project default)."""


class Announcement(msgspec.Struct, frozen=True):
    """A token appeared or vanished.

    Attributes:
        key: the token's.
        present: whether it is there.
        number: of the announcement, in order.
    """

    key: str
    present: bool
    number: int


class Presence:
    """Both ends of one direction: what is there on one side, and what the other side knows.

    Attributes:
        here: the keys of the tokens on the one side.
        known: the keys that the other side knows.
    """

    def __init__(self) -> None:
        self.here: set[str] = set()
        self.known: set[str] = set()
        self._number = 0
        self._under_way: set[int] = set()
        # By key: the latest announcement, the least number that is not out of date where it
        # arrives, and when to announce it again.
        self._made: dict[str, Announcement] = {}
        self._least: dict[str, int] = {}
        self._again_ns: dict[str, int] = {}

    def change(self, key: str, *, present: bool) -> Announcement | None:
        """A token appeared or vanished; returns what to announce, if anything."""
        (self.here.add if present else self.here.discard)(key)
        if key in self._again_ns:
            return None
        told = key in self._made and self._made[key].present
        return None if told is present else self._announce(key)

    def lose(self, announcement: Announcement, now_ns: int) -> None:
        """An announcement will not arrive."""
        key, number = announcement.key, announcement.number
        if self._leave(number) and key in self._made and self._made[key].number == number:
            self._again_ns[key] = now_ns + AGAIN_NS

    @property
    def next_ns(self) -> int | None:
        """When something is to be announced again; `None` if nothing was lost."""
        return min(self._again_ns.values(), default=None)

    def again(self, now_ns: int) -> list[Announcement]:
        """What to announce again by now."""
        keys = [key for key, due_ns in self._again_ns.items() if due_ns <= now_ns]
        for key in keys:
            del self._again_ns[key]
        return [self._announce(key) for key in keys]

    def arrive(self, announcement: Announcement) -> bool:
        """An announcement arrived; returns whether it tells the other side anything new."""
        key, present, number = announcement.key, announcement.present, announcement.number
        # Only the first copy of a duplicate counts, and none that was overtaken.
        if not self._leave(number) or number < self._least.get(key, number + 1):
            return False
        self._least[key] = number
        is_news = (key in self.known) is not present
        (self.known.add if present else self.known.discard)(key)
        if not present and self._made[key].number == number:
            del self._made[key], self._least[key]
        return is_news

    def _announce(self, key: str) -> Announcement:
        self._number += 1
        made = Announcement(key, key in self.here, self._number)
        self._made[key] = made
        self._least.setdefault(key, made.number)
        self._under_way.add(made.number)
        return made

    def _leave(self, number: int) -> bool:
        """Whether an announcement was under way until now."""
        if number not in self._under_way:
            return False
        self._under_way.remove(number)
        return True
