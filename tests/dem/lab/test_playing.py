"""The model in worlds of episodes: rewards, ends, names of actions, and solved tasks."""

import subprocess
import sys
from collections.abc import Callable
from itertools import islice
from typing import Any, ClassVar

import gymnasium
import numpy as np
import pytest
from gymnasium.wrappers.common import TimeLimit

from farside.dem import DynamicExpectancyModel, Exploration, Parameters
from farside.dem.lab import REWARDED, CycleMetrics, Episode, GymWorld, Situation, play


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
        rng, costs = np.random.default_rng(seed), GymWorld(env, place).action_costs
        return DynamicExpectancyModel(costs, Parameters(**parameters), rng=rng)

    return model


def causes(model: DynamicExpectancyModel, outcome: str) -> set[tuple[str, str]]:
    """What leads to a Token, alone or with others: place and action."""
    return {
        (context, hypothesis.action)
        for hypothesis in model.hypotheses
        if outcome in hypothesis.outcome
        for context in hypothesis.context
        if context != REWARDED
    }


def test_actions_are_named_by_their_numbers_in_the_environment() -> None:
    assert GymWorld(Corridor(), place).action_costs == {"10": 1.0, "11": 1.0}


def test_actions_that_are_not_discrete_are_refused() -> None:
    env = Corridor()
    env.action_space = gymnasium.spaces.Box(0, 1)
    with pytest.raises(TypeError, match=r"gymnasium\.spaces\.Discrete, or .+, found Box"):
        GymWorld(env, place)


def test_actions_have_the_names_that_are_given(make: Callable[..., DynamicExpectancyModel]) -> None:
    env = Corridor()
    for names in (["down", "up"], {"up": 11, "down": 10}):
        world = GymWorld(env, place, actions=names)
        model = DynamicExpectancyModel(world.action_costs, rng=np.random.default_rng(0))
        *_, last = islice(play(model, world), 20)
        assert last == Episode(steps=3, reward=3.0, reached=1)
        assert causes(model, REWARDED) == {("at:4", "up")}


def test_actions_that_the_environment_does_not_have_are_refused() -> None:
    for names in (["up"], ["up", "up"], ["up", "down", "left"]):
        with pytest.raises(ValueError, match="expected 2 different names"):
            GymWorld(Corridor(), place, actions=names)
    with pytest.raises(ValueError, match=r"Discrete.+ found 'up': 12"):
        GymWorld(Corridor(), place, actions={"up": 12, "down": 10})
    world = GymWorld(Corridor(), place)
    world.begin(None)
    with pytest.raises(ValueError, match="expected one of 10, 11, found 'up'"):
        world.act("up")


def test_actions_of_any_space_can_be_given_by_name() -> None:
    env = Corridor()
    env.action_space = gymnasium.spaces.Box(-1.0, 1.0, (1,))
    steps = {"left": np.array([-1.0], np.float32), "right": np.array([1.0], np.float32)}
    assert GymWorld(env, place, actions=steps).action_costs == {"left": 1.0, "right": 1.0}


def test_an_environment_is_no_world_yet(make: Callable[..., DynamicExpectancyModel]) -> None:
    env = Corridor()
    with pytest.raises(TypeError, match=r"such as GymWorld\(env, tokens\), found Corridor"):
        next(play(make(env), env))  # type: ignore[arg-type]


@pytest.mark.parametrize("seed", range(5))
def test_rewarded_is_a_goal_that_needs_no_knowledge_of_where_the_reward_is(
    make: Callable[..., DynamicExpectancyModel], seed: int
) -> None:
    env = Corridor()
    model = make(env, seed)
    episodes = list(islice(play(model, GymWorld(env, place)), 30))
    assert episodes[-1] == Episode(steps=3, reward=3.0, reached=1)
    assert causes(model, REWARDED) == {("at:4", "11")}


def test_the_goal_may_be_any_sign_and_need_not_end_the_episode(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    env = Corridor(limit=20)
    model = make(env)
    *_, last = islice(play(model, GymWorld(env, place), goal=["at:1"]), 30)
    assert last.reached > 0
    assert [goal.tokens for goal in model.goals] == [("at:1",)]


def test_a_reward_counts_only_above_the_threshold(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    env = Corridor()
    model = make(env)
    for _ in islice(play(model, GymWorld(env, place, reward_above=5.0)), 30):
        pass
    assert (REWARDED,) not in model.signs
    for _ in islice(play(model, GymWorld(env, place, reward_above=-2.0)), 30):
        pass
    assert causes(model, REWARDED)


def test_from_a_terminal_state_every_action_leads_to_the_start_of_the_next_episode(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    env = Corridor()
    model = make(env)
    for _ in islice(play(model, GymWorld(env, place), goal=["nowhere"]), 60):
        pass
    assert {"at:0", "at:5"} <= {context for context, _ in causes(model, "at:2")}


def test_nothing_is_learned_from_the_reset_after_a_truncation(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    env = Corridor(limit=1)
    model = make(env)
    for _ in islice(play(model, GymWorld(env, place)), 30):
        pass
    assert set(model.signs) == {("at:1",), ("at:2",), ("at:3",)}
    assert causes(model, "at:2") == set()


def test_an_end_at_the_time_limit_is_an_end(make: Callable[..., DynamicExpectancyModel]) -> None:
    class Late(Corridor):
        def step(self, action: int) -> tuple[int, float, bool, bool, dict[str, Any]]:
            at, reward, over, _, info = super().step(action)
            return at, reward, over, over, info

    model = make(Late())
    for _ in islice(play(model, GymWorld(Late(), place), goal=["nowhere"]), 60):
        pass
    assert {"at:0", "at:5"} <= {context for context, _ in causes(model, "at:2")}


def test_only_the_first_reset_is_seeded(make: Callable[..., DynamicExpectancyModel]) -> None:
    env = Corridor()
    for _ in islice(play(make(env), GymWorld(env, place), seed=7), 3):
        pass
    assert env.seeds == [7, None, None]


def test_the_same_seeds_play_the_same_episodes(make: Callable[..., DynamicExpectancyModel]) -> None:
    def episodes() -> list[Episode]:
        env = gymnasium.make("FrozenLake-v1")
        return list(islice(play(make(env, 3), GymWorld(env, place), seed=3), 20))

    assert episodes() == episodes()


@pytest.mark.parametrize("exploration", ["random", "curious"])
@pytest.mark.parametrize("seed", range(3))
def test_the_frozen_lake_without_slipping_is_solved_in_six_steps(
    make: Callable[..., DynamicExpectancyModel], seed: int, exploration: str
) -> None:
    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    model = make(env, seed, exploration=Exploration(exploration))
    episodes = list(islice(play(model, GymWorld(env, place), seed=seed), 250))
    assert episodes[-10:] == [Episode(steps=6, reward=1.0, reached=1)] * 10


def test_curiosity_does_not_return_to_a_hole_for_ever(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    """No action leads out of a hole: without learning from the reset it would stay tempting."""
    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    model = make(env, exploration=Exploration.CURIOUS)
    episodes = list(islice(play(model, GymWorld(env, place), seed=0), 60))
    assert sum(episode.reached for episode in episodes) > 20


def test_a_model_that_does_not_explore_cannot_play_what_it_has_not_learned(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    env = gymnasium.make("FrozenLake-v1", is_slippery=False)
    with pytest.raises(ValueError, match="expected a model that explores"):
        next(play(make(env, exploration=Exploration.NONE), GymWorld(env, place), seed=0))


def test_a_model_that_has_learned_plays_without_exploring(
    make: Callable[..., DynamicExpectancyModel],
) -> None:
    """Also where the goal does not end the episode: there is nothing to do any more, so it ends."""
    env = Corridor(limit=20)
    model = make(env)
    for _ in islice(play(model, GymWorld(env, place), goal=["at:4"]), 10):
        pass
    model.change(Parameters(exploration=Exploration.NONE))
    played = list(islice(play(model, GymWorld(env, place), goal=["at:4"]), 3))
    assert played == [Episode(steps=2, reward=-2.0, reached=1)] * 3


class Row:
    """Five places in a row without gymnasium: `right` leads from 0 to 4, where the goal is."""

    action_costs: ClassVar[dict[str, float]] = {"left": 1.0, "right": 1.0}

    def begin(self, seed: int | None) -> Situation:  # noqa: ARG002 - as a world has it
        self.at = 0
        return Situation(["at:0"])

    def act(self, action: str) -> Situation:
        self.at = max(0, self.at + (1 if action == "right" else -1))
        return Situation([f"at:{self.at}"], terminated=self.at == 4)


def test_any_object_with_the_members_of_a_world_is_one() -> None:
    model = DynamicExpectancyModel(Row.action_costs, rng=np.random.default_rng(0))
    *_, last = islice(play(model, Row(), goal=["at:4"]), 20)
    assert last == Episode(steps=4, reward=0.0, reached=1)


def test_who_watches_is_told_of_every_cycle() -> None:
    """Two places are new in the first two cycles; who knows the way is guided along it."""
    ticks = iter(range(1000))
    told: list[CycleMetrics] = []
    model = DynamicExpectancyModel(Row.action_costs, rng=np.random.default_rng(0))
    episodes = islice(
        play(model, Row(), goal=["at:4"], watch=told.append, clock=lambda: float(next(ticks))), 20
    )
    steps = [episode.steps for episode in episodes]
    assert [one.cycle for one in told] == list(range(1, sum(steps) + 21))
    assert {one.episode for one in told} == set(range(1, 21))
    first, *_, last = told
    assert (first.tokens, first.surprise, first.created, first.hypotheses) == (("at:0",), 1, 0, 0)
    assert (last.tokens, last.surprise, last.signs) == (("at:4",), 0, 5)
    assert sum(one.created - one.removed for one in told) == model.hypothesis_count
    assert last.mean_cm == model.mean_cm
    *_, third, _, _ = told
    assert (third.action, third.is_guided, third.seconds) == ("right", True, 1.0)
    assert third.value is not None


def test_without_a_clock_no_time_is_told() -> None:
    told: list[CycleMetrics] = []
    model = DynamicExpectancyModel(Row.action_costs, rng=np.random.default_rng(0))
    next(play(model, Row(), goal=["at:4"], watch=told.append))
    assert {one.seconds for one in told} == {None}


def test_the_laboratory_imports_no_library_of_an_extra_before_it_is_needed() -> None:
    script = """
import sys
from farside.dem import lab
for name in lab.__all__:
    getattr(lab, name)
sys.exit(bool({"gymnasium", "pandas", "plotly", "polars", "pyarrow"} & sys.modules.keys()))
"""
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0  # noqa: S603
