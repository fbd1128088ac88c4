"""Worlds that need credit, situations, differentiation and removal, over many seeds."""

import statistics
import sys
import time
from collections.abc import Callable, Sequence
from multiprocessing import Pool
from typing import NamedTuple

import numpy as np
from animats import MAZE4, WOODS1, Animat, Judged, judge, new_animat_model, train
from rich.console import Console
from rich.progress import track
from rich.table import Table
from worlds import Trial, aliased_trial, phantom_trial, removal_curve

from farside.dem import DynamicExpectancyModel, Exploration, Parameters

BARE = Parameters(removal=False, differentiation=False, situations=False)
CASES: dict[str, tuple[Callable[..., tuple[object, Trial]], Parameters]] = {
    "81 places, two Tokens sensed everywhere": (phantom_trial, Parameters()),
    "the same, credit alone": (phantom_trial, BARE),
    "the same, the seed's costs": (
        phantom_trial,
        Parameters(removal=False, differentiation=False, situations=False, own_credit=False),
    ),
    "aliased: place and heading separate": (aliased_trial, Parameters()),
    "the same, differentiation alone": (aliased_trial, Parameters(situations=False)),
    "the same, neither": (aliased_trial, Parameters(differentiation=False, situations=False)),
}
LINES = {
    "81 places, two Tokens sensed everywhere": "1.05",
    "aliased: place and heading separate": "1.15",
}


def ratio(case: tuple[str, int]) -> float:
    """Steps over the fewest possible, in one case with one seed."""
    trial, parameters = CASES[case[0]]
    return trial(case[1], parameters)[1].ratio


def table(seeds: Sequence[int]) -> Table:
    """Measure all cases with all seeds."""
    found = Table("path length / shortest", "mean", "greatest", "target")
    with Pool(2) as pool:
        for name in track(CASES, "walking"):
            ratios = pool.map(ratio, [(name, seed) for seed in seeds], chunksize=1)
            figures = (f"{statistics.mean(ratios):.3f}", f"{max(ratios):.2f}")
            found.add_row(name, *figures, LINES.get(name, ""))
    return found


class Maze(NamedTuple):
    """A maze, and how a model learns it: in random steps, or in its own."""

    name: str
    drawing: str
    steps: int
    exploration: Exploration


MAZES = [
    Maze(name, drawing, steps, exploration)
    for name, drawing in (("Maze4", MAZE4), ("Woods1", WOODS1))
    for steps, exploration in ((3000, Exploration.RANDOM), (1000, Exploration.CURIOUS))
]


def learn_maze(case: tuple[Maze, int]) -> tuple[Judged, float]:
    """How a model does after training, and the CPU time of a cycle of that in ms."""
    (_, drawing, steps, exploration), seed = case
    maze, rng = Animat(drawing), np.random.default_rng(seed)
    model = new_animat_model(Parameters(exploration=exploration), seed + 1000)
    began = time.process_time()
    train(model, maze, steps, rng, own_choice=exploration is Exploration.CURIOUS)
    cycle_ms = 1e3 * (time.process_time() - began) / steps
    return judge(model, maze, rng), cycle_ms


def mazes(seeds: Sequence[int]) -> Table:
    """Mazes sensed as eight Tokens: steps to food, length of the lists, time of a cycle."""
    found = Table(
        *("maze, steps of training", "steps to food", "over fewest (1.1)", "greatest"),
        *("hypotheses (5,000)", "ms a cycle (1)"),
    )
    with Pool(2) as pool:
        for maze in track(MAZES, "in mazes"):
            learned = pool.map(learn_maze, [(maze, seed) for seed in seeds], chunksize=1)
            ratios = [judged.ratio for judged, _ in learned]
            found.add_row(
                f"{maze.name}, {maze.steps:,} {maze.exploration}",
                f"{statistics.mean(judged.steps for judged, _ in learned):.2f}",
                f"{statistics.mean(ratios):.3f}",
                f"{max(ratios):.2f}",
                f"{statistics.mean(judged.hypotheses for judged, _ in learned):,.0f}",
                f"{statistics.median(cycle_ms for _, cycle_ms in learned):.2f}",
            )
    return found


def removal_s(arcs: int, delay: int) -> float:
    """CPU time of the cycle in which so many hypotheses fail and are removed.

    As many predictions of theirs are open for each of the cycles in reach.
    """
    parameters = Parameters(reach=delay, maturity=3, ineffective=0.4)
    model = DynamicExpectancyModel({"do": 1.0}, parameters, rng=np.random.default_rng(0))
    for action in ["do", *[None] * (delay - 1)]:
        model.sense(["hub"])
        model.perform(action)
    model.sense([f"spoke:{number}" for number in range(arcs)])
    model.perform(None)
    while True:
        began = time.process_time()
        removed = model.sense(["hub"]).removed
        took = time.process_time() - began
        model.perform("do")
        if removed >= arcs:
            return took


def removals() -> Table:
    """Whether removal takes time in proportion to what is removed, at any reach."""
    found = Table("hypotheses failing together", "reach 1 (ms)", "reach 3 (ms)", "ratio (1.5)")
    for arcs in (5_000, 20_000):
        near, far = (
            statistics.median(removal_s(arcs, delay) for _ in range(3)) for delay in (1, 3)
        )
        found.add_row(f"{arcs:,}", f"{1e3 * near:.0f}", f"{1e3 * far:.0f}", f"{far / near:.2f}")
    return found


def curve() -> Table:
    """The growth of the lists in a noisy world."""
    found = Table("cycle, in a yard with noise", "Signs", "hypotheses", "")
    lengths = removal_curve(Parameters(), cycles=40_000, every=4_000)[-1]
    most = max(length.hypotheses for length in lengths)
    for length in lengths:
        bar = "█" * round(40 * length.hypotheses / most)
        found.add_row(f"{length.cycle:,}", f"{length.signs}", f"{length.hypotheses:,}", bar)
    return found


def main(seeds: int = 30) -> None:
    """Print all tables."""
    console = Console(width=120)
    console.print(mazes(range(seeds)))
    console.print(table(range(seeds)))
    console.print(curve())
    console.print(removals())


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
