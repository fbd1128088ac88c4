"""Worlds in which credit, differentiation and removal show, with and without, over many seeds."""

import statistics
import sys
from collections.abc import Callable, Sequence
from multiprocessing import Pool

from rich.console import Console
from rich.progress import track
from rich.table import Table
from worlds import Trial, aliased_trial, phantom_trial, removal_curve

from farside.dem import Parameters

BARE = Parameters(removal=False, differentiation=False)
CASES: dict[str, tuple[Callable[..., tuple[object, Trial]], Parameters]] = {
    "81 places and two Tokens active everywhere": (phantom_trial, Parameters()),
    "the same, credit alone": (phantom_trial, BARE),
    "the same, the seed's costs": (
        phantom_trial,
        Parameters(removal=False, differentiation=False, own_credit=False),
    ),
    "aliased: place and heading apart": (aliased_trial, Parameters()),
    "the same without differentiation": (aliased_trial, Parameters(differentiation=False)),
}
LINES = {
    "81 places and two Tokens active everywhere": "1.05",
    "aliased: place and heading apart": "1.15",
}


def ratio(case: tuple[str, int]) -> float:
    """Steps over the least possible, in one case under one seed."""
    trial, parameters = CASES[case[0]]
    return trial(case[1], parameters)[1].ratio


def table(seeds: Sequence[int]) -> Table:
    """Measure all cases under all seeds."""
    found = Table("paths, in multiples of the shortest", "mean", "most", "line")
    with Pool(2) as pool:
        for name in track(CASES, "walking"):
            ratios = pool.map(ratio, [(name, seed) for seed in seeds], chunksize=1)
            figures = (f"{statistics.mean(ratios):.3f}", f"{max(ratios):.2f}")
            found.add_row(name, *figures, LINES.get(name, ""))
    return found


def curve() -> Table:
    """How the lists grow in a noisy world."""
    found = Table("cycle, in a yard with noise", "Signs", "hypotheses", "")
    lengths = removal_curve(Parameters(), cycles=40_000, every=4_000)[-1]
    most = max(length.hypotheses for length in lengths)
    for length in lengths:
        bar = "█" * round(40 * length.hypotheses / most)
        found.add_row(f"{length.cycle:,}", f"{length.signs}", f"{length.hypotheses:,}", bar)
    return found


def main(seeds: int = 30) -> None:
    """Print both tables."""
    console = Console()
    console.print(table(range(seeds)))
    console.print(curve())


if __name__ == "__main__":
    main(*map(int, sys.argv[1:2]))
