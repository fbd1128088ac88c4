"""Live control of the stand-alone emulator: its counters, and changes of its settings.

Both by a Zenoh `get` on the ground side:

    key                      payload of the get           reply
    farside/link/counters    none                         `EmulatorState` as JSON
    farside/link/control     what to change, as JSON      `EmulatorState` after the change

A change is a `[link]` table as in a profile, laid over what was said of the link before; `null`
removes a key. Times in it count from the start of the emulator. `both` stands for `up` and `down`,
and `out` in any of them starts an outage, which lasts until it is `false` again:

    {"down": {"loss": 0.2, "jitter": {"spread_s": 0.1}}}
    {"both": {"out": true}}
    {"preset": "moon", "blackouts": [{"start_s": 600, "end_s": 900}]}

A change is applied as a whole or, if anything in it is wrong, not at all, and an error message
replied.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import msgspec

from farside.files import MAX_FILE_BYTE
from farside.frames import OutageReason
from farside.link.profile.config import Affected, OneWay
from farside.link.profile.layers import laid_over, refused
from farside.node import Direction
from farside.validation import shown

COUNTERS_KEY = "farside/link/counters"
CONTROL_KEY = "farside/link/control"

_EXPECTED = 'expected a change such as {"down": {"loss": 0.2}} or {"both": {"out": true}}'


class WayCounters(msgspec.Struct, kw_only=True):
    """What one direction has done so far, in messages and in bytes of payload.

    Every message received is still `in_flight` or counts once, among `delivered`, `lost`, `outage`,
    `queue_full`, `expired`, `bit_error`, `store_full` and `no_route`.

    Attributes:
        received, received_byte: from the sender's side.
        delivered, delivered_byte: to the other side, duplicates not counted.
        duplicated: delivered a second time.
        corrupted: delivered with wrong bits, duplicates included.
        lost, outage, queue_full, expired, bit_error: not delivered, by reason; see `Fate`.
        store_full, no_route: likewise, by way of other nodes.
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
    store_full: int = 0
    no_route: int = 0
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


class LinkChanged(NamedTuple):
    """What a `get` on `CONTROL_KEY` asks for.

    Attributes:
        layer: a table to lay over the link's, unchecked; empty if nothing but `out` is asked for.
        out: which directions are to be out, and which as scheduled again.
    """

    layer: Mapping[str, Any]
    out: Mapping[Direction, bool]


def read_change(payload: bytes) -> LinkChanged:
    """Parse the payload of a `get` on `CONTROL_KEY`.

    Args:
        payload: JSON as at the top of this module.

    Raises:
        ValueError: if it is no change, with a message for its sender.
    """
    if len(payload) > MAX_FILE_BYTE:
        raise ValueError(f"{_EXPECTED} of at most {MAX_FILE_BYTE} bytes, found {len(payload)}")
    if not payload.strip():
        raise ValueError(f"{_EXPECTED}, found nothing")
    try:
        table = msgspec.json.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{_EXPECTED}, found what is no JSON: {error}") from error
    except RecursionError as error:
        raise ValueError(f"{_EXPECTED}, found tables nested too deeply") from error
    if not isinstance(table, dict):
        raise refused((), f"{_EXPECTED}, found {shown(table)}")
    change = _split(table)
    if not (change.layer or change.out):
        raise ValueError(f"{_EXPECTED}, found none")
    return change


def _split(table: Mapping[str, Any]) -> LinkChanged:
    """Take apart what a table says of the link's settings and of outages at once."""
    layer = {key: value for key, value in table.items() if key not in set(Affected)}
    out: dict[Direction, bool] = {}
    for affected in (Affected.BOTH, Affected.UP, Affected.DOWN):  # what is more exact stands
        way = table.get(affected.value, {})
        if affected is Affected.BOTH and not isinstance(way, dict):
            raise refused(("both",), f"expected a table, found {shown(way)}")
        settings = way
        if isinstance(way, dict):
            settings = {key: value for key, value in way.items() if key != "out"}
            now = way.get("out")
            if not isinstance(now, bool | None):
                raise refused((affected, "out"), f"expected true or false, found {shown(now)}")
            out |= {one: now for one in Direction if affected.includes(one) and now is not None}
        if settings != {}:
            ways = {one.value: settings for one in Direction if affected.includes(one)}
            layer = laid_over(layer, ways)
    return LinkChanged(layer, out)
