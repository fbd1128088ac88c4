"""Expected costs: an action is worth its cost and all its outcomes, each as often as it follows.

For a context s and an action a, tried again until one of its known outcomes i has come true:

    Q(s, a) = (c + Σ wᵢ·P_v(i)) / Σ wᵢ        P_v(s) = min over a of Q(s, a)

where c is what an attempt costs and wᵢ the measure that cost estimates rest on. With one outcome
that is equations 4 and 5 of the seed. Outcomes that no way leads on from are failed attempts, as is
all that is not accounted for; so a way is found exactly where equation 5 finds one. Outcomes at
different delays do not exclude each other, so each delay is an alternative of its own.

Where Σ wᵢ is above 1, some outcomes come together, and only each for itself is known. A situation
is worth what the best of its active Signs is, so the best outcomes are counted up to a sum of 1.

Source: Bellman's equation for a stochastic shortest path, solved by policy iteration (Howard); the
rest is a project default.
"""

import math
import warnings
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farside.dem.policy.equations import Equations, Floats, Ids, Policy
from farside.dem.policy.spread import Spread

_EXACT = 1e-13  # greatest relative change that a further round would make
_NEARLY = 1e-9  # no greater one may be left where further rounds come no nearer
_ROUNDS = 200  # of policy iteration; more than ten are rare
_KEEPS_ON = 1.0 - 2.0**-40  # an endless loop ends at last, so that every policy has a value
_LEAST, _MOST = 1e-200, 1e200  # a value, so that no sum overflows and none but the goal's is 0.0


class Alternatives:
    """All hypotheses, grouped by context, action and delay, and each whole's parts after them.

    A whole has each of its parts as an alternative at no cost, where whole implies part.

    Args:
        spread: the lists. While this is in use they must not change in structure.

    Attributes:
        structure: of the lists, by which this is made.
        arc: the hypotheses, group by group.
        group: the group of each arc.
        outcome: the outcome of each arc; of a part, itself.
        context: the context of each group; of a part, the whole.
        action: the action of each group of hypotheses.
    """

    def __init__(self, spread: Spread) -> None:
        self.structure = (spread.hypotheses.structure, spread.signs.structure)
        self._hypotheses = arcs = spread.hypotheses
        implied = spread.implied.pairs()
        delay = np.asarray(arcs.delay).astype(np.int64)
        living = np.flatnonzero(delay)
        context, action = (
            np.asarray(column)[living].astype(np.int64) for column in (arcs.context, arcs.action)
        )
        actions = int(action.max(initial=0)) + 1
        key = (context * actions + action) * (int(delay.max(initial=0)) + 1) + delay[living]
        order = np.argsort(key, kind="stable")
        first = np.flatnonzero(np.diff(key[order], prepend=-1))
        self.arc = living[order]
        self.action = action[order][first]
        self.context = np.concatenate((context[order][first], implied[:, 0]))
        own = np.asarray(arcs.outcome)[self.arc].astype(np.int64)
        self.outcome = np.concatenate((own, implied[:, 1]))
        sizes = np.diff(first, append=len(order))
        sizes = np.concatenate((sizes, np.ones(len(implied), dtype=np.int64)))
        self.group = np.repeat(np.arange(len(sizes)), sizes)

    def usable(self) -> NDArray[np.bool_]:
        """Of each hypothesis, whether equation 4 has a finite cost."""
        return np.asarray(self._hypotheses.cost)[self.arc] < math.inf

    def weights(self) -> Floats:
        """How often each outcome follows; 0.0 if it is not usable."""
        own = np.where(self.usable(), np.asarray(self._hypotheses.measure)[self.arc], 0.0)
        return np.concatenate((own, np.ones(len(self.outcome) - len(own))))

    def costs(self) -> Floats:
        """What one attempt costs in each group."""
        arcs = self._hypotheses
        own = np.asarray(arcs.action_costs)[self.action]
        for (context, action), risk in arcs.risks.items():
            # Sorted by context, and by action within.
            first, end = np.searchsorted(self.context[: len(own)], (context, context + 1)).tolist()
            own[first:end][self.action[first:end] == action] += risk
        return np.concatenate((own, np.zeros(len(self.context) - len(own))))


class Backup(NamedTuple):
    """What follows for each Sign from the values of its outcomes.

    Attributes:
        q: expected cost of each group.
        value: least of these, by row.
        share: how much each arc counts in its group.
    """

    q: Floats
    value: Floats
    share: Floats


class System:
    """The equations for the values of all Signs that can reach a goal, one row for each.

    Args:
        alternatives: what there is to do.
        known: by Sign id, 0.0 at the goal, infinite where no way leads there, and else anything.
        before: an earlier system of the same goal, whose policy this one begins with.

    Attributes:
        sign: the Sign of each row, ascending.
        arc, outcome: hypothesis (-1 for a part) and outcome of each arc that counts, in groups.
        weight: how often each of these follows; set by `follow`.
        starts: the first arc of each group.
        row: the row of each group, ascending.
        first: the first group of each row.
    """

    def __init__(
        self, alternatives: Alternatives, known: Floats, before: "System | None" = None
    ) -> None:
        self._alternatives = alternatives
        self.sign = np.flatnonzero((known > 0.0) & (known < math.inf))
        rows = np.full(len(known), -1)
        rows[self.sign] = np.arange(len(self.sign))
        row = rows[alternatives.context[alternatives.group]]
        counts = np.flatnonzero((row >= 0) & (known[alternatives.outcome] < math.inf))
        counts = counts[np.argsort(row[counts], kind="stable")]
        group = alternatives.group[counts]
        self._counts = counts
        self.outcome = alternatives.outcome[counts]
        self.arc = np.full(len(counts), -1)
        own = counts < len(alternatives.arc)
        self.arc[own] = alternatives.arc[counts[own]]
        self.starts = np.flatnonzero(np.diff(group, prepend=-1))
        self._groups = group[self.starts]
        sizes = np.diff(self.starts, append=len(counts))
        self._group = np.repeat(np.arange(len(self.starts)), sizes)
        self.row = row[counts[self.starts]]
        self.first = np.flatnonzero(np.diff(self.row, prepend=-1))
        self._leads_on = rows[self.outcome] >= 0
        self._order = np.arange(len(counts))
        # Names the groups of a row: by hypothesis or, where they are negative, by part.
        self._names = np.where(self.arc >= 0, self.arc, -2 - self.outcome)[self.starts]
        preferred = np.full(len(known), -1) if before is None else before.chosen(len(known))
        self._chosen: NDArray[np.bool_] = preferred[self.sign[self.row]] == self._names

    def chosen(self, size: int) -> Ids:
        """What the policy does at each of so many Signs, -1 where nothing is known of it."""
        chosen = np.full(size, -1)
        chosen[self.sign[self.row[self._chosen]]] = self._names[self._chosen]
        return chosen

    def follow(self) -> None:
        """Take in the measures and costs as they are; call this before anything else."""
        self.weight = self._alternatives.weights()[self._counts]
        starts, group = self.starts, self._group
        total = np.add.reduceat(self.weight, starts) if len(starts) else self.weight
        counted = np.where(total > 1.0 + _NEARLY, 1.0, total)
        with np.errstate(divide="ignore", over="ignore"):
            attempts = np.minimum(self._alternatives.costs()[self._groups] / counted, _MOST)
        self._attempts = np.where(counted > 0.0, attempts, math.inf)
        self._total = np.where(counted > 0.0, total, 1.0)
        self._counted = np.where(counted > 0.0, counted, 1.0)[group]
        # The groups whose outcomes come together, largest first, with their first arcs and sizes.
        sizes = np.diff(starts, append=len(group))
        crowded = (total > 1.0 + _NEARLY).nonzero()[0]
        crowded = crowded[np.argsort(-sizes[crowded], kind="stable")]
        self._crowded, self._crowd_sizes = starts[crowded], sizes[crowded]

    def backup(self, value: Floats) -> Backup:
        """What follows from the values of all Signs, by id."""
        onward = value[self.outcome]
        share = self._together(onward) / self._counted
        q = np.add.reduceat(share * onward, self.starts) + self._attempts
        return Backup(q, np.minimum.reduceat(q, self.first), share)

    def arcs(self, group: int) -> slice:
        """The arcs of a group."""
        end = self.starts[group + 1] if group + 1 < len(self.starts) else len(self.arc)
        return slice(int(self.starts[group]), int(end))

    def expected(self, group: int, value: Floats) -> float:
        """The expected cost of one group; see `backup`."""
        arcs, total = self.arcs(group), float(self._total[group])
        left = 1.0 if total > 1.0 + _NEARLY else total
        cost, counted = float(self._attempts[group]), left
        onward, weights = value[self.outcome[arcs]].tolist(), self.weight[arcs].tolist()
        for reached, weight in sorted(zip(onward, weights, strict=True)):
            cost += min(left, weight) / counted * reached
            left = max(0.0, left - weight)
        return cost

    def _together(self, onward: Floats) -> Floats:
        """How much each arc counts, where those that lead to the least values count first."""
        if not len(self._crowded):
            return self.weight
        order, together = self._ordered(onward), self.weight.copy()
        left = np.ones(len(self._crowded))
        # Group by group: in one sum over all, what changes in one would change last bits in others.
        for place in range(self._crowd_sizes[0]):
            among = int(np.searchsorted(-self._crowd_sizes, -place))
            arcs = order[self._crowded[:among] + place]
            together[arcs] = taken = np.minimum(left[:among], self.weight[arcs])
            left = left[:among] - taken
        return together

    def _ordered(self, onward: Floats) -> Ids:
        """All arcs, group by group, those that lead to the least values first."""
        order, group = self._order, self._group
        values = onward[order]
        turned = ((values[1:] < values[:-1]) & (group[1:] == group[:-1])).nonzero()[0]
        if len(turned):
            # Few groups, as a rule: the order is that of the last time.
            mixed = np.zeros(len(self.starts), dtype=np.bool_)
            mixed[group[turned]] = True
            places = mixed[group].nonzero()[0]
            arcs = order[places]
            order[places] = arcs[np.lexsort((onward[arcs], group[arcs]))]
        return order

    def solve(self, guess: Floats, equations: Equations) -> Floats:
        """The values of all Signs, by id.

        Args:
            equations: those of the policies before, if there were any.
            guess: values to begin with, changed in place. The nearer they are, the sooner this is
                done; what comes out does not depend on them, but for the last bits.

        Warns:
            RuntimeWarning: if they do not settle. That has not been seen; eight rounds have.
        """
        value, before, worst = guess, math.inf, 0.0
        for _ in range(_ROUNDS if len(self.sign) else 0):
            found = self.backup(value)
            short = found.value - value[self.sign]
            worst = float(np.max(np.abs(short) / found.value))
            if worst <= _EXACT:
                return value
            stands = not self._choose(found) and worst > before / 4
            if stands and worst <= _NEARLY:
                return value
            before = worst
            # Beside the value of an endless loop, what is added to it would be lost.
            base = 0.0 if worst > 1.0 else value[self.sign]
            known = np.zeros(len(value))
            known[self.sign] = self._attempts[self._chosen] if worst > 1.0 else short
            solved = equations.solve(self._policy(found), known, anew=stands)[self.sign]
            value[self.sign] = np.clip(base + solved, _LEAST, _MOST)
        if worst > 0.0:
            warnings.warn(
                f"expected values: expected them to settle within {_ROUNDS} rounds, found that the "
                f"last one changed one by {worst:.1g} of itself",
                RuntimeWarning,
                stacklevel=2,
            )
        return value

    def _choose(self, found: Backup) -> bool:
        """Choose the best group of each row, and tell whether any is another than before.

        What was chosen stands where it is as good: the fewer equations change, the better.
        """
        good = found.q <= found.value[self.row] * (1.0 + _EXACT)
        if (good & self._chosen).sum() == len(self.sign):
            return False
        best = good.nonzero()[0][::-1]
        choice = np.empty(len(self.sign), dtype=np.int64)
        choice[self.row[best]] = best
        stands = (good & self._chosen).nonzero()[0]
        choice[self.row[stands]] = stands
        self._chosen[:] = False
        self._chosen[choice] = True
        return True

    def _policy(self, found: Backup) -> Policy:
        """The chosen groups as the coefficients of linear equations."""
        arcs = (self._chosen[self._group] & self._leads_on).nonzero()[0]
        return Policy(
            sign=self.sign[self.row[self._group[arcs]]],
            outcome=self.outcome[arcs],
            share=found.share[arcs] * _KEEPS_ON,
        )
