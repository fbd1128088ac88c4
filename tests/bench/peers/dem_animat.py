"""The model as a player in the worlds of the classifier-system literature."""

import time
from collections.abc import Callable, Iterable, Sequence
from statistics import mean

import numpy as np
from fields import Field, Situation, Transition

from farside.dem import DynamicExpectancyModel, Exploration, Parameters

GOAL = ("rewarded",)
RELIABLE = 0.9
"""C_m above which a hypothesis counts as reliable: ACS2's θ_r."""

Tokens = Callable[[Situation], list[str]]


def parts(situation: Situation) -> list[str]:
    """A Token for each attribute."""
    return [f"{number}:{look}" for number, look in enumerate(situation)]


def whole(situation: Situation) -> list[str]:
    """One Token for all that is perceived."""
    return [f"view:{''.join(situation)}"]


class DemAnimat:
    """The model in one field: it explores without a goal, then goes to the reward.

    Args:
        field: where it is.
        seed: of the model, and of the random actions.
        tokens: what it senses of a situation.
        parameters: of the model. If it is curious, it explores by its own choice.

    Attributes:
        cpu_s: processor time of the exploration.
    """

    def __init__(self, field: Field, seed: int, tokens: Tokens, parameters: Parameters) -> None:
        self._field = field
        self._tokens = tokens
        self._rng, own = map(np.random.default_rng, np.random.SeedSequence(seed).spawn(2))
        actions = {str(action): 1.0 for action in range(field.actions)}
        self._model = DynamicExpectancyModel(actions, parameters, rng=own)
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

    def knowledge(self, transitions: Sequence[Transition]) -> float:
        """The share of which reliable hypotheses predict all that changes, each Token of it."""
        reliable = [known for known in self._model.hypotheses if known.cm > RELIABLE]
        known_by = {
            action: [
                (set(known.context), set(known.outcome))
                for known in reliable
                if known.action == str(action)
            ]
            for action in range(self._field.actions)
        }
        return mean(self._knows(known_by[change[1]], change) for change in transitions)

    def _knows(self, known: list[tuple[set[str], set[str]]], change: Transition) -> bool:
        sensed = set(self._tokens(change[0]))
        left = set(self._tokens(change[2])) - sensed
        for context, outcome in known:
            if context <= sensed:
                left -= outcome
        return not left

    def _sense(self) -> None:
        rewarded: Iterable[str] = GOAL if self._field.found else ()
        self._model.sense([*self._tokens(self._field.situation), *rewarded])

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
