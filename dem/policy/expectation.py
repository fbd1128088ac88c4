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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from farside.dem.policy.equations import Equations, Floats, Ids, Policy
from farside.dem.policy.spread import Spread

_EXACT = 1e-13  # greatest relative change that a further round would make
_NEARLY = 1e-9  # no greater one may be left where further rounds come no nearer
_ROUNDS = 200  # of policy iteration; more than ten are rare
_KEEPS_ON = 1.0 - 2.0**-40  # an endless loop ends at last, so that every policy has a value
_MOST = 1e200  # the greatest value, so that no sum overflows


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
        if arcs.risks:
            pairs = zip(self.context.tolist(), self.action.tolist(), strict=False)
            own = own + np.array([arcs.risks.get(pair, 0.0) for pair in pairs])
        return np.concatenate((own, np.zeros(len(self.context) - len(own))))


class Backup(NamedTuple):
    """What follows for each Sign from the values of its outcomes.

    Attributes:
        q: expected cost of each group.
        value: least of these, by row.
        choice: the first group that has it, by row.
        share: how much each arc counts in its group.
    """

    q: Floats
    value: Floats
    choice: Ids
    share: Floats


class System:
    """The equations for the values of all Signs that can reach a goal, one row for each.

    Args:
        alternatives: what there is to do.
        known: by Sign id, 0.0 at the goal, infinite where no way leads there, and else anything.

    Attributes:
        sign: the Sign of each row, ascending.
        arc, outcome: hypothesis (-1 for a part) and outcome of each arc that counts, in groups.
        weight: how often each of these follows; set by `follow`.
        starts: the first arc of each group.
        row: the row of each group, ascending.
        first: the first group of each row.
    """

    def __init__(self, alternatives: Alternatives, known: Floats) -> None:
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
        self._column = rows[self.outcome]
        self._order = np.arange(len(counts))
        self._equations = Equations(len(self.sign))

    def follow(self) -> None:
        """Take in the measures and costs as they are; call this before anything else."""
        self.weight = self._alternatives.weights()[self._counts]
        starts, group = self.starts, self._group
        total = np.add.reduceat(self.weight, starts) if len(starts) else self.weight
        counted = np.minimum(total, 1.0)
        with np.errstate(divide="ignore", over="ignore"):
            attempts = np.minimum(self._alternatives.costs()[self._groups] / counted, _MOST)
        self._attempts = np.where(counted > 0.0, attempts, math.inf)
        self._counted = np.where(counted > 0.0, counted, 1.0)[group]
        # The arcs of groups whose outcomes come together, and the first arc of the group of each.
        self._crowded = (total > 1.0)[group]
        arcs = self._crowded.nonzero()[0]
        self._crowded_first = np.searchsorted(arcs, starts)[group[arcs]]

    def backup(self, value: Floats) -> Backup:
        """What follows from the values of all Signs, by id."""
        onward = value[self.outcome]
        share = self._together(onward) / self._counted
        q = np.add.reduceat(share * onward, self.starts) + self._attempts
        least = np.minimum.reduceat(q, self.first)
        tied = (q == least[self.row]).nonzero()[0][::-1]
        choice = np.empty(len(self.sign), dtype=np.int64)
        choice[self.row[tied]] = tied
        return Backup(q, least, choice, share)

    def _together(self, onward: Floats) -> Floats:
        """How much each arc counts, where those that lead to the least values count first."""
        if not len(self._crowded_first):
            return self.weight
        order = self._ordered(onward)
        order = order[self._crowded[order]]
        weight = self.weight[order]
        taken = weight.cumsum() - weight
        left = 1.0 - (taken - taken[self._crowded_first])
        together = self.weight.copy()
        together[order] = np.minimum(np.maximum(left, 0.0), weight)
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

    def solve(self, guess: Floats) -> Floats:
        """The values of all Signs, by id.

        Args:
            guess: values to begin with, changed in place. The nearer they are, the sooner this is
                done; what comes out does not depend on them, but for the last bits.
        """
        value, before, chosen = guess, math.inf, np.empty(0, dtype=np.int64)
        for _ in range(_ROUNDS if len(self.sign) else 0):
            found = self.backup(value)
            short = found.value - value[self.sign]
            worst = float(np.max(np.abs(short) / found.value))
            stands = worst > before / 4 and np.array_equal(found.choice, chosen)
            if worst <= _EXACT or (stands and worst <= _NEARLY):
                break
            solved = self._equations.solve(self._policy(found), short, anew=stands)
            before, chosen = worst, found.choice
            value[self.sign] = np.clip(value[self.sign] + solved, 0.0, _MOST)
        return value

    def _policy(self, found: Backup) -> Policy:
        """The chosen groups as the coefficients of linear equations, row by row."""
        chosen = np.zeros(len(self.starts), dtype=np.bool_)
        chosen[found.choice] = True
        arcs = (chosen[self._group] & (self._column >= 0)).nonzero()[0]
        return Policy(
            row=self.row[self._group[arcs]],
            column=self._column[arcs],
            share=found.share[arcs] * _KEEPS_ON,
        )
