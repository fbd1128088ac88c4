"""What a mission file says of the link."""

from enum import StrEnum
from typing import Annotated

import msgspec
from msgspec import Meta

from farside.link.node import Direction, to_ns

NonNegative = Annotated[float, Meta(ge=0)]
Positive = Annotated[float, Meta(gt=0)]
Fraction = Annotated[float, Meta(ge=0, le=1)]
Count = Annotated[int, Meta(ge=1)]


class Section(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of the mission file. Unknown keys are refused."""


class OneWay(Section, frozen=True):
    """One direction of the link.

    Attributes:
        delay_s: propagation delay, the light time one way.
        rate_bit_s: rate cap in bit/s; unlimited where absent.
        queue_byte: bytes that may wait to be sent; one more and the newest frame is dropped
            (project default: 4096).
        loss: probability that a frame is lost on the way, each on its own.
    """

    delay_s: NonNegative
    rate_bit_s: Count | None = None
    queue_byte: Count = 4096
    loss: Fraction = 0.0


class Affected(StrEnum):
    """The directions that an outage takes away."""

    UP = "up"
    DOWN = "down"
    BOTH = "both"

    def includes(self, direction: Direction) -> bool:
        """Whether `direction` is affected."""
        return self is Affected.BOTH or self.value == direction.value


class Blackout(Section, frozen=True):
    """A scheduled outage from `start_s` up to, not including, `end_s` of simulated time.

    Raises:
        ValueError: if it ends before it starts.
    """

    start_s: NonNegative
    end_s: NonNegative
    direction: Affected = Affected.BOTH

    def __post_init__(self) -> None:
        if self.end_s <= self.start_s:
            raise ValueError(
                f"expected a blackout that ends after it starts, "
                f"found start_s = {self.start_s:g} and end_s = {self.end_s:g}"
            )

    @property
    def span_ns(self) -> tuple[int, int]:
        """Start and end in nanoseconds."""
        return to_ns(self.start_s), to_ns(self.end_s)


class LinkConfig(Section, frozen=True):
    """The `[link]` table: both directions, the blackouts, and a seed of its own if need be.

    Attributes:
        up, down: the two directions.
        blackouts: scheduled outages, at the rover's end of the path.
        seed: seeds the link's random streams in place of the mission's seed.
    """

    up: OneWay
    down: OneWay
    blackouts: tuple[Blackout, ...] = ()
    seed: Annotated[int, Meta(ge=0)] | None = None

    @property
    def lookahead_ns(self) -> int:
        """The shortest time that any frame takes: nodes may run this far ahead of each other."""
        return to_ns(min(self.up.delay_s, self.down.delay_s))

    @property
    def round_trip_ns(self) -> int:
        """Propagation both ways, without serialisation and waiting."""
        return to_ns(self.up.delay_s + self.down.delay_s)
