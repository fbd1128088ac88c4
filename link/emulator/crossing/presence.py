"""Which liveliness tokens of one side are there, as the other side knows it.

A state, not a row of events: what is lost on the way is sent again while it is true.
"""

import msgspec


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
        # By key: the latest announcement, and the number up to which all are out of date.
        self._made: dict[str, Announcement] = {}
        self._heard: dict[str, int] = {}

    def change(self, key: str, *, present: bool) -> Announcement | None:
        """A token appeared or vanished; returns what to announce, if anything."""
        (self.here.add if present else self.here.discard)(key)
        told = key in self._made and self._made[key].present
        return None if told is present else self._announce(key)

    def is_latest(self, announcement: Announcement) -> bool:
        """Whether nothing has been announced of this token since."""
        made = self._made.get(announcement.key)
        return made is not None and made.number == announcement.number

    def arrive(self, announcement: Announcement) -> bool:
        """An announcement arrived; returns whether it tells the other side anything new."""
        key, present, number = announcement.key, announcement.present, announcement.number
        # Only the first copy of a duplicate counts, and none that was overtaken.
        if number <= self._heard.get(key, number):
            return False
        self._heard[key] = number
        is_news = (key in self.known) is not present
        (self.known.add if present else self.known.discard)(key)
        if not present and self._made[key].number == number:
            del self._made[key], self._heard[key]
        return is_news

    def _announce(self, key: str) -> Announcement:
        self._number += 1
        made = Announcement(key, key in self.here, self._number)
        self._made[key] = made
        self._heard.setdefault(key, made.number - 1)
        return made
