"""H, the Hypothesis List, and A, the Action List.

A hypothesis is a row across typed columns: it takes tens of bytes, and numpy can view a column
without copying it. Two chains run through the rows, one of the same context and action, one of the
same outcome, each in order of age.
"""

import math
from array import array
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import msgspec

from farside.dem.equations import cost_estimate, reinforced, weakened
from farside.dem.journal import Entry, HypothesisAdded, HypothesisRemoved, Verdict, judged
from farside.dem.lists.packing import packed, unpack_into
from farside.dem.lists.signs import Sign
from farside.dem.parameters import Parameters

_NONE = -1


class Hypothesis(msgspec.Struct, frozen=True):
    """A µ-hypothesis: context ∧ action → outcome after `delay` cycles.

    Attributes:
        context, outcome: Signs.
        action: an Action's name.
        delay: cycles from context and action to outcome, 1 or more.
        cm: corroboration measure C_m, 0 to 1.
        credit: the same for what no better hypothesis foretold, 0 to 1; see
            `farside.dem.learning.credit`.
        predictions: how often it predicted and was judged.
        successes: how many of these predictions came true.
    """

    context: Sign
    action: str
    outcome: Sign
    delay: int
    cm: float
    credit: float
    predictions: int
    successes: int


class Change(NamedTuple):
    """A hypothesis was made or removed, or its cost changed.

    Attributes:
        hypothesis: its row. It may have been used again since.
        context, outcome: Signs at its ends.
        old_cost: cost estimate C_e before; infinite if it was made.
    """

    hypothesis: int
    context: int
    outcome: int
    old_cost: float


class ActionList:
    """A, what can be done and what it costs, ordered by name.

    Raises:
        ValueError: if there is no action, or a cost is not finite and above 0. A free action
            would make endless walks as good as short ones.
    """

    def __init__(self, costs: Mapping[str, float]) -> None:
        if not costs:
            raise ValueError("expected the cost of one action at least, found none")
        self.names = tuple(sorted(costs))
        self.costs = tuple(costs[name] for name in self.names)
        self._ids = {name: action for action, name in enumerate(self.names)}
        for name, cost in zip(self.names, self.costs, strict=True):
            if not 0.0 < cost < math.inf:
                raise ValueError(f"cost of action {name!r}: expected above 0, found {cost}")

    def __len__(self) -> int:
        return len(self.names)

    def id_of(self, name: str) -> int:
        """The id of an action.

        Raises:
            ValueError: if there is none of this name.
        """
        if name not in self._ids:
            raise ValueError(
                f"unknown action {name!r}: expected one of {', '.join(map(repr, self.names))}"
            )
        return self._ids[name]


class Chains:
    """Rows that belong together, each chain in order of being added.

    Attributes:
        first: first row by key, -1 for none; may be shorter than there are keys.
        following: next row by row, -1 at the end.
    """

    def __init__(self) -> None:
        self.first = array("i")
        self.following = array("i")
        self._last = array("i")

    def of(self, key: int) -> Iterator[int]:
        """The rows of a chain."""
        row = self.first[key] if key < len(self.first) else _NONE
        while row != _NONE:
            yield row
            row = self.following[row]

    def append(self, key: int, row: int) -> None:
        """Put a row at the end of a chain."""
        _extend(self.first, key)
        _extend(self._last, key)
        _extend(self.following, row)
        self.following[row] = _NONE
        last = self._last[key]
        if last == _NONE:
            self.first[key] = row
        else:
            self.following[last] = row
        self._last[key] = row

    def remove(self, key: int, row: int) -> None:
        """Take a row out of its chain."""
        before, here = _NONE, self.first[key]
        while here != row:
            before, here = here, self.following[here]
        after = self.following[row]
        if before == _NONE:
            self.first[key] = after
        else:
            self.following[before] = after
        if after == _NONE:
            self._last[key] = before

    def is_empty(self, key: int) -> bool:
        """Whether the chain has no row."""
        return key >= len(self.first) or self.first[key] == _NONE

    def is_single(self, key: int) -> bool:
        """Whether the chain has one row."""
        return not self.is_empty(key) and self.first[key] == self._last[key]


def _extend(column: "array[int]", key: int) -> None:
    if key >= len(column):
        column.extend([_NONE] * (key + 1 - len(column)))


class HypothesesState(msgspec.Struct, frozen=True, array_like=True):
    """A Hypothesis List as it is saved: `packed` columns, and what else it needs."""

    columns: tuple[bytes, ...]
    free: tuple[int, ...]
    cm_sum: float


class HypothesisList:
    """H, every µ-hypothesis, by ids that count from 0 and are used again after a removal.

    Attributes:
        context, action, outcome, delay, cm, credit, predictions, successes: see `Hypothesis`;
            what they hold of a removed row means nothing.
        cost: cost estimate C_e, kept up; infinite for a removed row.
        born: a number that grows with every hypothesis made: the order of age.
        structure: moves on whenever a row is added or removed.
        cm_sum: sum of all C_m, kept up with each change.
        changes: what the policy map must take in since it was last cleared.
        by_outcome: rows by outcome, for loops that a generator would slow.
        journal: where all that happens to the list is written down, if anywhere.
    """

    def __init__(self, actions: ActionList, parameters: Parameters) -> None:
        self.context = array("i")
        self.action = array("i")
        self.outcome = array("i")
        self.delay = array("i")
        self.cm = array("d")
        self.credit = array("d")
        self.cost = array("d")
        self.predictions = array("i")
        self.successes = array("i")
        self.born = array("q")
        self.structure = 0
        self.cm_sum = 0.0
        self.changes: list[Change] = []
        self.journal: list[Entry] | None = None
        self._actions = actions
        self._parameters = parameters
        self._measure = self.credit if parameters.own_credit else self.cm
        self._of_cause = Chains()
        self.by_outcome = Chains()
        self._free: list[int] = []
        self._births = 0

    def __len__(self) -> int:
        """How many rows there are, with those that are free to be used again."""
        return len(self.cm)

    @property
    def count(self) -> int:
        """How many hypotheses there are."""
        return len(self.cm) - len(self._free)

    def cause(self, context: int, action: int) -> int:
        """The number of a pair of context and action."""
        return context * len(self._actions) + action

    def of_cause(self, context: int, action: int) -> Iterator[int]:
        """The hypotheses that `context` and `action` make active, in order of age."""
        return self._of_cause.of(self.cause(context, action))

    def from_context(self, context: int) -> Iterator[int]:
        """The hypotheses of a context with any action."""
        for action in range(len(self._actions)):
            yield from self.of_cause(context, action)

    def of_outcome(self, outcome: int) -> Iterator[int]:
        """The hypotheses that end in `outcome`, in order of age."""
        return self.by_outcome.of(outcome)

    def is_last_of(self, hypothesis: int) -> bool:
        """Whether no other hypothesis has the same outcome."""
        return self.by_outcome.is_single(self.outcome[hypothesis])

    def is_context(self, sign: int) -> bool:
        """Whether any hypothesis has this Sign for its context."""
        return any(
            not self._of_cause.is_empty(self.cause(sign, action))
            for action in range(len(self._actions))
        )

    def find(self, context: int, action: int, outcome: int, delay: int) -> int | None:
        """This very hypothesis, `None` where there is none."""
        for same in self.of_cause(context, action):
            if self.outcome[same] == outcome and self.delay[same] == delay:
                return same
        return None

    def holds(self, context: int, action: int, outcome: int, delay: int) -> bool:
        """Whether there is this very hypothesis."""
        return self.find(context, action, outcome, delay) is not None

    def success_share(self, hypothesis: int) -> float:
        """Which share of its predictions came true; it was judged once at least."""
        return self.successes[hypothesis] / self.predictions[hypothesis]

    def by_age(self) -> list[int]:
        """All ids, in order of age."""
        free = set(self._free)
        living = (hypothesis for hypothesis in range(len(self)) if hypothesis not in free)
        return sorted(living, key=self.born.__getitem__)

    def add(self, context: int, action: int, outcome: int, delay: int, credit: float) -> int:
        """Make a new hypothesis with the first C_m: its id. The caller knows that it is new."""
        cm = self._parameters.initial_cm
        measure = credit if self._parameters.own_credit else cm
        cost = cost_estimate(self._actions.costs[action], measure)
        self._births += 1
        self.structure += 1
        self.cm_sum += cm
        row = (context, action, outcome, delay, cm, credit, cost, 0, 0, self._births)
        if self._free:
            added = self._free.pop()
            for column, value in zip(self._columns(), row, strict=True):
                column[added] = value  # type: ignore[call-overload]
        else:
            added = len(self)
            for column, value in zip(self._columns(), row, strict=True):
                column.append(value)  # type: ignore[arg-type]
        self._of_cause.append(self.cause(context, action), added)
        self.by_outcome.append(outcome, added)
        self.changes.append(Change(added, context, outcome, math.inf))
        if self.journal is not None:
            self.journal.append(HypothesisAdded(context, action, outcome, delay, credit))
        return added

    def remove(self, hypothesis: int) -> None:
        """Forget a hypothesis."""
        context, action = self.context[hypothesis], self.action[hypothesis]
        self._of_cause.remove(self.cause(context, action), hypothesis)
        self.by_outcome.remove(self.outcome[hypothesis], hypothesis)
        self._note_change(hypothesis)
        self.cost[hypothesis] = math.inf
        self.cm_sum -= self.cm[hypothesis]
        self.structure += 1
        self._free.append(hypothesis)
        if self.journal is not None:
            self.journal.append(HypothesisRemoved(hypothesis))

    def succeed(self, hypothesis: int, *, alone: bool) -> None:
        """A prediction came true; `alone` if no hypothesis of more credit made the same one."""
        alpha = self._parameters.alpha
        self.successes[hypothesis] += 1
        credit = self.credit[hypothesis]
        self._judge(
            hypothesis,
            reinforced(self.cm[hypothesis], alpha),
            reinforced(credit, alpha) if alone else credit,
        )
        if self.journal is not None:
            verdict = Verdict.ALONE if alone else Verdict.ACCOMPANIED
            self.journal.append(judged(hypothesis, verdict))

    def fail(self, hypothesis: int) -> None:
        """A prediction did not come true."""
        beta = self._parameters.beta
        self._judge(
            hypothesis, weakened(self.cm[hypothesis], beta), weakened(self.credit[hypothesis], beta)
        )
        if self.journal is not None:
            self.journal.append(judged(hypothesis, Verdict.FAILED))

    def named(self, names: Sequence[Sign]) -> tuple[Hypothesis, ...]:
        """All hypotheses in order of age, for people. `names` are the Signs by id."""
        return tuple(
            Hypothesis(
                context=names[self.context[hypothesis]],
                action=self._actions.names[self.action[hypothesis]],
                outcome=names[self.outcome[hypothesis]],
                delay=self.delay[hypothesis],
                cm=self.cm[hypothesis],
                credit=self.credit[hypothesis],
                predictions=self.predictions[hypothesis],
                successes=self.successes[hypothesis],
            )
            for hypothesis in self.by_age()
        )

    def state(self) -> HypothesesState:
        """Everything that `restore` needs. Costs follow from the rest."""
        columns = tuple(packed(column) for column in self._columns() if column is not self.cost)
        return HypothesesState(columns, tuple(self._free), self.cm_sum)

    def restore(self, state: HypothesesState) -> None:
        """Become the list that `state` was taken of. This one is new and has no rows yet."""
        own = (column for column in self._columns() if column is not self.cost)
        for column, data in zip(own, state.columns, strict=True):
            unpack_into(column, data)
        self._free += state.free
        self.cm_sum = state.cm_sum
        # A removed row's number stays until it is used again: the greatest is the last given.
        self._births = max(self.born, default=0)
        costs = self._actions.costs
        for action, measure in zip(self.action, self._measure, strict=True):
            self.cost.append(cost_estimate(costs[action], measure))
        for hypothesis in self._free:
            self.cost[hypothesis] = math.inf
        for hypothesis in self.by_age():
            cause = self.cause(self.context[hypothesis], self.action[hypothesis])
            self._of_cause.append(cause, hypothesis)
            self.by_outcome.append(self.outcome[hypothesis], hypothesis)

    def _judge(self, hypothesis: int, cm: float, credit: float) -> None:
        self._note_change(hypothesis)
        self.predictions[hypothesis] += 1
        self.cm_sum += cm - self.cm[hypothesis]
        self.cm[hypothesis] = cm
        self.credit[hypothesis] = credit
        self.cost[hypothesis] = cost_estimate(
            self._actions.costs[self.action[hypothesis]], self._measure[hypothesis]
        )

    def _note_change(self, hypothesis: int) -> None:
        self.changes.append(
            Change(
                hypothesis,
                self.context[hypothesis],
                self.outcome[hypothesis],
                self.cost[hypothesis],
            )
        )

    def _columns(self) -> "tuple[array[int] | array[float], ...]":
        return (
            self.context,
            self.action,
            self.outcome,
            self.delay,
            self.cm,
            self.credit,
            self.cost,
            self.predictions,
            self.successes,
            self.born,
        )
