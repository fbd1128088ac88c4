"""`python tests/bench/dem_map.py`: the Dynamic Policy Map compared with scipy's Dijkstra.

Both sides of a ratio are measured alternately in one run, so that a drift in the machine's speed
affects both.
"""

import statistics
import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.sparse import csr_array  # type: ignore[import-untyped]
from scipy.sparse.csgraph import dijkstra  # type: ignore[import-untyped]

from farside.dem import DynamicExpectancyModel
from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.hypothesis import CostChange
from farside.dem.lists.signs import SignList
from farside.dem.parameters import Parameters
from farside.dem.policy.policy_map import PolicyMap
from farside.dem.policy.spread import Spread

ACTION_COST = 2.66
BUILDS = 9
CHANGES = 400
HUBS = 25_000, 100_000  # arcs
Ids = NDArray[np.int64]


class Graph(NamedTuple):
    """Signs, actions and C_m of hypotheses, as columns."""

    sign_count: int
    context: Ids
    outcome: Ids
    action: Ids
    cm: NDArray[np.float64]


def grid(east: int, north: int, rng: np.random.Generator) -> Graph:
    """A grid of places with four actions each; an action off the grid has no effect."""
    place = np.arange(east * north)
    x, y = place % east, place // east
    beside = [(x + dx).clip(0, east - 1) + (y + dy).clip(0, north - 1) * east for dx, dy in MOVES]
    return Graph(
        len(place),
        np.tile(place, 4),
        np.concatenate(beside),
        np.repeat(np.arange(4), len(place)),
        rng.uniform(0.05, 1.0, 4 * len(place)),
    )


MOVES = ((0, 1), (1, 0), (0, -1), (-1, 0))


def random_graph(signs: int, hypotheses: int, rng: np.random.Generator) -> Graph:
    """Hypotheses between random Signs."""
    context, outcome = rng.integers(signs, size=(2, hypotheses))
    action = rng.integers(4, size=hypotheses)
    return Graph(signs, context, outcome, action, rng.uniform(0.05, 1.0, hypotheses))


def lists(graph: Graph) -> tuple[HypothesisList, SignList]:
    """The lists of a model that learned a graph."""
    signs = SignList()
    for sign in range(graph.sign_count):
        signs.add((f"at:{sign}",))
    hypotheses = HypothesisList(
        ActionList({f"{action}": ACTION_COST for action in range(4)}), Parameters()
    )
    ends = (graph.context.tolist(), graph.action.tolist(), graph.outcome.tolist())
    for arc, (context, action, outcome) in enumerate(zip(*ends, strict=True)):
        hypotheses.add(context, action, outcome, 1, 0.5)
        hypotheses.cm[arc] = graph.cm[arc]
        hypotheses.cost[arc] = ACTION_COST / graph.cm[arc]
    return hypotheses, signs


def _plain_matrix(graph: Graph) -> csr_array:
    """The arcs of a graph as a matrix for scipy: the least of parallel ones, and all loops."""
    cost = ACTION_COST / graph.cm
    order = np.lexsort((cost, graph.context, graph.outcome))
    ends = np.stack((graph.outcome[order], graph.context[order]))
    least = np.r_[True, (np.diff(ends) != 0).any(axis=0)]
    rows, columns = ends[:, least]
    starts = np.r_[0, np.cumsum(np.bincount(rows, minlength=graph.sign_count))]
    size = (graph.sign_count, graph.sign_count)
    return csr_array((cost[order][least], columns, starts), shape=size)


def _seconds(work: Callable[[], object]) -> float:
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


class WholeMap(NamedTuple):
    """Medians in seconds.

    Attributes:
        scipy_s: scipy's Dijkstra alone, on a finished matrix.
        build_s: a new map after changes of cost only.
        first_s: a new map after hypotheses were created or removed.
        table_s: values, best actions and depths of all Signs from an existing map.
    """

    scipy_s: float
    build_s: float
    first_s: float
    table_s: float


def whole_map(graph: Graph) -> WholeMap:
    """Build the map of a graph for a goal, and run scipy on the same graph."""
    hypotheses, signs = lists(graph)
    matrix = _plain_matrix(graph)
    goal = graph.sign_count // 2
    spread = Spread(hypotheses, signs, Parameters())
    policy = PolicyMap(goal, spread)
    assert policy.value == dijkstra(matrix, indices=goal).tolist()
    runs = [
        (
            _seconds(lambda: dijkstra(matrix, indices=goal)),
            _seconds(lambda: PolicyMap(goal, spread)),
            _seconds(lambda: PolicyMap(goal, Spread(hypotheses, signs, Parameters()))),
            _seconds(policy.table),
        )
        for _ in range(BUILDS)
    ]
    return WholeMap(*(statistics.median(column) for column in zip(*runs, strict=True)))


class Updates(NamedTuple):
    """Seconds to build a map, and to update it after one change of C_m."""

    build_s: float
    median_s: float
    p99_s: float
    most_s: float


def updates(graph: Graph, rng: np.random.Generator, *, on_paths: bool = False) -> Updates:
    """Change C_m of random hypotheses one by one, up or down, with an update after each.

    With `on_paths`, only of hypotheses that are the best at their context: no other change of a
    cost affects a value, unless it makes the hypothesis the best.
    """
    hypotheses, signs = lists(graph)
    spread = Spread(hypotheses, signs, Parameters())
    policy = PolicyMap(graph.sign_count // 2, spread)
    chosen = policy.table().best if on_paths else np.arange(len(hypotheses))
    took = []
    for arc in rng.choice(chosen[chosen >= 0], CHANGES).tolist():
        before, cm = hypotheses.cost[arc], hypotheses.cm[arc]
        cm = cm + 0.5 * (1.0 - cm) if rng.random() < 0.5 else 0.8 * cm
        hypotheses.cm[arc], hypotheses.cost[arc] = cm, ACTION_COST / cm
        change = CostChange(arc, hypotheses.context[arc], hypotheses.outcome[arc], before)

        def follow(change: CostChange = change) -> None:
            policy.update([change])
            _ = policy.value  # all of them

        took.append(_seconds(follow))
    anew = PolicyMap(policy.goal, spread)
    assert policy.value == anew.value
    build_s = statistics.median(
        _seconds(lambda: PolicyMap(policy.goal, spread)) for _ in range(BUILDS)
    )
    return Updates(
        build_s, statistics.median(took), statistics.quantiles(took, n=100)[-1], max(took)
    )


class Hub(NamedTuple):
    """Seconds for a hub whose predictions all fall due in one cycle, and for a bare Dijkstra."""

    scipy_s: float
    cycle_s: float
    mature_s: float


def hub(arcs: int) -> Hub:
    """A Sign that is active everywhere leads everywhere, in a world of as many places."""
    graph = grid(arcs // 100, 100, np.random.default_rng(0))
    matrix = _plain_matrix(graph)
    scipy_s = statistics.median(_seconds(lambda: dijkstra(matrix, indices=0)) for _ in range(5))
    model = DynamicExpectancyModel(
        {"go": 1.0}, Parameters(maturity=8), rng=np.random.default_rng(0)
    )
    signs, hypotheses = model._signs, model._hypotheses
    for place in range(arcs):
        hypotheses.add(signs.add(("hub",)), 0, signs.add((f"at:{place}",)), 1, 0.5)
        hypotheses.add(signs.add((f"at:{place}",)), 0, signs.add((f"at:{place + 1}",)), 1, 0.5)
    model.set_goal((f"at:{arcs}",), 1.0)
    took = []
    for place in range(10):
        began = time.perf_counter()
        model.sense(("hub", f"at:{place}"))
        model.choose()
        model.perform("go")
        took.append(time.perf_counter() - began)
    return Hub(scipy_s, statistics.median(took[2:7]), max(took[7:]))


def seed_map_s() -> float:
    """Seconds to build a map of 74 Signs, as many as in the seed's example."""
    graph = grid(37, 2, np.random.default_rng(0))
    spread = Spread(*lists(graph), Parameters())
    return statistics.median(_seconds(lambda: PolicyMap(0, spread)) for _ in range(2000))


def table() -> Table:
    """Measure, and tabulate the figures."""
    rng = np.random.default_rng(0)
    found = Table("measure", "figure", "limit")
    for name, graph in {
        "grid": grid(400, 250, rng),
        "random": random_graph(100_000, 400_000, rng),
    }.items():
        whole = whole_map(graph)
        found.add_row(
            f"{name}: new map / scipy alone ({1e3 * whole.scipy_s:.1f} ms)",
            f"{whole.build_s / whole.scipy_s:.2f}",
            "1.5",
        )
        found.add_row(f"{name}: the same with new arcs", f"{whole.first_s / whole.scipy_s:.2f}")
        found.add_row(
            f"{name}: best actions and depths / scipy alone",
            f"{whole.table_s / whole.scipy_s:.2f}",
        )
        for on_paths in (False, True):
            change = updates(graph, rng, on_paths=on_paths)
            which = "best arcs" if on_paths else "random arcs"
            found.add_row(
                f"{name}: build / update, {which} ({1e6 * change.median_s:.1f} µs)",
                f"{change.build_s / change.median_s:,.0f}",
                "100",
            )
            found.add_row(
                f"{name}: update p99, greatest / build, {which}",
                f"{change.p99_s / change.build_s:.2f}, {change.most_s / change.build_s:.2f}",
            )
    for arcs in HUBS:
        figures = hub(arcs)
        found.add_row(
            f"hub with {arcs:,} arcs: cycle, at maturity / bare Dijkstra of as many places "
            f"({1e3 * figures.scipy_s:.1f} ms)",
            f"{figures.cycle_s / figures.scipy_s:.1f}, {figures.mature_s / figures.scipy_s:.1f}",
        )
        found.add_row(
            "    the same, µs an arc",
            f"{1e6 * figures.cycle_s / arcs:.1f}, {1e6 * figures.mature_s / arcs:.1f}",
        )
    found.add_row("74 Signs (µs)", f"{1e6 * seed_map_s():.0f}", "100")
    return found


if __name__ == "__main__":
    Console().print(table())
