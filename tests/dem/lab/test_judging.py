"""Train, then judge: what counts, how sure the result is, and what the model may do meanwhile."""

import math
from collections.abc import Callable
from io import StringIO
from typing import ClassVar

import gymnasium
import numpy as np
import pytest
from rich.console import Console

from farside.dem import DynamicExpectancyModel, Exploration, Parameters
from farside.dem.lab import (
    CycleMetrics,
    Estimate,
    GymWorld,
    Judgement,
    Situation,
    judging,
    still,
    train_then_judge,
)

NOT_EXPLORING = Parameters(exploration=Exploration.NONE)


class Coin:
    """One toss an episode, which `toss` wins with probability .7; `pass` ends without a result."""

    action_costs: ClassVar[dict[str, float]] = {"pass": 1.0, "toss": 1.0}

    def begin(self, seed: int | None) -> Situation:
        if seed is not None:
            self.luck = np.random.default_rng(seed)
        return Situation(["table"])

    def act(self, action: str) -> Situation:
        won = action == "toss" and self.luck.random() < 0.7
        return Situation(["won" if won else "over"], reward=2.0 * won, terminated=True)


def made(seed: int, **parameters: object) -> DynamicExpectancyModel:
    rng = np.random.default_rng(seed)
    return DynamicExpectancyModel(Coin.action_costs, Parameters(**parameters), rng=rng)  # type: ignore[arg-type]


def tossing(seeds: int, judged: int = 40) -> Judgement:
    return train_then_judge(
        made,
        Coin(),
        episodes=30,
        judge_by=NOT_EXPLORING,
        judged=judged,
        seeds=range(seeds),
        goal=["won"],
    )


def test_the_lake_is_crossed_by_what_was_learned_with_curiosity() -> None:
    world = GymWorld(gymnasium.make("FrozenLake-v1", is_slippery=False), lambda at: [f"at:{at}"])

    def curious(seed: int) -> DynamicExpectancyModel:
        parameters = Parameters(exploration=Exploration.CURIOUS)
        rng = np.random.default_rng(seed)
        return DynamicExpectancyModel(world.action_costs, parameters, rng=rng)

    found = train_then_judge(
        curious, world, steps=400, judge_by=NOT_EXPLORING, judged=5, seeds=range(2)
    )
    assert found.success_rate.mean == 1.0
    assert found.steps == Estimate(6.0, 6.0, 6.0, 2)
    assert found.reward.mean == 1.0
    for one in found.seeds:
        assert 400 <= one.trained_steps < 500
        assert 0 < one.first_reached < 400
        assert {episode.steps for episode in one.episodes} == {6}


def wilson(rate: float, trials: int, bound: float) -> bool:
    """Whether the rate is just as far from a bound as 95 % allow: 1.96 deviations of the bound."""
    return abs(rate - bound) == pytest.approx(1.959964 * math.sqrt(bound * (1 - bound) / trials))


def test_the_interval_is_students_over_seeds_and_not_narrower_than_wilsons() -> None:
    found = tossing(seeds=8)
    rates = [seed.success_rate for seed in found.seeds]
    half = 2.364624 * float(np.std(rates, ddof=1)) / math.sqrt(8)  # of seven degrees of freedom
    rate, reward = found.success_rate, found.reward
    assert rate.mean == pytest.approx(float(np.mean(rates)))
    assert rate.samples == 8
    assert (reward.low, reward.high) == pytest.approx(
        (2 * (rate.mean - half), 2 * (rate.mean + half))
    )
    for bound, students in ((rate.low, rate.mean - half), (rate.high, rate.mean + half)):
        assert bound == pytest.approx(students) or wilson(rate.mean, 320, bound)
        assert abs(bound - rate.mean) >= half - 1e-9


def test_a_single_seed_is_judged_by_its_episodes() -> None:
    found = tossing(seeds=1)
    won = sum(episode.reached for episode in found.seeds[0].episodes)
    rate = found.success_rate
    assert wilson(won / 40, 40, rate.low)
    assert wilson(won / 40, 40, rate.high)
    assert (found.steps.samples, found.reward.samples) == (won, 40)
    assert str(found).startswith(f"{won / 40:.1%} (")


def test_where_every_seed_always_succeeds_the_interval_has_a_width() -> None:
    found = train_then_judge(
        made, Coin(), episodes=5, judged=1, seeds=range(10), goal=["table"], progress=False
    )
    assert found.success_rate.mean == found.success_rate.high == 1.0
    assert wilson(1.0, 10, found.success_rate.low)


def test_one_success_says_nothing_of_how_sure_it_is() -> None:
    found = train_then_judge(made, Coin(), episodes=30, judged=1, goal=["won"])
    assert (found.reward.low, found.reward.high) == (-math.inf, math.inf)
    assert 0.0 <= found.success_rate.low < found.success_rate.high <= 1.0


def test_who_knows_nothing_to_do_has_failed() -> None:
    found = train_then_judge(
        made, Coin(), episodes=0, judge_by=NOT_EXPLORING, judged=5, goal=["won"]
    )
    assert found.success_rate.mean == 0.0
    assert found.steps is None
    assert all(episode.is_stuck for episode in found.seeds[0].episodes)


class Endless:
    """Three places in a ring, without an end; a walk is broken off after 30 steps."""

    action_costs: ClassVar[dict[str, float]] = {"on": 1.0}

    def begin(self, seed: int | None) -> Situation:  # noqa: ARG002 - as a world has it
        self.steps = 0
        return Situation(["at:0"])

    def act(self, action: str) -> Situation:  # noqa: ARG002
        self.steps += 1
        return Situation([f"at:{self.steps % 3}"], truncated=self.steps == 30)


def test_an_episode_is_judged_until_the_goal_is_reached() -> None:
    model = DynamicExpectancyModel(Endless.action_costs, rng=np.random.default_rng(0))
    found = train_then_judge(model, Endless(), episodes=2, judged=3, goal=["at:2"])
    assert found.seeds[0].trained_steps == found.seeds[0].first_reached * 2 == 60
    assert [(one.steps, one.reached) for one in found.seeds[0].episodes] == [(2, 1)] * 3


def test_what_is_still_learns_nothing_while_it_is_judged() -> None:
    model = made(0)
    train_then_judge(model, Coin(), episodes=30, judged=1, goal=["won"])
    before = [(one.cm, one.credit) for one in model.hypotheses]
    train_then_judge(
        model, Coin(), episodes=0, judge_by=still(Parameters()), judged=50, goal=["won"]
    )
    assert [(one.cm, one.credit) for one in model.hypotheses] == before


def test_the_same_seeds_are_judged_alike_and_every_cycle_is_told() -> None:
    def judged() -> tuple[Judgement, list[CycleMetrics]]:
        told: list[CycleMetrics] = []
        found = train_then_judge(
            made, Coin(), episodes=5, judged=5, seeds=[3, 4], goal=["won"], watch=told.append
        )
        return found, told

    assert judged() == judged()
    _, told = judged()
    assert [one.episode for one in told] == [1 + cycle // 2 for cycle in range(20)] * 2


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({}, "expected either steps or episodes"),
        ({"steps": 1, "episodes": 1}, "expected either steps or episodes"),
        ({"steps": -1}, "expected training of 0 or more, found -1"),
        ({"steps": 1, "judged": 0}, "expected 1 episode or more, found 0"),
        ({"steps": 1, "seeds": []}, "expected one or more, found none"),
    ],
)
def test_what_cannot_be_judged_is_refused(wrong: dict[str, int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        train_then_judge(made, Coin(), goal=["won"], **wrong)  # type: ignore[arg-type]


def test_one_model_has_one_seed() -> None:
    with pytest.raises(ValueError, match="there are 2 seeds, found a single model"):
        train_then_judge(made(0), Coin(), steps=1, seeds=[0, 1])


def test_steps_are_not_waited_for_where_nobody_takes_any() -> None:
    idle: Callable[[int], DynamicExpectancyModel] = lambda seed: made(seed, exploration="none")  # noqa: E731
    with pytest.raises(ValueError, match="expected a model that explores while it is trained"):
        train_then_judge(idle, Coin(), steps=10, goal=["won"])


def test_progress_is_shown_only_of_what_takes_longer_than_two_seconds() -> None:
    now = [0.0]
    console = Console(file=StringIO(), force_terminal=True)
    bar = judging._Patient(console=console, get_time=lambda: now[0], auto_refresh=False)
    bar.add_task("training")
    now[0] = 1.9
    assert not list(bar.get_renderables())
    now[0] = 2.1
    assert list(bar.get_renderables())
