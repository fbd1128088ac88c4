"""The map of expected costs towards one goal: what `PolicyMap` is for the best of all outcomes."""

import math
from collections.abc import Iterable, Iterator, Sequence
from copy import copy
from typing import NamedTuple

import numpy as np

from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypothesis import CostChange
from farside.dem.policy.equations import Equations, Floats, Ids
from farside.dem.policy.expectation import Alternatives, System
from farside.dem.policy.policy_map import PolicyMap, PolicyTable, Reason
from farside.dem.policy.spread import Spread

TIE = 1e-6
"""Costs that differ by no more than this, as a fraction, are equal (project default): choices must
not depend on last bits."""

_BITS = 2.0**24


class Expectation:
    """What the maps of all goals share.

    Attributes:
        spread: the lists.
    """

    def __init__(self, spread: Spread) -> None:
        self.spread = spread
        self._alternatives: Alternatives | None = None

    @property
    def alternatives(self) -> Alternatives:
        """All hypotheses as alternatives, by the lists as they are."""
        structure = (self.spread.hypotheses.structure, self.spread.signs.structure)
        if self._alternatives is None or self._alternatives.structure != structure:
            self._alternatives = Alternatives(self.spread)
        return self._alternatives


class _Option(NamedTuple):
    """What may be done at a Sign: its expected cost, and the hypothesis of its best outcome."""

    total: float
    rank: tuple[float, int]
    arc: int


class ExpectedMap:
    """Policy values of all Signs towards one goal by all outcomes of each action.

    See `farside.dem.policy.expectation`. After changes of the lists the equations are solved again
    from the values before, when a value is asked for. The last bits depend on where that began. So
    they are rounded off, to 24 binary places, and all else follows from the rounded values: a model
    that was loaded, or built from telemetry, acts as the original would.

    The best outcome of an action leads nearer to the goal than where it began. The path is that of
    the best actions and their best outcomes.

    Args:
        goal: id of the goal's Sign.
        expectation: the lists.

    Attributes:
        goal: id of the goal's Sign.
    """

    def __init__(self, goal: int, expectation: Expectation) -> None:
        self.goal = goal
        self._expectation = expectation
        self._spread = expectation.spread
        self._hypotheses = self._spread.hypotheses
        self._alternatives: Alternatives | None = None
        self._usable = np.empty(0, dtype=np.bool_)
        self._exact: Floats = np.empty(0)
        self._system: System | None = None
        self._equations = Equations()
        self._is_current = False

    def update(self, changes: Iterable[CostChange], signs: Iterable[int] = ()) -> None:
        """Note that the lists have changed."""
        del changes, signs
        self._is_current = False

    def part(self) -> None:
        """Go on apart from the map that this one was copied from."""
        self._exact = self._exact.copy()
        self._equations = copy(self._equations)
        self._alternatives = None
        self._is_current = False

    @property
    def value(self) -> list[float]:
        """P_v by Sign id, infinite if no path leads to the goal."""
        self._solve()
        values: list[float] = self._values.tolist()
        return values

    def nearest(self, signs: Sequence[int]) -> float:
        """The least P_v of some Signs, infinite if no path leads from them to the goal."""
        self._solve()
        return min([float(self._values[sign]) for sign in signs], default=math.inf)

    def entry(self, active: Sequence[int]) -> int | None:
        """The active Sign to act from: least P_v, then higher C_m, then older hypothesis.

        `None` if no active Sign is on the map, or if the goal itself is active.
        """
        least = self.nearest(active)
        if least in {0.0, math.inf}:
            return None
        tied = [sign for sign in active if self._values[sign] <= least * (1.0 + TIE)]
        return tied[0] if len(tied) == 1 else min(tied, key=lambda sign: self._option(sign).rank)

    def best(self, sign: int) -> int | None:
        """The hypothesis to act on at a Sign; its context is the Sign or a part of it.

        It is that of the best outcome of the best action. `None` if no path leads to the goal, or
        if the Sign is the goal or implies it.
        """
        return self._option(sign).arc if 0.0 < self.nearest((sign,)) < math.inf else None

    def walk(self, start: int) -> Iterator[int]:
        """The hypotheses along the path from the Sign `start` to the goal."""
        sign = start
        while (arc := self.best(sign)) is not None:
            yield arc
            before, sign = sign, self._hypotheses.outcome[arc]
            if self._values[sign] >= self._values[before]:
                # The cost of the action vanishes beside the value: this walk could loop.
                yield from PolicyMap(self.goal, self._spread).walk(sign)
                return

    def planned(self, active: Sequence[int], actions: ActionList) -> float:
        """The cost of the actions along the path, if each has its best outcome at once.

        Infinite where no path is known.
        """
        start = self.entry(active)
        if start is None:
            return self.nearest(active)
        return sum(actions.costs[self._hypotheses.action[arc]] for arc in self.walk(start))

    def depth(self, sign: int) -> int | None:
        """Number of actions along the path to the goal; `None` if no path leads there."""
        if self.nearest((sign,)) == math.inf:
            return None
        return sum(1 for _ in self.walk(sign))

    def why(self, sign: int) -> Reason | None:
        """The reason for the best action at a Sign, `None` if there is no action."""
        if self.best(sign) is None:
            return None
        chosen, options = self._option(sign), self._options(sign)
        action = self._hypotheses.action
        others = [one for one in options if action[one.arc] != action[chosen.arc]]
        rival = self._best_of(others) if others else None
        return Reason(
            chosen.arc,
            float(self._values[sign]),
            None if rival is None else rival.arc,
            math.inf if rival is None else rival.total,
        )

    def table(self) -> PolicyTable:
        """All Signs that can reach the goal, with `value`, `best` and `depth` of each."""
        self._solve()
        values, outcome = self._values, self._hypotheses.outcome
        sign = np.flatnonzero(values < math.inf)
        sign = sign[np.argsort(values[sign], kind="stable")]
        best, depth = [-1] * len(values), [0] * len(values)
        for one in sign[values[sign] > 0.0].tolist():
            best[one] = arc = self._option(one).arc
            is_nearer = values[outcome[arc]] < values[one]
            depth[one] = 1 + depth[outcome[arc]] if is_nearer else sum(1 for _ in self.walk(one))
        return PolicyTable(sign, values[sign], np.array(best)[sign], np.array(depth)[sign])

    # --- what there is to do -------------------------------------------------------------------

    def _option(self, sign: int) -> _Option:
        return self._best_of(self._options(sign))

    def _best_of(self, options: Sequence[_Option]) -> _Option:
        least = min(option.total for option in options)
        tied = (option for option in options if option.total <= least * (1.0 + TIE))
        return min(tied, key=lambda option: option.rank)

    def _options(self, sign: int) -> list[_Option]:
        """What may be done at a Sign, by itself or by its parts."""
        contexts = (sign, *self._spread.implied.parts(sign))
        return [option for context in contexts for option in self._own_options(context)]

    def _own_options(self, context: int) -> Iterator[_Option]:
        system = self._solve()
        row = int(np.searchsorted(system.sign, context))
        if row == len(system.sign) or system.sign[row] != context:
            return
        ends = (*system.first[row : row + 2].tolist(), len(system.starts))
        for group in range(ends[0], ends[1]):
            arcs = system.arcs(group)
            if system.arc[arcs.start] < 0:
                continue
            total = system.expected(group, self._values)
            if total < math.inf:
                yield self._led(total, system.arc[arcs], system.weight[arcs])

    def _led(self, total: float, arcs: Ids, weights: Floats) -> _Option:
        cm, born, outcome = self._hypotheses.cm, self._hypotheses.born, self._hypotheses.outcome
        _, rank, arc = min(
            (float(self._values[outcome[arc]]), (-cm[arc], born[arc]), arc)
            for arc, weight in zip(arcs.tolist(), weights.tolist(), strict=True)
            if weight
        )
        return _Option(total, rank, arc)

    # --- values --------------------------------------------------------------------------------

    def _solve(self) -> System:
        """Bring the values up to date with the lists, and return the equations that they solve."""
        if self._is_current and self._system is not None:
            return self._system
        alternatives = self._expectation.alternatives
        usable, system, guess = alternatives.usable(), self._system, self._exact
        if (
            system is None
            or alternatives is not self._alternatives
            or not np.array_equal(usable, self._usable)
        ):
            self._alternatives, self._usable = alternatives, usable
            guess = np.array(self._spread.values(self.goal))
            system = self._system = System(alternatives, guess, system)
            before = self._exact
            kept = (before < math.inf) & (guess[: len(before)] < math.inf) & (before > 0.0)
            kept &= guess[: len(before)] > 0.0
            guess[: len(before)][kept] = before[kept]
        system.follow()
        self._exact = system.solve(guess, self._equations)
        mantissa, exponent = np.frexp(self._exact)
        self._values: Floats = np.ldexp(np.rint(mantissa * _BITS) / _BITS, exponent)
        self._is_current = True
        return system
