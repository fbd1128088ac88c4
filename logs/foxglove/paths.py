"""Track, policy and prediction as scenes in the yard."""

import math
from collections.abc import Iterable

from foxglove.messages import CubePrimitive, SpherePrimitive, TextPrimitive, Vector3

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
from farside.logs.foxglove.poses import Drawn, Where
from farside.logs.foxglove.shapes import (
    Parts,
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
from farside.logs.foxglove.sides import Believed
from farside.messages import Proposal, ProposedStep, Tokens
from farside.node import Record
from farside.places import ACTIONS, Cell
from farside.topics import (
    Decision,
    Likely,
    ModeEntry,
    PolicyMapEntry,
    Prediction,
    ProposalEnded,
    Review,
)

Point = tuple[float, float]

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
"""Corners of a segment of the track: what is sent again with each step, and seen after a seek."""

_STEP, _SHOWN, _OFF = 0.2, 0.5, 0.03
"""In cells: how far a point of the track is from the last, how far the rover goes until it is drawn
anew, and how far beside a straight line is no corner (project defaults)."""


class Track:
    """The track of the rover, coloured by its mode.

    It grows by segments, and only the newest is sent again with each new point, so that a log grows
    with the way driven and no faster.
    """

    def __init__(self, places: Places) -> None:
        self._places = places
        self._mode: Mode | None = None
        self._points: list[Point] = []
        self._drawn_to: Point | None = None
        self._number = 0

    def mode(self, _t_ns: int, entry: ModeEntry) -> Drawn:
        """The mode changes: the rover goes on in another colour."""
        self._mode = entry.mode
        self._go_on()
        return ()

    def pose(self, t_ns: int, at: Where) -> Drawn:
        """The rover is somewhere: drawn each half cell."""
        here, cell_m = (at.x_m, at.y_m), self._places.cell_m
        if self._drawn_to is None:
            self._points, self._drawn_to = [here], here
        if math.dist(self._points[-1], here) < _STEP * cell_m:
            return ()
        corner = self._points[-2:]
        if len(corner) == 2 and _is_between(corner[0], corner[1], here, _OFF * cell_m):
            self._points.pop()
        self._points.append(here)
        if math.dist(self._drawn_to, here) < _SHOWN * cell_m:
            return ()
        self._drawn_to = here
        tint = colour(_INK if self._mode is None else _MODES[self._mode])
        way = line(self._points, 0.02 * cell_m, 0.08 * cell_m, tint)
        drawn = scene(entity(t_ns, f"track {self._number}", Parts(lines=[way])))
        if len(self._points) >= _SEGMENT:
            self._go_on()
        return [Record(TRUTH_TRACK.name, t_ns, t_ns, drawn)]

    def _go_on(self) -> None:
        """Begin a segment where the last one ends."""
        self._points, self._number = self._points[-1:], self._number + 1


def _is_between(start: Point, middle: Point, end: Point, off_m: float) -> bool:
    """Whether a point lies on the way between two others, or but `off_m` beside it."""
    along = math.dist(start, end)
    (x, y), (to_x, to_y) = ((point[0] - start[0], point[1] - start[1]) for point in (middle, end))
    if along == 0 or not 0 <= x * to_x + y * to_y <= along**2:
        return False
    return abs(x * to_y - y * to_x) <= off_m * along


class PolicyScenes:
    """The policy map of the top-goal, and the path by it, as the rover has them."""

    def __init__(self, places: Places) -> None:
        self._places = places
        self._best: dict[Cell, tuple[float, str | None]] = {}
        self._path: list[Cell] = []

    def policy_map(self, t_ns: int, entry: PolicyMapEntry) -> Drawn:
        """Another top-goal, or none."""
        had = bool(self._best)
        self._best = {}
        for place in entry.places:  # ordered by value: the first of a cell is its best
            cell = self._places.cell(place.sign)
            if cell is not None:
                self._best.setdefault(cell, (place.value, place.action))
        drawn = self._remove(t_ns)
        if self._best or had:
            cells = scene(entity(t_ns, "cells", self._cells())) if self._best else nothing(t_ns)
            drawn.append(Record(ROVER_POLICY_CELLS.name, t_ns, t_ns, cells))
        return drawn

    def decision(self, t_ns: int, decision: Decision) -> Drawn:
        """What the rover decided on its own: the path from there by the map of the goal."""
        if decision.chooser is not Chooser.GOAL_DIRECTED or decision.proposal is not None:
            return ()
        start = next(filter(None, map(self._places.cell, decision.active)), None)
        cells = [] if start is None else self._walk(start)
        if len(cells) < 2:
            return self._remove(t_ns)
        if cells == self._path[-len(cells) :]:
            return ()  # the rover has come farther on it
        return self._draw(t_ns, cells, {cell: self._best[cell][0] for cell in cells})

    def proposal(self, t_ns: int, proposal: Proposal) -> Drawn:
        """The rover proposes a path."""
        return self._draw(t_ns, *_way(proposal.path, proposal.goal, self._places))

    def proposal_ended(self, t_ns: int, _ended: ProposalEnded) -> Drawn:
        """It does not stand any more."""
        return self._remove(t_ns)

    def _draw(self, t_ns: int, cells: list[Cell], costs: dict[Cell, float]) -> Drawn:
        self._path = cells
        return [_path(ROVER_POLICY, t_ns, cells, costs, self._places)]

    def _remove(self, t_ns: int) -> list[Record]:
        if not self._path:
            return []
        self._path = []
        return [Record(ROVER_POLICY.name, t_ns, t_ns, nothing(t_ns))]

    def _walk(self, start: Cell) -> list[Cell]:
        """The cells from `start` by the best action of each, as far as the map leads."""
        cells: dict[Cell, None] = {}
        cell: Cell | None = start
        while cell in self._best and cell not in cells:
            cells[cell] = None
            action = self._best[cell][1]
            cell = cell.beside(action) if action in ACTIONS else None
        return list(cells)

    def _cells(self) -> Parts:
        """A tile for each cell of the map, bright near the goal, with an arrow for its action."""
        side_m = self._places.cell_m
        farthest = max(value for value, _ in self._best.values()) or 1.0
        tiles, arrows = [], []
        for cell, (value, action) in self._best.items():
            x_m, y_m = self._places.centre_m(cell)
            tint = colour(_between(_NEAR, _FAR, value / farthest), 0.6)
            tiles.append(tile(standing(x_m, y_m, 0.005 * side_m), 0.9 * side_m, tint))
            if (step := ACTIONS.get(action or "")) is not None:
                east, north = step
                back_m = 0.2 * side_m
                x_m, y_m = x_m - back_m * east, y_m - back_m * north
                tail = standing(x_m, y_m, 0.03 * side_m, math.atan2(north, east))
                arrows.append(arrow(tail, 2 * back_m, colour(_INK, 0.6)))
        return Parts(arrows=arrows, cubes=tiles)


class GroundPolicy:
    """The path of the proposal that the ground was shown last, until it is answered or over."""

    def __init__(self, places: Places) -> None:
        self._places = places
        self._shown: Proposal | None = None

    def proposal(self, t_ns: int, proposal: Proposal) -> Drawn:
        """A proposal has arrived."""
        self._shown = proposal
        cells, costs = _way(proposal.path, proposal.goal, self._places)
        return [_path(GROUND_POLICY, t_ns, cells, costs, self._places)]

    def review(self, t_ns: int, review: Review) -> Drawn:
        """The operator has answered one."""
        if self._shown is None or review.proposal != self._shown.number:
            return ()
        return self._remove(t_ns)

    def belief(self, t_ns: int, belief: Believed) -> Drawn:
        """The ground learns which one stands."""
        known, shown = belief.proposal, self._shown
        if shown is None or known is None or known.value == shown.number:
            return ()
        return self._remove(t_ns) if known.so_ns > shown.time_ns else ()

    def _remove(self, t_ns: int) -> Drawn:
        self._shown = None
        return [Record(GROUND_POLICY.name, t_ns, t_ns, nothing(t_ns))]


class Predicted:
    """Where the ground predicts the rover to be by now.

    A tile for each place, the more solid the more probable, with the probability of the first; and
    a ball where it is more probable than not.
    """

    def __init__(self, places: Places) -> None:
        self._places = places
        self._drawn: tuple[Likely, ...] = ()

    def prediction(self, t_ns: int, prediction: Prediction) -> Drawn:
        """A prediction, which replaces the one before; nothing if it is the same."""
        if prediction.likely == self._drawn:
            return ()
        self._drawn = prediction.likely
        side_m = self._places.cell_m
        tiles: list[CubePrimitive] = []
        balls: list[SpherePrimitive] = []
        labels: list[TextPrimitive] = []
        for likely in prediction.likely:
            cell, probability = self._places.cell(likely.sign), likely.probability
            if cell is None:
                continue
            x_m, y_m = self._places.centre_m(cell)
            if not labels:  # the most probable comes first
                over = standing(x_m, y_m, 0.8 * side_m)
                labels.append(text(f"{probability:.0%}", over, 0.2 * side_m, colour(_INK)))
            tint = colour(_PREDICTED, 0.7 * probability)
            tiles.append(tile(standing(x_m, y_m, 0.01 * side_m), 0.6 * side_m, tint))
            if probability >= 0.5:
                size = Vector3(x=0.3 * side_m, y=0.3 * side_m, z=0.3 * side_m)
                above = standing(x_m, y_m, 0.5 * side_m)
                solid = colour(_PREDICTED, probability)
                balls.append(SpherePrimitive(pose=above, size=size, color=solid))
        # Without a place nothing is shown, under the same name.
        parts = Parts(cubes=tiles, spheres=balls, texts=labels)
        return [Record(GROUND_PREDICTED.name, t_ns, t_ns, scene(entity(t_ns, "now", parts)))]


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
    arrows = []
    if len(points) > 1:
        (x_m, y_m), (to_x_m, to_y_m) = points[-2:]
        tail = standing(x_m, y_m, 0.04 * side_m, math.atan2(to_y_m - y_m, to_x_m - x_m))
        arrows.append(arrow(tail, side_m, tint))
    labels = [
        text(f"{costs[cell]:.0f}", standing(*point, 0.3 * side_m), 0.2 * side_m, colour(_INK))
        for cell, point in zip(cells, points, strict=True)
        if cell in costs
    ]
    way = line(points, 0.04 * side_m, 0.1 * side_m, tint)
    parts = Parts(arrows=arrows, lines=[way], texts=labels)
    return Record(topic.name, t_ns, t_ns, scene(entity(t_ns, "path", parts)))


def _between(near: Rgb, far: Rgb, share: float) -> Rgb:
    red, green, blue = (a + (b - a) * share for a, b in zip(near, far, strict=True))
    return red, green, blue
