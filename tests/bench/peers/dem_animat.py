"""The model as a player in the worlds of the classifier-system literature."""

import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from fields import Field, Knowledge, Situation, Transition

from farside.dem import DynamicExpectancyModel, Exploration, Hypothesis, Parameters, Values

GOAL = ("rewarded",)
FAILED = ("failed",)
AVERSION = 100.0
"""What an end of a trial without reward costs beside, where all outcomes of an action count."""

RELIABLE = 0.9
"""Least C_m of a reliable hypothesis: ACS2's θ_r."""

Tokens = Callable[[Situation], list[str]]


def parts(situation: Situation) -> list[str]:
    """A Token for each attribute."""
    return [f"{number}:{look}" for number, look in enumerate(situation)]


def whole(situation: Situation) -> list[str]:
    """One Token for all that is perceived."""
    return [f"view:{''.join(situation)}"]


def _is_reliable(known: Hypothesis) -> bool:
    return known.cm >= RELIABLE


class DemAnimat:
    """The model in one field: it explores without a goal, then goes to the reward.

    Args:
        field: where it is.
        seed: of the model, and of the random actions.
        tokens: what it senses of a situation.
        parameters: of the model. If it is curious, it explores by its own choice. If its values are
            expected ones, it senses a trial that ends without the goal, and is averse to that.

    Attributes:
        cpu_s: processor time of the exploration.
    """

    def __init__(self, field: Field, seed: int, tokens: Tokens, parameters: Parameters) -> None:
        self._field = field
        self._tokens = tokens
        self._rng, own = map(np.random.default_rng, np.random.SeedSequence(seed).spawn(2))
        actions = {str(action): 1.0 for action in range(field.actions)}
        self._model = DynamicExpectancyModel(actions, parameters, rng=own)
        self._averse = parameters.values is Values.EXPECTED
        if self._averse:
            self._model.avert(FAILED, AVERSION)
        self._curious = parameters.exploration is Exploration.CURIOUS
        self.cpu_s = 0.0

    def explore(self, steps: int) -> None:
        """Explore for so many steps, trial after trial."""
        began = time.process_time()
        self._field.begin()
        made = 0
        for _ in range(steps):
            if self._field.over or made == self._field.limit:
                self._end()
                self._field.begin()
                made = 0
            self._sense()
            self._perform(self._explored())
            made += 1
        self._end()
        self.cpu_s = time.process_time() - began

    def exploit(self, start: int) -> int:
        """One trial without exploration; returns its steps. The model continues to learn."""
        self._field.begin(start)
        self._model.set_goal(GOAL, priority=1.0)
        steps = 0
        while not self._field.over and steps < self._field.limit:
            self._sense()
            choice = self._model.choose(explore=False)
            self._perform(choice.action if choice else self._any())
            steps += 1
        self._sense()
        self._model.perform(None)
        return steps

    @property
    def rules(self) -> int:
        """The number of hypotheses."""
        return self._model.hypothesis_count

    def knowledge(self, transitions: Sequence[Transition]) -> Knowledge:
        """What reliable, or credible, hypotheses predict: every Token that is new."""
        reliable, credible = (
            [known for known in self._model.hypotheses if least(known)]
            for least in (_is_reliable, self._is_credible)
        )
        return Knowledge(self._share(reliable, transitions), self._share(credible, transitions))

    def _is_credible(self, known: Hypothesis) -> bool:
        return known.credit >= self._model.parameters.initial_cm / 2

    def _share(self, rules: Sequence[Hypothesis], transitions: Sequence[Transition]) -> float:
        by_action = defaultdict(list)
        for known in rules:
            by_action[known.action].append((set(known.context), set(known.outcome)))
        held = 0
        for before, action, after in transitions:
            sensed = set(self._tokens(before))
            left = set(self._tokens(after)) - sensed
            for context, outcome in by_action[str(action)]:
                if context <= sensed:
                    left -= outcome
            held += not left
        return held / len(transitions)

    def _sense(self) -> None:
        ended: Iterable[str] = ()
        if self._field.found:
            ended = GOAL
        elif self._field.over and self._averse:
            ended = FAILED
        self._model.sense([*self._tokens(self._field.situation), *ended])

    def _perform(self, action: str) -> None:
        self._model.perform(action)
        self._field.do(int(action))

    def _explored(self) -> str:
        choice = self._model.choose() if self._curious else None
        return choice.action if choice else self._any()

    def _any(self) -> str:
        return str(self._rng.integers(self._field.actions))

    def _end(self) -> None:
        """The end of a trial: what comes then follows from it, or curiosity would stay there."""
        self._sense()
        self._model.perform(self._explored() if self._curious and self._field.over else None)
