"""Which keys of a mission can change while it runs, and that all that was made of them changes."""

from collections.abc import Iterator
from functools import cache
from typing import Any

import msgspec
import pytest
from insides import insides
from short_life import SHORT

from farside.control import Mode
from farside.dem.parameters import OWN_RULES
from farside.messages import SetMode
from farside.missions import load_mission
from farside.missions.build import build_channel, build_ground, build_operator, build_rover
from farside.missions.extensions.kinds import NONE
from farside.missions.reliving.changing import Live, change, refusals, why_fixed
from farside.missions.schema import MissionFile
from farside.validation import Key, dotted

_UNSEEN = "duration_s", "about", "expect", "ground.recorded.log", "ground.operator_options"
"""What nothing that Farside brings is made of: what a run is judged by, what is read as the mission
is loaded, and what an operator of one's own is made with."""

RULES = [{"rule": "probability", "above": 0.9}]
_WAY: dict[str, Any] = {
    "delay_s": 1.5,
    "delay_table": [{"t_s": 0.0, "delay_s": 1.0}, {"t_s": 9.0, "delay_s": 2.0}],
    "delay_trace": {"points": [{"t_s": 0.0, "delay_s": 1.0}, {"t_s": 9.0, "delay_s": 2.0}]},
    "rate_bit_s": 1234,
    "rate_table": [{"t_s": 0.0, "rate_bit_s": 900}],
    "rate_trace": {"times_ms": [10, 20]},
    "overhead_byte": 9,
    "queue_byte": 5000,
    "queue_frame": 7,
    "drop": "oldest",
    "lifetime_s": 3.0,
    "loss": 0.3,
    "bit_error_rate": 0.01,
    "bit_errors": "flip",
    "corrupt": 0.1,
    "jitter": {"spread_s": 0.2},
    "reorder": {"share": 0.2, "hold_s": 0.3},
    "duplicate": 0.2,
    "slots": {"min_s": 0.2, "max_s": 0.3},
}
_OTHERS: dict[str, Any] = {
    **{f"link.{way}.{key}": value for way in ("up", "down") for key, value in _WAY.items()},
    "link.blackouts": [{"start_s": 15.0, "end_s": 30.0, "direction": "up"}],
    "link.changes": [{"at_s": 25.0, "loss": 0.3}],
    "rover.goals": [{"place": "A"}, {"place": "C", "priority": 3.0}],
    "rover.avoid": [{"cost_s": 50.0, "place": "A"}, {"cost_s": 5.0, "token": "battery:low"}],
    "rover.faults": [{"what": "tilt", "start_s": 20.0, "end_s": 35.0}],
    "rover.failsafe.hold_after_s": 7.0,
    "rover.failsafe.lost_after_s": 17.0,
    "rover.failsafe.on_loss": "hold",
    "rover.failsafe.return_to": "signal",
    "rover.failsafe.return_priority": 0.7,
    "rover.failsafe.tilt_limit_rad": 0.3,
    "rover.consent.by": "veto",
    "rover.consent.veto_window_s": 99.0,
    "rover.battery.capacity_j": 20_000.0,
    "rover.battery.idle_w": 11.0,
    "rover.battery.drive_w": 12.0,
    "rover.battery.charge_w": 13.0,
    "rover.battery.low": 0.3,
    "rover.battery.charged": 0.8,
    "rover.battery.charge_priority": 3.0,
    "rover.battery.reserve": 2.0,
    "rover.dem.alpha": 0.1,
    "rover.dem.beta": 0.1,
    "rover.dem.learning_probability": 0.1,
    "rover.dem.initial_cm": 0.1,
    "rover.dem.improbable": 0.1,
    "rover.dem.plain": True,
    **{f"rover.dem.{rule}": False for rule in OWN_RULES},
    "rover.dem.maturity": 9,
    "rover.dem.ineffective": 0.01,
    "rover.dem.break_multiple": 99.0,
    "rover.dem.recovery": 99,
    "rover.dem.values": "expected",
    "rover.dem.exploration": "curious",
    "rover.dem.curiosity.optimistic_cost": 99.0,
    "rover.dem.curiosity.restlessness": 9.0,
    "ground.operator": "queued",
    "ground.script": [{"do": "tour", "places": ["C"]}],
    "ground.guide.times": 2,
    "ground.guide.ahead": 2,
    "ground.supervisor.goals": [{"place": "A"}],
    "ground.supervisor.mode": "autonomous",
    "ground.supervisor.patience_s": 9.0,
    "ground.recorded.orders": [{"time_ns": 5, "json": '{"act":{"type":"veto","proposal":1}}'}],
    "ground.recorded.progress": [{"time_ns": 5, "json": '{"step":1,"of":2,"waiting_for":null}'}],
    "ground.rules": RULES,
    "ground.silent_after_s": 9.0,
    "ground.command_lifetime_s": 9.0,
}
"""For each key that can change another value than in the short mission."""

_WITH: dict[str, dict[str, Any]] = {
    "rover.consent.veto_window_s": {"rover.consent.by": "veto"},
    "ground.guide": {"ground.operator": "guide"},
    "ground.supervisor": {"ground.operator": "supervisor"},
    "ground.recorded": {"ground.operator": "recorded", "ground.recorded.orders": []},
}
"""With what else a key acts at all."""

_LEFT_OUT = {
    "link": (".agenda", "._outages_noted"),  # what is told of outages, numbered
    "ground": ("._progress",),  # the last that was told of it
}
"""Of a node that changes, what is of before."""


def keys(kind: type[msgspec.Struct] = MissionFile, above: Key = ()) -> Iterator[Key]:
    """All keys of a mission that are no tables of keys themselves."""
    for field in msgspec.structs.fields(kind):
        key = (*above, field.name)
        if isinstance(field.type, type) and issubclass(field.type, msgspec.Struct):
            yield from keys(field.type, key)
        else:
            yield key


def assigned(mission: MissionFile, values: dict[str, Any]) -> MissionFile:
    """A mission with other values, in place of what cannot be beside them."""
    data = msgspec.to_builtins(mission)
    for key, value in values.items():
        *path, last = key.split(".")
        table = data
        for part in path:
            table = table[part]
        for stem in ("delay_", "rate_"):
            if last.startswith(stem) and path[0] == "link":
                for other in [name for name in table if name.startswith(stem)]:
                    del table[other]
        table[last] = value
    return msgspec.convert(data, MissionFile)


def alive(mission: MissionFile) -> Live:
    ground = build_ground(mission, build_operator(mission))
    return Live(build_rover(mission), build_channel(mission), ground)


@cache
def short() -> MissionFile:
    return load_mission("blackout", SHORT).mission


def test_the_keys_that_can_change_are_these_and_all_others_are_refused() -> None:
    able = {dotted(key) for key in keys() if why_fixed(key) is None}
    assert able == {*_OTHERS, *_UNSEEN}


@pytest.mark.parametrize("key", _OTHERS)
def test_all_that_was_made_of_a_key_changes_with_it(key: str) -> None:
    """At the start a node that changes is as one that is made so; nothing keeps a copy."""
    needed = next((values for stem, values in _WITH.items() if key.startswith(stem)), {})
    before = assigned(short(), needed)
    after = assigned(before, {key: _OTHERS[key]})
    live, table = alive(before), key.split(".", maxsplit=1)[0]
    was, made = node(live, table), node(alive(after), table)

    change(live, before, after, 0, NONE)

    assert was != made
    assert node(live, table) == made


def node(live: Live, table: str) -> dict[str, str]:
    """What the node that goes by a table of the mission holds."""
    left_out = _LEFT_OUT.get(table, ())
    held = insides(getattr(live, table))
    return {path: leaf for path, leaf in held.items() if not any(one in path for one in left_out)}


def test_a_controller_of_ones_own_is_not_given_the_parameters_of_farsides() -> None:
    own = assigned(short(), {"rover.controller": "mine:Mine"})
    (problem,) = refusals(own, assigned(own, {"rover.dem.alpha": 0.1}))
    assert (problem.key, "of one's own" in problem.text) == (("rover", "dem", "alpha"), True)


def test_rules_of_scripts_do_not_unseat_who_goes_by_none() -> None:
    """What was ordered already is not lost with it."""
    queued = assigned(short(), {"ground.operator": "queued"})
    live = alive(queued)
    live.ground.order([SetMode(Mode.SHARED)])
    present = live.ground.operator

    change(live, queued, assigned(queued, {"ground.rules": RULES}), 0, NONE)

    assert live.ground.operator is present
