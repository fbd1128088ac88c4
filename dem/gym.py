"""The model in worlds of other people: gymnasium environments with discrete actions.

    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    model = DynamicExpectancyModel(action_costs(env), rng=numpy.random.default_rng(7))
    for episode in islice(play(model, env, lambda place: [f"at:{place}"]), 100):
        print(episode.steps, episode.reached)

Needs Farside's extra `gymnasium`; nothing else in `farside.dem` does.

A reward teaches the model nothing, but it can be sensed: the Token `rewarded` is active in the
cycle after a reward, and set as a goal it makes the model look for whatever brings rewards,
without knowing where that is. Penalties are not sensed: the model has no aversion.
"""

from collections.abc import Callable, Iterable, Iterator
from typing import Any, NamedTuple, TypeVar

import gymnasium

from farside.dem.lists.signs import to_sign
from farside.dem.model import DynamicExpectancyModel

REWARDED = "rewarded"
"""The Token sensed together with what followed a reward."""

_Observation = TypeVar("_Observation")


class Episode(NamedTuple):
    """How an episode went.

    Attributes:
        steps: actions performed.
        reward: sum of the rewards.
        reached: how often the goal was reached.
    """

    steps: int
    reward: float
    reached: int


def action_costs(env: gymnasium.Env[Any, Any]) -> dict[str, float]:
    """The actions of `env`, named by their numbers, at a cost of 1 each.

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
    """Let the model act and learn, episode after episode, for as long as the caller asks.

    The goal is set anew whenever it has been reached. From where an episode terminated, whatever
    the model does leads to the start of the next; it learns that as it learns all else, so that
    it has no reason to be curious of the place for ever. Across the jump that follows a time
    limit it learns nothing.

    Args:
        model: with the actions that `action_costs` names; between two of its cycles.
        env: the world.
        tokens: what is sensed of an observation.
        goal: a Sign of these Tokens, or of `REWARDED`.
        reward_above: a reward is one that is greater than this.
        seed: of the first reset; the later ones go on from there.
    """
    wanted = to_sign(goal)
    model.set_goal(wanted, priority=1.0)
    while True:
        observation, _ = env.reset(seed=seed)
        seed = None
        steps, total, reached = 0, 0.0, 0
        rewarded = terminated = truncated = False
        while True:
            sensed = model.sense([*tokens(observation), *([REWARDED] if rewarded else [])])
            if any(goal.tokens == wanted for goal in sensed.reached):
                reached += 1
                model.set_goal(wanted, priority=1.0)
            if terminated or truncated:
                break
            action = model.choose().action
            model.perform(action)
            observation, reward, terminated, truncated, _ = env.step(int(action))
            steps, total, rewarded = steps + 1, total + float(reward), float(reward) > reward_above
        model.perform(model.choose().action if terminated else None)
        yield Episode(steps, total, reached)
