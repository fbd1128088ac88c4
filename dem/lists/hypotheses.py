"""H, the Hypothesis List.

A hypothesis is a row across typed columns: it takes tens of bytes, and numpy can view a column
without a copy. Each row is on two chains, that of its context and action and that of its outcome,
both in order of age.
"""

import math
from array import array
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from farside.dem.changes import (
    ActionAdded,
    CostSet,
    HypothesisAdded,
    HypothesisRemoved,
    ListChange,
    PredictionResult,
    encoded_result,
)
from farside.dem.equations import averaged, averaging_rate, cost_estimate, reinforced, weakened
from farside.dem.lists.actions import ActionList
from farside.dem.lists.aversions import AversionList, Risks
from farside.dem.lists.chains import NO_ROW, Chains
from farside.dem.lists.hypothesis import CostChange, HypothesesState, Hypothesis
from farside.dem.lists.packing import crc_of, packed, unpack_into
from farside.dem.lists.signs import Sign, SignList
from farside.dem.parameters import Parameters


class HypothesisList:
    """H, every µ-hypothesis. The id of a hypothesis is its row; ids of removed ones are reused.

    Attributes:
        context, action, outcome, delay, cm, credit, predictions, successes: see `Hypothesis`;
            of a free row only the delay is defined: 0.
        results, run: what C_m is the average of, and its latest results; see
            `farside.dem.equations.averaged`.
        cost: the current cost estimate C_e; infinite for a free row.
        measure: the column that cost estimates rest on, `credit` or `cm`.
        risks: by context and action what an attempt risks beside its cost, where it does; see
            `farside.dem.lists.aversions`.
        born: serial number of creation, which gives the order of age.
        structure: incremented whenever a hypothesis is created or removed.
        cm_sum: the current sum of all C_m.
        cost_changes: changes for the policy map, since the list was last cleared.
        by_outcome: the chains by outcome, for loops that a generator would slow down.
        recorded: where all changes are recorded for a shadow; `None` if they are not.
    """

    def __init__(
        self,
        actions: ActionList,
        parameters: Parameters,
        aversions: AversionList | None = None,
    ) -> None:
        self.context = array("i")
        self.action = array("i")
        self.outcome = array("i")
        self.delay = array("i")
        self.cm = array("d")
        self.credit = array("d")
        self.cost = array("d")
        self.predictions = array("i")
        self.successes = array("i")
        self.results = array("i")
        self.run = array("d")
        self.born = array("q")
        self.structure = 0
        self.cm_sum = 0.0
        self.cost_changes: list[CostChange] = []
        self.recorded: list[ListChange] | None = None
        self._actions = actions
        self._parameters = parameters
        self.measure = self.credit if parameters.own_credit else self.cm
        self._risks = Risks(aversions or AversionList(SignList()), self)
        self.risks = self._risks.by_cause
        self._of_cause = Chains()
        self.by_outcome = Chains()
        self._free: list[int] = []
        self._births = 0

    def change(self, parameters: Parameters) -> None:
        """Strengthen, weaken and estimate costs by these from now on."""
        before, self._parameters = self._parameters, parameters
        if parameters.own_credit is not before.own_credit:
            self.measure = self.credit if parameters.own_credit else self.cm
            self.estimate_costs(range(len(self)))
            self.follow_aversions()

    def register(self, action: str, cost: float) -> int:
        """Add an action that is met for the first time, and return its id.

        The columns by cause are laid out anew: that takes time in proportion to them, once.
        """
        self._of_cause.widen(len(self._actions), len(self._actions) + 1)
        added = self._actions.add(action, cost)
        if self.recorded is not None:
            self.recorded.append(ActionAdded(action, cost))
        return added

    def set_cost(self, action: int, cost: float) -> None:
        """Have an action cost something else: the cost estimates follow at once."""
        self._actions.set_cost(action, cost)
        self.estimate_costs(one for one, done in enumerate(self.action) if done == action)
        if self.recorded is not None:
            self.recorded.append(CostSet(action, cost))

    def __len__(self) -> int:
        """Number of rows, free ones included."""
        return len(self.cm)

    @property
    def count(self) -> int:
        """Number of hypotheses."""
        return len(self.cm) - len(self._free)

    def cause(self, context: int, action: int) -> int:
        """The index of a pair of context and action."""
        return context * len(self._actions) + action

    def of_cause(self, context: int, action: int) -> Iterator[int]:
        """The hypotheses with this context and action, oldest first."""
        return self._of_cause.of(self.cause(context, action))

    def from_context(self, context: int) -> Iterator[int]:
        """The hypotheses with this context and any action."""
        chains, first = self._of_cause, self.cause(context, 0)
        for cause in range(first, first + len(self._actions)):
            # Not `of_cause`: a generator within a generator would take half as long again.
            row = chains.head(cause)
            while row != NO_ROW:
                yield row
                row = chains.following[row]

    def of_outcome(self, outcome: int) -> Iterator[int]:
        """The hypotheses with this outcome, oldest first."""
        return self.by_outcome.of(outcome)

    def is_last_of(self, hypothesis: int) -> bool:
        """Whether no other hypothesis has the same outcome."""
        return self.by_outcome.is_single(self.outcome[hypothesis])

    def is_outcome(self, sign: int) -> bool:
        """Whether any hypothesis has this Sign as its outcome."""
        return not self.by_outcome.is_empty(sign)

    def is_context(self, sign: int) -> bool:
        """Whether any hypothesis has this Sign as its context."""
        return any(
            not self._of_cause.is_empty(self.cause(sign, action))
            for action in range(len(self._actions))
        )

    def find(self, context: int, action: int, outcome: int, delay: int) -> int | None:
        """The id of this very hypothesis, `None` if there is none."""
        for same in self.of_cause(context, action):
            if self.outcome[same] == outcome and self.delay[same] == delay:
                return same
        return None

    def holds(self, context: int, action: int, outcome: int, delay: int) -> bool:
        """Whether this very hypothesis exists."""
        return self.find(context, action, outcome, delay) is not None

    def is_living(self, hypothesis: int) -> bool:
        """Whether there is a hypothesis with this id."""
        return 0 <= hypothesis < len(self.delay) and self.delay[hypothesis] > 0

    def success_rate(self, hypothesis: int) -> float:
        """The fraction of its predictions that came true. One at least must have fallen due."""
        return self.successes[hypothesis] / self.predictions[hypothesis]

    def by_age(self) -> list[int]:
        """All ids, oldest first."""
        free = set(self._free)
        living = (hypothesis for hypothesis in range(len(self)) if hypothesis not in free)
        return sorted(living, key=self.born.__getitem__)

    def add(self, context: int, action: int, outcome: int, delay: int, credit: float) -> int:
        """Create a hypothesis with the initial C_m, and return its id. It must not exist yet."""
        cm = self._parameters.initial_cm
        measure = credit if self._parameters.own_credit else cm
        cost = cost_estimate(self.attempt_cost(context, action), measure)
        self._births += 1
        self.structure += 1
        self.cm_sum += cm
        row = (context, action, outcome, delay, cm, credit, cost, 0, 0, 1, 1.0, self._births)
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
        self.cost_changes.append(CostChange(added, context, outcome, math.inf))
        self._risks.follow(added)
        if self.recorded is not None:
            self.recorded.append(HypothesisAdded(context, action, outcome, delay, credit))
        return added

    def remove(self, hypothesis: int) -> None:
        """Remove a hypothesis."""
        context, action = self.context[hypothesis], self.action[hypothesis]
        self._of_cause.remove(self.cause(context, action), hypothesis)
        self.by_outcome.remove(self.outcome[hypothesis], hypothesis)
        self._note_cost_change(hypothesis)
        self._risks.follow(hypothesis)
        self.cost[hypothesis] = math.inf
        self.delay[hypothesis] = 0
        self.cm_sum -= self.cm[hypothesis]
        self.structure += 1
        self._free.append(hypothesis)
        if self.recorded is not None:
            self.recorded.append(HypothesisRemoved(hypothesis))

    def succeed(self, hypothesis: int, *, alone: bool) -> None:
        """A prediction came true; `alone` if no hypothesis with more credit predicted the same."""
        cm, credit = self.cm[hypothesis], self.credit[hypothesis]
        alpha = self._rate(hypothesis, self._parameters.alpha, cm, 1.0)
        self.successes[hypothesis] += 1
        self._settle(
            hypothesis,
            reinforced(cm, alpha),
            reinforced(credit, alpha) if alone else credit,
        )
        if self.recorded is not None:
            result = PredictionResult.ALONE if alone else PredictionResult.ACCOMPANIED
            self.recorded.append(encoded_result(hypothesis, result))

    def fail(self, hypothesis: int) -> None:
        """A prediction failed."""
        cm = self.cm[hypothesis]
        beta = self._rate(hypothesis, self._parameters.beta, 1.0 - cm, -1.0)
        self._settle(hypothesis, weakened(cm, beta), weakened(self.credit[hypothesis], beta))
        if self.recorded is not None:
            self.recorded.append(encoded_result(hypothesis, PredictionResult.FAILED))

    def most_credible(
        self, contexts: Iterable[int], action: int, names: Sequence[Sign]
    ) -> Hypothesis | None:
        """The hypothesis with the highest C_m of those with one of these contexts and this action.

        Ties go to the one with the most Tokens in its context, then to the oldest; `None` if there
        is no such hypothesis.

        Args:
            contexts: Signs.
            action: the Action.
            names: the Signs by id.
        """
        found = (one for context in contexts for one in self.of_cause(context, action))
        best = min(
            found,
            key=lambda one: (-self.cm[one], -len(names[self.context[one]]), self.born[one]),
            default=None,
        )
        return None if best is None else self.one_named(best, names)

    def track_record(self) -> tuple[int, int]:
        """How often the most credible expectations of the next cycle came true, and fell due.

        Of each context and action it is the hypothesis with a delay of one cycle and the highest
        C_m, then the oldest.
        """
        ids = np.flatnonzero(np.asarray(self.delay) == 1)
        causes = np.asarray(self.context)[ids] * len(self._actions) + np.asarray(self.action)[ids]
        order = np.lexsort((np.asarray(self.born)[ids], -np.asarray(self.cm)[ids], causes))
        _, firsts = np.unique(causes[order], return_index=True)
        best = ids[order][firsts]
        successes, predictions = (
            np.asarray(self.successes)[best],
            np.asarray(self.predictions)[best],
        )
        return int(successes.sum()), int(predictions.sum())

    def named(self, names: Sequence[Sign]) -> tuple[Hypothesis, ...]:
        """All hypotheses with their Signs and actions by name, oldest first.

        Args:
            names: the Signs by id.
        """
        return tuple(self.one_named(hypothesis, names) for hypothesis in self.by_age())

    def one_named(self, hypothesis: int, names: Sequence[Sign]) -> Hypothesis:
        """A hypothesis with its Signs and action by name; see `named`."""
        return Hypothesis(
            context=names[self.context[hypothesis]],
            action=self._actions.names[self.action[hypothesis]],
            outcome=names[self.outcome[hypothesis]],
            delay=self.delay[hypothesis],
            cm=self.cm[hypothesis],
            credit=self.credit[hypothesis],
            predictions=self.predictions[hypothesis],
            successes=self.successes[hypothesis],
        )

    def state(self) -> HypothesesState:
        """Everything that `restore` needs. Costs follow from the rest."""
        columns = tuple(packed(column) for column in self._own_columns())
        return HypothesesState(columns, tuple(self._free), self.cm_sum)

    def crc(self) -> int:
        """CRC-32 of all columns by id, to the last bit of every C_m, and of the ids reused next."""
        return crc_of([*self._own_columns(), array("q", self._free)])

    def restore(self, state: HypothesesState) -> None:
        """Become the list that `state` was taken from. This one must be new."""
        for column, data in zip(self._own_columns(), state.columns, strict=True):
            unpack_into(column, data)
        self._free += state.free
        self.cm_sum = state.cm_sum
        # A free row keeps its serial number, so the greatest is the last that was assigned.
        self._births = max(self.born, default=0)
        self.cost.extend([math.inf] * len(self.cm))
        for hypothesis in self._free:
            self.delay[hypothesis] = 0
        for hypothesis in self.by_age():
            cause = self.cause(self.context[hypothesis], self.action[hypothesis])
            self._of_cause.append(cause, hypothesis)
            self.by_outcome.append(self.outcome[hypothesis], hypothesis)
            self._estimate_cost(hypothesis)
        self.follow_aversions()
        self.cost_changes.clear()

    def _rate(self, hypothesis: int, constant: float, probability: float, sign: float) -> float:
        """The rate of the next result, which had this probability by C_m; see `averaged`."""
        if not self._parameters.averaging:
            return constant
        before, run = self.results[hypothesis], self.run[hypothesis]
        improbable = self._parameters.improbable
        results, self.run[hypothesis] = averaged(before, run, probability, sign, improbable)
        self.results[hypothesis] = results
        return averaging_rate(constant, results)

    def _settle(self, hypothesis: int, cm: float, credit: float) -> None:
        self._note_cost_change(hypothesis)
        self.predictions[hypothesis] += 1
        self.cm_sum += cm - self.cm[hypothesis]
        self.cm[hypothesis] = cm
        self.credit[hypothesis] = credit
        self._estimate_cost(hypothesis)
        self._risks.follow(hypothesis)

    def estimate_costs(self, hypotheses: Iterable[int]) -> None:
        """Estimate costs anew, because something else than C_m has changed."""
        for hypothesis in hypotheses:
            if self.is_living(hypothesis):
                self._note_cost_change(hypothesis)
                self._estimate_cost(hypothesis)

    def _estimate_cost(self, hypothesis: int) -> None:
        attempt = self.attempt_cost(self.context[hypothesis], self.action[hypothesis])
        self.cost[hypothesis] = cost_estimate(attempt, self.measure[hypothesis])

    @property
    def action_costs(self) -> Sequence[float]:
        """The cost of each action, by id."""
        return self._actions.costs

    def attempt_cost(self, context: int, action: int) -> float:
        """What one attempt costs: the action, and what it risks in this context."""
        risk = self.risks.get((context, action), 0.0) if self.risks else 0.0
        return self._actions.costs[action] + risk

    def follow_aversions(self) -> None:
        """Bring the cost estimates up to date after any change of the Aversion List."""
        self._risks.follow_all()

    def _note_cost_change(self, hypothesis: int) -> None:
        context, outcome = self.context[hypothesis], self.outcome[hypothesis]
        self.cost_changes.append(CostChange(hypothesis, context, outcome, self.cost[hypothesis]))

    def _own_columns(self) -> "list[array[int] | array[float]]":
        """All columns but the costs, which follow from the others."""
        return [column for column in self._columns() if column is not self.cost]

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
            self.results,
            self.run,
            self.born,
        )
