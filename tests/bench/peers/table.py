"""The Dynamic Expectancy Model and its peers: `python tests/bench/peers/table.py [SEEDS]`.

Prints one table of means and standard deviations, by default over 30 seeds. Every learner has one
set of parameters for all tasks, except the peers on the two mazes that change: there they have
those of their published figures.
"""

import sys
from collections.abc import Callable
from multiprocessing import Pool
from typing import Any

import numpy as np
from baselines import DynaQ, DynaQPlus, PrioritizedSweeping, QLearning
from dem_player import DemPlayer
from mazes import Player, blocking_maze, dyna_maze, new_goal, shortcut_maze
from msgspec.structs import replace
from numpy.random import Generator
from rich.console import Console
from rich.progress import track
from rich.table import Table

from farside.dem import Curiosity, Exploration, Parameters, Values

PROCESSES = 2
EPSILON = 0.1
LEARNING = Parameters(initial_cm=0.75)
CURIOUS = replace(
    LEARNING,
    exploration=Exploration.CURIOUS,
    curiosity=Curiosity(optimistic_cost=10.0, restlessness=2e4),
)

# By heading: the task, the name of the peers' parameters, the target.
TASKS: dict[str, tuple[Callable[[Player, int], int], str, str]] = {
    "Dyna maze\nsteps": (lambda player, _: dyna_maze(player), "still", "850 or fewer"),
    "blocking\nreward": (lambda player, _: blocking_maze(player), "blocking", "208 or more"),
    "shortcut\nreward": (lambda player, _: shortcut_maze(player), "shortcut", "445 or more"),
    "new goal\nextra steps": (new_goal, "still", "0"),
}
DYNA: dict[str, Any] = {
    "still": {"planning": 50},
    "blocking": {"planning": 10, "alpha": 1.0},
    "shortcut": {"planning": 50, "alpha": 1.0},
}
KAPPA = {"still": 1e-4, "blocking": 1e-4, "shortcut": 1e-3}
PLAYERS: dict[str, Callable[[Generator, str], Player]] = {
    "Q-learning": lambda rng, _: QLearning(rng),
    "Dyna-Q": lambda rng, maze: DynaQ(rng, **DYNA[maze]),
    "Dyna-Q+": lambda rng, maze: DynaQPlus(rng, **DYNA[maze], kappa=KAPPA[maze]),
    "prioritized sweeping": lambda rng, _: PrioritizedSweeping(rng, planning=5),
    "DEM, random": lambda rng, _: DemPlayer(rng, LEARNING),
    "DEM, ε .1": lambda rng, _: DemPlayer(rng, LEARNING, epsilon=EPSILON),
    "DEM, curious": lambda rng, _: DemPlayer(rng, CURIOUS),
    "DEM, curious, expected": lambda rng, _: DemPlayer(
        rng, replace(CURIOUS, values=Values.EXPECTED)
    ),
}


def play(job: tuple[str, str, int]) -> tuple[str, str, int]:
    """Let a player do a task with a seed; returns the two names and the score."""
    player, task, seed = job
    score, maze, _ = TASKS[task]
    return player, task, score(PLAYERS[player](np.random.default_rng(seed), maze), seed)


def main() -> None:
    """Run everything, and print the table."""
    seeds = int(sys.argv[1]) if sys.argv[1:] else 30
    jobs = [(player, task, seed) for seed in range(seeds) for player in PLAYERS for task in TASKS]
    scores: dict[tuple[str, str], list[int]] = {}
    console = Console()
    with Pool(PROCESSES) as pool:
        played = pool.imap_unordered(play, jobs)
        for player, task, score in track(played, "playing", len(jobs), console=console):
            scores.setdefault((player, task), []).append(score)
    table = Table("player", title=f"{seeds} seeds: mean ± standard deviation")
    for task in TASKS:
        table.add_column(task, justify="right", no_wrap=True)
    for player in PLAYERS:
        table.add_row(player, *(_summary(scores[player, task]) for task in TASKS))
    table.add_section()
    table.add_row("target, DEM curious", *(line for _, _, line in TASKS.values()))
    console.print(table)


def _summary(scores: list[int]) -> str:
    return f"{np.mean(scores):,.1f} ± {np.std(scores):,.1f}"


if __name__ == "__main__":
    main()
