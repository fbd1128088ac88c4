"""The model in gymnasium environments: rewards, ends of episodes, and solved tasks."""

import subprocess
import sys
from collections.abc import Callable
from itertools import islice
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers.common import TimeLimit

from farside.dem import DynamicExpectancyModel, Exploration, Parameters
from farside.dem.lab.gym import REWARDED, Episode, action_costs, play


class Corridor(gymnasium.Env[Any, Any]):
    """Places 0 to 5 in a row, starting at 2. Action 11 goes up, 10 down; both ends terminate.

    The reward is 5 at the upper end, -1 for every other step. `seeds` collects those of resets.
    """

    def __init__(self, limit: int | None = None) -> None:
        self.action_space = gymnasium.spaces.Discrete(2, start=10)
        self.observation_space = gymnasium.spaces.Discrete(6)
        self.limit = limit
        self.seeds: list[int | None] = []

    def reset(
        self,
        *,
        seed: int | None = None,
        options: dict[str, Any] | None = None,  # noqa: ARG002 - as gymnasium has it
    ) -> tuple[int, dict[str, Any]]:
        super().reset(seed=seed)
        self.seeds.append(seed)
        self.at, self.steps = 2, 0
        return self.at, {}

    def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
        self.at += 1 if action == 11 else -1
        self.steps += 1
        over = self.at in {0, 5}
        late = self.limit is not None and self.steps >= self.limit
        return self.at, 5.0 if self.at == 5 else -1.0, over, late and not over, {}


def place(observation: int) -> list[str]:
    return [f"at:{observation}"]


@pytest.fixture
def make() -> Callable[..., DynamicExpectancyModel]:
    """A model for an environment."""

    def model(
        env: Corridor | TimeLimit, seed: int = 0, **parameters: Any
    ) -> DynamicExpectancyModel:
        rng = np.random.default_rng(seed)
        return DynamicExpectancyModel(action_costs(env), Parameters(**parameters), rng=rng)

    return model


def causes(model: DynamicExpectancyModel, outcome: str) -> set[tuple[tuple[str, ...], str]]:
    return {
        (hypothesis.context, hypothesis.action)
        for hypothesis in model.hypotheses
        if hypothesis.outcome == (outcome,)
    }


def test_actions_are_named_by_their_numbers_in_the_environment() -> None:
    assert action_costs(Corridor()) == {"10": 1.0, "11": 1.0}


def test_actions_that_are_not_discrete_are_refused() -> None:
    env = Corridor()
    env.action_space = gymnasium.spaces.Box(0, 1)
    with pytest.raises(TypeError, match=r"expected gymnasium\.spaces\.Discrete, found Box"):
        action_costs(env)


@pytest.mark.parametrize("seed", range(5))
def test_rewarded_is_a_goal_that_needs_no_knowledge_of_where_the_reward_is(
    make: Callable[..., DynamicExpectancyModel], seed: int
) -> None:
    env = Corridor()
    model = make(env, seed)
    episodes = list(islice(play(model, env, place), 30))
    assert episodes[-1] == Episode(steps=3, reward=3.0, reached=1)
    assert causes(model, REWARDED) == {(("at:4",), "11")}


def test_the_goal_may_be_any_sign_and_need_not_end_the_episode(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    env = Corridor(limit=20)
    model = make(env)
    *_, last = islice(play(model, env, place, goal=["at:1"]), 30)
    assert last.reached > 0
    assert [goal.tokens for goal in model.goals] == [("at:1",)]


def test_a_reward_counts_only_above_the_threshold(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    env = Corridor()
    model = make(env)
    for _ in islice(play(model, env, place, reward_above=5.0), 30):
        pass
    assert (REWARDED,) not in model.signs
    for _ in islice(play(model, env, place, reward_above=-2.0), 30):
        pass
    assert (("at:3",), "10") in causes(model, REWARDED)


def test_from_a_terminal_state_every_action_leads_to_the_start_of_the_next_episode(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    env = Corridor()
    model = make(env)
    for _ in islice(play(model, env, place, goal=["nowhere"]), 60):
        pass
    assert {("at:0",), ("at:5",)} <= {context for context, _ in causes(model, "at:2")}


def test_nothing_is_learned_from_the_reset_after_a_truncation(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    env = Corridor(limit=1)
    model = make(env)
    for _ in islice(play(model, env, place), 30):
        pass
    assert set(model.signs) == {("at:1",), ("at:2",), ("at:3",)}
    assert causes(model, "at:2") == set()


def test_only_the_first_reset_is_seeded(make: Callable[..., DynamicExpectancyModel]) -> None:
    env = Corridor()
    for _ in islice(play(make(env), env, place, seed=7), 3):
        pass
    assert env.seeds == [7, None, None]


def test_the_same_seeds_play_the_same_episodes(make: Callable[..., DynamicExpectancyModel]) -> None:
    def episodes() -> list[Episode]:
        env = gymnasium.make("FrozenLake-v1")
        return list(islice(play(make(env, 3), env, place, seed=3), 20))

    assert episodes() == episodes()


@pytest.mark.parametrize("exploration", ["random", "curious"])
@pytest.mark.parametrize("seed", range(3))
def test_the_frozen_lake_without_slipping_is_solved_in_six_steps(
    make: Callable[..., DynamicExpectancyModel], seed: int, exploration: str
) -> None:
    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    model = make(env, seed, exploration=Exploration(exploration))
    episodes = list(islice(play(model, env, place, seed=seed), 250))
    assert episodes[-10:] == [Episode(steps=6, reward=1.0, reached=1)] * 10


def test_curiosity_does_not_return_to_a_hole_for_ever(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    """No action leads out of a hole: without learning from the reset it would stay tempting."""
    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    model = make(env, exploration=Exploration.CURIOUS)
    episodes = list(islice(play(model, env, place, seed=0), 60))
    assert sum(episode.reached for episode in episodes) > 20


def test_a_model_that_does_not_explore_cannot_play_what_it_has_not_learned(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    with pytest.raises(ValueError, match="expected a model that explores"):
        next(play(make(env, exploration=Exploration.NONE), env, place, seed=0))


def test_the_model_itself_does_not_import_gymnasium() -> None:
    script = "import sys, farside.dem; sys.exit('gymnasium' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0  # noqa: S603
