"""What a mission most likely does not mean, though it can be run: steps that can never go on."""

from collections.abc import Iterable, Iterator, Sequence

from farside.control import Mode
from farside.ground.config import (
    AwaitReached,
    GroundConfig,
    GuideConfig,
    Leave,
    Pursue,
    RecordedConfig,
    ScriptStep,
    Supervise,
    SupervisorConfig,
    SwitchMode,
    Teach,
    Tour,
    WaitUntil,
)
from farside.link.profile.config import LinkConfig
from farside.link.profile.schedule import outages_of
from farside.missions.schema import ChargeExpected, MissionFile, ReachedExpected
from farside.node import Direction, to_ns
from farside.rover.config import HEARTBEATS, DemConfig
from farside.validation import Problem, shown

_RARELY_LOST = 0.5
"""A link that loses fewer of its frames than this is not taken for lost by chance."""


def warnings(mission: MissionFile) -> Iterator[Problem]:
    """What can never come about in a mission, each at its key, in order of the file.

    Only what is certain from the mission file is warned of: where the link may be lost at times
    that nobody scheduled, the rover may turn to its goals by itself.

    Args:
        mission: a checked mission, its link resolved.
    """
    plan = _Plan(mission)
    if 2 * mission.rover.body.radius_m >= mission.world.cell_m:
        text = f"the rover is as wide as a cell of {mission.world.cell_m:g} m: it will be blocked"
        yield Problem(("rover", "body", "radius_m"), text)
    yield from _unread(mission)
    yield from _grace(mission)
    for number, step in enumerate(mission.ground.steps or ()):
        yield from _step(("ground", "script", str(number)), step, plan, mission)
    yield from _expectations(mission, plan)


def _step(
    key: tuple[str, ...], step: ScriptStep, plan: "_Plan", mission: MissionFile
) -> Iterator[Problem]:
    """The problems with a step, which takes the plan further."""
    match step:
        case Tour(places=places) if places:
            plan.at = places[-1]
            yield from _unseen(key, places, mission)
        case SwitchMode(mode=mode):
            plan.mode = mode
        case Pursue():
            yield from _pursue(key, step, plan)
        case Teach():
            plan.at = None
        case Leave(goals=goals):
            plan.send(Mode.AUTONOMOUS, [wanted.place for wanted in goals])
        case Supervise(goals=goals, mode=mode):
            plan.send(Mode(mode), [wanted.place for wanted in goals])
            if not goals:
                yield Problem((*key, "goals"), "there is no goal: nothing is done")
        case AwaitReached(place=place):
            yield from _unwanted((*key, "place"), "waits for", place, plan)
        case WaitUntil(until_s=until_s) if until_s >= mission.duration_s:
            text = f"waits until {until_s:g} s, but the run ends at {mission.duration_s:g} s"
            yield Problem((*key, "until_s"), text)
        case _:
            pass


def _unread(mission: MissionFile) -> Iterator[Problem]:
    """What a controller or an operator of one's own has no use for."""
    rover, ground = mission.rover, mission.ground
    tables: dict[str, tuple[str, object, object]] = {
        "script": ("scripted", ground.script, ()),
        "guide": ("guide", ground.guide, GuideConfig()),
        "supervisor": ("supervisor", ground.supervisor, SupervisorConfig()),
        "recorded": ("recorded", ground.recorded, RecordedConfig()),
    }
    for table, (reader, found, default) in tables.items():
        if ground.operator != reader and found != default:
            text = f"is not read: ground.operator is {shown(ground.operator)}"
            yield Problem(("ground", table), text)
    if ground.rules and not _reads_rules(ground):
        text = "are not read: no step answers proposals or supervises"
        if ground.operator != "scripted":
            text = f"are not read: ground.operator is {shown(ground.operator)}"
        yield Problem(("ground", "rules"), text)
    if rover.controller != "dem" and rover.dem != DemConfig():
        text = f"is not read: rover.controller is {shown(rover.controller)}"
        yield Problem(("rover", "dem"), text)
    if rover.controller == "queued" and rover.avoid:
        text = f"is not read: rover.controller is {shown(rover.controller)}"
        yield Problem(("rover", "avoid"), text)


def _reads_rules(ground: GroundConfig) -> bool:
    return any(isinstance(step, Pursue | Supervise) for step in ground.steps or ())


def _grace(mission: MissionFile) -> Iterator[Problem]:
    """The problem with heartbeats so rare that silence counts later than the mission says."""
    least_s = HEARTBEATS * mission.ground.heartbeat_s
    if mission.rover.failsafe.hold_after_s < least_s:
        beats = f"which is {HEARTBEATS:g} heartbeats: a single lost one is none"
        text = f"silence counts from {least_s:g} s on, {beats}"
        yield Problem(("rover", "failsafe", "hold_after_s"), text)


def _unseen(key: tuple[str, ...], places: Sequence[str], mission: MissionFile) -> Iterator[Problem]:
    """The problem with driving to a place in terrain shadow: the ground never sees it done."""
    chart = mission.world.chart()
    for number, place in enumerate(places):
        if chart.places[place] in chart.shadow:
            text = f"{place} lies in terrain shadow: the ground cannot see the rover arrive there"
            yield Problem((*key, "places", str(number)), text)


class _Plan:
    """What is known of a run as the script goes on.

    Attributes:
        is_scripted: whether the mission says what the operator does. Of any other nothing is known.
        mode: the rover's, if the link is not lost.
        at: the place where the rover is, `None` if that is not known.
        wanted: the places that the operator has set as goals.
        preloaded: the mission goals.
        lost_after_s: the silence after which the rover takes up the mission goals.
        loses_link: whether there may be such a silence.
    """

    def __init__(self, mission: MissionFile) -> None:
        self.is_scripted = mission.ground.steps is not None
        self.mode = Mode.GUIDED
        self.at: str | None = mission.rover.start
        self.wanted: set[str] = set()
        self.preloaded = {goal.place for goal in mission.rover.goals}
        self.lost_after_s = mission.rover.failsafe.lost_after_s
        # Silence begins with the last heartbeat before an outage, and ends with the first after it.
        least_s = self.lost_after_s - 2 * mission.ground.heartbeat_s
        self.loses_link = bool(mission.world.chart().shadow) or _may_be_lost(
            mission.link, max(0, to_ns(least_s))
        )

    def send(self, mode: Mode, places: Iterable[str]) -> None:
        """Goals are sent in a mode; where the rover is afterwards, is not known."""
        self.mode, self.at = mode, None
        self.wanted.update(places)


def _may_be_lost(link: LinkConfig, least_ns: int) -> bool:
    """Whether the rover may take the link for lost, in an outage of `least_ns` or by chance."""
    up = link.up
    rare = isinstance(up.loss, float | int) and max(up.loss, up.corrupt) < _RARELY_LOST
    if not rare or up.bit_error_rate or up.rate_table or up.rate_trace or link.changes:
        return True
    outages = outages_of(link, Direction.UP)
    return any(outage.end_ns - outage.begin_ns >= least_ns for outage in outages)


def _pursue(key: tuple[str, ...], step: Pursue, plan: _Plan) -> Iterator[Problem]:
    plan.wanted.add(step.place)
    if plan.mode is Mode.GUIDED and plan.at != step.place and not plan.loses_link:
        text = (
            f"waits for goal {step.place} to be reached, but a guided rover acts on no goal: put a "
            'step with do = "mode" and mode = "shared" before it'
        )
        yield Problem((*key, "do"), text)
    plan.at = step.place


def _unwanted(key: tuple[str, ...], verb: str, place: str, plan: _Plan) -> Iterator[Problem]:
    """The problem with a place to be reached as a goal that nobody ever wants."""
    plan.at = None
    if (
        not plan.is_scripted
        or place in plan.wanted
        or (place in plan.preloaded and plan.loses_link)
    ):
        return
    text = f"{verb} goal {place}, which no step before sets, and which is not in rover.goals"
    if place in plan.preloaded:
        text = (
            f"{verb} goal {place} of rover.goals, which is pursued only when the link is lost: "
            f"no outage of the uplink lasts {plan.lost_after_s:g} s"
        )
    yield Problem(key, text)


def _expectations(mission: MissionFile, plan: _Plan) -> Iterator[Problem]:
    for number, expected in enumerate(mission.expect):
        key = ("expect", str(number))
        match expected:
            case ReachedExpected(place=place, in_blackout=in_blackout):
                yield from _unwanted((*key, "place"), "expects", place, plan)
                if in_blackout and not mission.link.blackouts:
                    yield Problem((*key, "in_blackout"), "the mission has no blackout")
            case ChargeExpected(at_least=charge) if charge > mission.rover.battery.initial:
                text = f"the battery begins with less: {mission.rover.battery.initial:g}"
                yield Problem((*key, "at_least"), text)
            case _:
                pass
