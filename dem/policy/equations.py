"""Linear equations of policy values, solved again and again as a few of them change.

A policy says of every Sign what is done there, and so to which Signs that leads, and how often:

    x(s) − Σ share(s, i)·x(i) = b(s)

From one cycle to the next only the equations of the Signs differ where something was learned, new
Signs among them. So the matrix is factored rarely; what has changed since is a matrix of low rank,
which Sherman, Morrison and Woodbury's formula takes into account.
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
_CHANGED_AT_ONCE = 16  # to factor is about as fast as to solve for so many once more
_ACCURATE = 1e-9  # greatest error by the formula, as a fraction of the greatest known value
_ROOM = 1.25  # for so many times as many Signs as there are


class Policy(NamedTuple):
    """The shares, as three columns in order of the first; those of the goal are left out.

    A Sign of which there is nothing here has x(s) = b(s).
    """

    sign: Ids
    outcome: Ids
    share: Floats


class Equations:
    """Solves the equations of one policy after the other. A copy goes on by itself."""

    def __init__(self) -> None:
        self._room = 0
        self._factors: Any = None
        self._factored = Policy(np.empty(0, np.int64), np.empty(0, np.int64), np.empty(0))
        # The solutions of the factored equations for a 1 at one Sign alone, and which is where.
        self._units: Floats = np.empty((0, 0))
        self._place: dict[int, int] = {}

    def solve(self, policy: Policy, known: Floats, *, anew: bool) -> Floats:
        """The solution x, by Sign id.

        Args:
            policy: the equations.
            known: b by Sign id.
            anew: whether to factor anew, as the last solution was not good enough.
        """
        size = len(known)
        room = self._room if size <= self._room else int(_ROOM * size)
        if size < FEW_SIGNS:
            matrix = np.eye(size)
            np.subtract.at(matrix, (policy.sign, policy.outcome), policy.share)
            return np.linalg.solve(matrix, known).astype(np.float64)
        known = np.pad(known, (0, room - size))
        solution = None if anew or room > self._room else self._updated(policy, known)
        if solution is None:
            self._factor(policy, room)
            solution = self._factors.solve(known)
        return solution[:size]

    def _updated(self, policy: Policy, known: Floats) -> Floats | None:
        """The solution by the formula; `None` where too much has changed, or it finds none."""
        changed = self._changed(policy)
        if changed is None:
            return None
        solution: Floats = self._factors.solve(known)
        if changed:
            try:
                solution += self._correction(policy, changed, solution)
            except np.linalg.LinAlgError:
                return None
        # Where loops hardly ever end, the formula is not accurate.
        onward = np.bincount(policy.sign, policy.share * solution[policy.outcome], len(known))
        error = float(np.abs(solution - onward - known).max())
        return solution if error <= _ACCURATE * float(np.abs(known).max()) else None

    def _factor(self, policy: Policy, room: int) -> None:
        from scipy.sparse import csc_array, eye_array  # type: ignore[import-untyped] # noqa: PLC0415
        from scipy.sparse.linalg import splu  # type: ignore[import-untyped] # noqa: PLC0415

        shares = csc_array((policy.share, (policy.sign, policy.outcome)), (room, room))
        self._factors = splu((eye_array(room) - shares).tocsc())
        self._factored, self._room = policy, room
        # Not cleared: copies may go on with those that there are.
        self._units, self._place = np.empty((room, _CHANGED), order="F"), {}

    def _changed(self, policy: Policy) -> list[int] | None:
        """The Signs whose equations are others than those factored, `None` if too many are."""
        # Of a hash of its row, a change is as good as sure to change the sum.
        before, now = (self._fingerprint(one) for one in (self._factored, policy))
        changed: list[int] = (before != now).any(axis=0).nonzero()[0].tolist()
        new = len(changed) - len(self._place.keys() & changed)
        is_few = new <= _CHANGED_AT_ONCE and new + len(self._place) <= _CHANGED
        return changed if is_few else None

    def _fingerprint(self, policy: Policy) -> Floats:
        """Two numbers of each row that are the same if the row is, and else hardly ever."""
        marked = policy.share * (1.0 + policy.outcome)
        return np.stack(
            [np.bincount(policy.sign, by, self._room) for by in (marked, marked * marked)]
        )

    def _correction(self, policy: Policy, changed: list[int], solution: Floats) -> Floats:
        """What to add to a solution of the factored equations, as some are others by now."""
        self._solve_units(changed)
        places = np.array([self._place[sign] for sign in changed])
        reduced, right = np.eye(len(changed)), np.zeros(len(changed))
        for equations, factor in ((policy, 1.0), (self._factored, -1.0)):
            ends = np.searchsorted(equations.sign, np.stack((changed, np.add(changed, 1))))
            for row, (first, end) in enumerate(ends.T.tolist()):
                share, onward = factor * equations.share[first:end], equations.outcome[first:end]
                reduced[row] -= share @ self._units[onward[:, None], places]
                right[row] += share @ solution[onward]
        much = np.zeros(len(self._place))
        much[places] = np.linalg.solve(reduced, right)
        added: Floats = self._units[:, : len(much)] @ much
        return added

    def _solve_units(self, signs: list[int]) -> None:
        new = [sign for sign in signs if sign not in self._place]
        if new:
            units = np.zeros((self._room, len(new)))
            units[new, range(len(new))] = 1.0
            known = len(self._place)
            self._units[:, known : known + len(new)] = self._factors.solve(units)
            self._place.update(zip(new, range(known, known + len(new)), strict=True))
