"""The top-goal's map as a graph: Signs with their values, and what the best actions lead to."""

import math
from collections import defaultdict
from typing import NamedTuple

from farside.dem.lists.hypothesis import Hypothesis
from farside.dem.lists.signs import Sign
from farside.dem.model import DynamicExpectancyModel


class Node(NamedTuple):
    """A Sign.

    Attributes:
        sign: the Sign.
        value: P_v, infinite where no way to the goal is known.
        action: the best action, `None` at the goal and off the map.
        depth: number of steps on the best path to the goal.
    """

    sign: Sign
    value: float
    action: str | None
    depth: int


class Arc(NamedTuple):
    """What a Sign's best action leads to, or the part of it whose way is its own.

    Attributes:
        source: the Sign.
        target: the Sign that it leads to.
        action: the action, `None` from a whole to its part.
        cm: C_m of the hypothesis, 1 from a whole to its part.
        is_ahead: whether it is on the policy path from what is sensed now.
    """

    source: Sign
    target: Sign
    action: str | None
    cm: float
    is_ahead: bool


class Graph(NamedTuple):
    """What there is to draw.

    Attributes:
        goal: the top-goal's Sign.
        here: the Sign to act from now, `None` without one.
        nodes: the Signs, nearest to the goal first, then those off the map by age.
        arcs: one at most from every Sign.
        links: pairs of Signs where a hypothesis more credible than not leads from one to the other.
        left_out: the number of Signs that were too many.
    """

    goal: Sign
    here: Sign | None
    nodes: tuple[Node, ...]
    arcs: tuple[Arc, ...]
    links: tuple[tuple[Sign, Sign], ...]
    left_out: int


_CREDIBLE = 0.5


def graph_of(model: DynamicExpectancyModel, most: int) -> Graph:
    """The graph of the top-goal's map, of the `most` Signs nearest to the goal.

    Raises:
        ValueError: if there is no map.
    """
    rows = model.policy_map()
    if not rows:
        wanted = ", ".join(str(goal.tokens) for goal in model.goals) or "no goal"
        raise ValueError(
            f"expected a top-goal whose Sign is known, found {wanted}: set a goal with set_goal()"
        )
    nodes = [Node(row.sign, row.value, row.action, row.depth) for row in rows]
    on_map = {node.sign for node in nodes}
    nodes += [Node(sign, math.inf, None, 0) for sign in model.signs if sign not in on_map]
    drawn = {node.sign: node for node in nodes[:most]}
    path = [step.sign for step in model.policy_path()]
    arcs = _arcs(model, drawn, set(path))
    links = {
        (one.context, one.outcome): None
        for one in model.hypotheses
        if one.credit >= _CREDIBLE and one.context in drawn and one.outcome in drawn
    }
    return Graph(
        goal=min((node.sign for node in nodes if node.value == 0.0), key=len),
        here=path[0] if path else None,
        nodes=tuple(drawn.values()),
        arcs=arcs,
        links=tuple(links),
        left_out=len(nodes) - len(drawn),
    )


def _arcs(
    model: DynamicExpectancyModel, drawn: dict[Sign, Node], path: set[Sign]
) -> tuple[Arc, ...]:
    by_cause: dict[tuple[Sign, str], list[Hypothesis]] = defaultdict(list)
    for one in model.hypotheses:
        if one.outcome in drawn:
            by_cause[one.context, one.action].append(one)
    arcs = []
    for node in drawn.values():
        part = _part_of_equal_value(node, drawn)
        known = [] if node.action is None else by_cause[node.sign, node.action]
        if part is not None:
            arcs.append(Arc(node.sign, part, None, 1.0, is_ahead=node.sign in path))
        elif known:
            best = _best(model, node, known, drawn)
            arcs.append(Arc(node.sign, best.outcome, node.action, best.cm, node.sign in path))
    return tuple(arcs)


def _part_of_equal_value(node: Node, drawn: dict[Sign, Node]) -> Sign | None:
    """The part whose value a whole has, as to reach it is to reach its parts."""
    if len(node.sign) == 1 or node.value == math.inf:
        return None
    for other in drawn.values():
        if other.value == node.value and len(other.sign) < len(node.sign):
            if set(other.sign).issubset(node.sign):
                return other.sign
        elif other.value > node.value:
            return None
    return None


def _best(
    model: DynamicExpectancyModel,
    node: Node,
    known: list[Hypothesis],
    drawn: dict[Sign, Node],
) -> Hypothesis:
    """The hypothesis behind a value, P_v(s) = min over hypotheses of cost / measure + P_v(s').

    So cost >= (P_v(s) - P_v(s')) * measure, with equality for the hypothesis that is the least.
    """
    credited = model.parameters.own_credit

    def gain(one: Hypothesis) -> float:
        measure = one.credit if credited else one.cm
        gained = node.value - drawn[one.outcome].value
        return gained * measure if math.isfinite(gained) else -math.inf

    return max(known, key=gain)
