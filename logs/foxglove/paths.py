"""Track, policy and prediction as scenes in the yard."""

import math
from collections.abc import Iterable, Iterator
from itertools import pairwise

from foxglove.messages import SpherePrimitive, Vector3

from farside.control import Chooser, Mode
from farside.logs.foxglove.maps import Places
from farside.logs.foxglove.names import (
    GROUND_POLICY,
    GROUND_PREDICTED,
    ROVER_POLICY,
    ROVER_POLICY_CELLS,
    TRUTH_TRACK,
    PictureTopic,
)
from farside.logs.foxglove.shapes import (
    Primitive,
    Rgb,
    arrow,
    colour,
    entity,
    line,
    nothing,
    scene,
    standing,
    text,
    tile,
)
from farside.messages import Proposal, ProposedStep, Tokens
from farside.node import Record
from farside.places import ACTIONS
from farside.topics import (
    BeliefEntry,
    Decision,
    ModeEntry,
    PolicyMapEntry,
    Pose,
    Prediction,
    ProposalEnded,
    Review,
)

Cell = tuple[int, int]

# Colours that stay apart for the colour-blind (Okabe and Ito, 2008), for what is drawn together.
_MODES: dict[Mode, Rgb] = {
    Mode.GUIDED: (0.0, 0.45, 0.70),
    Mode.SHARED: (0.0, 0.62, 0.45),
    Mode.AUTONOMOUS: (0.84, 0.37, 0.0),
}
_POLICY: Rgb = (0.80, 0.47, 0.65)
_PREDICTED: Rgb = (0.90, 0.60, 0.0)
_NEAR: Rgb = (0.94, 0.89, 0.26)
_FAR: Rgb = (0.27, 0.0, 0.33)
_INK: Rgb = (0.1, 0.1, 0.1)

_SEGMENT = 32
"""Points of a segment of the track: what is sent again with each step, and seen after a seek."""


class Track:
    """The track of the rover, coloured by its mode.

    It grows by segments, and only the newest is sent again with each new point, so that a log grows
    with the way driven and no faster.
    """

    def __init__(self, places: Places) -> None:
        self._places = places
        self._mode: Mode | None = None
        self._points: list[tuple[float, float]] = []
        self._number = 0

    def mode(self, _t_ns: int, entry: ModeEntry) -> Iterator[Record]:
        """The mode changes."""
        self._mode = entry.mode
        self._go_on()
        yield from ()

    def pose(self, t_ns: int, pose: Pose) -> Iterator[Record]:
        """The rover is somewhere: a point each half cell."""
        here = pose.x_m, pose.y_m
        if not self._points:
            self._points.append(here)
        if math.dist(self._points[-1], here) < 0.5 * self._places.cell_m:
            return
        self._points.append(here)
        tint = colour(_INK if self._mode is None else _MODES[self._mode])
        way = line(self._points, 0.02 * self._places.cell_m, 0.08 * self._places.cell_m, tint)
        drawn = scene(entity(t_ns, f"track {self._number}", (way,)))
        yield Record(TRUTH_TRACK.name, t_ns, t_ns, drawn)
        if len(self._points) >= _SEGMENT:
            self._go_on()

    def _go_on(self) -> None:
        """Begin a segment where the last one ends."""
        self._points, self._number = self._points[-1:], self._number + 1


class PolicyScenes:
    """The policy map of the top-goal, and the path by it, as the rover has them."""

    def __init__(self, places: Places) -> None:
        self._places = places
        self._best: dict[Cell, tuple[float, str | None]] = {}
        self._is_drawn = False

    def policy_map(self, t_ns: int, entry: PolicyMapEntry) -> Iterator[Record]:
        """Another top-goal, or none."""
        had = bool(self._best)
        self._best = {}
        for place in entry.places:  # ordered by value: the first of a cell is its best
            cell = self._places.cell(place.sign)
            if cell is not None:
                self._best.setdefault(cell, (place.value, place.action))
        if self._best or had:
            cells = scene(entity(t_ns, "cells", self._cells())) if self._best else nothing(t_ns)
            yield Record(ROVER_POLICY_CELLS.name, t_ns, t_ns, cells)
        yield from self._remove(t_ns)

    def decision(self, t_ns: int, decision: Decision) -> Iterator[Record]:
        """What the rover decided on its own: the path from there by the map of the goal."""
        if decision.chooser is not Chooser.GOAL_DIRECTED or decision.proposal is not None:
            return
        start = next(filter(None, map(self._places.cell, decision.active)), None)
        if start is not None and len(cells := self._walk(start)) > 1:
            costs = {cell: self._best[cell][0] for cell in cells}
            yield from self._draw(t_ns, cells, costs)

    def proposal(self, t_ns: int, proposal: Proposal) -> Iterator[Record]:
        """The rover proposes a path."""
        yield from self._draw(t_ns, *_way(proposal.path, proposal.goal, self._places))

    def proposal_ended(self, t_ns: int, _ended: ProposalEnded) -> Iterator[Record]:
        """It does not stand any more."""
        yield from self._remove(t_ns)

    def _draw(self, t_ns: int, cells: list[Cell], costs: dict[Cell, float]) -> Iterator[Record]:
        self._is_drawn = True
        yield _path(ROVER_POLICY, t_ns, cells, costs, self._places)

    def _remove(self, t_ns: int) -> Iterator[Record]:
        if self._is_drawn:
            self._is_drawn = False
            yield Record(ROVER_POLICY.name, t_ns, t_ns, nothing(t_ns))

    def _walk(self, start: Cell) -> list[Cell]:
        """The cells from `start` by the best action of each, as far as the map leads."""
        cells: dict[Cell, None] = {}
        cell: Cell | None = start
        while cell in self._best and cell not in cells:
            cells[cell] = None
            step = ACTIONS.get(self._best[cell][1] or "")
            cell = step and (cell[0] + step[0], cell[1] + step[1])
        return list(cells)

    def _cells(self) -> list[Primitive]:
        """A tile for each cell of the map, bright near the goal, with an arrow for its action."""
        side_m = self._places.cell_m
        farthest = max(value for value, _ in self._best.values()) or 1.0
        parts: list[Primitive] = []
        for cell, (value, action) in self._best.items():
            x_m, y_m = self._places.centre_m(cell)
            tint = colour(_between(_NEAR, _FAR, value / farthest), 0.6)
            parts.append(tile(x_m, y_m, 0.9 * side_m, 0.005 * side_m, tint))
            if (step := ACTIONS.get(action or "")) is not None:
                east, north = step
                heading_rad = math.atan2(north, east)
                back_m = 0.2 * side_m
                tail = standing(
                    x_m - back_m * east, y_m - back_m * north, 0.03 * side_m, heading_rad
                )
                parts.append(arrow(tail, 2 * back_m, colour(_INK, 0.6)))
        return parts


class GroundPolicy:
    """The path of the proposal that the ground was shown last, until it is answered or over."""

    def __init__(self, places: Places) -> None:
        self._places = places
        self._shown: Proposal | None = None

    def proposal(self, t_ns: int, proposal: Proposal) -> Iterator[Record]:
        """A proposal has arrived."""
        self._shown = proposal
        cells, costs = _way(proposal.path, proposal.goal, self._places)
        yield _path(GROUND_POLICY, t_ns, cells, costs, self._places)

    def review(self, t_ns: int, review: Review) -> Iterator[Record]:
        """The operator has answered one."""
        if self._shown is not None and review.proposal == self._shown.number:
            yield from self._remove(t_ns)

    def belief(self, t_ns: int, belief: BeliefEntry) -> Iterator[Record]:
        """The ground learns which one stands."""
        known, shown = belief.proposal, self._shown
        if shown is None or known is None or known.value == shown.number:
            return
        if known.so_ns > shown.time_ns:
            yield from self._remove(t_ns)

    def _remove(self, t_ns: int) -> Iterator[Record]:
        self._shown = None
        yield Record(GROUND_POLICY.name, t_ns, t_ns, nothing(t_ns))


class Predicted:
    """Where the ground predicts the rover to be by now: a tile for each place, the more solid the
    more probable, and a ball where it is more probable than not.
    """

    def __init__(self, places: Places) -> None:
        self._places = places

    def prediction(self, t_ns: int, prediction: Prediction) -> Iterator[Record]:
        """A prediction, which replaces the one before."""
        side_m = self._places.cell_m
        parts: list[Primitive] = []
        for likely in prediction.likely:
            cell, probability = self._places.cell(likely.sign), likely.probability
            if cell is None:
                continue
            x_m, y_m = self._places.centre_m(cell)
            parts.append(
                tile(x_m, y_m, 0.6 * side_m, 0.01 * side_m, colour(_PREDICTED, 0.7 * probability))
            )
            if probability >= 0.5:
                ball = Vector3(x=0.3 * side_m, y=0.3 * side_m, z=0.3 * side_m)
                above = standing(x_m, y_m, 0.5 * side_m)
                tint = colour(_PREDICTED, probability)
                parts.append(SpherePrimitive(pose=above, size=ball, color=tint))
            if probability >= 0.05:
                label = f"{probability:.0%}"
                over = standing(x_m, y_m, 0.8 * side_m)
                parts.append(text(label, over, 0.2 * side_m, colour(_INK)))
        # Without a place nothing is shown, under the same name.
        drawn = scene(entity(t_ns, "now", parts))
        yield Record(GROUND_PREDICTED.name, t_ns, t_ns, drawn)


def _way(
    path: Iterable[ProposedStep], goal: Tokens, places: Places
) -> tuple[list[Cell], dict[Cell, float]]:
    """The cells of a policy path to the goal, and the cost to go at each."""
    costs: dict[Cell, float] = {}
    for step in path:
        if (cell := places.cell(step.sign)) is not None:
            costs.setdefault(cell, step.cost_to_go)
    cells = list(costs)
    if (end := places.cell(goal)) is not None and end not in costs:
        cells.append(end)
    return cells, costs


def _path(
    topic: PictureTopic, t_ns: int, cells: list[Cell], costs: dict[Cell, float], places: Places
) -> Record:
    """A path with the cost to go at each of its steps."""
    side_m, tint = places.cell_m, colour(_POLICY)
    points = list(map(places.centre_m, cells))
    parts: list[Primitive] = [line(points, 0.04 * side_m, 0.1 * side_m, tint)]
    if len(points) > 1:
        (x_m, y_m), (to_x_m, to_y_m) = list(pairwise(points))[-1]
        heading_rad = math.atan2(to_y_m - y_m, to_x_m - x_m)
        parts.append(arrow(standing(x_m, y_m, 0.04 * side_m, heading_rad), side_m, tint))
    parts += [
        text(f"{costs[cell]:.0f}", standing(*point, 0.3 * side_m), 0.2 * side_m, colour(_INK))
        for cell, point in zip(cells, points, strict=True)
        if cell in costs
    ]
    return Record(topic.name, t_ns, t_ns, scene(entity(t_ns, "path", parts)))


def _between(near: Rgb, far: Rgb, share: float) -> Rgb:
    red, green, blue = (a + (b - a) * share for a, b in zip(near, far, strict=True))
    return red, green, blue
