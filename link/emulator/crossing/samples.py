"""What is published in one domain: taken there, and published in the other.

A message keeps its key, encoding, attachment, priority, timestamp, source and kind (put or delete).
It is published with congestion control `BLOCK`, so none is lost except by the link: a slow receiver
makes the emulator wait.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

import zenoh

from farside.link.emulator.control import CONTROL_KEY, COUNTERS_KEY

PRIORITIES = (
    zenoh.Priority.BACKGROUND,
    zenoh.Priority.DATA_LOW,
    zenoh.Priority.DATA,
    zenoh.Priority.DATA_HIGH,
    zenoh.Priority.INTERACTIVE_LOW,
    zenoh.Priority.INTERACTIVE_HIGH,
    zenoh.Priority.REAL_TIME,
)
"""Zenoh's priorities by frame priority, from the lowest."""

_PRIORITY_OF = {int(priority): number for number, priority in enumerate(PRIORITIES)}  # type: ignore[call-overload]

DEFAULT_PRIORITY = PRIORITIES.index(zenoh.Priority.DATA)
"""The frame priority of what Zenoh does not show the priority of."""

OWN_KEYS = tuple(map(zenoh.KeyExpr, (CONTROL_KEY, COUNTERS_KEY)))
"""Those of the emulator itself, which never cross."""

_MAX_SHARED = 4096

_Value = TypeVar("_Value")

Metadata = tuple[
    zenoh.KeyExpr,
    bool,
    int,
    bool,
    zenoh.Encoding,
    zenoh.ZBytes | None,
    zenoh.Timestamp | None,
    zenoh.SourceInfo | None,
]
"""Everything of a sample but its payload: key, whether it deletes, frame priority, express,
encoding, attachment, timestamp, source. The sample itself would take twice the memory, since it
keeps alive the whole batch that it was received in."""


def subscribe(
    near: zenoh.Session, keys: Sequence[zenoh.KeyExpr], take: Callable[[zenoh.Sample], None]
) -> None:
    """Have each sample on any of `keys` taken once; not those published by `near` itself."""
    for number, key in enumerate(keys):
        # What a subscriber before takes as well is not taken twice.
        others = [other for other in (*OWN_KEYS, *keys[:number]) if other.intersects(key)]
        listener = _unless_on(others, take)
        near.declare_subscriber(key, listener, allowed_origin=zenoh.Locality.REMOTE)


def _unless_on(
    others: Sequence[zenoh.KeyExpr], take: Callable[[zenoh.Sample], None]
) -> Callable[[zenoh.Sample], None]:
    if not others:
        return take

    def listen(sample: zenoh.Sample) -> None:
        if not any(key.intersects(sample.key_expr) for key in others):
            take(sample)

    return listen


class MetadataReader:
    """Reads the metadata of samples; a million messages share few different keys."""

    def __init__(self) -> None:
        self._keys: dict[zenoh.KeyExpr, zenoh.KeyExpr] = {}
        self._encodings: dict[zenoh.Encoding, zenoh.Encoding] = {}

    def read(self, sample: zenoh.Sample) -> Metadata:
        """The metadata of `sample`."""
        return (
            _shared(self._keys, sample.key_expr),
            sample.kind == zenoh.SampleKind.DELETE,
            _PRIORITY_OF[int(sample.priority)],  # type: ignore[call-overload]
            sample.express,
            _shared(self._encodings, sample.encoding),
            sample.attachment,
            sample.timestamp,
            sample.source_info,
        )


def _shared(kept: dict[_Value, _Value], value: _Value) -> _Value:
    """`value`, or an equal one kept before."""
    if len(kept) == _MAX_SHARED:
        kept.clear()
    return kept.setdefault(value, value)


def publish(far: zenoh.Session, payload: bytes, metadata: Metadata) -> None:
    """Put or delete as the sample did."""
    key, deletes, priority, express, encoding, attachment, timestamp, source = metadata
    if deletes:
        far.delete(
            key,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=PRIORITIES[priority],
            express=express,
            attachment=attachment,
            timestamp=timestamp,
            source_info=source,
        )
        return
    far.put(
        key,
        payload,
        encoding=encoding,
        congestion_control=zenoh.CongestionControl.BLOCK,
        priority=PRIORITIES[priority],
        express=express,
        attachment=attachment,
        timestamp=timestamp,
        source_info=source,
    )
