"""ACS2, the anticipatory classifier system of Butz, as pyalcs 1.5 has it.

A classifier states a condition, an action and all that changes then. Its quality is 0 to 1; a
reliable one is above θ_r.
"""

import random
import time
from collections.abc import Sequence
from statistics import mean
from typing import Any

import numpy as np
from fields import Field, Knowledge, Transition
from lcs import Perception
from lcs.agents.acs2 import ACS2, Configuration

RELIABLE = 0.9
"""θ_r, as published."""

CREDIBLE = 0.25
"""Half the quality of a new classifier; the model takes half the credit of a new hypothesis."""


class _SpentError(Exception):
    """The steps of the exploration are used up."""


class _Environment:
    """A field in the form of an environment of gym, as that was in the days of pyalcs."""

    def __init__(self, field: Field) -> None:
        self.action_space = self
        self.budget: float = 0
        self.start: int | None = None
        self.steps = 0
        self._field = field

    def sample(self) -> int:
        """A random action, drawn as pyalcs draws."""
        return int(np.random.randint(self._field.actions))  # noqa: NPY002

    def reset(self) -> Perception:
        """Begin a trial."""
        self._field.begin(self.start)
        self.steps = 0
        return Perception(self._field.situation)

    def step(self, action: int) -> tuple[Perception, float, bool, dict[str, Any]]:
        """Perform an action. When one too many is asked for, the last has been learned from."""
        if not self.budget:
            raise _SpentError
        self.budget -= 1
        self._field.do(action)
        self.steps += 1
        reward = self._field.reward if self._field.found else 0.0
        over = self._field.over or self.steps == self._field.limit
        return Perception(self._field.situation), reward, over, {}


class Acs2Player:
    """ACS2 in one field, with its published settings: β .05, θ_r .9, θ_i .1, ε .8.

    Args:
        field: where it is.
        seed: of the two global generators from which pyalcs draws.
        genetic: whether rules are also generalised by the genetic algorithm.

    Attributes:
        cpu_s: processor time of the exploration.
    """

    def __init__(self, field: Field, seed: int, *, genetic: bool) -> None:
        random.seed(seed)
        np.random.seed(seed)  # noqa: NPY002
        self._environment = _Environment(field)
        self._agent = ACS2(
            Configuration(
                classifier_length=len(field.situation),
                number_of_possible_actions=field.actions,
                metrics_trial_frequency=10**9,
                do_ga=genetic,
                beta=0.05,
                theta_i=0.1,
                theta_r=RELIABLE,
                epsilon=0.8,
            )
        )
        self.cpu_s = 0.0

    def explore(self, steps: int) -> None:
        """Explore for so many steps, trial after trial."""
        self._environment.budget = steps
        began = time.process_time()
        try:
            self._agent.explore(self._environment, steps)
        except _SpentError:
            self.cpu_s = time.process_time() - began

    def exploit(self, start: int) -> int:
        """One trial without exploration; returns its steps."""
        self._environment.budget = np.inf
        self._environment.start = start
        self._agent.exploit(self._environment, 1)
        return self._environment.steps

    @property
    def rules(self) -> int:
        """The number of different classifiers."""
        return len(self._agent.population)

    def knowledge(self, transitions: Sequence[Transition]) -> Knowledge:
        """What a reliable, or a credible, classifier predicts: all that changes, nothing else."""
        return Knowledge(
            *(
                mean(
                    any(
                        rule.q >= least
                        and rule.predicts_successfully(Perception(p0), action, Perception(p1))
                        for rule in self._agent.population
                    )
                    for p0, action, p1 in transitions
                )
                for least in (RELIABLE, CREDIBLE)
            )
        )
