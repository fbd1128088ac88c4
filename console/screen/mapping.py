"""What stands on the map: the rover as heard, as predicted, and the ways ahead of it."""

from collections.abc import Iterable, Iterator

from farside.console.screen.screen import Ghost, GoalSpot, MapView, Pose, Spot
from farside.console.wording import percent, span_text
from farside.ground.view.view import GroundView
from farside.logs.events import sign_text
from farside.logs.picture import Picture
from farside.messages import Tokens
from farside.node import to_s
from farside.places import Cell, Chart, is_place_token, place_name
from farside.topics import BeliefItem, Likely, PathReview, Prediction

_HALF = 0.5


def map_view(picture: Picture, view: GroundView, chart: Chart) -> MapView:
    """The map at a moment.

    Args:
        picture: what the ground has noted.
        view: what follows from it.
        chart: the map.
    """
    heard = picture.telemetry
    pose, label, stale = None, "nothing heard yet", False
    if heard is not None:
        pose = Pose(heard.x_m, heard.y_m, heard.heading_rad)
        label = f"as of {span_text(view.now_ns - heard.time_ns)} ago"
        stale = picture.belief is not None and BeliefItem.POSE in picture.belief.stale
    after = tuple(_ghost(one, chart, f"after {one.command}") for one in view.after)
    return MapView(
        heard=pose,
        heard_label=label,
        heard_stale=stale,
        now=None if view.predicted is None else _ghost(view.predicted, chart, "now, as predicted"),
        after=after,
        track=_track(picture, view.now_ns, chart),
        committed=tuple(ghost.spots[0] for ghost in after if is_likely(ghost.spots)),
        policy=_policy(view.path, chart),
        policy_label="" if view.path is None else path_text(view.path),
        goals=tuple(_goals(view, chart)),
        heat=tuple(_at(((one.place, one.cost_to_go) for one in view.heat), chart=chart)),
    )


def is_likely(spots: tuple[Spot, ...]) -> bool:
    """Whether a ghost is drawn as one: below one half a region is drawn in its place."""
    return bool(spots) and spots[0].amount >= _HALF


def spots_of(likely: Iterable[Likely], chart: Chart) -> tuple[Spot, ...]:
    """The places of these Signs, each with its probability; what is no place is left out."""
    placed = ((token, one.probability) for one in likely for token in one.sign)
    return tuple(_at(placed, chart=chart))


def place_text(sign: Tokens) -> str:
    """A Sign in few words: the name of its place, or its Tokens."""
    place = next(filter(is_place_token, sign), None)
    return sign_text(sign) if place is None else sign_text((place_name(place),))


def path_text(path: PathReview) -> str:
    """A way in few words: `to B: 24.1 s to go, as planned 83 %`."""
    chance = "" if path.chance is None else f", as planned {percent(path.chance)}"
    return f"to {place_text(path.goal)}: {path.cost_to_go:.1f} s to go{chance}"


def _at(placed: Iterable[tuple[str, float]], *, chart: Chart) -> Iterator[Spot]:
    for token, amount in placed:
        cell = chart.cells.get(token)
        if cell is not None:
            yield Spot(cell.east, cell.north, amount)


def _ghost(prediction: Prediction, chart: Chart, label: str) -> Ghost:
    spots = spots_of(prediction.likely, chart)
    sure = f" {percent(spots[0].amount)}" if spots else ": not known where"
    return Ghost(spots, prediction.command, f"{label}{sure}")


def _track(picture: Picture, now_ns: int, chart: Chart) -> tuple[Spot, ...]:
    by_age = sorted(picture.visited.items(), key=lambda visit: visit[1])
    return tuple(_at(((place, to_s(now_ns - t_ns)) for place, t_ns in by_age), chart=chart))


def _policy(path: PathReview | None, chart: Chart) -> tuple[Spot, ...]:
    if path is None:
        return ()
    steps = [(token, step.cost_to_go) for step in path.path for token in step.sign]
    return tuple(_at([*steps, *((token, 0.0) for token in path.goal)], chart=chart))


def _goals(view: GroundView, chart: Chart) -> Iterator[GoalSpot]:
    for order, goal in enumerate(view.goals, start=1):
        cell: Cell | None = next(filter(None, map(chart.cells.get, goal.tokens)), None)
        if cell is not None:
            name = place_text(goal.tokens)
            yield GoalSpot(cell.east, cell.north, name, order, goal.is_sent)
