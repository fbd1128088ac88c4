"""The model in gymnasium worlds, compared with tabular Q-learning at the same number of steps.

`python tests/bench/gym_table.py [SEEDS [PART OF A WORLD'S NAME [PART OF A LEARNER'S NAME]]]` prints
one table. The default of 6 seeds takes about 15 minutes on one processor; 30 seeds of what the ice
is about are `gym_table.py 30 slippery expected`. Requires the extra `gymnasium`, and minigrid for
the room. Q-learning has α .1, γ .99, ε .1 while it learns and ε 0 while it is evaluated; it starts
with zeros and breaks ties at random. It receives every reward, while the model only senses that a
reward was above 0. On the cliff no reward is, so there the model is given a Token as its goal.
"""

import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from itertools import islice
from statistics import mean, median
from typing import Any, NamedTuple

import gymnasium
import minigrid
import msgspec
import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from farside.dem import Curiosity, DynamicExpectancyModel, Exploration, Parameters, Values
from farside.dem.lab import FAILED, REWARDED, Episode, GymWorld, play

EVALUATED = 100
"""Number of episodes after the budget, in which the success rate is measured."""

Tokens = Callable[[Any], list[str]]
Learner = tuple[Iterator[Episode], Callable[[], None]]  # the second makes it stop exploring


class World(NamedTuple):
    """An environment, the Tokens sensed in it, and the number of steps to learn it."""

    name: str
    env: Callable[[], gymnasium.Env[Any, Any]]
    tokens: Tokens
    budget: int
    goal: str = REWARDED
    floor: float = 0.0  # an episode succeeds if it ends with a reward above this
    # Of the models with expected values: what an end without a reward costs, and how improbable a
    # run of luck must be to be taken for a change of the world; here the odds never change. To know
    # odds takes many tries, and so the curious one tries again sooner.
    aversion: float = 0.0
    improbable: float = Parameters().improbable
    restlessness: float = Curiosity().restlessness


class Result(NamedTuple):
    """The result of one learner with one seed; `first` and `effort` are None without a success."""

    first: int | None
    rate: float
    effort: float | None


def state(observation: Any) -> list[str]:
    """One Token for each state."""
    return [f"state:{observation}"]


def taxi_parts(observation: int) -> list[str]:
    """Place, passenger and destination as separate Tokens."""
    rest, destination = divmod(int(observation), 4)
    place, passenger = divmod(rest, 5)
    return [f"at:{place // 5},{place % 5}", f"passenger:{passenger}", f"to:{destination}"]


def room_state(observation: dict[str, Any]) -> list[str]:
    """Position and direction of the agent of a MiniGrid, as one Token."""
    (east,), (south,) = np.nonzero(observation["image"][:, :, 0] == 10)
    return [f"at:{east},{south},{observation['direction']}"]


def room() -> gymnasium.Env[Any, Any]:
    """An empty room of 6 × 6 places, fully observed."""
    return minigrid.wrappers.FullyObsWrapper(gymnasium.make("MiniGrid-Empty-8x8-v0"))  # type: ignore[no-untyped-call]


WORLDS = (
    World("FrozenLake", lambda: gymnasium.make("FrozenLake-v1", is_slippery=False), state, 5_000),
    World(
        "FrozenLake, slippery",
        lambda: gymnasium.make("FrozenLake-v1"),
        state,
        20_000,
        aversion=100.0,
        improbable=1e-5,
        restlessness=1_000.0,
    ),
    World(
        "CliffWalking",
        lambda: gymnasium.make("CliffWalking-v1", max_episode_steps=200),
        state,
        10_000,
        goal="state:47",
        floor=-50.0,
    ),
    World("Taxi", lambda: gymnasium.make("Taxi-v4"), state, 10_000),
    World("Taxi, in parts", lambda: gymnasium.make("Taxi-v4"), taxi_parts, 10_000),
    World("MiniGrid room", room, room_state, 10_000),
)


def model_play(world: World, seed: int, parameters: Parameters) -> Iterator[Episode]:
    """The episodes of a model, which continues to learn while it is evaluated."""
    played = GymWorld(world.env(), world.tokens)
    rng = np.random.default_rng(seed)
    model = DynamicExpectancyModel(played.action_costs, parameters, rng=rng)
    return play(model, played, goal=[world.goal], seed=seed)


def expected_play(world: World, seed: int, exploration: Exploration) -> Learner:
    """The same with expected values and an aversion to failure, without curiosity in the end."""
    played = GymWorld(world.env(), world.tokens, tells_failure=world.aversion > 0.0)
    parameters = Parameters(
        values=Values.EXPECTED,
        exploration=exploration,
        improbable=world.improbable,
        curiosity=Curiosity(restlessness=world.restlessness),
    )
    rng = np.random.default_rng(seed)
    model = DynamicExpectancyModel(played.action_costs, parameters, rng=rng)
    if world.aversion:
        model.avert([FAILED], world.aversion)
    judged = msgspec.structs.replace(parameters, exploration=Exploration.RANDOM)
    return play(model, played, goal=[world.goal], seed=seed), lambda: model.change(judged)


class QLearner:
    """Tabular Q-learning."""

    def __init__(self, world: World, seed: int) -> None:
        self._world = world
        self._env = world.env()
        self._seed = seed
        self._rng = np.random.default_rng(seed)
        actions = len(GymWorld(self._env, world.tokens).action_costs)
        self._q: dict[str, Any] = defaultdict(lambda: np.zeros(actions))
        self._epsilon = 0.1

    def stop_exploring(self) -> None:
        """Stop exploring."""
        self._epsilon = 0.0

    def play(self) -> Iterator[Episode]:
        """Episode after episode."""
        seed: int | None = self._seed
        while True:
            observation, _ = self._env.reset(seed=seed)
            seed = None
            at, steps, total, over = self._key(observation), 0, 0.0, False
            terminated, reward = False, 0.0
            while not over:
                action = self._choose(self._q[at])
                observation, paid, terminated, truncated, _ = self._env.step(action)
                reward = float(paid)
                before, at = at, self._key(observation)
                best = 0.0 if terminated else self._q[at].max()
                self._q[before][action] += 0.1 * (reward + 0.99 * best - self._q[before][action])
                steps, total, over = steps + 1, total + reward, terminated or truncated
            yield Episode(steps, total, int(terminated and reward > self._world.floor))

    def _key(self, observation: Any) -> str:
        return " ".join(self._world.tokens(observation))

    def _choose(self, values: Any) -> int:
        if self._rng.random() < self._epsilon:
            return int(self._rng.integers(len(values)))
        return int(self._rng.choice(np.flatnonzero(values == values.max())))


def evaluate(world: World, learner: str, seed: int) -> Result:
    """Let a learner use up its budget, then count its successes."""
    episodes, stop_exploring = LEARNERS[learner](world, seed)
    steps, first = 0, None
    while steps < world.budget:
        episode = next(episodes)
        steps += episode.steps
        if episode.reached and first is None:
            first = steps
    stop_exploring()
    evaluated = list(islice(episodes, EVALUATED))
    successes = sum(episode.reached > 0 for episode in evaluated)
    effort = sum(episode.steps for episode in evaluated) / successes if successes else None
    return Result(first, successes / EVALUATED, effort)


def _random(world: World, seed: int) -> Learner:
    return model_play(world, seed, Parameters()), lambda: None


def _curious(world: World, seed: int) -> Learner:
    return model_play(world, seed, Parameters(exploration=Exploration.CURIOUS)), lambda: None


def _expected(world: World, seed: int) -> Learner:
    return expected_play(world, seed, Exploration.RANDOM)


def _curious_expected(world: World, seed: int) -> Learner:
    return expected_play(world, seed, Exploration.CURIOUS)


def _q_learning(world: World, seed: int) -> Learner:
    learner = QLearner(world, seed)
    return learner.play(), learner.stop_exploring


LEARNERS = {
    "DEM, random exploration": _random,
    "DEM, curious": _curious,
    "DEM, expected values": _expected,
    "DEM, curious, expected values": _curious_expected,
    "Q-learning": _q_learning,
}


def row(results: list[Result]) -> list[str]:
    """The cells of a learner in a world."""
    firsts = [result.first for result in results if result.first is not None]
    efforts = [result.effort for result in results if result.effort is not None]
    rates = [result.rate for result in results]
    return [
        f"{median(firsts):,.0f}" if firsts else "-",
        f"{len(firsts)}/{len(results)}",
        f"{mean(rates):.0%} ({min(rates):.0%} to {max(rates):.0%})",
        f"{median(efforts):,.1f}" if efforts else "-",
    ]


def main(seeds: int, only: str = "", learners: str = "") -> None:
    """Measure in one process for each processor, and print the table."""
    console = Console()
    table = Table(
        "world", "budget, steps", "learner", "first success, steps", "seeds with one",
        f"success rate, {EVALUATED} episodes after", "steps per success then",
    )  # fmt: skip
    jobs = [
        (world, learner, seed)
        for world in range(len(WORLDS))
        for learner in LEARNERS
        for seed in range(seeds)
        if only in WORLDS[world].name and learners in learner
    ]
    results = defaultdict(list)
    with ProcessPoolExecutor() as pool:
        evaluated = pool.map(_job, jobs)
        for job, result in zip(
            jobs, track(evaluated, total=len(jobs), console=console), strict=True
        ):
            results[job[:2]].append(result)
    for (world, learner), found in results.items():
        name, budget = WORLDS[world].name, f"{WORLDS[world].budget:,}"
        table.add_row(name, budget, learner, *row(found))
    console.print(table)


def _job(job: tuple[int, str, int]) -> Result:
    world, learner, seed = job
    return evaluate(WORLDS[world], learner, seed)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 6, *sys.argv[2:])
