"""When to send what: bursts that do not affect each other.

So each fate is evidence of one impairment alone. Simulated time costs nothing.
"""

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from farside.link.check.traffic.reference import (
    FOREVER_NS,
    MARGIN_NS,
    MOST_KINDS,
    Bools,
    Ints,
    Phase,
    Reference,
)
from farside.node import to_s

_LONGEST_NS = 1 << 58
"""What a burst may take at most, from the first frame sent to the last one arrived: 9 years."""

_MOST_PHASES = 500
"""In how many phases of a kind at most, spread evenly over all, bursts are sent."""

_FULL_KINDS = 8
"""How many kinds get all the bursts asked for; more of them share."""


class Burst(NamedTuple):
    """Frames sent at once.

    Attributes:
        size_byte: the size of each.
        frames: how many they are.
        busy_ns: the longest time until the last bit of all has left.
        crowded: whether all but the first are handed over 1 ns after it; otherwise each is 1 ns
            after the one before.
        priorities: of the frames in order; 0 where there are none.
    """

    size_byte: int
    frames: int
    busy_ns: int
    crowded: bool = False
    priorities: tuple[int, ...] = ()

    @property
    def span_ns(self) -> int:
        """The longest time from the first hand-over until the last bit of all has left."""
        return self.busy_ns + (1 if self.crowded else self.frames)


class LeftOut(NamedTuple):
    """Phases of one kind in which a probe cannot be made.

    Attributes:
        phases: these.
        why: the reason in words.
    """

    phases: list[Phase]
    why: str


class Traffic(NamedTuple):
    """Frames of one direction in order of sending.

    Attributes:
        time_ns, size_byte: when each is sent, and its size.
        phase: index of the phase that each belongs to.
        burst: number of the burst that each belongs to, from 0.
        priority: the priority of each.
        left_out: where nothing is sent.
    """

    time_ns: Ints
    size_byte: Ints
    phase: Ints
    burst: Ints
    priority: Ints
    left_out: tuple[LeftOut, ...] = ()


BurstOf = Callable[[Phase, int], Burst | str | None]
"""The burst for a phase whose longest window is given in ns; why there is none, or `None` if none
is needed."""


def plan_bursts(
    reference: Reference,
    rng: Generator,
    burst_of: BurstOf,
    count: int,
    key: Callable[[Phase], int],
) -> Traffic:
    """Up to `count` bursts for each kind of phase, spread over its phases.

    Args:
        reference: the direction to send in.
        rng: chooses the times.
        burst_of: see `BurstOf`.
        count: how many bursts at most.
        key: which phases are of one kind.
    """
    kinds, passed_over = reference.kinds(key)
    if len(kinds) > _FULL_KINDS:
        count = max(1, count * _FULL_KINDS // len(kinds))
    found: list[tuple[int, Burst, Ints]] = []
    left_out: list[LeftOut] = []
    for indices in kinds:
        own, why = _of_kind(reference, rng, burst_of, count, indices)
        found += own
        if why is not None:
            left_out.append(LeftOut([reference.phases[index] for index in indices], why))
    if passed_over and (found or left_out):
        text = f"{passed_over:,} more settings, of which only {MOST_KINDS} are measured"
        left_out.append(LeftOut([], text))
    return frames_of(reference, found, left_out, key)


def _of_kind(
    reference: Reference, rng: Generator, burst_of: BurstOf, count: int, indices: list[int]
) -> tuple[list[tuple[int, Burst, Ints]], str | None]:
    """The bursts in phases of one kind; if there are none, the reason, unless none is needed."""
    if len(indices) > _MOST_PHASES:
        spread = np.linspace(0, len(indices) - 1, _MOST_PHASES).astype(int)
        indices = [indices[index] for index in spread]
    rooms = {index: reference.windows.longest_ns(index) for index in indices}
    found: list[tuple[int, Burst, Ints]] = []
    why: str | None = None
    needed = False
    # Those with the least room first, so that what they have no room for falls to the others.
    for number, index in enumerate(sorted(indices, key=lambda one: rooms[one])):
        burst = burst_of(reference.phases[index], rooms[index])
        if burst is None:
            continue
        needed = True
        if isinstance(burst, str):
            why = burst
            continue
        quota = -(-count // (len(indices) - number))
        if not quota:
            break
        try:
            times = _starts_ns(reference, index, burst, quota, rng)
        except _NoTimeError as error:
            why = str(error)
            continue
        count -= len(times)
        found.append((index, burst, times))
    if not needed or found:
        return found, None
    return found, why


class _NoTimeError(Exception):
    """There is no time for a burst. Its text is the reason."""


def _starts_ns(reference: Reference, index: int, burst: Burst, count: int, rng: Generator) -> Ints:
    """Up to `count` times to send a burst.

    Raises:
        _NoTimeError: if there is none.
    """
    begins, ends = reference.windows.of(index)
    if not len(begins):
        raise _NoTimeError("the direction is out for as long as this is so")
    if reference.greatest_delay_ns > FOREVER_NS:
        raise _NoTimeError("the delay is longer than is simulated")
    busy_ns, spread_ns = burst.span_ns, reference.phases[index].spread_ns
    slot_ns = busy_ns + spread_ns + 4 * MARGIN_NS
    if slot_ns > _LONGEST_NS:
        raise _NoTimeError(f"a probe may take {to_s(slot_ns):.3g} s, longer than is simulated")
    need_ns = busy_ns + 2 * MARGIN_NS
    longest_ns = int((ends - begins).max())
    fits = ends - begins >= need_ns
    if not fits.any():
        raise _NoTimeError(
            f"a probe takes {to_s(need_ns):.3g} s, and no window is longer than "
            f"{to_s(longest_ns):.3g} s"
        )
    times = _candidates_ns(
        begins[fits], ends[fits], need_ns, slot_ns, count, reference.settled_ns, rng
    )
    times = times[reference.is_clear(*reference.stay_ns(times, busy_ns, spread_ns))]
    if not len(times):
        raise _NoTimeError("no moment was found at which no outage is near")
    if burst.frames > 1:
        times = times[~reference.is_compressed(times, times + busy_ns)]
    if not len(times):
        raise _NoTimeError("the delay falls as fast as time passes: what is sent arrives at once")
    if len(times) > count:
        times = times[np.linspace(0, len(times) - 1, count).astype(int)]
    return times


def _candidates_ns(  # noqa: PLR0917 - all that a window has
    begins: Ints,
    ends: Ints,
    need_ns: int,
    slot_ns: int,
    count: int,
    settled_ns: int,
    rng: Generator,
) -> Ints:
    """Times in windows, a slot and a random part of its eighth apart, about twice the count."""
    wanted = 2 * count
    if len(begins) > wanted:
        chosen = np.linspace(0, len(begins) - 1, wanted).astype(int)
        begins, ends = begins[chosen], ends[chosen]
    period_ns = slot_ns + slot_ns // 8
    most = (ends - begins - need_ns) // period_ns + 1
    limit = -(-wanted // len(begins))
    while np.minimum(most, limit).sum() < wanted and limit < most.max():
        limit *= 2
    numbers = np.minimum(most, limit)
    # Spread over the whole window, up to where all has settled.
    lengths = np.minimum(ends, np.maximum(settled_ns, begins)) - begins - need_ns
    periods = np.maximum(period_ns, lengths // numbers)
    which = np.repeat(np.arange(len(begins)), numbers)
    within = np.arange(len(which)) - np.repeat(np.cumsum(numbers) - numbers, numbers)
    times = begins[which] + MARGIN_NS + within * periods[which]
    times += rng.integers(0, max(1, slot_ns // 8), size=len(times))
    found: Ints = np.minimum(times, (ends - need_ns + MARGIN_NS)[which])
    return found


def frames_of(
    reference: Reference,
    found: Sequence[tuple[int, Burst, Ints]],
    left_out: Sequence[LeftOut],
    key: Callable[[Phase], int],
) -> Traffic:
    """The frames of all bursts that are over, on arrival, before the next begins.

    Args:
        reference: the direction to send in.
        found: indices of phases, and the bursts to send in each, at which times.
        left_out: where nothing is sent.
        key: which phases are of one kind.
    """
    which = np.repeat(np.arange(len(found)), [len(times) for *_, times in found]).astype(np.int64)
    starts = np.concatenate([np.empty(0, np.int64), *(times for *_, times in found)])
    order = np.argsort(starts, kind="stable")
    which, starts = which[order], starts[order]
    busy = np.array([burst.span_ns for _, burst, _ in found], dtype=np.int64)
    spread = np.array([reference.phases[index].spread_ns for index, *_ in found], np.int64)
    kept = _in_order(*reference.arrival_range_ns(starts, busy[which], spread[which]))
    which, starts = which[kept], starts[kept]
    left_out = [*left_out, *_unsent(reference, found, which, key)]
    counts = np.array([burst.frames for _, burst, _ in found], dtype=np.int64)[which]
    bursts = np.repeat(np.arange(len(which)), counts)
    place = np.arange(len(bursts)) - np.repeat(np.cumsum(counts) - counts, counts)
    rows = which[bursts]
    size = np.array([burst.size_byte for _, burst, _ in found], dtype=np.int64)
    phase = np.array([index for index, *_ in found], dtype=np.int64)
    latest = np.array([1 if one.crowded else one.frames for _, one, _ in found], dtype=np.int64)
    times = starts[bursts] + np.minimum(place, latest[rows])
    priorities = np.zeros(len(rows), dtype=np.int64)
    for row, (_, burst, _) in enumerate(found):
        if burst.priorities:
            own = rows == row
            priorities[own] = np.array(burst.priorities)[place[own]]
    return Traffic(times, size[rows], phase[rows], bursts, priorities, tuple(left_out))


def _unsent(
    reference: Reference,
    found: Sequence[tuple[int, Burst, Ints]],
    kept: Ints,
    key: Callable[[Phase], int],
) -> Iterator[LeftOut]:
    """The kinds of phases of which no burst was kept."""
    sent = {key(reference.phases[found[row][0]]) for row in set(kept.tolist())}
    unsent: dict[int, list[Phase]] = {}
    for one in (reference.phases[index] for index, *_ in found):
        if key(one) not in sent:
            unsent.setdefault(key(one), []).append(one)
    for phases in unsent.values():
        yield LeftOut(phases, "what is sent then arrives after what is sent later")


def _in_order(first_ns: Ints, last_ns: Ints) -> Bools:
    """Which of these spans to keep, so that each ends before all later ones begin."""
    kept = np.ones(len(first_ns), dtype=np.bool_)
    if (last_ns[:-1] < first_ns[1:]).all():
        return kept
    least = 2 * FOREVER_NS + _LONGEST_NS
    for index in reversed(range(len(first_ns))):
        kept[index] = last_ns[index] < least
        if kept[index]:
            least = min(least, int(first_ns[index]))
    return kept
