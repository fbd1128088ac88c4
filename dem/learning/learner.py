"""The learner: how a cycle changes the lists, whoever chose the action before it."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import msgspec
from numpy.random import Generator

from farside.dem.learning.credit import initial_credit, standing_alone
from farside.dem.learning.differentiation import Differentiation, DifferentiationState
from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypotheses import HypothesesState, HypothesisList
from farside.dem.lists.predictions import PredictionList
from farside.dem.lists.signs import Sign, SignList, SignsState
from farside.dem.lists.trials import Trials, TrialsState
from farside.dem.parameters import Parameters

_GAIN = 0.25  # the least fraction of a part's failures that a conjunction must avoid
_SURE = 0.9  # the C_m above which a Token predicts well enough alone


class CycleResult(NamedTuple):
    """What was sensed and learned in a cycle.

    Attributes:
        active, novel, unexpected: ids of Signs, oldest first; see `farside.dem.Sensed`.
        succeeded, failed: number of due predictions that came true, or did not.
        created, removed: number of hypotheses created or removed.
    """

    active: list[int]
    novel: list[int]
    unexpected: list[int]
    succeeded: int
    failed: int
    created: int
    removed: int


class _Trace(NamedTuple):
    """The activation trace of a past cycle: its active Signs, and the action performed, if any."""

    active: list[int]
    action: int | None


class LearnerState(msgspec.Struct, frozen=True, array_like=True):
    """All lists as they are saved, and the activation traces, the latest first."""

    signs: SignsState
    hypotheses: HypothesesState
    trials: TrialsState
    predictions: tuple[tuple[int, ...], ...]
    differentiation: DifferentiationState
    traces: tuple[tuple[tuple[int, ...], int | None], ...]
    probation: tuple[int, ...]
    cycle: int


class Learner:
    """Changes the lists of Signs, hypotheses, predictions and trials, cycle by cycle.

    Attributes:
        signs, actions, hypotheses, trials: the lists.
        cycle: number of completed cycles.
    """

    def __init__(self, actions: ActionList, parameters: Parameters, rng: Generator) -> None:
        self.signs = SignList()
        self.actions = actions
        self.hypotheses = HypothesisList(actions, parameters)
        self.trials = Trials()
        self.cycle = 0
        self._parameters = parameters
        self._rng = rng
        self._predictions = PredictionList(parameters.reach)
        self._differentiation = Differentiation(parameters.maturity)
        # Hypotheses removed in the current call.
        self._removed: set[int] = set()
        self._probation: set[int] = set()
        # The latest first.
        self._traces: deque[_Trace] = deque(maxlen=parameters.reach)

    def change(self, parameters: Parameters) -> None:
        """Learn by these from now on.

        Raises:
            ValueError: if `reach` is less than before: nothing would tell any more whether
                hypotheses of a longer delay come true.
        """
        before, reach = self._parameters.reach, parameters.reach
        if reach < before:
            raise ValueError(f"reach: expected at least {before}, as before, found {reach}")
        self._parameters = parameters
        self._traces = deque(self._traces, maxlen=reach)
        self._predictions.extend(reach - before)
        self._differentiation.change(parameters.maturity)
        self.hypotheses.change(parameters)

    def register(self, action: str, cost: float) -> int:
        """Add an action that is met for the first time, and return its id."""
        self.trials.widen(len(self.actions), len(self.actions) + 1)
        return self.hypotheses.register(action, cost)

    def sense(self, tokens: Sign, needed: Sequence[int]) -> CycleResult:
        """Begin a cycle: settle predictions, differentiate, remove and create hypotheses.

        Args:
            tokens: what is sensed.
            needed: goals. The last hypothesis with one of these outcomes is never removed.
        """
        active, novel = self.signs.sense(tokens)
        due = self._predictions.take_due()
        predicted = self._predicted(due)
        unexpected = [sign for sign in active if sign not in predicted and sign not in novel]
        before = self.hypotheses.count
        came_true = self._settle(due, active)
        grown = self.hypotheses.count
        if self._parameters.removal:
            self._remove(due, [*needed, *active])
        removed = grown - self.hypotheses.count
        self._end_probation(due)
        self._create(novel + unexpected)
        return CycleResult(
            active=active,
            novel=novel,
            unexpected=unexpected,
            succeeded=came_true,
            failed=len(due) - came_true,
            created=self.hypotheses.count - before + removed,
            removed=removed,
        )

    def perform(self, active: list[int], action: int | None, needed: Sequence[int]) -> None:
        """End the cycle: every hypothesis whose context and action are active predicts.

        Args:
            active: the active Signs.
            action: the action performed, if any.
            needed: goals.
        """
        if action is not None:
            delay = self.hypotheses.delay
            for context in active:
                self.trials.count(self.hypotheses.cause(context, action), self.cycle)
                for hypothesis in self.hypotheses.of_cause(context, action):
                    self._predictions.add(hypothesis, delay[hypothesis])
        expired = self._traces[-1].active if len(self._traces) == self._traces.maxlen else []
        self._traces.appendleft(_Trace(active, action))
        self._removed.clear()
        for sign in expired if self._parameters.removal else ():
            self._forget_sign(sign, needed)
        self.cycle += 1

    def forget(self, sign: int, needed: Sequence[int]) -> None:
        """Remove a conjunction that is no longer a goal, unless anything else refers to it.

        Args:
            sign: the conjunction.
            needed: goals and active Signs.
        """
        if self._parameters.removal:
            self._removed.clear()
            self._forget_sign(sign, needed)

    def state(self) -> LearnerState:
        """Everything that `restore` needs."""
        return LearnerState(
            signs=self.signs.state(),
            hypotheses=self.hypotheses.state(),
            trials=self.trials.state(),
            predictions=self._predictions.state(),
            differentiation=self._differentiation.state(),
            traces=tuple((tuple(trace.active), trace.action) for trace in self._traces),
            probation=tuple(sorted(self._probation)),
            cycle=self.cycle,
        )

    def restore(self, state: LearnerState) -> None:
        """Become the learner that `state` was taken from. This one must be new."""
        self.signs.restore(state.signs)
        self.hypotheses.restore(state.hypotheses)
        self.trials.restore(state.trials)
        self._predictions.restore(state.predictions)
        self._differentiation.restore(state.differentiation)
        self._traces.extend(_Trace(list(active), action) for active, action in state.traces)
        self._probation.update(state.probation)
        self.cycle = state.cycle

    @property
    def open_predictions(self) -> tuple[tuple[int, ...], ...]:
        """P, as hypotheses by the number of cycles until they are due, from 1 on."""
        return self._predictions.state()

    @property
    def traces(self) -> tuple[tuple[list[int], int | None], ...]:
        """The active Signs and the action of each past cycle within reach, the latest first."""
        return tuple(self._traces)

    @property
    def last_action(self) -> int | None:
        """The action performed in the last cycle, if any."""
        return self._traces[0].action if self._traces else None

    # --- settling ------------------------------------------------------------------------------

    def _predicted(self, due: list[int]) -> set[int]:
        """The Signs that credible predictions in P* name."""
        outcome, credit = self.hypotheses.outcome, self.hypotheses.credit
        if not self._parameters.own_credit:
            return {outcome[hypothesis] for hypothesis in due}
        credible = self._parameters.initial_cm / 2
        return {outcome[hypothesis] for hypothesis in due if credit[hypothesis] >= credible}

    def _settle(self, due: list[int], active: list[int]) -> int:
        """Settle P* and differentiate; return the number of predictions that came true."""
        hypotheses = self.hypotheses
        sensed = set(active)
        came_true = [one for one in due if hypotheses.outcome[one] in sensed]
        alone = dict(zip(came_true, standing_alone(came_true, hypotheses), strict=True))
        for hypothesis in due:
            if hypothesis in alone:
                hypotheses.succeed(hypothesis, alone=alone[hypothesis])
            else:
                hypotheses.fail(hypothesis)
        if self._parameters.differentiation:
            for hypothesis in due:
                self._differentiate(hypothesis, success=hypothesis in alone)
        return len(came_true)

    def _differentiate(self, hypothesis: int, *, success: bool) -> None:
        hypotheses = self.hypotheses
        trace = self._traces[hypotheses.delay[hypothesis] - 1]
        context = self.signs.names[hypotheses.context[hypothesis]]
        beside = [
            sign
            for sign in trace.active
            if not self.signs.is_compound(sign) and self.signs.names[sign][0] not in context
        ]
        token = self._differentiation.note(
            hypothesis,
            hypotheses.predictions[hypothesis],
            hypotheses.successes[hypothesis],
            beside,
            success=success,
        )
        if token is not None and not self._predicts_alone(token, hypothesis):
            self._spawn(hypothesis, tuple(sorted((*context, *self.signs.names[token]))))

    def _predicts_alone(self, token: int, hypothesis: int) -> bool:
        """Whether a Token by itself predicts the outcome as well as any conjunction could."""
        hypotheses = self.hypotheses
        action, outcome = hypotheses.action[hypothesis], hypotheses.outcome[hypothesis]
        same = hypotheses.find(token, action, outcome, hypotheses.delay[hypothesis])
        return same is not None and hypotheses.cm[same] > _SURE

    def _spawn(self, hypothesis: int, context: Sign) -> None:
        hypotheses = self.hypotheses
        if self.signs.find(context) is None:
            self._probation.add(self.signs.add(context))
        sign = self.signs.add(context)
        action, outcome = hypotheses.action[hypothesis], hypotheses.outcome[hypothesis]
        delay = hypotheses.delay[hypothesis]
        if not hypotheses.holds(sign, action, outcome, delay):
            hypotheses.add(sign, action, outcome, delay, self._parameters.initial_cm)

    # --- conjunctions on probation -------------------------------------------------------------

    def know(self, sign: Sign) -> None:
        """Add a Sign, or end its probation if it was spawned."""
        self._probation.discard(self.signs.add(sign))

    def _end_probation(self, due: list[int]) -> None:
        """Admit the conjunctions that have proved themselves to further hypotheses.

        A spawned conjunction is at first the context of one hypothesis only. Some arise by
        chance, and if each of them became outcome and context of everything, the lists would grow
        without limit in a noisy world. Probation ends after a quarter of maturity without a
        failure, or when the mature hypothesis is not removed (project default).
        """
        if not self._probation:
            return
        hypotheses, maturity = self.hypotheses, self._parameters.maturity
        for hypothesis in due:
            predictions = hypotheses.predictions[hypothesis]
            never_failed = hypotheses.successes[hypothesis] == predictions
            if hypothesis not in self._removed and (
                predictions >= maturity or (never_failed and predictions >= maturity // 4)
            ):
                self._probation.discard(hypotheses.context[hypothesis])

    # --- creation and removal ------------------------------------------------------------------

    def _create(self, outcomes: list[int]) -> None:
        for outcome in outcomes:
            if outcome in self._probation:
                continue
            for delay, trace in enumerate(self._traces, start=1):
                if trace.action is not None:
                    self._take_opportunities(trace, outcome, delay)

    def _take_opportunities(self, trace: _Trace, outcome: int, delay: int) -> None:
        hypotheses, action = self.hypotheses, trace.action
        assert action is not None  # noqa: S101 - checked by the caller
        contexts = [context for context in trace.active if context not in self._probation]
        tries = [self.trials.tried(hypotheses.cause(context, action)) for context in contexts]
        for context, tried in zip(contexts, tries, strict=True):
            if hypotheses.holds(context, action, outcome, delay):
                continue
            if self._rng.random() < self._parameters.learning_probability:
                credit = initial_credit(self._parameters.initial_cm, tried, min(tries))
                hypotheses.add(context, action, outcome, delay, credit)

    def _remove(self, due: list[int], needed: list[int]) -> None:
        """Remove the hypotheses that have just proved useless, and what depends on them."""
        self._removed.clear()
        for hypothesis in due:
            if hypothesis not in self._removed and self._is_useless(hypothesis, needed):
                self._forget(hypothesis, needed)

    def _is_useless(self, hypothesis: int, needed: Sequence[int]) -> bool:
        hypotheses, parameters = self.hypotheses, self._parameters
        if hypotheses.predictions[hypothesis] < parameters.maturity:
            return False
        if hypotheses.outcome[hypothesis] in needed and hypotheses.is_last_of(hypothesis):
            return False
        return hypotheses.cm[hypothesis] < parameters.ineffective or self._is_redundant(hypothesis)

    def _is_redundant(self, hypothesis: int) -> bool:
        """Whether a conjunction predicts no better than one of its parts.

        It must avoid at least a quarter of the part's failures. Checked whenever the number of
        predictions is a multiple of maturity (project default).
        """
        hypotheses, maturity = self.hypotheses, self._parameters.maturity
        if hypotheses.predictions[hypothesis] % maturity:
            return False
        action, outcome = hypotheses.action[hypothesis], hypotheses.outcome[hypothesis]
        delay, rate = hypotheses.delay[hypothesis], hypotheses.success_rate(hypothesis)
        for part in self.signs.parts(hypotheses.context[hypothesis]):
            rival = hypotheses.find(part, action, outcome, delay)
            if rival is not None and hypotheses.predictions[rival] >= maturity:
                rival_rate = hypotheses.success_rate(rival)
                if rate <= rival_rate + _GAIN * (1.0 - rival_rate):
                    return True
        return False

    def _forget(self, hypothesis: int, needed: Sequence[int]) -> None:
        hypotheses = self.hypotheses
        hypotheses.remove(hypothesis)
        self._removed.add(hypothesis)
        self._predictions.forget(hypothesis)
        self._differentiation.forget(hypothesis)
        self._forget_sign(hypotheses.context[hypothesis], needed)

    def _forget_sign(self, sign: int, needed: Sequence[int]) -> None:
        """Remove a conjunction that is no context, is not needed, and is in no activation trace.

        A conjunction exists to be a context. Hypotheses with it as outcome are removed with it.
        """
        if (
            not self.signs.is_compound(sign)
            or sign in needed
            or self.hypotheses.is_context(sign)
            or any(sign in trace.active for trace in self._traces)
        ):
            return
        for hypothesis in list(self.hypotheses.of_outcome(sign)):
            if hypothesis not in self._removed:
                self._forget(hypothesis, needed)
        if self.signs.is_compound(sign):
            first = self.hypotheses.cause(sign, 0)
            self.trials.forget(range(first, first + len(self.actions)))
            self.signs.remove(sign)
            self._probation.discard(sign)
