"""The check of a link by way of other nodes: does each frame arrive as early as any way allows?

What is asked for is computed anew from the contacts, by relaxing them until no arrival gets earlier
(Bellman and Ford), so that it shares nothing with the router of the channel. Of these frames each
pair has a link of its own, without anything random.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import msgspec
import numpy as np
from numpy.random import Generator

from farside.link.check.lines import (
    CheckLine,
    bit_error_loss,
    exact_line,
    point,
    share_line,
    unmeasured,
)
from farside.link.check.traffic.planning import Traffic
from farside.link.check.traffic.reference import Ints
from farside.link.check.traffic.run import Arrivals, ChannelFactory, run_probe, seeds
from farside.link.profile.config import LinkConfig, OneWay
from farside.link.profile.hops.routing import Hop, Routing
from farside.link.profile.schedule import outages_of
from farside.node import NEVER_NS, NS_PER_S, Direction, to_ns, to_s

_SINGLES = 60
_MOST_RANDOM = 4_000
_BYTE = 64
_WHY = "on a way by other nodes it is not told apart from the waits there"


class RelayedFindings(NamedTuple):
    """What the check of one direction found: the lines, and how many frames were sent."""

    lines: list[CheckLine]
    frames: int


def check_relayed(
    config: LinkConfig,
    channel_factory: ChannelFactory,
    frames: int,
    seed: int,
    on_progress: Callable[[float], None],
) -> dict[Direction, RelayedFindings]:
    """Send frames by way of the nodes of `config`, and see when they arrive.

    Arguments as of `farside.link.check.check_link`.
    """
    routing = config.routing
    if routing is None:
        raise ValueError("expected a link by way of other nodes, found a direct one")
    calm = msgspec.structs.replace(
        config, up=_calm(config.up), down=_calm(config.down), blackouts=(), changes=()
    )
    rng, _ = seeds(seed, 0)
    found: dict[Direction, RelayedFindings] = {}
    for share, direction in enumerate(Direction):
        lines = _Lines(config, calm, direction, channel_factory, rng, seed)
        found[direction] = RelayedFindings(
            [
                *lines.arrivals(routing),
                *lines.chances(min(frames, _MOST_RANDOM)),
                *_left_out(config, direction, routing),
                exact_line("records that disagree", lines.sent, 0, lines.disagreeing),
            ],
            lines.sent,
        )
        on_progress((share + 1) / len(Direction))
    return found


def earliest_ns(hops: Sequence[Hop], ends: tuple[int, int], ready_ns: int, size_byte: int) -> int:
    """When a frame arrives at the earliest, nothing else being sent; `NEVER_NS` if it cannot.

    Args:
        hops: the contacts.
        ends: where it comes from and goes to.
        ready_ns: from when on it can leave.
        size_byte: what is sent of it, overhead included.
    """
    at_ns, changed = {ends[0]: ready_ns}, True
    while changed:
        changed = False
        for hop in hops:
            if hop.sender not in at_ns:
                continue
            start_ns = max(at_ns[hop.sender], to_ns(hop.begin_s))
            end_ns = start_ns - (-size_byte * 8 * NS_PER_S // hop.rate_bit_s)
            if start_ns >= to_ns(hop.end_s) or end_ns > to_ns(hop.end_s):
                continue
            arrival_ns = end_ns + to_ns(hop.owlt_s)
            if arrival_ns < at_ns.get(hop.receiver, NEVER_NS):
                at_ns[hop.receiver], changed = arrival_ns, True
    return at_ns.get(ends[1], NEVER_NS)


class _Lines:
    """The lines of one direction."""

    def __init__(  # noqa: PLR0917 - of one check
        self,
        config: LinkConfig,
        calm: LinkConfig,
        direction: Direction,
        channel_factory: ChannelFactory,
        rng: Generator,
        seed: int,
    ) -> None:
        self._config, self._calm, self._direction = config, calm, direction
        self._factory, self._rng, self._seed = channel_factory, rng, seed
        self.sent = self.disagreeing = 0

    def arrivals(self, routing: Routing) -> list[CheckLine]:
        """Frames alone, and two at once: the second has the first before it at every contact."""
        sent_byte = _BYTE + self._calm.way(self._direction).overhead_byte
        if routing.store_byte < 2 * sent_byte:
            why = (
                f"no node may hold more than {routing.store_byte} bytes, and the check sends two "
                f"frames of {sent_byte} at once"
            )
            return [unmeasured("earliest arrival", "s", math.nan, why)]
        ends, hops = routing.ends(self._direction), routing.hops
        asked: list[int] = []
        late: list[int] = []
        wrong = second_wrong = seconds = 0
        for time_ns in self._times_ns(hops, ends[0]):
            arrives_ns = earliest_ns(hops, ends, time_ns, sent_byte)
            seen = self._run(self._calm, np.array([time_ns, time_ns]))
            first_ns, second_ns = (int(one) for one in seen.time_ns)
            if arrives_ns >= NEVER_NS:
                wrong += first_ns >= 0
                continue
            asked.append(arrives_ns - time_ns)
            late.append(first_ns - time_ns if first_ns >= 0 else NEVER_NS)
            wrong += first_ns != arrives_ns
            # As one frame of twice the size it would be later at each node than it can be.
            latest_ns = earliest_ns(hops, ends, time_ns, 2 * sent_byte)
            if latest_ns < NEVER_NS:
                seconds += 1
                second_wrong += not arrives_ns <= second_ns <= latest_ns
        if not asked:
            return [unmeasured("earliest arrival", "s", math.nan, "no contacts lead there")]
        second = exact_line("second frames out of turn", seconds, 0, second_wrong)
        if self._calm.way(self._direction).queue_frame == 1:
            why = "the queue holds one frame"
            second = unmeasured("second frames out of turn", "", 0.0, why)
        mean = to_s(sum(late)) / len(late)
        delay = point(to_s(sum(asked)) / len(asked))
        return [
            CheckLine(
                "delay of the first way", "s", len(asked), delay, mean, lambda _: point(mean)
            ),
            exact_line("frames not at their earliest", len(asked), 0, wrong),
            second,
        ]

    def chances(self, frames: int) -> list[CheckLine]:
        """How often what is random happens, of those frames that arrive if nothing does."""
        way = self._config.way(self._direction)
        names = ("loss", way.loss), ("duplication", way.duplicate), ("corruption", way.corrupt)
        if self._config.changes or not isinstance(way.loss, float):
            why = "on a way by other nodes, what changes or comes in bursts is not measured"
            return [unmeasured(name, "share", math.nan, why) for name, _ in names]
        hops = self._config.routing.hops if self._config.routing else ()
        last_ns = max((to_ns(hop.end_s) for hop in hops), default=1)
        times_ns = np.sort(self._rng.integers(0, last_ns, size=frames))
        counted = self._run(self._calm, times_ns).arrived
        free = msgspec.structs.replace(self._config, blackouts=())
        seen = self._run(free, times_ns)
        arrived = seen.arrived & counted
        lost = 1 - (1 - way.loss) * (1 - bit_error_loss(way, _BYTE))
        flips = way.corrupt if not way.bit_error_rate else math.nan
        return [
            share_line("loss", lost, ~seen.arrived[counted]),
            share_line("duplication", way.duplicate, seen.copies[arrived] > 1),
            share_line("corruption", flips, seen.wrong_bits[arrived] > 0)
            if not math.isnan(flips)
            else unmeasured("corruption", "share", flips, "bit errors flip bits as well"),
        ]

    def _times_ns(self, hops: Sequence[Hop], source: int) -> list[int]:
        """Moments all over the plan, and around the beginnings and ends of the first contacts."""
        last_ns = max((to_ns(hop.end_s) for hop in hops), default=1)
        edges = [
            to_ns(t_s) for hop in hops if hop.sender == source for t_s in (hop.begin_s, hop.end_s)
        ]
        some = self._rng.choice(edges or [0], size=_SINGLES // 2).tolist()
        shifts = self._rng.integers(-NS_PER_S, NS_PER_S, size=len(some)).tolist()
        near = [max(0, edge + shift) for edge, shift in zip(some, shifts, strict=True)]
        return [*near, *some, *self._rng.integers(0, last_ns, size=_SINGLES - len(some)).tolist()]

    def _run(self, config: LinkConfig, times_ns: Ints) -> Arrivals:
        none = np.zeros(len(times_ns), dtype=np.int64)
        traffic = Traffic(times_ns, np.full(len(times_ns), _BYTE), none, none, none)
        _, streams = seeds(self._seed, self.sent)
        seen = run_probe(
            self._factory(config, streams),
            {self._direction: traffic},
            lambda _count: None,
            lifetime_ns=NEVER_NS,
        )[self._direction]
        self.sent += len(times_ns)
        self.disagreeing += seen.disagreeing
        return seen


def _left_out(config: LinkConfig, direction: Direction, routing: Routing) -> Iterator[CheckLine]:
    """What is asked for and not measured."""
    way = config.way(direction)
    if way.jitter is not None:
        yield unmeasured("jitter", "s", way.jitter.spread_s, _WHY)
    if way.reorder is not None:
        yield unmeasured("reordering", "share", way.reorder.share, _WHY)
    outages = len(outages_of(config, direction))
    if outages:
        yield unmeasured("outages", "", outages, _WHY)
    yield unmeasured("bytes in a store", "", routing.store_byte, "the check fills no stores")


def _calm(way: OneWay) -> OneWay:
    """The same direction without anything random."""
    return msgspec.structs.replace(
        way, loss=0.0, bit_error_rate=0.0, corrupt=0.0, jitter=None, reorder=None, duplicate=0.0
    )
