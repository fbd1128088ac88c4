"""Where the Signs of a graph stand: by place, by value, or held by springs."""

import math
import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from farside.dem.lab.graph import Graph
from farside.dem.lists.signs import Sign

Point = tuple[float, float]
"""Across and up, in steps: neighbours are about 1 apart."""

_PLACE = re.compile(r"at:(-?\d+(?:\.\d+)?),(-?\d+(?:\.\d+)?)")
_AROUND = 0.3  # steps from a place to the second Sign there, and the third
_ROUNDS = 40  # of stress majorisation


class Layout(StrEnum):
    """How the Signs of a picture are laid out."""

    AUTO = "auto"
    """`places` where half of the Signs have one, else `springs`."""

    PLACES = "places"
    """By Tokens such as `at:3,4`: 3 across, 4 up. Signs without a place stand below."""

    VALUES = "values"
    """The goal at the right, and every Sign as far to the left of it as its policy value says."""

    SPRINGS = "springs"
    """As far from each other as there are steps in between, as well as a plane allows."""


def positions(graph: Graph, layout: Layout, places: Mapping[str, Point]) -> dict[Sign, Point]:
    """The position of every Sign that is drawn.

    Args:
        graph: the graph.
        layout: how.
        places: positions of Tokens, beside `at:x,y`.
    """
    by_place = _by_place(graph, places)
    if layout is Layout.AUTO:
        has_places = 2 * len(by_place) >= len(graph.nodes)
        layout = Layout.PLACES if has_places else Layout.SPRINGS
    if layout is Layout.PLACES:
        return _apart(by_place) | _below(graph, by_place)
    return _by_value(graph) if layout is Layout.VALUES else _by_springs(graph)


# --- places ------------------------------------------------------------------------------------


def _by_place(graph: Graph, places: Mapping[str, Point]) -> dict[Sign, Point]:
    found: dict[Sign, Point] = {}
    for node in graph.nodes:
        for token in node.sign:
            pair = _PLACE.fullmatch(token)
            if token in places or pair is not None:
                found[node.sign] = (
                    places[token] if pair is None else (float(pair[1]), float(pair[2]))
                )
                break
    return found


def _apart(by_place: Mapping[Sign, Point]) -> dict[Sign, Point]:
    """Signs at one place stand around it, the shortest in the middle."""
    together: dict[Point, list[Sign]] = defaultdict(list)
    for sign, point in by_place.items():
        together[point].append(sign)
    found = {}
    for (across, up), signs in together.items():
        for number, sign in enumerate(sorted(signs, key=lambda sign: (len(sign), sign))):
            turn = 2.4 * number  # the golden angle
            off = _AROUND * min(1.0, math.sqrt(number) / 2 + 0.5) if number else 0.0
            found[sign] = across + off * math.cos(turn), up + off * math.sin(turn)
    return found


def _below(graph: Graph, by_place: Mapping[Sign, Point]) -> dict[Sign, Point]:
    """Signs on the map that have no place, in rows below it."""
    without = [
        node.sign
        for node in graph.nodes
        if node.sign not in by_place and (node.value < math.inf or node.sign == graph.goal)
    ]
    left = min((across for across, _ in by_place.values()), default=0.0)
    right = max((across for across, _ in by_place.values()), default=10.0)
    bottom = min((up for _, up in by_place.values()), default=0.0)
    per_row = max(6, int(right - left) // 2 + 1)
    return {
        sign: (left + 2.0 * (number % per_row), bottom - 1.5 - number // per_row)
        for number, sign in enumerate(without)
    }


# --- values ------------------------------------------------------------------------------------


def _by_value(graph: Graph) -> dict[Sign, Point]:
    """The tree of best actions: each Sign on the row of what most lead through to it."""
    values = {node.sign: node.value for node in graph.nodes if node.value < math.inf}
    leads_to = {arc.source: arc.target for arc in graph.arcs}
    before: dict[Sign, list[Sign]] = defaultdict(list)
    for sign in values:  # nearest first
        if sign in leads_to:
            before[leads_to[sign]].append(sign)
    deepest = max((node.depth for node in graph.nodes), default=0)
    per_cost = (deepest or 1) / (max(values.values()) or 1.0)
    sizes = dict.fromkeys(values, 1)
    for sign in reversed(values):
        if sign in leads_to:
            sizes[leads_to[sign]] += sizes[sign]
    rows: dict[Sign, int] = {}
    leaves = 0
    for root in (sign for sign in values if sign not in leads_to):
        pending = [(root, False)]
        while pending:
            sign, is_passed = pending.pop()
            if is_passed:
                rows[sign] = rows[max(before[sign], key=sizes.__getitem__)]
            elif before[sign]:
                pending.append((sign, True))
                pending += [(one, False) for one in _outwards(before[sign], sizes)]
            else:
                rows[sign] = leaves
                leaves += 1
    return {sign: (-values[sign] * per_cost, -float(row)) for sign, row in rows.items()}


def _outwards(signs: list[Sign], sizes: Mapping[Sign, int]) -> list[Sign]:
    """The Sign that most lead to in the middle, those that few lead to at the ends."""
    ordered = sorted(signs, key=sizes.__getitem__)
    return ordered[::2] + ordered[1::2][::-1]


# --- springs -----------------------------------------------------------------------------------


def _by_springs(graph: Graph) -> dict[Sign, Point]:
    """Stress majorisation (Gansner, Koren and North 2004)."""
    signs = [node.sign for node in graph.nodes]
    if len(signs) < 3:
        return {sign: (float(number), 0.0) for number, sign in enumerate(signs)}
    steps = _steps_between(signs, [(arc.source, arc.target) for arc in graph.arcs] + [*graph.links])
    points = _majorised(_unfolded(steps), steps)
    goal = signs.index(graph.goal)
    # The goal to the right of the middle, and the first of the others above it.
    points -= points.mean(axis=0)
    points *= np.where(points[goal] < 0, -1.0, 1.0)
    return {sign: (float(x), float(y)) for sign, (x, y) in zip(signs, points, strict=True)}


def _steps_between(
    signs: Sequence[Sign], links: Sequence[tuple[Sign, Sign]]
) -> NDArray[np.float64]:
    """The fewest links between any two Signs; what no links join is a little farther than all."""
    number = {sign: index for index, sign in enumerate(signs)}
    beside: list[set[int]] = [set() for _ in signs]
    for source, target in links:
        beside[number[source]].add(number[target])
        beside[number[target]].add(number[source])
    steps = np.full((len(signs), len(signs)), np.inf)
    for start in range(len(signs)):
        frontier, distance = [start], 0
        while frontier:
            steps[start, frontier] = distance
            distance += 1
            reached = {two for one in frontier for two in beside[one]}
            frontier = [one for one in sorted(reached) if steps[start, one] == np.inf]
    apart = np.isinf(steps)
    steps[apart] = steps[~apart].max() + 2
    return steps


def _unfolded(steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """A first layout without folds: the two slowest modes of the links, if they were springs."""
    # Feeble springs between all hold together what no links join.
    springs = np.where(steps == 1, 1.0, 1e-4)
    np.fill_diagonal(springs, 0.0)
    rates, modes = np.linalg.eigh(np.diag(springs.sum(axis=1)) - springs)
    points: NDArray[np.float64] = modes[:, 1:3] / np.sqrt(rates[1:3])
    # What coincides would stay together.
    turns = 2.4 * np.arange(len(points))
    return points + 1e-3 * np.stack([np.cos(turns), np.sin(turns)], axis=1)


def _majorised(points: NDArray[np.float64], steps: NDArray[np.float64]) -> NDArray[np.float64]:
    weights = 1.0 / np.where(steps > 0, steps, np.inf) ** 2
    laplacian = np.diag(weights.sum(axis=1)) - weights
    inverse = np.linalg.pinv(laplacian)
    for _ in range(_ROUNDS):
        between = np.linalg.norm(points[:, None] - points[None], axis=2)
        ratios = weights * steps / np.maximum(between, 1e-9)
        points = inverse @ ((np.diag(ratios.sum(axis=1)) - ratios) @ points)
    return points
