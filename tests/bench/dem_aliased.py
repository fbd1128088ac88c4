"""Mazes where cells look alike, with longer traces, and with a memory Token.

The arguments are the number of seeds, and `long` for the row that takes longer than all others.
"""

import sys
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from statistics import mean
from typing import NamedTuple

import numpy as np
from animats import ALIASED, FOOD, PATIENCE, SIDES, Animat
from rich.console import Console
from rich.progress import track
from rich.table import Table

from farside.dem import DynamicExpectancyModel, Parameters
from farside.dem.lab import Situation, memory, play, train_then_judge

BUDGETS = ((3_000, True), (20_000, True), (3_000, False))
"""Random steps, and whether the view is one Token."""

LONG = (20_000, False)
"""The same, if asked for: it takes longer than all of the others."""

LEARNERS = ((1, 0), (3, 0), (1, 1))
"""Reach and memory."""

SEEDS = 2
NOWHERE = ("nowhere",)
"""A goal that cannot be, so that steps are random."""


class AliasedMaze:
    """A maze as a world; episodes begin at free cells drawn at random, or at each in turn.

    Args:
        drawing: the maze.
        in_turn: whether every free cell is to be a beginning, one after the other, and whether an
            episode ends after `PATIENCE` steps.
        as_one: whether the view is one Token, instead of eight.
    """

    action_costs = dict.fromkeys(SIDES, 1.0)

    def __init__(self, drawing: str, *, in_turn: bool, as_one: bool) -> None:
        self.maze = Animat(drawing)
        self._rng = np.random.default_rng(0)
        self._in_turn, self._as_one = in_turn, as_one
        self._begun = self._steps = 0

    def begin(self, seed: int | None) -> Situation:
        """Begin an episode."""
        if seed is not None:
            self._rng = np.random.default_rng(seed)
        self.maze.begin(self._rng)
        if self._in_turn:
            self.maze.state = self.maze.free[self._begun % len(self.maze.free)]
            self._begun += 1
        self._steps = 0
        return self._situation()

    def act(self, action: str) -> Situation:
        """Take a step."""
        self.maze.do(action)
        self._steps += 1
        return self._situation()

    def _situation(self) -> Situation:
        tokens: Iterable[str] = sorted(self.maze.tokens() - set(FOOD))
        if self._as_one:
            tokens = [" ".join(tokens)]
        is_late = self._in_turn and self._steps >= PATIENCE
        found = FOOD if self.maze.has_food else ()
        return Situation([*tokens, *found], terminated=self.maze.has_food, truncated=is_late)


class Case(NamedTuple):
    """What is compared in a maze."""

    maze: str
    as_one: bool
    reach: int
    memory: int
    steps: int


def ratio(case: Case, seed: int) -> float:
    """Steps to food from every free cell over the fewest, after random steps."""

    def world(*, in_turn: bool) -> AliasedMaze:
        return AliasedMaze(ALIASED[case.maze], in_turn=in_turn, as_one=case.as_one)

    parameters = Parameters(reach=case.reach)
    rng = np.random.default_rng([seed, 1])
    model = DynamicExpectancyModel(AliasedMaze.action_costs, parameters, rng=rng)
    walked = 0
    for episode in play(model, memory(world(in_turn=False), case.memory), goal=NOWHERE, seed=seed):
        walked += episode.steps
        if walked >= case.steps:
            break
    model.withdraw_goal(NOWHERE)
    judged = world(in_turn=True)
    found = train_then_judge(
        model,
        memory(judged, case.memory),
        episodes=0,
        judged=len(judged.maze.free),
        goal=FOOD,
        progress=False,
    )
    (only,) = found.seeds
    return mean(episode.steps for episode in only.episodes) / judged.maze.optimum()


def _job(job: tuple[Case, int]) -> float:
    return ratio(*job)


def main(seeds: int = SEEDS, long: str = "") -> None:
    """Measure in one process for each processor, and print the table."""
    console = Console()
    budgets = (*BUDGETS, LONG) if long else BUDGETS
    rows = list(product(budgets, LEARNERS))
    jobs = [
        (Case(maze, as_one, reach, steps_back, steps), seed)
        for (steps, as_one), (reach, steps_back) in rows
        for maze in ALIASED
        for seed in range(seeds)
    ]
    with ProcessPoolExecutor() as pool:
        found = list(track(pool.map(_job, jobs), total=len(jobs), console=console))
    table = Table("steps to food / fewest", "view", "reach", "memory", *ALIASED, "mean")
    ratios = iter(found)
    for (steps, as_one), (reach, steps_back) in rows:
        means = [mean(next(ratios) for _ in range(seeds)) for _ in ALIASED]
        table.add_row(
            f"after {steps:,} random steps",
            "one Token" if as_one else "eight Tokens",
            str(reach),
            "yes" if steps_back else "",
            *(f"{value:.2f}" for value in (*means, mean(means))),
        )
    console.print(table)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS, *sys.argv[2:])
