"""The price of the shadow: bits a cycle, share of the downlink, and the time to catch up.

Beside it stands what it would cost to send the policy map of the present goal in every cycle, as
compressed MessagePack with the same frames around it: no map of any other goal, no probabilities,
and nothing to compute a way from elsewhere with.
"""

import zlib
from typing import Any

import msgspec
from nodes import flown
from noting import view_of

from farside.dem import DynamicExpectancyModel
from farside.logs import RunView
from farside.missions import load_mission
from farside.missions.loading import shipped_missions
from farside.topics import GROUND_SHADOW, ROVER_MODEL

MISSIONS = tuple(shipped_missions())
OUTAGE_S = 60.0
"""How long an outage is at least for the time to catch up after it to count."""


class MapSizes:
    """The lengths of the policy map at the end of every cycle of a model, compressed."""

    def __init__(self) -> None:
        self.size_byte: list[int] = []

    def watch(self, model: DynamicExpectancyModel) -> None:
        """Measure from now on."""
        perform = model.perform

        def measured(action: str | None) -> None:
            table = msgspec.msgpack.encode([msgspec.structs.astuple(r) for r in model.policy_map()])
            self.size_byte.append(len(zlib.compress(table)))
            perform(action)

        model.perform = measured  # type: ignore[method-assign]


def priced(name: str, seed: int) -> dict[str, Any]:
    """One run of a shipped mission, and what its shadow took of the link."""
    maps = MapSizes()
    flight = flown(load_mission(name, {"seed": seed}).mission, maps.watch)
    view = view_of(flight.records)
    price = view.shadow
    assert price is not None
    assert flight.shadow is not None
    payload_byte = sum(entry.size_byte for _, entry in view.each(ROVER_MODEL))
    around_byte = (price.downlink_byte - payload_byte) / price.updates
    cycles = len(maps.size_byte)
    return {
        "mission": name,
        "seed": seed,
        "cycles": cycles,
        "updates": price.updates,
        "payload_byte": payload_byte,
        "downlink_byte": price.downlink_byte,
        "report_byte": price.report_byte,
        "downlink_share": price.downlink_share,
        "bits_per_cycle": 8 * price.downlink_byte / cycles,
        "map_bits_per_cycle": 8 * (sum(maps.size_byte) / cycles + around_byte),
        "largest_map_byte": max(maps.size_byte),
        "catch_up_s": catching_up(view),
        "equal": flight.shadow.in_step
        and flight.shadow.model.hypotheses == flight.model.hypotheses,
    }


def catching_up(view: RunView) -> list[float]:
    """For each long outage: how long after it the ground first held what came of it."""
    made = {entry.number: t_s for t_s, entry in view.each(ROVER_MODEL)}
    held = [(t_s, made[entry.number]) for t_s, entry in view.each(GROUND_SHADOW) if entry.in_step]
    ends = sorted({span.end_s for span in view.outages if span.end_s - span.start_s >= OUTAGE_S})
    first = (next((t_s - end_s for t_s, so_s in held if so_s >= end_s), None) for end_s in ends)
    return [time_s for time_s in first if time_s is not None]
