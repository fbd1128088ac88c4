"""Removal: of hypotheses that have proved useless, and of conjunctions that nothing refers to.

Source: seed for ineffective hypotheses, and that the last one for a goal is kept; the rest is a
project default.
"""

from collections.abc import Collection, Container, Iterable

from farside.dem.learning.workspace import Workspace

_GAIN = 0.25  # the least fraction of a part's failures that a conjunction must avoid


class Removal:
    """Removes hypotheses and conjunctions.

    Attributes:
        removed: hypotheses removed in the current call of the learner.
    """

    def __init__(self, work: Workspace) -> None:
        self._work = work
        self.removed: set[int] = set()

    def useless(self, due: Iterable[int], needed: Collection[int]) -> None:
        """Remove the hypotheses that have just proved useless, and what depends on them.

        Args:
            due: hypotheses whose predictions were settled.
            needed: goals and active Signs.
        """
        for hypothesis in due:
            if hypothesis not in self.removed and self._is_useless(hypothesis, needed):
                self._forget(hypothesis, needed)

    def random(self, tokens: Iterable[int], needed: Collection[int]) -> None:
        """Remove all that was learned of situations with Tokens that turned out to be random."""
        work = self._work
        names = {work.signs.names[token][0] for token in tokens}
        for sign in sorted(work.wholes):
            if names.isdisjoint(work.signs.names[sign]):
                continue
            hypotheses = work.hypotheses
            for hypothesis in [*hypotheses.from_context(sign), *hypotheses.of_outcome(sign)]:
                if hypothesis not in self.removed:
                    self._forget(hypothesis, needed)

    def _is_useless(self, hypothesis: int, needed: Container[int]) -> bool:
        hypotheses, parameters = self._work.hypotheses, self._work.parameters
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
        work, hypotheses = self._work, self._work.hypotheses
        maturity = work.parameters.maturity
        if hypotheses.predictions[hypothesis] % maturity:
            return False
        action, outcome = hypotheses.action[hypothesis], hypotheses.outcome[hypothesis]
        delay, rate = hypotheses.delay[hypothesis], hypotheses.success_rate(hypothesis)
        for part in work.signs.parts(hypotheses.context[hypothesis]):
            rival = hypotheses.find(part, action, outcome, delay)
            if rival is not None and hypotheses.predictions[rival] >= maturity:
                rival_rate = hypotheses.success_rate(rival)
                if rate <= rival_rate + _GAIN * (1.0 - rival_rate):
                    return True
        return False

    def _forget(self, hypothesis: int, needed: Container[int]) -> None:
        work, hypotheses = self._work, self._work.hypotheses
        context, outcome = hypotheses.context[hypothesis], hypotheses.outcome[hypothesis]
        hypotheses.remove(hypothesis)
        self.removed.add(hypothesis)
        work.predictions.forget(hypothesis)
        work.differentiation.forget(hypothesis)
        self.sign(context, needed)
        if outcome in work.wholes:
            self.sign(outcome, needed)

    def sign(self, sign: int, needed: Container[int]) -> None:
        """Remove a conjunction that is no context, is not needed, and is in no activation trace.

        A conjunction exists to be a context. Hypotheses with it as outcome are removed with it. A
        situation may be an outcome alone: it has not been left yet.

        Args:
            sign: the conjunction, or a Token, which stays.
            needed: goals and active Signs.
        """
        work = self._work
        if (
            not work.signs.is_compound(sign)
            or sign in needed
            or work.hypotheses.is_context(sign)
            or (sign in work.wholes and work.hypotheses.is_outcome(sign))
            or any(sign in trace.active for trace in work.traces)
        ):
            return
        for hypothesis in list(work.hypotheses.of_outcome(sign)):
            if hypothesis not in self.removed:
                self._forget(hypothesis, needed)
        if work.signs.is_compound(sign):
            actions = len(work.actions)
            first = work.hypotheses.cause(sign, 0)
            work.trials.forget(range(first, first + actions))
            work.situations.forget(sign, actions)
            work.signs.remove(sign)
            work.probation.discard(sign)
            work.wholes.discard(sign)
