"""The baselines: tabular Q-learning, Dyna-Q, Dyna-Q+ and prioritized sweeping.

After Sutton and Barto, Reinforcement Learning, second edition, chapters 6 and 8. Learners act
ε-greedily, with ties broken at random. A reward of 1, at the goal, ends the episode:

    Q(s, a) ← Q(s, a) + α (r + γ max Q(s′, ·) − Q(s, a)),   max Q(s′, ·) = 0 where r > 0

Learners with a model of the maze are told of a new goal: the reward in their model is moved there.
The Dynamic Expectancy Model is told as much. Plain Q-learning has to find the goal.
"""

from heapq import heappop, heappush
from math import sqrt

import numpy as np
from mazes import MOVES, Place

ACTIONS = tuple(MOVES)
_CHUNK = 4096


class QLearning:
    """One-step Q-learning.

    Args:
        rng: the only source of randomness.
        alpha: α, step size.
        gamma: γ, discount.
        epsilon: ε, probability of a random move.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        *,
        alpha: float = 0.1,
        gamma: float = 0.95,
        epsilon: float = 0.1,
    ) -> None:
        self.alpha = alpha
        self.gamma = gamma
        self.epsilon = epsilon
        self.values: dict[Place, list[float]] = {}
        self._rng = rng
        self._drawn: list[float] = []

    def begin(self, goal: Place | None) -> None:
        """Nothing to do: the reward alone marks the goal."""

    def end(self, place: Place) -> None:
        """Nothing to do: no update looks beyond the reward."""

    def act(self, place: Place) -> str:
        """The move with the greatest value, or with probability ε a random one."""
        if self.draw() < self.epsilon:
            return ACTIONS[self.below(len(ACTIONS))]
        values = self.of(place)
        greatest = max(values)
        best = [action for action, value in enumerate(values) if value == greatest]
        return ACTIONS[best[self.below(len(best))]]

    def learn(self, place: Place, action: str, after: Place, reward: float) -> None:
        """Update the value of the move."""
        self.update(place, ACTIONS.index(action), after, reward)

    def of(self, place: Place) -> list[float]:
        """The values of the moves at `place`, 0 at first."""
        values = self.values.get(place)
        if values is None:
            values = self.values[place] = [0.0] * len(ACTIONS)
        return values

    def error(
        self, place: Place, action: int, after: Place, reward: float, bonus: float = 0.0
    ) -> float:
        """The temporal-difference error of a move; a bonus adds to the reward without ending."""
        beyond = 0.0 if reward > 0 else self.gamma * max(self.of(after))
        return reward + bonus + beyond - self.of(place)[action]

    def update(
        self, place: Place, action: int, after: Place, reward: float, bonus: float = 0.0
    ) -> None:
        """Reduce the temporal-difference error of a move by the fraction α."""
        self.of(place)[action] += self.alpha * self.error(place, action, after, reward, bonus)

    def draw(self) -> float:
        """A random number from 0 to 1, drawn in bulk for speed."""
        if not self._drawn:
            self._drawn = self._rng.random(_CHUNK).tolist()
        return self._drawn.pop()

    def below(self, count: int) -> int:
        """A random integer from 0 to `count` − 1."""
        return int(self.draw() * count)


class DynaQ(QLearning):
    """Q-learning that also learns from remembered moves and their latest results.

    Args:
        rng, alpha, gamma, epsilon: see `QLearning`.
        planning: number of remembered moves to learn from after each real one. Each is drawn as a
            known place, then a known move there.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        *,
        planning: int,
        alpha: float = 0.1,
        gamma: float = 0.95,
        epsilon: float = 0.1,
    ) -> None:
        super().__init__(rng, alpha=alpha, gamma=gamma, epsilon=epsilon)
        self.planning = planning
        self.model: dict[Place, dict[int, tuple[Place, float]]] = {}
        self._known: list[tuple[Place, list[int]]] = []
        self._moves: dict[Place, list[int]] = {}
        self._goal: Place | None = None

    def begin(self, goal: Place | None) -> None:
        """Move the reward in the model to a new goal."""
        if goal != self._goal:
            self._goal = goal
            for moves in self.model.values():
                for action, (after, _) in moves.items():
                    moves[action] = after, float(after == goal)

    def learn(self, place: Place, action: str, after: Place, reward: float) -> None:
        """Update the value of the move, remember the move, and plan."""
        super().learn(place, action, after, reward)
        self.remember(place, ACTIONS.index(action), after, reward)
        for _ in range(self.planning):
            self.plan()

    def remember(self, place: Place, action: int, after: Place, reward: float) -> None:
        """Add the move to the model."""
        if place not in self.model:
            self.model[place] = {}
            self._moves[place] = []
            self._known.append((place, self._moves[place]))
        if action not in self.model[place]:
            self._moves[place].append(action)
        self.model[place][action] = after, reward

    def plan(self) -> None:
        """Learn from one remembered move."""
        place, moves = self._known[self.below(len(self._known))]
        action = moves[self.below(len(moves))]
        after, reward = self.model[place][action]
        self.update(place, action, after, reward)


class DynaQPlus(DynaQ):
    """Dyna-Q that plans with a reward of r + κ√τ for a move last made τ steps ago.

    Moves never made at a known place are planned with too, as if they had no effect and had last
    been made at step 0.

    Args:
        rng, planning, alpha, gamma, epsilon: see `DynaQ`.
        kappa: κ.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        *,
        planning: int,
        kappa: float,
        alpha: float = 0.1,
        gamma: float = 0.95,
        epsilon: float = 0.1,
    ) -> None:
        super().__init__(rng, planning=planning, alpha=alpha, gamma=gamma, epsilon=epsilon)
        self.kappa = kappa
        self._step = 0
        self._made: dict[Place, list[int]] = {}

    def remember(self, place: Place, action: int, after: Place, reward: float) -> None:
        """Add the move to the model, and with a new place all moves from it."""
        self._step += 1
        if place not in self._made:
            self._made[place] = [0] * len(ACTIONS)
            for other in range(len(ACTIONS)):
                super().remember(place, other, place, 0.0)
        self._made[place][action] = self._step
        super().remember(place, action, after, reward)

    def plan(self) -> None:
        """Learn from one move of the model, with its bonus."""
        place, moves = self._known[self.below(len(self._known))]
        action = moves[self.below(len(moves))]
        after, reward = self.model[place][action]
        bonus = self.kappa * sqrt(self._step - self._made[place][action])
        self.update(place, action, after, reward, bonus)


class PrioritizedSweeping(DynaQ):
    """Dyna-Q that plans with the moves of greatest error first, and backwards from there.

    Args:
        rng, planning, alpha, gamma, epsilon: see `DynaQ`.
        threshold: θ, the error above which a move enters the priority queue.
    """

    def __init__(
        self,
        rng: np.random.Generator,
        *,
        planning: int,
        alpha: float = 0.5,
        gamma: float = 0.95,
        epsilon: float = 0.1,
        threshold: float = 1e-4,
    ) -> None:
        super().__init__(rng, planning=planning, alpha=alpha, gamma=gamma, epsilon=epsilon)
        self.threshold = threshold
        self._queue: list[tuple[float, Place, int]] = []
        self._priority: dict[tuple[Place, int], float] = {}
        self._before: dict[Place, dict[tuple[Place, int], None]] = {}

    def begin(self, goal: Place | None) -> None:
        """Move the reward in the model to a new goal, and queue the moves that this affects."""
        moved = goal != self._goal
        super().begin(goal)
        if moved:
            for place, moves in self.model.items():
                for action in moves:
                    self._consider(place, action)

    def learn(self, place: Place, action: str, after: Place, reward: float) -> None:
        """Remember the move and plan; there is no other learning."""
        self.remember(place, ACTIONS.index(action), after, reward)
        self._before.setdefault(after, {})[place, ACTIONS.index(action)] = None
        self._consider(place, ACTIONS.index(action))
        for _ in range(self.planning):
            self.plan()

    def plan(self) -> None:
        """Learn from the move of greatest error, and queue the moves that lead to its place."""
        while self._queue:
            priority, place, action = heappop(self._queue)
            if self._priority.get((place, action)) != -priority:
                continue
            del self._priority[place, action]
            after, reward = self.model[place][action]
            self.update(place, action, after, reward)
            for earlier in self._before.get(place, ()):
                if self.model[earlier[0]][earlier[1]][0] == place:
                    self._consider(*earlier)
            return

    def _consider(self, place: Place, action: int) -> None:
        after, reward = self.model[place][action]
        error = abs(self.error(place, action, after, reward))
        if error > max(self.threshold, self._priority.get((place, action), 0.0)):
            self._priority[place, action] = error
            heappush(self._queue, (-error, place, action))
