"""The seed's claims, measured: `python tests/bench/dem_claims.py [SEEDS]`.

The yard is that of the mission `blackout`: 74 places, and 186 ways from a place to the next, its
arcs. Means come with 95 % intervals by percentile bootstrap over the seeds, shares with 95 %
intervals after Wilson. The default of 30 seeds takes about 1 minute on two processors.
"""

import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from multiprocessing import Pool
from statistics import median

import numpy as np
from intervals import mean_told, share_told
from random_walks import times_sensed
from rich.console import Console
from rich.progress import track
from rich.table import Table

from farside.dem import DynamicExpectancyModel, Exploration, Parameters
from farside.missions.figure1.example import CYCLES, YARD
from farside.missions.loading import load_mission
from farside.places import ACTIONS, Cell, Chart

PROCESSES = 2
WALKS = 10_000
ROUTES = 20
"""Number of ways that a model is led once, for each seed."""

SWITCHES = 40
"""Number of times that the goal changes, for each seed."""

Arc = tuple[Cell, str, Cell]


def yard() -> Chart:
    """The yard of `blackout`."""
    return load_mission("blackout").mission.world.chart()


def new_model(seed: int, exploration: Exploration) -> DynamicExpectancyModel:
    """A model for a yard."""
    rng = np.random.default_rng(seed)
    return DynamicExpectancyModel(
        dict.fromkeys(ACTIONS, 1.0), Parameters(exploration=exploration), rng=rng
    )


def beside(chart: Chart, cell: Cell, action: str) -> Cell:
    """Where a move ends: at the same place, if a wall or a rock is there."""
    after = cell.beside(action)
    return after if after in chart.tokens else cell


def arcs_of(chart: Chart) -> set[Arc]:
    """Every way from a place to the next."""
    return {
        (cell, action, after) for cell in chart.tokens for action, after in chart.neighbours(cell)
    }


def distances(chart: Chart, cell: Cell) -> dict[Cell, int]:
    """The fewest moves from a place to every other, and so from every other to it."""
    steps, frontier = {cell: 0}, [cell]
    for at in frontier:
        for _, after in chart.neighbours(at):
            if after not in steps:
                steps[after] = steps[at] + 1
                frontier.append(after)
    return steps


def tour(chart: Chart, rng: np.random.Generator) -> Iterator[str]:
    """The moves of an operator who goes to the nearest arc not yet gone, again and again."""
    left, cell = sorted(arcs_of(chart)), chart.places["D"]
    while left:
        far = distances(chart, cell)
        least = min(far[arc[0]] for arc in left)
        nearest = [arc for arc in left if far[arc[0]] == least]
        start, action, after = nearest[rng.integers(len(nearest))]
        yield from [*chart.way(cell, start), action]
        left.remove((start, action, after))
        cell = after


def lead(model: DynamicExpectancyModel, chart: Chart, start: Cell, moves: Sequence[str]) -> None:
    """Let the model watch some moves."""
    cell = start
    for move in moves:
        model.sense([chart.tokens[cell]])
        model.perform(move)
        cell = beside(chart, cell, move)
    model.sense([chart.tokens[cell]])
    model.perform(None)


def taught(chart: Chart, seed: int) -> DynamicExpectancyModel:
    """A model that was led over every arc, most of them once."""
    model = new_model(seed, Exploration.NONE)
    lead(model, chart, chart.places["D"], list(tour(chart, np.random.default_rng(seed))))
    return model


def explored(way: str, seed: int) -> int:
    """The number of actions until a model knows every arc of the yard."""
    chart, rng = yard(), np.random.default_rng(seed)
    model = new_model(seed + 1000, Exploration.CURIOUS if way == "curious" else Exploration.NONE)
    led = tour(chart, rng)
    left, cell, actions = arcs_of(chart), chart.places["D"], 0
    model.sense([chart.tokens[cell]])
    while left:
        match way:
            case "guided":
                action = next(led)
            case "curious":
                choice = model.choose()
                assert choice is not None, "something is always left to try"
                action = choice.action
            case _:
                action = str(rng.choice(list(ACTIONS)))
        model.perform(action)
        arc = cell, action, beside(chart, cell, action)
        cell, actions = arc[2], actions + 1
        model.sense([chart.tokens[cell]])
        if arc in left and _knows(model, chart, arc):
            left.remove(arc)
    return actions


def _knows(model: DynamicExpectancyModel, chart: Chart, arc: Arc) -> bool:
    start, action, end = arc
    return any(
        (known.context, known.action, known.outcome)
        == ((chart.tokens[start],), action, (chart.tokens[end],))
        for known in model.hypotheses
    )


def one_trial(seed: int) -> tuple[int, int]:
    """Of models that were led once from a place to another, how many then go there as fast."""
    chart, rng = yard(), np.random.default_rng(seed)
    cells = list(chart.tokens)
    held = 0
    for _ in range(ROUTES):
        start, goal = (cells[number] for number in rng.choice(len(cells), 2, replace=False))
        model = new_model(seed, Exploration.NONE)
        way = list(chart.way(start, goal))
        lead(model, chart, start, way)
        held += walked(model, chart, start, goal) == len(way)
    return held, ROUTES


def walked(model: DynamicExpectancyModel, chart: Chart, cell: Cell, goal: Cell) -> int:
    """The number of moves that the model makes to a goal, without exploring."""
    model.set_goal([chart.tokens[goal]], priority=1.0)
    moves = 0
    while True:
        model.sense([chart.tokens[cell]])
        choice = model.choose()
        model.perform(choice.action if choice else None)
        if choice is None:
            return moves if cell == goal else -1
        cell, moves = beside(chart, cell, choice.action), moves + 1


def map_at_once(seed: int) -> tuple[float, float, float]:
    """How much is on the map of a goal as soon as it is set, in per cent, with every goal in turn.

    All values, and those of a shortest way; and the median time for all values of a goal, in ms.
    """
    chart = yard()
    model = taught(chart, seed)
    valued, shortest, times = 0, 0, []
    for goal in chart.tokens:
        began = time.perf_counter()
        model.set_goal([chart.tokens[goal]], priority=1.0)
        values = model.policy_map()
        times.append(1e3 * (time.perf_counter() - began))
        fewest = distances(chart, goal)
        valued += len(values)
        shortest += sum(row.depth == fewest[chart.cells[row.sign[0]]] for row in values)
        model.withdraw_goal([chart.tokens[goal]])
    pairs = len(chart.tokens) ** 2
    return 100 * valued / pairs, 100 * shortest / pairs, median(times)


def switched(seed: int) -> tuple[int, int]:
    """Moves made while the goal changes again and again on the way, and the fewest possible."""
    chart, rng = yard(), np.random.default_rng(seed)
    model, cells = taught(chart, seed), list(chart.tokens)
    cell, made, fewest = chart.places["D"], 0, 0
    for _ in range(SWITCHES):
        goal = cells[rng.integers(len(cells))]
        far = len(chart.way(cell, goal))
        turned = cell
        model.set_goal([chart.tokens[goal]], priority=1.0)
        for _ in range(far // 2):
            model.sense([chart.tokens[turned]])
            choice = model.choose()
            assert choice is not None, "the yard is known"
            model.perform(choice.action)
            turned, made = beside(chart, turned, choice.action), made + 1
        fewest += far - len(chart.way(turned, goal))
        model.withdraw_goal([chart.tokens[goal]])
        cell = turned
    return made, fewest


MEASURES: dict[str, Callable[[int], tuple[float, ...]]] = {
    "guided": lambda seed: (explored("guided", seed),),
    "curious": lambda seed: (explored("curious", seed),),
    "random": lambda seed: (explored("random", seed),),
    "one trial": one_trial,
    "map": map_at_once,
    "switch": switched,
}


def measure(job: tuple[str, int]) -> tuple[float, ...]:
    """One measure with one seed."""
    name, seed = job
    return MEASURES[name](seed)


def sensed_twice(chart: Chart) -> str:
    """The share of seeds with which random actions sense every place at least twice."""
    sensed = times_sensed(chart, CYCLES, WALKS, np.random.default_rng(0))
    return share_told(int((sensed.min(axis=1) > 1).sum()), WALKS)


def rows(found: dict[str, list[tuple[float, ...]]]) -> Iterator[tuple[str, str]]:
    """Each claim, and what was measured."""
    for name in ("guided", "curious", "random"):
        actions = [values[0] for values in found[name]]
        yield f"actions until all arcs are known, {name}", mean_told(actions)
    held, led = (int(sum(values)) for values in zip(*found["one trial"], strict=True))
    yield "led once over a way: takes it by itself", share_told(held, led)
    valued, shortest, times = zip(*found["map"], strict=True)
    yield "a goal is set: places with a value at once, %", mean_told(valued, 1)
    yield "of these, with the value of a shortest way, %", mean_told(shortest, 1)
    yield "time for all values, ms", mean_told(times, 2)
    extra = [100 * (made - fewest) / fewest for made, fewest in found["switch"]]
    yield "the goal changes on the way: moves in vain, %", mean_told(extra, 1)
    for name, chart in (("blackout", yard()), ("figure 1", Chart(YARD, 1.0))):
        yield f"{CYCLES} random actions sense all twice, {name}", sensed_twice(chart)


def main(seeds: int = 30) -> None:
    """Measure everything, and print the table."""
    console = Console()
    jobs = [(name, seed) for name in MEASURES for seed in range(seeds)]
    found: dict[str, list[tuple[float, ...]]] = defaultdict(list)
    with Pool(PROCESSES) as pool:
        measured = pool.imap(measure, jobs)
        for (name, _), values in zip(
            jobs, track(measured, "measuring", len(jobs), console=console), strict=True
        ):
            found[name].append(values)
    table = Table("claim", "measured", title=f"{seeds} seeds: 95 % intervals")
    for row in rows(found):
        table.add_row(*row)
    console.print(table)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
