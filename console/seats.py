"""Seats: more than one page may look, one has the stick."""

GONE_S = 10.0
"""After this wall time without its holder's page the stick is free (project default): a reload or
a short loss of the connection keeps it."""


class Seats:
    """Who of those that look has the stick. A page may be open more than once, in a reload.

    The first page gets the stick. Another one asks for it, and the holder hands it over. It is free
    when its holder has been gone for `GONE_S`: who comes or asks then gets it at once. Times are
    seconds of wall time, from any origin.

    Attributes:
        asks: the page that asks for the stick; `None` if none does.
    """

    def __init__(self) -> None:
        self._holder: str | None = None
        self._open: dict[str, int] = {}
        self._gone_s: float | None = None
        self.asks: str | None = None

    @property
    def looking(self) -> int:
        """How many pages look."""
        return len(self._open)

    def holds(self, page: str) -> bool:
        """Whether the page has the stick."""
        return page == self._holder

    def free(self, now_s: float) -> bool:
        """Whether whoever comes or asks gets the stick at once."""
        if self._holder is None:
            return True
        return self._gone_s is not None and now_s - self._gone_s >= GONE_S

    def open(self, page: str, now_s: float) -> None:
        """A page is opened, or its connection is back."""
        self._open[page] = self._open.get(page, 0) + 1
        if self.holds(page):
            self._gone_s = None
        elif self.free(now_s):
            self._give(page)

    def close(self, page: str, now_s: float) -> None:
        """A page is closed, or its connection lost."""
        if page not in self._open:
            return
        self._open[page] -= 1
        if self._open[page]:
            return
        del self._open[page]
        if self.asks == page:
            self.asks = None
        if self.holds(page):
            self._gone_s = now_s

    def ask(self, page: str, now_s: float) -> bool:
        """Ask for the stick; whether the page has it now. Otherwise its holder is to answer."""
        if self.holds(page):
            return True
        if page in self._open and self.free(now_s):
            self._give(page)
            return True
        if page in self._open:
            self.asks = page
        return False

    def hand_over(self, page: str) -> bool:
        """The holder gives the stick to the page that asks; whether it did."""
        if not self.holds(page) or self.asks is None:
            return False
        self._give(self.asks)
        return True

    def _give(self, page: str) -> None:
        self._holder, self._gone_s = page, None
        if self.asks == page:
            self.asks = None
