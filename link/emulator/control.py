"""Live control of the stand-alone emulator: its counters, and changes of its settings.

Both by a Zenoh `get` on the ground side:

    key                      payload of the get           reply
    farside/link/counters    none                         `EmulatorState` as JSON
    farside/link/control     what to change, as JSON      `EmulatorState` after the change

A change names `up`, `down` or `both`, each with keys of `OneWay` and their new values, and `out`:

    {"down": {"loss": 0.2, "jitter": {"spread_s": 0.1}}}
    {"both": {"out": true}}

A key replaces the previous value as a whole; `null` removes it. A delay or a rate also replaces
the alternative keys for it. `out` starts an outage, which lasts until it is `false` again. A change
is applied as a whole or, if anything in it is wrong, not at all, and an error message replied.
"""

from collections.abc import Mapping
from typing import Any

import msgspec

from farside.frames import OutageReason
from farside.link.profile.config import Affected, OneWay
from farside.node import Direction

COUNTERS_KEY = "farside/link/counters"
CONTROL_KEY = "farside/link/control"

_ALTERNATIVES = (("delay_s", "delay_table"), ("rate_bit_s", "rate_table", "rate_trace"))

_decode_change = msgspec.json.Decoder(dict[str, dict[str, Any]]).decode


class WayCounters(msgspec.Struct, kw_only=True):
    """What one direction has done so far, in messages and in bytes of payload.

    Every message received is still `in_flight` or counts once, among `delivered`, `lost`, `outage`,
    `queue_full`, `expired` and `bit_error`.

    Attributes:
        received, received_byte: from the sender's side.
        delivered, delivered_byte: to the other side, duplicates not counted.
        duplicated: delivered a second time.
        corrupted: delivered with wrong bits, duplicates included.
        lost, outage, queue_full, expired, bit_error: not delivered, by reason; see `Fate`.
        in_flight: queued or on the way.
        queries, replies, announcements: how many of `received` were queries; replies and ends of
            replies; tokens that appeared or vanished; all others were samples. Ends and
            announcements that were lost are sent again, and count again.
    """

    received: int = 0
    received_byte: int = 0
    delivered: int = 0
    delivered_byte: int = 0
    duplicated: int = 0
    corrupted: int = 0
    lost: int = 0
    outage: int = 0
    queue_full: int = 0
    expired: int = 0
    bit_error: int = 0
    in_flight: int = 0
    queries: int = 0
    replies: int = 0
    announcements: int = 0


class OutageState(msgspec.Struct, frozen=True):
    """Why a direction is out, and for how much longer; `None` if it was commanded out."""

    reason: OutageReason
    left_s: float | None


class WayState(msgspec.Struct, frozen=True):
    """One direction: its counters, its outage if there is one, and its settings."""

    counters: WayCounters
    outage: OutageState | None
    settings: OneWay


class SideState(msgspec.Struct, frozen=True):
    """One of the two Zenoh domains.

    Attributes:
        connected: how many of its nodes are connected to the emulator.
        unheard: messages delivered while none was, which nobody received.
    """

    connected: int
    unheard: int


class EmulatorState(msgspec.Struct, frozen=True):
    """The emulator, `elapsed_s` after its start.

    The sides are those of `farside.link.emulator.relay`; `None` without it.
    """

    elapsed_s: float
    up: WayState
    down: WayState
    rover_side: SideState | None = None
    ground_side: SideState | None = None

    def way(self, direction: Direction) -> WayState:
        """The state of one direction."""
        return self.up if direction is Direction.UP else self.down


class WayChange(msgspec.Struct, frozen=True):
    """The effect of a change on one direction; `None` for what stays."""

    settings: OneWay | None = None
    out: bool | None = None


def read_change(payload: bytes, settings: Mapping[Direction, OneWay]) -> dict[Direction, WayChange]:
    """Parse the payload of a `get` on `CONTROL_KEY`.

    Args:
        payload: JSON as at the top of this module.
        settings: of both directions before the change.

    Raises:
        ValueError: if it is no valid change, with a message for its sender.
    """
    try:
        tables = _decode_change(payload)
    except RecursionError as error:
        raise ValueError("expected a change, found tables nested too deeply") from error
    if unknown := sorted(tables.keys() - set(Affected)):
        raise ValueError(f"expected up, down or both, found {', '.join(unknown)}")
    changes = {}
    for direction in Direction:
        wanted: dict[str, Any] = {}
        for name in Affected:
            if name.includes(direction):
                wanted |= tables.get(name, {})
        if wanted:
            changes[direction] = _way_change(direction, wanted, settings[direction])
    if not changes:
        raise ValueError('expected a change such as {"down": {"loss": 0.2}}, found none')
    return changes


def _way_change(direction: Direction, wanted: dict[str, Any], before: OneWay) -> WayChange:
    try:
        out = msgspec.convert(wanted.pop("out", None), bool | None)
    except msgspec.ValidationError as error:
        raise ValueError(f"{direction}.out: {error}") from error
    return WayChange(changed(before, wanted, where=direction) if wanted else None, out)


def alternatives_to(key: str) -> list[str]:
    """The keys of `OneWay` that are alternatives to `key`, of which at most one may be given."""
    for alternatives in _ALTERNATIVES:
        if key in alternatives:
            return [name for name in alternatives if name != key]
    return []


def changed(before: OneWay, wanted: Mapping[str, Any], *, where: str) -> OneWay:
    """`before` with some keys replaced by plain values, or removed where they are `None`.

    Raises:
        ValueError: if a key is unknown or its value invalid; the message begins with `where`.
    """
    values = msgspec.to_builtins(before)
    for key in wanted:
        for other in alternatives_to(key):
            values.pop(other, None)
    values |= wanted
    given = {key: value for key, value in values.items() if value is not None}
    if unknown := sorted(given.keys() - set(OneWay.__struct_fields__)):
        raise ValueError(f"{where}: expected a key of a direction, found {', '.join(unknown)}")
    try:
        return msgspec.convert(given, OneWay)
    except msgspec.ValidationError as error:
        raise ValueError(f"{where}: {error}") from error
