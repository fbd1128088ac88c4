"""Queries that have crossed and are not over: which replies belong to them, and when they end.

Without clock and Zenoh. Times are nanoseconds since the start.
"""

from dataclasses import dataclass, field
from itertools import count
from typing import Generic, TypeVar

MAX_OPEN = 50_000
"""How many queries may be open in a direction at once (project default; about 200 MB). One that is
lost, or that nobody answers, stays open, for only its caller knows when it stops waiting."""

_Query = TypeVar("_Query")


@dataclass(slots=True)
class _Exchange(Generic[_Query]):
    """A query, and its replies as far as they have been made and have arrived."""

    query: _Query
    asked_ns: int
    has_arrived: bool = False
    made: int = 0
    received: set[int] = field(default_factory=set)
    total: int | None = None


class Exchanges(Generic[_Query]):
    """Both ends of the queries of one direction. Each is asked once, each reply given once.

    The end of a query says how many replies it had. Until all of them have arrived, the query stays
    open: so a lost reply is no reply until the caller's time is up, and none comes too late because
    the end has overtaken it.

    Attributes:
        longest_ns: the longest time from a query to a reply or its end so far.
    """

    def __init__(self, max_open: int = MAX_OPEN) -> None:
        self._open: dict[int, _Exchange[_Query]] = {}
        self._numbers = count()
        self._max_open = max_open
        self.longest_ns = 0

    def begin(self, query: _Query, now_ns: int) -> int:
        """A query was made; returns its number."""
        number = next(self._numbers)
        self._open[number] = _Exchange(query, now_ns)
        return number

    def overflow(self) -> tuple[int, _Query] | None:
        """Close the oldest query if there are too many, and return it with its number."""
        if len(self._open) <= self._max_open:
            return None
        number = next(iter(self._open))
        return number, self._open.pop(number).query

    def ask(self, number: int) -> bool:
        """A query arrived; returns whether it is to be asked now."""
        exchange = self._open.get(number)
        if exchange is None or exchange.has_arrived:
            return False
        exchange.has_arrived = True
        return True

    def reply(self, number: int) -> int | None:
        """A reply was made; returns which one it is, `None` if the query is closed."""
        exchange = self._open.get(number)
        if exchange is None:
            return None
        exchange.made += 1
        return exchange.made

    def end(self, number: int) -> int | None:
        """There will be no more replies; returns how many there were, `None` as above."""
        exchange = self._open.get(number)
        return None if exchange is None else exchange.made

    def is_open(self, number: int) -> bool:
        """Whether a query is open."""
        return number in self._open

    def receive(self, number: int, index: int, now_ns: int) -> _Query | None:
        """A reply arrived; returns the query to which it is to be given, if it is."""
        exchange = self._open.get(number)
        if exchange is None or index in exchange.received:
            return None
        exchange.received.add(index)
        self.longest_ns = max(self.longest_ns, now_ns - exchange.asked_ns)
        return exchange.query

    def finish(self, number: int, now_ns: int, total: int | None = None) -> _Query | None:
        """Close a query if all its replies have arrived; returns it if it is closed now.

        Args:
            number: the query's.
            now_ns: the present.
            total: how many replies there were, if the end has just arrived.
        """
        exchange = self._open.get(number)
        if exchange is None:
            return None
        if total is not None:
            exchange.total = total
            self.longest_ns = max(self.longest_ns, now_ns - exchange.asked_ns)
        if exchange.total != len(exchange.received):
            return None
        return self._open.pop(number).query

    def close(self) -> list[_Query]:
        """Close all queries and return them."""
        queries = [exchange.query for exchange in self._open.values()]
        self._open.clear()
        return queries
