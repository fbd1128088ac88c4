"""Linear equations of policy values, solved again and again as a few of them change.

A policy says of every Sign what is done there, and so to which Signs that leads, and how often:

    x(s) − Σ share(s, i)·x(i) = b(s)

From one cycle to the next only the equations of the Signs differ where something was learned. So
the matrix is factored rarely; what has changed since is a matrix of low rank, which Sherman,
Morrison and Woodbury's formula takes into account.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ids = NDArray[np.int64]

FEW_SIGNS = 100
"""The number of Signs from which scipy solves for their values (project default): importing scipy
takes 0.7 s, once."""

_CHANGED = 64  # so many changed equations before all are factored anew


class Policy(NamedTuple):
    """The shares, as three columns in order of row; those of the goal are left out."""

    row: Ids
    column: Ids
    share: Floats


class Equations:
    """Solves the equations of one policy after the other.

    Args:
        size: number of Signs.
    """

    def __init__(self, size: int) -> None:
        self._size = size
        self._factors: Any = None
        self._factored = Policy(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))
        self._columns: dict[int, Floats] = {}

    def solve(self, policy: Policy, known: Floats, *, anew: bool) -> Floats:
        """The solution x.

        Args:
            policy: the equations.
            known: b by row.
            anew: whether to factor anew, as the last solution was not good enough.
        """
        if self._size < FEW_SIGNS:
            matrix = np.eye(self._size)
            np.subtract.at(matrix, (policy.row, policy.column), policy.share)
            return np.linalg.solve(matrix, known).astype(np.float64)
        changed = self._changed(policy)
        if anew or self._factors is None or len(self._columns.keys() | changed) > _CHANGED:
            self._factor(policy)
            changed = []
        solution: Floats = self._factors.solve(known)
        if not changed:
            return solution
        unit = self._solved_units(changed)
        less = self._rows(policy, changed) - self._rows(self._factored, changed)
        change = np.eye(len(changed)) - less @ unit
        return solution + unit @ np.linalg.solve(change, less @ solution)

    def _factor(self, policy: Policy) -> None:
        from scipy.sparse import csc_array, eye_array  # type: ignore[import-untyped] # noqa: PLC0415
        from scipy.sparse.linalg import splu  # type: ignore[import-untyped] # noqa: PLC0415

        shares = csc_array((policy.share, (policy.row, policy.column)), (self._size, self._size))
        self._factors = splu((eye_array(self._size) - shares).tocsc())
        self._factored = policy
        self._columns.clear()

    def _changed(self, policy: Policy) -> list[int]:
        """The rows that are others than those factored."""
        if self._factors is None:
            return []
        # Of a hash of its row, a change is as good as sure to change the sum.
        before, now = (self._fingerprint(one) for one in (self._factored, policy))
        changed: list[int] = (before != now).any(axis=0).nonzero()[0].tolist()
        return changed

    def _fingerprint(self, policy: Policy) -> Floats:
        """Two numbers of each row that are the same if the row is, and else hardly ever."""
        marked = policy.share * (1.0 + policy.column)
        return np.stack(
            [np.bincount(policy.row, by, self._size) for by in (marked, marked * marked)]
        )

    def _solved_units(self, rows: list[int]) -> Floats:
        """The solutions of the factored equations for a 1 in each of these rows alone."""
        new = [row for row in rows if row not in self._columns]
        if new:
            units = np.zeros((self._size, len(new)))
            units[new, range(len(new))] = 1.0
            self._columns.update(zip(new, self._factors.solve(units).T, strict=True))
        return np.stack([self._columns[row] for row in rows], axis=1)

    def _rows(self, policy: Policy, rows: list[int]) -> Floats:
        """Some rows of the shares."""
        found = np.zeros((len(rows), self._size))
        ends = np.searchsorted(policy.row, np.stack((rows, np.add(rows, 1))))
        for place, (first, end) in enumerate(ends.T.tolist()):
            np.add.at(found[place], policy.column[first:end], policy.share[first:end])
        return found
