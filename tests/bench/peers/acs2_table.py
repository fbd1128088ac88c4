"""The model beside ACS2: `python tests/bench/peers/acs2_table.py [SEEDS [LEARNER [FIELD]]]`.

Explore for a number of steps, then judge without exploration, after the papers on ACS2: what share
of the changes is predicted by reliable rules, how long the way to the goal is from every start, how
many rules there are. Prints means with 95 % intervals, by percentile bootstrap over the seeds; the
default of 2 seeds takes about 2 minutes on two processors, 30 seeds half an hour, almost all of it
for ACS2. With parts of names, only those learners and fields are measured.
"""

import sys
from collections import defaultdict
from collections.abc import Callable, Sequence
from multiprocessing import Pool
from statistics import mean
from typing import NamedTuple, Protocol

from acs2 import Acs2Player
from animats import MAZE4, WOODS1
from dem_animat import DemAnimat, Tokens, parts, whole
from fields import Field, FrozenLake, Knowledge, Maze, Transition
from intervals import mean_told
from rich.console import Console
from rich.progress import track
from rich.table import Table

from farside.dem import Exploration, Parameters, Values

PROCESSES = 2
TRIALS = 100
"""How often a learner is judged where all trials begin at one place."""


class Learner(Protocol):
    """What both kinds of player can do."""

    cpu_s: float

    def explore(self, steps: int) -> None:
        """Explore for so many steps."""

    def exploit(self, start: int) -> int:
        """One trial without exploration; returns its steps."""

    @property
    def rules(self) -> int:
        """The length of its list."""

    def knowledge(self, transitions: Sequence[Transition]) -> Knowledge:
        """The shares of the transitions that it predicts."""


class Row(NamedTuple):
    """A learner, and the steps for which it explores."""

    learner: str
    steps: int


class Result(NamedTuple):
    """The result of a learner with one seed.

    Attributes:
        knowledge: shares of the changes predicted.
        rules: length of its list.
        found: share of the trials that ended at the goal.
        steps: mean steps of a trial; one that did not counts as one given up.
        cpu_s: processor time of the exploration.
    """

    knowledge: Knowledge
    rules: float
    found: float
    steps: float
    cpu_s: float


def _acs2(*, genetic: bool) -> Callable[[Field, int], Learner]:
    return lambda field, seed: Acs2Player(field, seed, genetic=genetic)


def _dem(
    tokens: Tokens, exploration: Exploration, values: Values = Values.BEST
) -> Callable[[Field, int], Learner]:
    parameters = Parameters(exploration=exploration, values=values)
    return lambda field, seed: DemAnimat(field, seed, tokens, parameters)


LEARNERS: dict[str, Callable[[Field, int], Learner]] = {
    "ACS2": _acs2(genetic=False),
    "ACS2 with GA": _acs2(genetic=True),
    "DEM, a Token each": _dem(parts, Exploration.RANDOM),
    "DEM, a Token each, curious": _dem(parts, Exploration.CURIOUS),
    "DEM, one Token": _dem(whole, Exploration.RANDOM),
    "DEM, one Token, curious": _dem(whole, Exploration.CURIOUS),
    "DEM, one Token, expected": _dem(whole, Exploration.RANDOM, Values.EXPECTED),
}
IN_A_MAZE = [
    Row("ACS2", 3_000),
    Row("ACS2", 15_000),
    Row("ACS2 with GA", 3_000),
    Row("DEM, a Token each", 3_000),
    Row("DEM, a Token each, curious", 1_000),
    Row("DEM, one Token", 3_000),
    Row("DEM, one Token, curious", 1_000),
]
ON_ICE = ["ACS2", "DEM, one Token", "DEM, one Token, curious", "DEM, one Token, expected"]
FIELDS: dict[str, tuple[Callable[[int], Field], list[Row]]] = {
    "Maze4": (lambda seed: Maze(MAZE4, seed), IN_A_MAZE),
    "Woods1": (lambda seed: Maze(WOODS1, seed), IN_A_MAZE),
    "FrozenLake": (
        lambda seed: FrozenLake(seed, slippery=False),
        [Row(learner, 5_000) for learner in ON_ICE],
    ),
    "FrozenLake, slippery": (
        lambda seed: FrozenLake(seed, slippery=True),
        [Row(learner, 20_000) for learner in ON_ICE],
    ),
}
Job = tuple[str, Row, int]


def judge(job: Job) -> Result:
    """Let a learner explore a field, then judge it."""
    name, row, seed = job
    field = FIELDS[name][0](seed)
    learner = LEARNERS[row.learner](field, seed)
    learner.explore(row.steps)
    knowledge, rules = learner.knowledge(field.transitions()), learner.rules
    steps, found = [], []
    for start in range(field.starts) if field.starts > 1 else [0] * TRIALS:
        made = learner.exploit(start)
        found.append(field.found)
        steps.append(made if field.found else field.limit)
    return Result(knowledge, rules, mean(found), mean(steps), learner.cpu_s)


def cells(results: Sequence[Result]) -> list[str]:
    """The cells of a row."""
    return [
        mean_told([100 * result.knowledge.reliable for result in results]),
        mean_told([100 * result.knowledge.credible for result in results]),
        mean_told([100 * result.found for result in results]),
        mean_told([result.steps for result in results], digits=2),
        mean_told([result.rules for result in results]),
        mean_told([result.cpu_s for result in results], digits=1),
    ]


def main(seeds: int = 2, learner: str = "", field: str = "") -> None:
    """Run everything, or what has these parts of names, and print the table."""
    console = Console()
    jobs = [
        (name, row, seed)
        for name, (_, rows) in FIELDS.items()
        if field in name
        for row in rows
        if learner in row.learner
        for seed in range(seeds)
    ]
    results: dict[tuple[str, Row], list[Result]] = defaultdict(list)
    with Pool(PROCESSES) as pool:
        judged = pool.imap(judge, jobs)
        for (name, row, _), result in zip(
            jobs, track(judged, "playing", len(jobs), console=console), strict=True
        ):
            results[name, row].append(result)
    table = Table(
        "field", "learner", "explored", "reliable, %", "credible, %", "found, %", "steps to goal",
        "rules", "CPU, s",
        title=f"{seeds} seeds: mean (95 % interval)",
    )  # fmt: skip
    for (name, row), found in results.items():
        table.add_row(name, row.learner, f"{row.steps:,}", *cells(found))
    console.print(table)


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 2, *sys.argv[2:3])
