"""The link as a mission file, or a profile of `farside link`, describes it.

Some tables name a file or an ephemeris. `farside.link.profile.resolve` replaces them by plain
tables, so that whatever simulates reads no files.
"""

from enum import StrEnum
from typing import Annotated

import msgspec
from msgspec import Meta

from farside.frames import OutageReason
from farside.link.profile.ephemeris import Ephemeris
from farside.link.profile.hops.routing import Routing
from farside.link.profile.impairments import Jitter, LossModel, Reorder, Slots
from farside.node import Direction, to_ns
from farside.settings import Count, Fraction, NonNegative, Positive, Section, expect_growing
from farside.validation import MEASURED

DELAY_KEYS = ("delay_s", "delay_table", "delay_trace")
"""The keys of a direction that give its delay, of which one at most may be there."""

RATE_KEYS = ("rate_bit_s", "rate_table", "rate_trace")
"""The keys of a direction that give its rate, of which one at most may be there."""

EPHEMERIS_FILES = ("kernel", "horizons")
"""The keys of an ephemeris that name its files, of which one at most may be there."""


class DropPolicy(StrEnum):
    """Which frame a full queue drops: the newest, the oldest, or one of the lowest priority."""

    NEWEST = "newest"
    OLDEST = "oldest"
    LOWEST = "lowest"


class BitErrorEffect(StrEnum):
    """What a bit error does: lose the frame, or let it arrive with the bit flipped."""

    LOSE = "lose"
    FLIP = "flip"


class AtEnd(StrEnum):
    """What follows the last line of a trace: the first one again, or nothing more."""

    WRAP = "wrap"
    END = "end"


class AfterLast(StrEnum):
    """What follows the last point of a measured delay: it stays, or the first one comes again."""

    HOLD = "hold"
    WRAP = "wrap"


class DelayPoint(Section, frozen=True):
    """The propagation delay of what is sent at a time; linear between the points.

    Attributes:
        t_s: the simulated time of sending.
        delay_s: the delay then.
    """

    t_s: NonNegative
    delay_s: NonNegative


class DelayTrace(Section, frozen=True):
    """A measured propagation delay; linear between the points, and before the first as there.

    Attributes:
        file: path of the measurement, a time and a one-way delay per line; see
            `farside.link.profile.plans.delays`.
        points: its lines.
        at_end: what follows the last point. If it wraps, that point stands at the time 0 of the
            next round.

    Raises:
        ValueError: if the times do not grow, or a round has no length.
    """

    file: str | None = None
    points: Annotated[tuple[DelayPoint, ...], MEASURED] = ()
    at_end: AfterLast = AfterLast.HOLD

    def __post_init__(self) -> None:
        expect_growing("points", [point.t_s for point in self.points])
        if self.at_end is AfterLast.WRAP and self.points and not self.points[-1].t_s:
            raise ValueError("points: expected a last t_s above 0 for what wraps, found 0")


class RateStep(Section, frozen=True):
    """The rate from a time on.

    Attributes:
        t_s: the simulated time.
        rate_bit_s: the rate from then on; 0 for none.
    """

    t_s: NonNegative
    rate_bit_s: Annotated[int, Meta(ge=0)]


class Trace(Section, frozen=True):
    """Delivery opportunities of 1500 bytes each, in mahimahi's format.

    Attributes:
        file: path of the trace, one whole number of milliseconds per line.
        times_ms: its lines.
        at_end: what follows the last line.

    Raises:
        ValueError: if the times fall, or none is above 0, since a trace must have a length.
    """

    file: str | None = None
    times_ms: Annotated[tuple[Annotated[int, Meta(ge=0)], ...], MEASURED] = ()
    at_end: AtEnd = AtEnd.WRAP

    def __post_init__(self) -> None:
        expect_growing("times_ms", self.times_ms, may_repeat=True)
        if self.times_ms and not self.times_ms[-1]:
            raise ValueError("times_ms: expected a last time above 0 ms, found 0")


class OneWay(Section, frozen=True):
    """One direction of the link. What is absent does not impair.

    Attributes:
        delay_s: propagation delay, the light time one way.
        delay_table: the same over time, in place of `delay_s`.
        delay_trace: the same as measured, in place of either.
        rate_bit_s: rate cap in bit/s; unlimited where absent.
        rate_table: the same over time, in place of `rate_bit_s`; starts at 0 s.
        rate_trace: delivery opportunities, in place of either.
        overhead_byte: bytes sent with each frame on top of its own; at most 65,535, as for a frame.
        queue_byte: bytes that may wait in the transmit queue (project default: 4096).
        queue_frame: frames that may wait; any number where absent.
        drop: which frame is dropped when either limit is exceeded.
        lifetime_s: how long a frame without a lifetime of its own may wait; it is dropped when its
            turn comes later.
        loss: probability that a frame is lost, or a model with memory.
        bit_error_rate: probability that a bit arrives wrong, independently of all others.
        bit_errors: what such an error does.
        corrupt: probability that one bit of a frame is flipped.
        jitter: delay on top of the propagation.
        reorder: frames held back, so that later ones overtake them.
        duplicate: probability that a frame arrives twice.
        slots: when frames are let through, in bursts; at any time where absent.

    Raises:
        ValueError: if delay or rate is given in two ways, or a table is out of order.
    """

    delay_s: NonNegative | None = None
    delay_table: Annotated[tuple[DelayPoint, ...], MEASURED] = ()
    delay_trace: DelayTrace | None = None
    rate_bit_s: Count | None = None
    rate_table: Annotated[tuple[RateStep, ...], MEASURED] = ()
    rate_trace: Trace | None = None
    overhead_byte: Annotated[int, Meta(ge=0, le=65_535)] = 0
    queue_byte: Count = 4096
    queue_frame: Count | None = None
    drop: DropPolicy = DropPolicy.NEWEST
    lifetime_s: Positive | None = None
    loss: LossModel = 0.0
    bit_error_rate: Fraction = 0.0
    bit_errors: BitErrorEffect = BitErrorEffect.LOSE
    corrupt: Fraction = 0.0
    jitter: Jitter | None = None
    reorder: Reorder | None = None
    duplicate: Fraction = 0.0
    slots: Slots | None = None

    def __post_init__(self) -> None:
        _expect_one(self, *DELAY_KEYS)
        _expect_one(self, *RATE_KEYS)
        for name in ("delay_table", "rate_table"):
            expect_growing(name, [point.t_s for point in getattr(self, name)])
        if self.rate_table and self.rate_table[0].t_s > 0:
            raise ValueError(f"rate_table: expected t_s = 0 first, found {self.rate_table[0].t_s}")

    @property
    def least_delay_ns(self) -> int:
        """The shortest propagation delay at any time."""
        return to_ns(min(self._delays_s))

    @property
    def greatest_delay_ns(self) -> int:
        """The longest propagation delay at any time, without jitter."""
        return to_ns(max(self._delays_s))

    @property
    def _delays_s(self) -> list[float]:
        return [point.delay_s for point in self.delay_points] or [self.delay_s or 0.0]

    @property
    def delay_points(self) -> tuple[DelayPoint, ...]:
        """The points of the delay over time, of a table or a trace; none where it is constant."""
        return self.delay_table if self.delay_trace is None else self.delay_trace.points


def _expect_one(section: Section, *names: str) -> None:
    given = [name for name in names if getattr(section, name) not in (None, ())]
    if len(given) > 1:
        raise ValueError(f"expected one of {', '.join(names)}, found {' and '.join(given)}")


class Affected(StrEnum):
    """The directions that an outage or a change affects."""

    UP = "up"
    DOWN = "down"
    BOTH = "both"

    def includes(self, direction: Direction) -> bool:
        """Whether `direction` is affected."""
        return self is Affected.BOTH or self.value == direction.value


class Blackout(Section, frozen=True):
    """An outage from `start_s` up to, not including, `end_s` of simulated time.

    Attributes:
        start_s: when it begins.
        end_s: when it is over.
        direction: what is out.
        reason: the cause that the log names.

    Raises:
        ValueError: if it ends before it starts.
    """

    start_s: NonNegative
    end_s: NonNegative
    direction: Affected = Affected.BOTH
    reason: OutageReason = OutageReason.BLACKOUT

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


class Passes(Section, frozen=True):
    """Periodic passes: in service for `length_s` in every `period_s`, and out otherwise.

    Attributes:
        first_s: when the first pass begins.
        length_s: length of a pass.
        period_s: time from the start of one pass to the start of the next; a millisecond at least.
        direction: what is out between passes.

    Raises:
        ValueError: if a pass is not shorter than the period.
    """

    length_s: Positive
    period_s: Annotated[float, Meta(ge=0.001)]
    first_s: NonNegative = 0.0
    direction: Affected = Affected.BOTH

    def __post_init__(self) -> None:
        if self.length_s >= self.period_s:
            raise ValueError(
                f"expected passes shorter than their period, found length_s = {self.length_s:g} "
                f"and period_s = {self.period_s:g}"
            )


class ContactPlan(Section, frozen=True):
    """A contact plan of ION or HDTN: contacts give rates and outages, ranges give delays.

    Attributes:
        file: path of the plan; `.json` for HDTN, anything else for ION.
        ground: node number of the ground.
        rover: node number of the rover.
        store_byte: if the two have no direct contacts, bytes of frames that each node between them
            may hold in each direction (project default: 64 MiB).
    """

    file: str
    ground: int
    rover: int
    store_byte: Count | None = None


_CHANGING = (
    "rate_bit_s",
    "loss",
    "bit_error_rate",
    "corrupt",
    "jitter",
    "reorder",
    "duplicate",
    "slots",
)


class LinkChange(Section, frozen=True):
    """From `at_s` on, the keys given here replace those of `direction`.

    Delays do not change in this way: a `delay_table` lets the ends know beforehand.

    Attributes:
        at_s: when it changes.
        direction: what changes.
        rate_bit_s: as in `[link.up]`, in place of any rate there, table or trace.
        loss, bit_error_rate, corrupt, jitter, reorder, duplicate, slots: as in `[link.up]`.
    """

    at_s: NonNegative
    direction: Affected = Affected.BOTH
    rate_bit_s: Count | None = None
    loss: LossModel | None = None
    bit_error_rate: Fraction | None = None
    corrupt: Fraction | None = None
    jitter: Jitter | None = None
    reorder: Reorder | None = None
    duplicate: Fraction | None = None
    slots: Slots | None = None

    def applied_to(self, one_way: OneWay) -> OneWay:
        """`one_way` with the keys of this change replaced."""
        given = {key: value for key in _CHANGING if (value := getattr(self, key)) is not None}
        if "rate_bit_s" in given:
            given |= {"rate_table": (), "rate_trace": None}
        return msgspec.structs.replace(one_way, **given)


class LinkConfig(Section, frozen=True):
    """The `[link]` table: both directions, outages and changes.

    Attributes:
        up: the direction from the ground to the rover.
        down: the direction from the rover to the ground.
        preset: name of the profile that supplies what this table does not, such as `moon`.
        start: the date at simulated time 0, in UTC, such as `2026-11-28T00:00:00Z`: of a contact
            plan with dates, and of the ephemeris.
        ephemeris: gives the delays, and outages at conjunction.
        blackouts: outages at given times, at the rover's end of the path.
        passes: periodic visibility.
        contacts: a contact plan.
        routing: the contacts by way of other nodes, which `contacts` becomes if the two ends have
            no direct ones; gives delays and rates.
        changes: what changes during the run, in order of time.
        mtu_byte: the longest frame; longer messages are cut (project default: 1024).
        store_byte: capacity of the store at each end (project default: 256 KiB).
        seed: seed of the link's random streams, in place of the mission's.
    """

    up: OneWay = OneWay()
    down: OneWay = OneWay()
    preset: str | None = None
    start: str | None = None
    ephemeris: Ephemeris | None = None
    blackouts: tuple[Blackout, ...] = ()
    passes: Passes | None = None
    contacts: ContactPlan | None = None
    routing: Routing | None = None
    changes: tuple[LinkChange, ...] = ()
    mtu_byte: Annotated[int, Meta(ge=128, le=65_535)] = 1024
    store_byte: Count = 256 * 1024
    seed: Annotated[int, Meta(ge=0)] | None = None

    def way(self, direction: Direction) -> OneWay:
        """The settings of one direction."""
        return self.up if direction is Direction.UP else self.down

    @property
    def lookahead_ns(self) -> int:
        """The shortest propagation delay: how far the nodes may run ahead of each other."""
        if self.routing is not None:
            return self.routing.least_delay_ns
        return min(self.up.least_delay_ns, self.down.least_delay_ns)

    @property
    def round_trip_ns(self) -> int:
        """The longest propagation delay both ways, without queueing and sending."""
        return self.up.greatest_delay_ns + self.down.greatest_delay_ns
