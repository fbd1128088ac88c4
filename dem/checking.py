"""What must hold of saved lists before any of them is used.

A list that is restored trusts its numbers: an id that is out of range would index past its end, or
make it grow by gigabytes. The checks here let only such lists through as a model can have. Each
raises `ValueError`, with what was expected, if that is not so.
"""

import math
from array import array
from collections.abc import Collection, Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from farside.dem.learning.differentiation import WATCHES, DifferentiationState
from farside.dem.learning.learner import LearnerState
from farside.dem.learning.situations import REMEMBERED, SituationsState
from farside.dem.lists.actions import ActionList
from farside.dem.lists.goals import Aside, Goal, GoalsState, GoalState
from farside.dem.lists.hypothesis import HypothesesState
from farside.dem.lists.packing import unpack_into
from farside.dem.lists.signs import Sign, SignsState, to_sign
from farside.dem.lists.trials import TrialsState
from farside.dem.parameters import Parameters

_GREATEST_COUNT = 2**30  # of cycles, births and predictions: half of what the columns hold


class CheckedLists:
    """Saved Signs and hypotheses that fit together, and what else refers to them.

    Args:
        actions, parameters: those of the model.
        signs, hypotheses: its lists as they were saved.

    Raises:
        ValueError: if no model has such lists.
    """

    def __init__(
        self,
        actions: ActionList,
        parameters: Parameters,
        signs: SignsState,
        hypotheses: HypothesesState,
    ) -> None:
        self._actions, self._parameters = len(actions), parameters
        self._check_signs(signs)
        self._check_hypotheses(hypotheses)

    def _check_signs(self, state: SignsState) -> None:
        names = state.names
        self._names = names
        self._signs = {sign for sign, name in enumerate(names) if name}
        free = {sign for sign, name in enumerate(names) if not name}
        _expect(all(_is_sign(name) for name in names), "Signs with their Tokens in order")
        _expect(len(set(names)) == len(self._signs) + bool(free), "no Sign twice")
        _expect(set(state.free) == free and len(state.free) == len(free), "the free ids of Signs")
        _check_births(_column("q", state.born), len(names))
        self._tokens = {name for name in names if len(name) == 1}
        self._compounds = {sign for sign in self._signs if len(names[sign]) > 1}
        self._check_ids("never active", state.never_active, self._compounds)

    def _check_hypotheses(self, state: HypothesesState) -> None:
        kinds = "iiiiddiiidq"
        _expect(len(state.columns) == len(kinds), f"{len(kinds)} columns of hypotheses")
        columns = [_column(kind, data) for kind, data in zip(kinds, state.columns, strict=True)]
        context, action, outcome, delay, cm, credit, predictions, successes = columns[:8]
        results, run, born = columns[8:]
        rows = len(context)
        _expect(all(len(column) == rows for column in columns), "columns of one length")
        for column, low, high, what in (
            (context, 0, len(self._names) - 1, "contexts that are known"),
            (outcome, 0, len(self._names) - 1, "outcomes that are known"),
            (action, 0, self._actions - 1, "actions that are known"),
            (delay, 0, self._parameters.reach, "delays within reach"),
            (cm, 0, 1, "C_m from 0 to 1"),
            (credit, 0, 1, "credit from 0 to 1"),
            (predictions, 0, _GREATEST_COUNT, "a possible number of predictions"),
        ):
            _expect(bool(np.all((column >= low) & (column <= high))), what)
        _expect(
            bool(np.all((successes >= 0) & (successes <= predictions))),
            "no more successes than due",
        )
        _expect(
            bool(np.all((results >= 1) & (results <= predictions + 1))), "averages of past results"
        )
        possible = (abs(run) > 0) & (abs(run) <= 1) & ((run > 0) | (successes < predictions))
        _expect(bool(np.all(possible)), "probabilities of past results")
        _check_births(born, rows)
        free = set(state.free)
        _expect(len(free) == len(state.free) and free <= set(range(rows)), "free rows")
        self._hypotheses = set(range(rows)) - free
        living = np.array(sorted(self._hypotheses), dtype=np.intp)
        known = np.array([bool(name) for name in self._names], dtype=bool)
        _expect(bool(np.all(known[context[living]] & known[outcome[living]])), "no removed Signs")
        _expect(bool(np.all(delay[living] > 0)), "a delay of each hypothesis")
        keys = np.stack([context[living], action[living], outcome[living], delay[living]])
        _expect(np.unique(keys, axis=1).shape[1] == len(living), "no hypothesis twice")
        total = float(cm[living].sum())
        _expect(math.isclose(state.cm_sum, total, abs_tol=1e-3), "the sum of all C_m")
        self._delay = delay

    def check_learner(self, state: LearnerState) -> None:
        """The lists that refer to these.

        Raises:
            ValueError: if they do not fit.
        """
        reach = self._parameters.reach
        _expect(0 <= state.cycle <= _GREATEST_COUNT, "a possible number of cycles")
        self._check_trials(state.trials, state.cycle)
        _expect(len(state.traces) <= reach, "activation traces within reach")
        for active, action, situation in state.traces:
            self._check_ids("activation trace", active, self._signs)
            _expect(action is None or 0 <= action < self._actions, "actions that are known")
            self._check_situation(situation)
            if action is not None:
                causes = [context * self._actions + action for context in active]
                tried = all(one < len(self._tries) and self._tries[one] > 0 for one in causes)
                _expect(tried, "trials of the past")
        self._check_situation(state.situation)
        _expect(len(state.predictions) == reach, "predictions within reach")
        for due in state.predictions:
            self._check_ids("prediction", due, self._hypotheses)
        self._check_differentiation(state.differentiation)
        self._check_situations(state.situations)
        self._check_ids("probation", state.probation, self._compounds)
        self._check_ids("wholes", state.wholes, self._compounds)

    def check_active(self, active: Collection[int]) -> None:
        """The active Signs.

        Raises:
            ValueError: if one is unknown.
        """
        self._check_ids("active", active, self._signs)

    def check_due(self, state: LearnerState, *, awaits_action: bool) -> None:
        """That every prediction finds the activation trace of its context when it falls due.

        Args:
            state: of the learner.
            awaits_action: whether the cycle is still without its action.

        Raises:
            ValueError: if one would not.
        """
        for due_in, due in enumerate(state.predictions, start=int(awaits_action)):
            for hypothesis in due:
                delay = int(self._delay[hypothesis])
                kept = len(state.traces) + due_in
                _expect(due_in < delay <= kept, "predictions as old as the traces")

    def _check_trials(self, state: TrialsState, cycle: int) -> None:
        tries, last = _column("i", state.tries), _column("q", state.last)
        causes = len(self._names) * self._actions
        _expect(len(tries) == len(last) <= causes, "trials of known Signs")
        _expect(bool(np.all((tries >= 0) & (tries <= _GREATEST_COUNT))), "a number of trials")
        _expect(bool(np.all((last >= -1) & (last <= cycle))), "trials of past cycles")
        self._tries = tries

    def _check_situation(self, situation: Sign) -> None:
        known = all((token,) in self._tokens for token in situation)
        _expect(_is_sign(situation) and known, "a situation of known Tokens")

    def _check_situations(self, state: SituationsState) -> None:
        kinds = "qdddb"
        _expect(len(state.columns) == len(kinds), f"{len(kinds)} columns of Tokens")
        columns = [_column(kind, data) for kind, data in zip(kinds, state.columns, strict=True)]
        sensed, *shares, random = columns
        rows = len(sensed)
        _expect(all(len(column) == rows for column in columns), "columns of one length")
        _expect(rows <= len(self._names), "what followed of known Tokens")
        _expect(0 <= state.cycles <= _GREATEST_COUNT, "a possible number of cycles")
        _expect(bool(np.all((sensed >= 0) & (sensed <= state.cycles))), "Tokens of past cycles")
        _expect(0.0 <= state.repetitions <= _GREATEST_COUNT, "a possible number of repetitions")
        most = 1.001 * state.repetitions  # shares of one add up to about one
        possible = all(bool(np.all((one >= 0.0) & (one <= most))) for one in shares)
        _expect(possible, "no more with a Token than all repetitions")
        _expect(bool(np.all((random == 0) | (random == 1))), "Tokens that are random or not")
        causes = {(context, action) for context, action, _ in state.followed}
        _expect(len(causes) == len(state.followed) <= REMEMBERED, "what followed each cause once")
        tokens = {sign for sign in self._signs - self._compounds if sign < rows}
        for context, action, followed in state.followed:
            _expect(context in self._signs and 0 <= action < self._actions, "causes that are known")
            self._check_ids("what followed", followed, tokens)

    def _check_differentiation(self, state: DifferentiationState) -> None:
        self._check_ids("watch", [one.hypothesis for one in state.watches], self._hypotheses)
        self._check_ids("watched", [one for one, _ in state.watched], self._hypotheses)
        _expect(all(1 <= times <= WATCHES for _, times in state.watched), "watches begun")
        tokens = self._signs - self._compounds
        for watch in state.watches:
            _expect(watch.cases < self._parameters.maturity, "watches that are not over")
            self._check_ids("watch", [token for token, _, _ in watch.beside], tokens)
            _expect(0 <= watch.successes <= watch.cases, "no more successes than cases")
            for _, successes, cases in watch.beside:
                others, other_cases = watch.successes - successes, watch.cases - cases
                _expect(
                    0 <= successes <= cases >= 1 and 0 <= others <= other_cases,
                    "cases that add up",
                )

    def _check_ids(self, what: str, ids: Collection[int], known: Collection[int]) -> None:
        _expect(
            len(set(ids)) == len(ids) and all(one in known for one in ids), f"{what}: known ids"
        )


def check_goals(goals: Iterable[Goal | GoalState]) -> None:
    """That goals can be wanted.

    Raises:
        ValueError: if one has no Tokens, or nobody who wants it, or an impossible number.
    """
    signs = []
    for goal in goals:
        signs.append(goal.tokens)
        _expect(bool(goal.tokens) and _is_sign(goal.tokens), "goals with their Tokens in order")
        _check_priorities(goal.priorities)
        if isinstance(goal, GoalState):
            _expect(goal.value_at_start >= 0, "a policy value of 0 or more")
            until = goal.blocked_until
            _expect(until is None or 0 <= until <= 2 * _GREATEST_COUNT, "a cycle to recover in")
            is_blocked = goal.aside is Aside.BLOCKED
            _expect(is_blocked == (until is not None), "a cycle to recover in if it is blocked")
    _expect(len(set(signs)) == len(signs), "no goal twice")


def check_goal_list(state: GoalsState) -> None:
    """A saved Goal List.

    Raises:
        ValueError: if no model has such goals.
    """
    check_goals(state.goals)
    _expect(all(sign and _is_sign(sign) for sign in state.held), "goals held by rules")
    check_goals(Goal(sign, priorities) for sign, priorities in state.met)


def _check_priorities(priorities: Mapping[str, float]) -> None:
    possible = bool(priorities) and all(map(math.isfinite, priorities.values()))
    _expect(possible, "a finite priority of each goal")


def _check_births(born: NDArray[Any], count: int) -> None:
    possible = len(np.unique(born)) == len(born) == count
    _expect(possible and bool(np.all((born >= 1) & (born <= 2**62))), "one birth for each id")


def _column(kind: str, data: bytes) -> NDArray[Any]:
    column: array[int] | array[float] = array(kind)
    unpack_into(column, data)
    return np.asarray(column)


def _is_sign(name: Sign) -> bool:
    return name == to_sign(name)


def _expect(holds: bool, what: str) -> None:  # noqa: FBT001
    if not holds:
        raise ValueError(f"expected {what}")
