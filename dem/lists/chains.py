"""Linked lists of rows, held in arrays."""

from array import array
from collections.abc import Iterator

from farside.dem.lists.packing import widen

NO_ROW = -1
"""In place of a row, where there is none."""


class Chains:
    """Linked lists of rows, one for each key, in order of insertion, linked both ways.

    Attributes:
        first: first row by key, -1 for none; may be shorter than there are keys.
        following: next row by row, -1 at the end.
    """

    def __init__(self) -> None:
        self.first = array("i")
        self.following = array("i")
        self._last = array("i")
        # A hub is the context or outcome of very many, which may be removed in one cycle.
        self._preceding = array("i")

    def widen(self, before: int, after: int) -> None:
        """Have key `r * before + i` be `r * after + i` from now on; see `packing.widen`."""
        widen(self.first, before, after, NO_ROW)
        widen(self._last, before, after, NO_ROW)

    def of(self, key: int) -> Iterator[int]:
        """The rows of a chain."""
        row = self.head(key)
        while row != NO_ROW:
            yield row
            row = self.following[row]

    def head(self, key: int) -> int:
        """The first row of a chain, `NO_ROW` if it has none."""
        return self.first[key] if key < len(self.first) else NO_ROW

    def append(self, key: int, row: int) -> None:
        """Add a row at the end of a chain."""
        _extend(self.first, key)
        _extend(self._last, key)
        _extend(self.following, row)
        _extend(self._preceding, row)
        last = self._last[key]
        self.following[row], self._preceding[row] = NO_ROW, last
        if last == NO_ROW:
            self.first[key] = row
        else:
            self.following[last] = row
        self._last[key] = row

    def remove(self, key: int, row: int) -> None:
        """Unlink a row from its chain."""
        before, after = self._preceding[row], self.following[row]
        if before == NO_ROW:
            self.first[key] = after
        else:
            self.following[before] = after
        if after == NO_ROW:
            self._last[key] = before
        else:
            self._preceding[after] = before

    def is_empty(self, key: int) -> bool:
        """Whether the chain has no row."""
        return key >= len(self.first) or self.first[key] == NO_ROW

    def is_single(self, key: int) -> bool:
        """Whether the chain has exactly one row."""
        return not self.is_empty(key) and self.first[key] == self._last[key]


def _extend(column: "array[int]", index: int) -> None:
    if index >= len(column):
        column.extend([NO_ROW] * (index + 1 - len(column)))
