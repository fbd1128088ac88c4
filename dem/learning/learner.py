"""The learner: how a cycle changes the lists, whoever chose the action before it."""

from collections import deque
from collections.abc import Collection, Container, Sequence
from typing import NamedTuple

import msgspec
from numpy.random import Generator

from farside.dem.learning.creation import Creation
from farside.dem.learning.credit import standing_alone
from farside.dem.learning.differentiation import DifferentiationState
from farside.dem.learning.removal import Removal
from farside.dem.learning.situations import SituationsState
from farside.dem.learning.workspace import Trace, Workspace
from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypothesis import HypothesesState
from farside.dem.lists.signs import Sign, SignsState
from farside.dem.lists.trials import TrialsState
from farside.dem.parameters import Parameters

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


class LearnerState(msgspec.Struct, frozen=True, array_like=True):
    """All lists as they are saved, and the activation traces, the latest first.

    See `farside.dem.learning.workspace` for what they hold.
    """

    signs: SignsState
    hypotheses: HypothesesState
    trials: TrialsState
    predictions: tuple[tuple[int, ...], ...]
    differentiation: DifferentiationState
    situations: SituationsState
    traces: tuple[tuple[tuple[int, ...], int | None, Sign], ...]
    situation: Sign
    probation: tuple[int, ...]
    wholes: tuple[int, ...]
    cycle: int


class Learner:
    """Changes the lists of Signs, hypotheses, predictions and trials, cycle by cycle.

    Attributes:
        signs, actions, hypotheses, trials, aversions: the lists.
    """

    def __init__(self, actions: ActionList, parameters: Parameters, rng: Generator) -> None:
        self._work = work = Workspace(actions, parameters)
        self.signs, self.actions = work.signs, actions
        self.hypotheses, self.trials = work.hypotheses, work.trials
        self.aversions = work.aversions
        self._predictions, self._differentiation = work.predictions, work.differentiation
        self._creation = Creation(work, rng)
        self._removal = Removal(work)

    @property
    def cycle(self) -> int:
        """The number of completed cycles."""
        return self._work.cycle

    @property
    def _parameters(self) -> Parameters:
        return self._work.parameters

    def change(self, parameters: Parameters) -> None:
        """Learn by these from now on.

        Raises:
            ValueError: if `reach` is less than before: nothing would tell any more whether
                hypotheses of a longer delay come true.
        """
        work, before, reach = self._work, self._parameters.reach, parameters.reach
        if reach < before:
            raise ValueError(f"reach: expected at least {before}, as before, found {reach}")
        work.parameters = parameters
        work.traces = deque(work.traces, maxlen=reach)
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
        credible = self._credible(due)
        foreseen = {self.hypotheses.outcome[hypothesis] for hypothesis in credible}
        unexpected = self._unexpected(active, novel, foreseen)
        turned_random = self._situate(active)
        disproved = self._disproved(credible, active)
        before = self.hypotheses.count
        came_true = self._settle(due, active)
        grown = self.hypotheses.count
        kept = {*needed, *active}
        if self._parameters.removal:
            self._removal.removed.clear()
            self._removal.useless(due, kept)
            self._removal.random(turned_random, kept)
        removed = grown - self.hypotheses.count
        self._end_probation(due)
        self._creation.explain(
            novel + unexpected, active, foreseen=foreseen, disproved=disproved, needed=needed
        )
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
        work = self._work
        if action is not None:
            delay = self.hypotheses.delay
            for context in active:
                self.trials.count(self.hypotheses.cause(context, action), work.cycle)
                for hypothesis in self.hypotheses.of_cause(context, action):
                    self._predictions.add(hypothesis, delay[hypothesis])
        expired = work.traces[-1].active if len(work.traces) == work.traces.maxlen else []
        work.traces.appendleft(Trace(active, action, work.situation))
        self._removal.removed.clear()
        for sign in expired if self._parameters.removal else ():
            self._removal.sign(sign, needed)
        work.cycle += 1

    def forget(self, sign: int, needed: Sequence[int]) -> None:
        """Remove a conjunction that is no longer a goal, unless anything else refers to it.

        Args:
            sign: the conjunction.
            needed: goals and active Signs.
        """
        if self._parameters.removal:
            self._removal.removed.clear()
            self._removal.sign(sign, needed)

    def state(self) -> LearnerState:
        """Everything that `restore` needs."""
        work = self._work
        return LearnerState(
            signs=self.signs.state(),
            hypotheses=self.hypotheses.state(),
            trials=self.trials.state(),
            predictions=self._predictions.state(),
            differentiation=self._differentiation.state(),
            situations=work.situations.state(),
            traces=tuple(
                (tuple(trace.active), trace.action, trace.situation) for trace in work.traces
            ),
            situation=work.situation,
            probation=tuple(sorted(work.probation)),
            wholes=tuple(sorted(work.wholes)),
            cycle=work.cycle,
        )

    def restore(self, state: LearnerState) -> None:
        """Become the learner that `state` was taken from. This one must be new."""
        work = self._work
        self.signs.restore(state.signs)
        self.hypotheses.restore(state.hypotheses)
        self.trials.restore(state.trials)
        self._predictions.restore(state.predictions)
        self._differentiation.restore(state.differentiation)
        work.situations.restore(state.situations)
        for active, action, situation in state.traces:
            work.traces.append(Trace(list(active), action, situation))
        work.situation = state.situation
        work.probation.update(state.probation)
        work.wholes.update(state.wholes)
        work.cycle = state.cycle

    @property
    def open_predictions(self) -> tuple[tuple[int, ...], ...]:
        """P, as hypotheses by the number of cycles until they are due, from 1 on."""
        return self._predictions.state()

    @property
    def traces(self) -> tuple[tuple[list[int], int | None], ...]:
        """The active Signs and the action of each past cycle within reach, the latest first."""
        return tuple((trace.active, trace.action) for trace in self._work.traces)

    @property
    def last_action(self) -> int | None:
        """The action performed in the last cycle, if any."""
        return self._work.traces[0].action if self._work.traces else None

    # --- sensing -------------------------------------------------------------------------------

    def _credible(self, due: Sequence[int]) -> Sequence[int]:
        """The credible predictions in P*; see `farside.dem.learning.credit`."""
        if not self._parameters.own_credit:
            return due
        credit, least = self.hypotheses.credit, self._parameters.initial_cm / 2
        return [hypothesis for hypothesis in due if credit[hypothesis] >= least]

    def _unexpected(
        self, active: Sequence[int], novel: Sequence[int], foreseen: Collection[int]
    ) -> list[int]:
        """The active Signs that are neither novel nor foreseen.

        With `situations`, to foresee a whole is to foresee its parts.
        """
        names, met = self.signs.names, {*foreseen, *novel}
        wholes: list[set[str]] = []
        if self._parameters.situations:
            wholes = [set(names[sign]) for sign in foreseen if len(names[sign]) > 1]
        return [
            sign
            for sign in active
            if sign not in met and not any(whole.issuperset(names[sign]) for whole in wholes)
        ]

    def _disproved(self, credible: Sequence[int], active: Container[int]) -> set[int]:
        """The delays with which a credible prediction failed that was not of a random Token."""
        if not self._parameters.situations:
            return set()
        outcome, delay = self.hypotheses.outcome, self.hypotheses.delay
        return {
            delay[hypothesis]
            for hypothesis in credible
            if outcome[hypothesis] not in active and not self._work.is_random(outcome[hypothesis])
        }

    def _situate(self, active: Sequence[int]) -> Sequence[int]:
        """Find the situation; return the Tokens that have turned out to be random."""
        work = self._work
        if not self._parameters.situations:
            work.situation = ()
            return ()
        tokens = work.tokens_of(active)
        contexts, tries, action = work.last_trials()
        turned_random = work.situations.note(contexts, tries, action, tokens)
        names = self.signs.names
        work.situation = tuple(sorted(names[token][0] for token in work.situations.tell(tokens)))
        return turned_random

    # --- settling ------------------------------------------------------------------------------

    def _settle(self, due: list[int], active: list[int]) -> int:
        """Settle P* and differentiate; return the number of predictions that came true."""
        hypotheses, here = self.hypotheses, set(active)
        came_true = [one for one in due if hypotheses.outcome[one] in here]
        names = self.signs.names if self._parameters.situations else None
        alone = dict(zip(came_true, standing_alone(came_true, hypotheses, names), strict=True))
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
        context = hypotheses.context[hypothesis]
        trace = self._work.traces[hypotheses.delay[hypothesis] - 1]
        situation = self.signs.find(trace.situation)
        if situation not in (None, context) and hypotheses.is_context(situation):
            return  # the situation tells more
        beside: list[int] = []
        if self._differentiation.is_watching(hypothesis):
            name = self.signs.names[context]
            beside = [
                token
                for token in self._work.tokens_of(trace.active)
                if self.signs.names[token][0] not in name
            ]
        token = self._differentiation.note(
            hypothesis,
            hypotheses.predictions[hypothesis],
            hypotheses.successes[hypothesis],
            beside,
            success=success,
        )
        if token is not None and not self._predicts_alone(token, hypothesis):
            together = (*self.signs.names[context], *self.signs.names[token])
            self._spawn(hypothesis, tuple(sorted(together)))

    def _predicts_alone(self, token: int, hypothesis: int) -> bool:
        """Whether a Token by itself predicts the outcome as well as any conjunction could."""
        hypotheses = self.hypotheses
        action, outcome = hypotheses.action[hypothesis], hypotheses.outcome[hypothesis]
        same = hypotheses.find(token, action, outcome, hypotheses.delay[hypothesis])
        return same is not None and hypotheses.cm[same] > _SURE

    def _spawn(self, hypothesis: int, context: Sign) -> None:
        hypotheses = self.hypotheses
        if self.signs.find(context) is None:
            self._work.probation.add(self.signs.add(context))
        sign = self.signs.add(context)
        action, outcome = hypotheses.action[hypothesis], hypotheses.outcome[hypothesis]
        delay = hypotheses.delay[hypothesis]
        if not hypotheses.holds(sign, action, outcome, delay):
            hypotheses.add(sign, action, outcome, delay, self._parameters.initial_cm)

    # --- conjunctions on probation -------------------------------------------------------------

    def know(self, sign: Sign) -> None:
        """Add a Sign, or end its probation if it was spawned."""
        self._work.probation.discard(self.signs.add(sign))

    def _end_probation(self, due: list[int]) -> None:
        """Admit the conjunctions that have proved themselves to further hypotheses.

        A spawned conjunction is at first the context of one hypothesis only. Some arise by
        chance, and if each of them became outcome and context of everything, the lists would grow
        without limit in a noisy world. Probation ends after a quarter of maturity without a
        failure, or when the mature hypothesis is not removed (project default).
        """
        if not self._work.probation:
            return
        hypotheses, maturity = self.hypotheses, self._parameters.maturity
        for hypothesis in due:
            predictions = hypotheses.predictions[hypothesis]
            never_failed = hypotheses.successes[hypothesis] == predictions
            if hypothesis not in self._removal.removed and (
                predictions >= maturity or (never_failed and predictions >= maturity // 4)
            ):
                self._work.probation.discard(hypotheses.context[hypothesis])
