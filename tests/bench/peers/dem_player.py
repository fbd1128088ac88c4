"""The Dynamic Expectancy Model as a player in the mazes."""

from dataclasses import dataclass, field

import numpy as np
from mazes import MOVES, Place

from farside.dem import DynamicExpectancyModel, Parameters


def token(place: Place) -> str:
    """The only Token sensed at a place."""
    return f"at:{place[0]},{place[1]}"


@dataclass
class DemPlayer:
    """Plays the model's own choices, or with probability `epsilon` a random move.

    The end of an episode is a cycle without an action, so that nothing is learned from the return
    to the start.
    """

    rng: np.random.Generator
    parameters: Parameters
    epsilon: float = 0.0
    model: DynamicExpectancyModel = field(init=False)

    def __post_init__(self) -> None:
        self.model = DynamicExpectancyModel(
            dict.fromkeys(MOVES, 1.0), self.parameters, rng=self.rng
        )

    def begin(self, goal: Place | None) -> None:
        """Set the goal, which was removed when the last episode reached it."""
        if goal is not None:
            self.model.set_goal([token(goal)], priority=1.0)

    def act(self, place: Place) -> str:
        """The model's choice, or a random move."""
        self.model.sense([token(place)])
        if self.epsilon and self.rng.random() < self.epsilon:
            action = str(self.rng.choice(list(MOVES)))
        else:
            choice = self.model.choose()
            assert choice is not None, "a model that explores has always something to do"
            action = choice.action
        self.model.perform(action)
        return action

    def learn(self, place: Place, action: str, after: Place, reward: float) -> None:
        """Nothing to do: the model learns when it senses."""

    def end(self, place: Place) -> None:
        """Sense the last place and perform no action."""
        self.model.sense([token(place)])
        self.model.perform(None)
