"""The model in gymnasium environments with discrete actions.

    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    model = DynamicExpectancyModel(action_costs(env), rng=numpy.random.default_rng(7))
    for episode in islice(play(model, env, lambda state: [f"at:{state}"]), 100):
        print(episode.steps, episode.reached)

Requires Farside's extra `gymnasium`; nothing else in `farside.dem` does.

The model does not learn from rewards, but it can sense them: the Token `rewarded` is active in the
cycle after a reward. With this Token as its goal, the model seeks whatever leads to a reward,
without being told where that is. Penalties are not sensed: the model has no aversion.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple, TypeVar

import gymnasium

from farside.dem.lists.signs import to_sign
from farside.dem.model import DynamicExpectancyModel

REWARDED = "rewarded"
"""The Token sensed with the observation that came with a reward."""

_Observation = TypeVar("_Observation")


class Episode(NamedTuple):
    """The result of an episode.

    Attributes:
        steps: number of actions performed.
        reward: sum of the rewards.
        reached: number of times that the goal was reached.
    """

    steps: int
    reward: float
    reached: int


def action_costs(env: gymnasium.Env[Any, Any]) -> dict[str, float]:
    """The actions of `env`, named by their numbers, each at a cost of 1.

    Raises:
        TypeError: if the actions of `env` are not `gymnasium.spaces.Discrete`.
    """
    space = env.action_space
    if not isinstance(space, gymnasium.spaces.Discrete):
        raise TypeError(f"actions: expected gymnasium.spaces.Discrete, found {space}")
    return {str(space.start + number): 1.0 for number in range(space.n)}


def play(
    model: DynamicExpectancyModel,
    env: gymnasium.Env[_Observation, Any],
    tokens: Callable[[_Observation], Iterable[str]],
    *,
    goal: Iterable[str] = (REWARDED,),
    reward_above: float = 0.0,
    seed: int | None = None,
) -> Iterator[Episode]:
    """Let the model act and learn, episode after episode, for as long as the caller iterates.

    The goal is set again each time it is reached. From the terminal state of an episode, every
    action leads to the start of the next one. The model learns this like anything else, or else
    curiosity would draw it back to that state for ever. From a truncation at a time limit it
    learns nothing.

    Args:
        model: a model with the actions of `action_costs`, between two cycles.
        env: the environment.
        tokens: gives the Tokens of an observation.
        goal: a Sign of these Tokens, or of `REWARDED`.
        reward_above: only a greater reward counts as a reward.
        seed: seed of the first reset.

    Raises:
        ValueError: if the model does not explore, and knows no way to the goal: an environment
            does not wait.
    """
    wanted = to_sign(goal)
    while True:
        observation, _ = env.reset(seed=seed)
        seed = None
        steps, total, reached = 0, 0.0, 0
        rewarded = terminated = truncated = False
        while True:
            if not model.goal_priorities(wanted):
                model.set_goal(wanted, priority=1.0)
            sensed = model.sense([*tokens(observation), *([REWARDED] if rewarded else [])])
            if any(goal.tokens == wanted for goal in sensed.reached):
                reached += 1
            if terminated or truncated:
                break
            action = _chosen_by(model)
            model.perform(action)
            observation, reward, terminated, truncated, _ = env.step(int(action))
            steps, total, rewarded = steps + 1, total + float(reward), float(reward) > reward_above
        model.perform(_chosen_by(model) if terminated else None)
        yield Episode(steps, total, reached)


def _chosen_by(model: DynamicExpectancyModel) -> str:
    choice = model.choose()
    if choice is None:
        raise ValueError(
            "exploration: expected a model that explores, random or curious, found one with no "
            "known way to the goal and nothing else to do"
        )
    return choice.action
