"""What of a mission can change while it runs, and how that acts on the live objects."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import msgspec

from farside.dem import DynamicExpectancyModel
from farside.ground.config import GroundConfig
from farside.ground.node import Ground
from farside.link.channel.node import Channel
from farside.messages import Tokens
from farside.missions.build import build_operator
from farside.missions.extensions.kinds import NONE, Extensions
from farside.missions.schema import MissionFile
from farside.places import place_token
from farside.rover.config import RoverConfig
from farside.rover.controller import change_aversions
from farside.rover.node import Rover
from farside.rover.world.faults import Faults
from farside.validation import Key, Problem

_START = "it acts at the start only"
_AGREED = "both ends agreed on it before the start"
_DRAWN = "numbers have been drawn from it since the start"
_LEARNED = "what was learned until then is laid out by it"
_OWN = "a controller of one's own does not go by it"
_DRIVEN = "the motion under way, and what the ground reckons with, was made by it"
_MODEL = "rover", "dem"

_MAY: Mapping[Key, str | None] = {
    (): _START,
    ("about",): None,
    ("duration_s",): None,
    ("expect",): None,
    ("seed",): _DRAWN,
    ("tick_s",): "all steps before were of this length",
    ("world",): "the rover has driven and learned in this yard",
    ("link",): _AGREED,
    ("link", "seed"): _DRAWN,
    ("link", "up"): None,
    ("link", "down"): None,
    ("link", "blackouts"): None,
    ("link", "changes"): None,
    ("rover", "controller"): "another one would know nothing of what was learned",
    ("rover", "controller_options"): _START,
    ("rover", "shadow"): _AGREED,
    ("rover", "body"): _DRIVEN,
    ("rover", "drive"): _DRIVEN,
    ("rover", "sensors"): _DRIVEN,
    ("rover", "goals"): None,
    ("rover", "avoid"): None,
    ("rover", "failsafe"): None,
    ("rover", "consent"): None,
    ("rover", "faults"): None,
    ("rover", "battery"): None,
    ("rover", "battery", "initial"): _START,
    _MODEL: None,
    (*_MODEL, "reach"): _LEARNED,
    ("ground",): None,
    ("ground", "heartbeat_s"): _AGREED,
}
"""Why a key, and all below it, cannot change during a run; `None` where it can. The longest key
counts."""


class Live(NamedTuple):
    """The nodes of a run, alive."""

    rover: Rover
    link: Channel
    ground: Ground


def why_fixed(key: Key) -> str | None:
    """Why a key of the mission cannot change during a run; `None` if it can."""
    length = max(n for n in range(len(key) + 1) if key[:n] in _MAY)
    return _MAY[key[:length]]


def refusals(before: MissionFile, after: MissionFile) -> Iterator[Problem]:
    """Why one mission cannot become another while it runs, by key; nothing if it can."""
    for key in different_keys(before, after):
        why = why_fixed(key)
        if key[:2] == _MODEL and after.rover.controller != "dem":
            why = _OWN
        if why is not None:
            yield Problem(key, f"expected no change during the run: {why}")


def different_keys(before: MissionFile, after: MissionFile) -> Iterator[Key]:
    """The keys whose values differ; arrays count as a whole."""
    yield from _different(msgspec.to_builtins(before), msgspec.to_builtins(after), ())


def _different(before: Any, after: Any, key: Key) -> Iterator[Key]:
    if isinstance(before, dict) and isinstance(after, dict):
        for name in {**before, **after}:
            yield from _different(before.get(name), after.get(name), (*key, name))
    elif before != after:
        yield key


def change(
    live: Live, before: MissionFile, after: MissionFile, now_ns: int, extensions: Extensions
) -> None:
    """Have live nodes go by another mission from `now_ns` on.

    The channel is the other link from then on. What both ends have agreed on beforehand stays:
    nobody foresees what changes. Nor is the ground told of what changes on board, but for the
    parameters of the model, without which its shadow could not follow.

    Args:
        live: the nodes, between two windows.
        before: the mission so far.
        after: the mission from now on, without `refusals`.
        now_ns: the present.
        extensions: the controller and operator of one's own.

    Raises:
        ExtensionError: if an operator of one's own is not found.
    """
    if after.link != before.link:
        live.link.adopt(after.link)
    if after.rover != before.rover:
        _change_rover(live.rover, after.rover, now_ns)
        if live.ground.shadow is not None and after.rover.dem != before.rover.dem:
            live.ground.shadow.model.agree(after.rover.dem)
    if after.ground != before.ground:
        coming = msgspec.structs.replace(after, ground=_still_to_come(after.ground, now_ns))
        same = after.ground.operator == before.ground.operator
        live.ground.change(after.ground, build_operator(coming, extensions if same else NONE))


def _still_to_come(ground: GroundConfig, now_ns: int) -> GroundConfig:
    """The `[ground]` table without the recorded orders that are past."""
    recorded = ground.recorded
    orders = tuple(line for line in recorded.orders or () if line.time_ns >= now_ns)
    progress = tuple(line for line in recorded.progress if line.time_ns >= now_ns)
    coming = msgspec.structs.replace(recorded, orders=orders, progress=progress)
    return msgspec.structs.replace(ground, recorded=coming)


def _change_rover(rover: Rover, config: RoverConfig, now_ns: int) -> None:
    """Have a rover go by another `[rover]` table from now on.

    What it was told stays: goals that were reached or withdrawn, and what the operator said of
    `on_loss`. A proposal that stands keeps its veto window. The charge is the energy left.
    """
    before, rover.config = rover.config, config
    parts, failsafe = rover.parts, config.failsafe
    parts.journal.now_ns = now_ns
    if config.dem != before.dem and isinstance(rover.controller, DynamicExpectancyModel):
        rover.controller.change(config.dem)
    parts.silence.change(failsafe)
    rover.pilot.change(failsafe)
    parts.proposals.change(config.consent, parts.silence.grace_ns)
    parts.battery.change(config.battery)
    parts.gate.factor = config.battery.reserve
    parts.goals.change_mission(_goals(before), _goals(config))
    change_aversions(rover.controller, before.aversions, config.aversions)
    rover.faults = Faults(config.faults)


def _goals(config: RoverConfig) -> dict[Tokens, float]:
    return {(place_token(goal.place),): goal.priority for goal in config.goals}
