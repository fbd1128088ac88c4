"""The worlds in which ACS2 and the model meet: two mazes of its literature and two frozen lakes."""

from typing import Any, NamedTuple, Protocol

import gymnasium
import numpy as np
from animats import SIDES, Animat

Situation = tuple[str, ...]
"""What is perceived, one character for each attribute."""

Transition = tuple[Situation, int, Situation]
"""A situation, the number of an action, and another situation that can follow."""


class Knowledge(NamedTuple):
    """What a learner knows of its field: shares of all transitions.

    Attributes:
        reliable: predicted by rules of a quality of .9 or more.
        credible: predicted by rules of at least half the quality that a new one has.
    """

    reliable: float
    credible: float


class Field(Protocol):
    """A world of trials, as a classifier system perceives it. Its actions are numbered."""

    @property
    def actions(self) -> int:
        """How many actions there are."""

    @property
    def limit(self) -> int:
        """The number of steps after which a trial is given up."""

    @property
    def reward(self) -> float:
        """What the goal pays."""

    @property
    def starts(self) -> int:
        """The number of places where a trial may begin."""

    @property
    def situation(self) -> Situation:
        """What is perceived."""

    @property
    def over(self) -> bool:
        """Whether the trial has ended."""

    @property
    def found(self) -> bool:
        """Whether it has ended at the goal."""

    def begin(self, start: int | None = None) -> None:
        """Begin a trial: anywhere, or at the start of this number."""

    def do(self, action: int) -> None:
        """Perform an action."""

    def transitions(self) -> list[Transition]:
        """Every change that can follow an action, except after the end of a trial."""


class Maze:
    """A maze, whose eight attributes are what the cells around look like. See `Field`."""

    actions = len(SIDES)
    limit = 50
    reward = 1000.0

    def __init__(self, drawing: str, seed: int) -> None:
        self._animat = Animat(drawing)
        self._rng = np.random.default_rng(seed)
        self.starts = len(self._animat.free)

    @property
    def situation(self) -> Situation:
        """What is perceived."""
        looks = dict(token.split(":") for token in self._animat.tokens() if ":" in token)
        return tuple(looks[side][1] for side in SIDES)

    @property
    def over(self) -> bool:
        """Whether the food is found."""
        return self._animat.has_food

    found = over

    def begin(self, start: int | None = None) -> None:
        """Begin a trial."""
        if start is None:
            self._animat.begin(self._rng)
        else:
            self._animat.state = self._animat.free[start]

    def do(self, action: int) -> None:
        """Perform an action."""
        self._animat.do(self._animat.actions[action])

    def transitions(self) -> list[Transition]:
        """Every change that can follow an action."""
        found = []
        for start in range(self.starts):
            for action in range(self.actions):
                self.begin(start)
                before = self.situation
                self.do(action)
                found.append((before, action, self.situation))
        return [change for change in found if change[0] != change[2]]

    def optimum(self) -> float:
        """The fewest steps to the food, as a mean over the starts."""
        return self._animat.optimum()


class FrozenLake:
    """Gymnasium's frozen lake of 4 × 4 places, with one attribute for each. See `Field`."""

    actions = 4
    limit = 100
    reward = 1.0
    starts = 1
    over = False
    found = False

    def __init__(self, seed: int, *, slippery: bool) -> None:
        self._lake: Any = gymnasium.make("FrozenLake-v1", is_slippery=slippery).unwrapped
        self._seed: int | None = seed
        self._state = 0

    @property
    def situation(self) -> Situation:
        """What is perceived."""
        return self._at(self._state)

    def begin(self, start: int | None = None) -> None:  # noqa: ARG002 - there is one
        """Begin a trial."""
        self._state, _ = self._lake.reset(seed=self._seed)
        self._seed = None
        self.over = self.found = False

    def do(self, action: int) -> None:
        """Perform an action."""
        self._state, reward, self.over, _, _ = self._lake.step(action)
        self.found = reward > 0

    def transitions(self) -> list[Transition]:
        """Every change that can follow an action."""
        return [
            (self._at(before), action, self._at(after))
            for before, kind in enumerate(self._lake.desc.flat)
            if kind in {b"S", b"F"}
            for action in range(self.actions)
            for after in sorted({int(outcome[1]) for outcome in self._lake.P[before][action]})
            if after != before
        ]

    def _at(self, state: int) -> Situation:
        return tuple("X" if place == state else "0" for place in range(self._lake.desc.size))
