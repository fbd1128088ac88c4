"""The entries of a plan while it is read: what is told twice, changed or taken back."""

from bisect import bisect_left
from collections.abc import Iterator
from itertools import chain
from typing import Generic, TypeVar

from farside.link.profile.plans.contacts import Contact, ContactPlanError, Range

_Entry = TypeVar("_Entry", Contact, Range)


class Book(Generic[_Entry]):
    """The contacts or the ranges of all pairs of nodes; those of one pair do not overlap."""

    def __init__(self) -> None:
        self._by_pair: dict[tuple[int, int], list[_Entry]] = {}

    def __iter__(self) -> Iterator[_Entry]:
        return chain.from_iterable(self._by_pair.values())

    def overlapping(self, new: _Entry) -> _Entry | None:
        """An entry of the same pair that overlaps `new`, if there is one."""
        entries = self._by_pair.get((new.source, new.dest), [])
        at = bisect_left(entries, new)
        near = entries[max(0, at - 1) : at + 1]
        return next((e for e in near if e.begin_s < new.end_s and new.begin_s < e.end_s), None)

    def add(self, new: _Entry) -> None:
        """Add `new`; what is told twice counts once.

        Ranges that overlap and agree on the light time become one.

        Raises:
            ContactPlanError: if it overlaps another entry of its pair that says otherwise.
        """
        while (other := self.overlapping(new)) and other != new:
            if not (isinstance(new, Range) and new.owlt_s == other[-1]):
                kind = type(new).__name__.lower()
                raise ContactPlanError(
                    f"expected no {kind} from {new.source} to {new.dest} that overlaps another, "
                    f"found {_span(new)} beside {_span(other)}"
                )
            self.take(new.source, new.dest, other.begin_s)
            new = new._replace(
                begin_s=min(new.begin_s, other.begin_s), end_s=max(new.end_s, other.end_s)
            )
        if other is None:
            entries = self._by_pair.setdefault((new.source, new.dest), [])
            entries.insert(bisect_left(entries, new), new)

    def take(self, source: int, dest: int, begin_s: float) -> _Entry:
        """Remove and return the entry that begins at `begin_s`.

        Raises:
            ContactPlanError: if there is none.
        """
        entries = self._by_pair.get((source, dest), [])
        at = bisect_left(entries, begin_s, key=_begin_s)
        if at == len(entries) or entries[at].begin_s != begin_s:
            raise ContactPlanError(
                f"expected one from {source} to {dest} that starts at {begin_s:.12g} s, "
                f"found none so far"
            )
        return entries.pop(at)

    def clear(self, source: int, dest: int) -> None:
        """Remove all entries of a pair, if there are any."""
        self._by_pair.pop((source, dest), None)


def _begin_s(entry: Contact | Range) -> float:
    return entry.begin_s


def _span(entry: Contact | Range) -> str:
    return f"{entry.begin_s:.12g} s to {entry.end_s:.12g} s"
