"""Learning: what a cycle's Signs do to the lists, whoever chose the action before."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import msgspec
from numpy.random import Generator

from farside.dem.learning.credit import first_credit, standing_alone
from farside.dem.learning.differentiation import Differentiation, DifferentiationState
from farside.dem.lists.hypotheses import ActionList, HypothesesState, HypothesisList
from farside.dem.lists.signs import Sign, SignList, SignsState
from farside.dem.lists.trials import Trials, TrialsState
from farside.dem.parameters import Parameters

_GAIN = 0.25
_SURE = 0.9


class PredictionList:
    """P, the hypotheses that have predicted, by the cycle in which their outcome is due."""

    def __init__(self, reach: int) -> None:
        self._due: deque[list[int]] = deque([] for _ in range(reach))

    def add(self, hypothesis: int, delay: int) -> None:
        """Note that `hypothesis` predicts its outcome `delay` cycles from now."""
        self._due[delay - 1].append(hypothesis)

    def take_due(self) -> list[int]:
        """Move on by one cycle and take P*, the predictions due in it."""
        due = self._due.popleft()
        self._due.append([])
        return due

    def forget(self, hypothesis: int) -> None:
        """Drop the predictions of a hypothesis that is no more."""
        for due in self._due:
            while hypothesis in due:
                due.remove(hypothesis)

    def state(self) -> tuple[tuple[int, ...], ...]:
        """Everything that `restore` needs: the hypotheses by cycles until they are due."""
        return tuple(tuple(due) for due in self._due)

    def restore(self, state: tuple[tuple[int, ...], ...]) -> None:
        """Become the list that `state` was taken of. This one is new and empty yet."""
        self._due = deque(list(due) for due in state)


class Learned(NamedTuple):
    """What came of a cycle, as ids in order of age.

    Attributes:
        active, novel, unexpected: Signs; see `farside.dem.Sensed`.
        succeeded, failed, created, removed: how many predictions came true or did not, and how
            many hypotheses came or went.
    """

    active: list[int]
    novel: list[int]
    unexpected: list[int]
    succeeded: int
    failed: int
    created: int
    removed: int


class _Past(NamedTuple):
    """A cycle that has been: the Signs active in it, and the action performed, if any."""

    active: list[int]
    action: int | None


class LearnerState(msgspec.Struct, frozen=True, array_like=True):
    """All lists as they are saved. `past` is the traces, one cycle ago first."""

    signs: SignsState
    hypotheses: HypothesesState
    trials: TrialsState
    predictions: tuple[tuple[int, ...], ...]
    differentiation: DifferentiationState
    past: tuple[tuple[tuple[int, ...], int | None], ...]
    probation: tuple[int, ...]
    cycle: int


class Learner:
    """Keeps the lists that learning changes: Signs, hypotheses, predictions, trials.

    Attributes:
        signs, actions, hypotheses, trials: the lists.
        cycle: how many cycles have been ended.
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
        self._gone: set[int] = set()
        self._probation: set[int] = set()
        # One cycle ago first.
        self._past: deque[_Past] = deque(maxlen=parameters.reach)

    def sense(self, tokens: Sign, needed: Sequence[int]) -> Learned:
        """Take in what is sensed: settle, create, differentiate, remove.

        Args:
            tokens: what is sensed.
            needed: Signs that goals need, of which the last hypothesis is never removed.
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
        return Learned(
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
            action: what was performed, if anything.
            needed: Signs that goals need.
        """
        if action is not None:
            delay = self.hypotheses.delay
            for context in active:
                self.trials.count(self.hypotheses.cause(context, action), self.cycle)
                for hypothesis in self.hypotheses.of_cause(context, action):
                    self._predictions.add(hypothesis, delay[hypothesis])
        gone = self._past[-1].active if len(self._past) == self._past.maxlen else []
        self._past.appendleft(_Past(active, action))
        self._gone.clear()
        for sign in gone if self._parameters.removal else ():
            self._forget_sign(sign, needed)
        self.cycle += 1

    def forget(self, sign: int, needed: Sequence[int]) -> None:
        """Remove a conjunction that a goal no longer needs, unless anything else refers to it.

        Args:
            sign: the conjunction.
            needed: Signs that goals need, and those active.
        """
        if self._parameters.removal:
            self._gone.clear()
            self._forget_sign(sign, needed)

    def state(self) -> LearnerState:
        """Everything that `restore` needs."""
        return LearnerState(
            signs=self.signs.state(),
            hypotheses=self.hypotheses.state(),
            trials=self.trials.state(),
            predictions=self._predictions.state(),
            differentiation=self._differentiation.state(),
            past=tuple((tuple(past.active), past.action) for past in self._past),
            probation=tuple(sorted(self._probation)),
            cycle=self.cycle,
        )

    def restore(self, state: LearnerState) -> None:
        """Become the learner that `state` was taken of. This one is new."""
        self.signs.restore(state.signs)
        self.hypotheses.restore(state.hypotheses)
        self.trials.restore(state.trials)
        self._predictions.restore(state.predictions)
        self._differentiation.restore(state.differentiation)
        self._past.extend(_Past(list(active), action) for active, action in state.past)
        self._probation.update(state.probation)
        self.cycle = state.cycle

    @property
    def last_action(self) -> int | None:
        """The action performed in the cycle before, if any."""
        return self._past[0].action if self._past else None

    # --- settling ------------------------------------------------------------------------------

    def _predicted(self, due: list[int]) -> set[int]:
        """The Signs that P* names, as far as it can be believed."""
        outcome, credit = self.hypotheses.outcome, self.hypotheses.credit
        if not self._parameters.own_credit:
            return {outcome[hypothesis] for hypothesis in due}
        credible = self._parameters.initial_cm / 2
        return {outcome[hypothesis] for hypothesis in due if credit[hypothesis] >= credible}

    def _settle(self, due: list[int], active: list[int]) -> int:
        """Judge P*, and let what is mature spawn: how many predictions came true."""
        hypotheses = self.hypotheses
        came_true = [one for one in due if hypotheses.outcome[one] in active]
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
        past = self._past[hypotheses.delay[hypothesis] - 1]
        context = self.signs.names[hypotheses.context[hypothesis]]
        beside = [
            sign
            for sign in past.active
            if not self.signs.is_compound(sign) and self.signs.names[sign][0] not in context
        ]
        token = self._differentiation.note(
            hypothesis,
            hypotheses.predictions[hypothesis],
            hypotheses.successes[hypothesis],
            beside,
            success=success,
        )
        if token is not None and not self._tells_alone(token, hypothesis):
            self._spawn(hypothesis, tuple(sorted((*context, *self.signs.names[token]))))

    def _tells_alone(self, token: int, hypothesis: int) -> bool:
        """Whether a Token's own Sign foretells the outcome as well as any conjunction could."""
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
        """Make a Sign known, or end its probation if it was spawned."""
        self._probation.discard(self.signs.add(sign))

    def _end_probation(self, due: list[int]) -> None:
        """Let those conjunctions into further hypotheses that have proved good for one.

        A conjunction that was spawned belongs to one hypothesis at first. Chance makes such too,
        and if each became outcome and context of everything, the lists would grow for ever in a
        noisy world. So it has to be right a quarter of maturity without a failure, or to be kept
        when mature (project default).
        """
        if not self._probation:
            return
        hypotheses, maturity = self.hypotheses, self._parameters.maturity
        for hypothesis in due:
            judged = hypotheses.predictions[hypothesis]
            never_failed = hypotheses.successes[hypothesis] == judged
            if hypothesis not in self._gone and (
                judged >= maturity or (never_failed and judged >= maturity // 4)
            ):
                self._probation.discard(hypotheses.context[hypothesis])

    # --- creation and removal ------------------------------------------------------------------

    def _create(self, outcomes: list[int]) -> None:
        for outcome in outcomes:
            if outcome in self._probation:
                continue
            for delay, past in enumerate(self._past, start=1):
                if past.action is not None:
                    self._take_opportunities(past, outcome, delay)

    def _take_opportunities(self, past: _Past, outcome: int, delay: int) -> None:
        hypotheses, action = self.hypotheses, past.action
        assert action is not None  # noqa: S101 - the caller sees to it
        contexts = [context for context in past.active if context not in self._probation]
        tries = [self.trials.tried(hypotheses.cause(context, action)) for context in contexts]
        for context, tried in zip(contexts, tries, strict=True):
            if hypotheses.holds(context, action, outcome, delay):
                continue
            if self._rng.random() < self._parameters.learning_probability:
                credit = first_credit(self._parameters.initial_cm, tried, min(tries))
                hypotheses.add(context, action, outcome, delay, credit)

    def _remove(self, due: list[int], needed: list[int]) -> None:
        """Remove what has just proved ineffective or redundant; then what hangs on it."""
        self._gone.clear()
        for hypothesis in due:
            if hypothesis not in self._gone and self._is_useless(hypothesis, needed):
                self._forget(hypothesis, needed)

    def _is_useless(self, hypothesis: int, needed: Sequence[int]) -> bool:
        hypotheses, parameters = self.hypotheses, self._parameters
        if hypotheses.predictions[hypothesis] < parameters.maturity:
            return False
        if hypotheses.outcome[hypothesis] in needed and hypotheses.is_last_of(hypothesis):
            return False
        return hypotheses.cm[hypothesis] < parameters.ineffective or self._is_redundant(hypothesis)

    def _is_redundant(self, hypothesis: int) -> bool:
        """Whether a conjunction tells no better than one of its parts does.

        It must tell at least a quarter of the part's failures away. Asked each time that as many
        predictions as make it mature have been judged (project default).
        """
        hypotheses, maturity = self.hypotheses, self._parameters.maturity
        if hypotheses.predictions[hypothesis] % maturity:
            return False
        action, outcome = hypotheses.action[hypothesis], hypotheses.outcome[hypothesis]
        delay, share = hypotheses.delay[hypothesis], hypotheses.success_share(hypothesis)
        for part in self.signs.parts(hypotheses.context[hypothesis]):
            rival = hypotheses.find(part, action, outcome, delay)
            if rival is not None and hypotheses.predictions[rival] >= maturity:
                rival_share = hypotheses.success_share(rival)
                if share <= rival_share + _GAIN * (1.0 - rival_share):
                    return True
        return False

    def _forget(self, hypothesis: int, needed: Sequence[int]) -> None:
        hypotheses = self.hypotheses
        hypotheses.remove(hypothesis)
        self._gone.add(hypothesis)
        self._predictions.forget(hypothesis)
        self._differentiation.forget(hypothesis)
        self._forget_sign(hypotheses.context[hypothesis], needed)

    def _forget_sign(self, sign: int, needed: Sequence[int]) -> None:
        """Remove a conjunction that is no hypothesis's context, and no goal needs, or trace holds.

        A conjunction is there to be a context: what ends in it goes with it.
        """
        if (
            not self.signs.is_compound(sign)
            or sign in needed
            or self.hypotheses.is_context(sign)
            or any(sign in past.active for past in self._past)
        ):
            return
        for hypothesis in list(self.hypotheses.of_outcome(sign)):
            if hypothesis not in self._gone:
                self._forget(hypothesis, needed)
        if self.signs.is_compound(sign):
            first = self.hypotheses.cause(sign, 0)
            self.trials.forget(range(first, first + len(self.actions)))
            self.signs.remove(sign)
            self._probation.discard(sign)
