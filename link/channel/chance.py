"""Random impairments: loss, bit errors, jitter, reordering and duplication.

Every purpose has a random stream of its own, with one draw per frame in the order in which frames
are handed over, whether it is needed or not. So neither another impairment nor the fate of earlier
frames changes what a frame draws.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from itertools import accumulate, pairwise
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from farside.frames import Fate
from farside.link.profile.config import BitErrorEffect, OneWay
from farside.link.profile.impairments import Jitter, LossModel
from farside.link.profile.jitter import Sample, sampler
from farside.link.profile.loss import LossChain
from farside.node import Frame, to_ns

_BLOCK_BIT = 1 << 21
"""Of frames longer than any mission's, the bits that are drawn at once where many are wrong."""

_MANY = 0.02
_FEW = 16
_SKIP_BLOCK = 1 << 16


class Impairment(msgspec.Struct, gc=False):
    """What happens to one frame, if it is sent, besides jitter.

    Attributes:
        loss: `LOST` or `BIT_ERROR` if the frame is lost to either.
        flips: the payload's bits that will be wrong: bit n of this number is bit n of the payload,
            least significant first. As short as the payload, however many they are.
        hold_ns: for how long the frame is held back.
        copy_ns: jitter of its duplicate; `None` without one.
    """

    loss: Fate | None = None
    flips: int = 0
    hold_ns: int = 0
    copy_ns: int | None = None


UNIMPAIRED = Impairment()
"""What happens to most frames: nothing."""


class Draw(NamedTuple):
    """What the next frames draw, in order of hand-over.

    Attributes:
        jitters_ns: the delay of each frame on top of the propagation.
        impairments: of the frames that meet with anything else, few as a rule, by index.
    """

    jitters_ns: list[int]
    impairments: dict[int, Impairment]


NOTHING_DRAWN = Draw([], {})
"""What no frames draw."""


class Stream:
    """The random numbers of one purpose, one per frame.

    Numbers that nobody needs are skipped only when the next ones are drawn.
    """

    def __init__(self, draw: Callable[[int], Any]) -> None:
        self._draw = draw
        self._skipped = 0

    def take(self, count: int) -> NDArray[Any]:
        """The numbers of the next `count` frames."""
        while self._skipped:
            block = min(self._skipped, _SKIP_BLOCK)
            self._draw(block)
            self._skipped -= block
        numbers: NDArray[Any] = self._draw(count)
        return numbers

    def skip(self, count: int) -> None:
        """Pass over the numbers of the next `count` frames."""
        self._skipped += count


class LossProcess:
    """Which frames are lost, by a loss model with or without memory."""

    def __init__(self, steps: Generator, losses: Generator) -> None:
        self._steps = Stream(steps.random)
        self._losses = Stream(losses.random)
        self._start(0.0)

    def configure(self, model: LossModel) -> None:
        """Use `model` from the next frame on; a different one starts in its first state."""
        if model != self._model:
            self._start(model)

    def _start(self, model: LossModel) -> None:
        self._model = model
        exits, self._probabilities = LossChain.of(model)
        # For each state: below which number it is left, and for which state.
        self._thresholds = [
            list(zip(accumulate(p for p, _ in leaving), (to for _, to in leaving), strict=True))
            for leaving in exits
        ]
        self._state = 0

    def draw(self, count: int) -> list[int]:
        """Indices of the next `count` frames that are lost."""
        thresholds, probabilities = self._thresholds, self._probabilities
        if len(thresholds) == 1:
            self._steps.skip(count)
            return _hits(self._losses, probabilities[0], count)
        steps, losses = self._steps.take(count), self._losses.take(count)
        # The chain can only leave its state where the number is low enough for some state.
        candidates = _indices(steps < max(leaving[-1][0] for leaving in thresholds))
        state, begins, in_force = self._state, [0], [probabilities[self._state]]
        for index, step in zip(candidates, steps[candidates].tolist(), strict=True):
            for below, following in thresholds[state]:
                if step < below:
                    state = following
                    begins.append(index)
                    in_force.append(probabilities[state])
                    break
        self._state = state
        if len(in_force) == 1:
            return _indices(losses < in_force[0])
        runs = [end - begin for begin, end in pairwise((*begins, count))]
        return _indices(losses < np.array(in_force).repeat(runs))


class CorrelatedHits:
    """Which frames are hit with probability p, with correlation c between successive ones.

    A frame is hit if its random number is below p·(1 − c), or below p·(1 − c) + c if the frame
    before was hit. So without correlation one is as another. The first comes after one not hit, as
    in `CorrelatedLoss`.
    """

    def __init__(self, rng: Generator) -> None:
        self._stream = Stream(rng.random)
        self._asked, self._was_hit = (0.0, 0.0), False

    def configure(self, probability: float, correlation: float) -> None:
        """Hit so from the next frame on; other values than before begin anew."""
        if (probability, correlation) != self._asked:
            self._asked, self._was_hit = (probability, correlation), False

    def draw(self, count: int) -> list[int]:
        """Indices of the next `count` frames that are hit."""
        probability, correlation = self._asked
        if not probability or not correlation:
            return _hits(self._stream, probability, count)
        numbers = self._stream.take(count)
        fresh = probability * (1 - correlation)
        again = fresh + correlation
        hit = numbers < min(fresh, again)
        decided = hit | (numbers >= max(fresh, again))
        # The others are as the frame before, or the opposite where correlation is negative.
        places = np.arange(count)
        last = np.maximum.accumulate(np.where(decided, places, -1))
        before = np.where(last >= 0, hit[last], self._was_hit)
        hit = before ^ ((correlation < 0) & ((places - last) % 2 == 1))
        self._was_hit = bool(hit[-1])
        return _indices(hit)


class JitterProcess:
    """Jitter of any shape, correlated from frame to frame (a Gaussian copula)."""

    def __init__(self, rng: Generator) -> None:
        self._noise = Stream(rng.standard_normal)
        self._score: float | None = None
        self._jitter: Jitter | None = None
        self._sample: Sample = _no_jitter

    def draw(
        self, jitter: Jitter | None, count: int, indices: Sequence[int] | None = None
    ) -> list[int]:
        """Jitter of the next `count` frames in nanoseconds, or only of those at `indices`."""
        if jitter is None:
            self._noise.skip(count)
            self._score = None
            return [0] * (count if indices is None else len(indices))
        if jitter is not self._jitter:
            self._jitter, self._sample = jitter, sampler(jitter)
        scores = self._scores(jitter.correlation, count)
        if indices is not None:
            scores = [scores[index] for index in indices]
        return self._sample(scores)

    def _scores(self, correlation: float, count: int) -> list[float]:
        noise = self._noise.take(count)
        if correlation:
            # xₜ = ρ·xₜ₋₁ + √(1 − ρ²)·n, whose variance stays 1
            kicks, score = (math.sqrt(1 - correlation**2) * noise).tolist(), self._score
            if score is None:
                kicks[0], score = float(noise[0]), 0.0
            scores = [score := correlation * score + kick for kick in kicks]
        else:
            scores = noise.tolist()
        self._score = scores[-1]
        return scores


class BitErrors:
    """Which bits arrive wrong: each independently, and one per frame by corruption."""

    def __init__(self, rngs: Sequence[Generator]) -> None:
        first, rest, corrupt, where = rngs
        self._first = Stream(first.random)
        self._rest = Stream(rest.bit_generator.random_raw)
        self._corrupt = Stream(corrupt.random)
        self._where = Stream(where.random)

    def draw(self, config: OneWay, sizes_byte: Sequence[int]) -> dict[int, int | None]:
        """Wrong bits of the frames that have any, by index in `sizes_byte`; `None` if lost."""
        wrong = self._by_rate(config, sizes_byte)
        for index, bit in self._corrupted(config.corrupt, sizes_byte).items():
            found = wrong.get(index, 0)
            if found is not None:
                # A bit flipped twice is right again.
                wrong[index] = found ^ 1 << bit
        return wrong

    def _by_rate(self, config: OneWay, sizes_byte: Sequence[int]) -> dict[int, int | None]:
        count, rate = len(sizes_byte), config.bit_error_rate
        if not rate:
            self._first.skip(count)
            self._rest.skip(count)
            return {}
        # How many bits are right before the first wrong one is geometrically distributed.
        log_right = math.log1p(-min(rate, 1 - 2**-53))
        bits = {size: (size + config.overhead_byte) * 8 for size in set(sizes_byte)}
        any_wrong = {size: -math.expm1(count * log_right) for size, count in bits.items()}
        draws, seeds = self._first.take(count), self._rest.take(count)
        candidates = _indices(draws < max(any_wrong.values()))
        wrong: dict[int, int | None] = {}
        for index, first in zip(candidates, draws[candidates].tolist(), strict=True):
            size, found = sizes_byte[index], None
            if first >= any_wrong[size]:
                continue
            if config.bit_errors is BitErrorEffect.FLIP:
                right = min(int(math.log1p(-first) / log_right), bits[size] - 1)
                found = _wrong_bits(right, bits[size], rate, int(seeds[index]))
                if found.bit_length() > size * 8:
                    found = None
            wrong[index] = found
        return wrong

    def _corrupted(self, probability: float, sizes_byte: Sequence[int]) -> dict[int, int]:
        """The one bit that is flipped, by index of the frames concerned."""
        count = len(sizes_byte)
        if not probability:
            self._corrupt.skip(count)
            self._where.skip(count)
            return {}
        where = self._where.take(count)
        return {
            index: int(where[index] * sizes_byte[index] * 8)
            for index in _hits(self._corrupt, probability, count)
            if sizes_byte[index]
        }


def _wrong_bits(first: int, bits: int, rate: float, seed: int) -> int:
    """The wrong bits as one number, as in `Impairment`; `first` is the first of them."""
    rng = np.random.default_rng(seed)
    after = bits - first - 1
    if after > _BLOCK_BIT and rate > _MANY:
        sizes = (min(_BLOCK_BIT, after - begin) for begin in range(0, after, _BLOCK_BIT))
        blocks = (np.packbits(rng.random(size) < rate, bitorder="little") for size in sizes)
        rest = int.from_bytes(b"".join(block.tobytes() for block in blocks), "little")
    else:
        count = int(rng.binomial(after, rate))
        rest = _with_bits(rng.choice(after, count, replace=False), after) if count else 0
    return (rest << 1 | 1) << first


def _with_bits(places: NDArray[np.int64], bits: int) -> int:
    """The number with these bits set, of so many."""
    if len(places) <= _FEW:
        return sum(1 << place for place in places.tolist())
    octets = np.zeros(bits // 8 + 1, np.uint8)
    np.bitwise_or.at(octets, places >> 3, (1 << (places & 7)).astype(np.uint8))
    return int.from_bytes(octets.tobytes(), "little")


def _no_jitter(scores: Sequence[float]) -> list[int]:
    return [0] * len(scores)


def _hits(stream: Stream, probability: float, count: int) -> list[int]:
    """Indices of the next `count` frames that are hit, each with this probability."""
    if not probability:
        stream.skip(count)
        return []
    return _indices(stream.take(count) < probability)


def _indices(hit: NDArray[np.bool_]) -> list[int]:
    indices: list[int] = hit.nonzero()[0].tolist()
    return indices


class RandomImpairments:
    """All random impairments of one direction.

    Args:
        rng: the direction's generator, from which one per purpose is spawned.
        config: the direction.
    """

    def __init__(self, rng: Generator, config: OneWay) -> None:
        # The order says which child serves which purpose, so it is part of what a seed means.
        steps, losses, hold, duplicate, jitter, copy, *bits = rng.spawn(10)
        self._loss = LossProcess(steps, losses)
        self._hold = CorrelatedHits(hold)
        self._duplicate = Stream(duplicate.random)
        self._jitter = JitterProcess(jitter)
        self._copy = JitterProcess(copy)
        self._bits = BitErrors(bits)
        self.configure(config)

    def configure(self, config: OneWay) -> None:
        """Use `config` from the next frame on."""
        self._config = config
        self._loss.configure(config.loss)
        reorder = config.reorder
        self._hold.configure(*((reorder.share, reorder.correlation) if reorder else (0.0, 0.0)))

    def draw(self, frames: Sequence[Frame]) -> Draw:
        """What happens to the next frames, in order of hand-over."""
        if not frames:
            return NOTHING_DRAWN
        config, count = self._config, len(frames)
        found: defaultdict[int, Impairment] = defaultdict(Impairment)
        for index in self._loss.draw(count):
            found[index].loss = Fate.LOST
        for index, wrong in self._bits.draw(config, [len(f.payload) for f in frames]).items():
            impairment = found[index]
            if wrong is not None:
                impairment.flips = wrong
            elif impairment.loss is None:
                impairment.loss = Fate.BIT_ERROR
        self._hold_back(found, count)
        self._duplicate_some(found, count)
        return Draw(self._jitter.draw(config.jitter, count), found)

    def _hold_back(self, found: defaultdict[int, Impairment], count: int) -> None:
        reorder = self._config.reorder
        hold_ns = to_ns(reorder.hold_s) if reorder else 0
        for index in self._hold.draw(count):
            found[index].hold_ns = hold_ns

    def _duplicate_some(self, found: defaultdict[int, Impairment], count: int) -> None:
        duplicated = _hits(self._duplicate, self._config.duplicate, count)
        jitter = self._config.jitter if self._config.duplicate else None
        jitters_ns = self._copy.draw(jitter, count, duplicated)
        for index, jitter_ns in zip(duplicated, jitters_ns, strict=True):
            found[index].copy_ns = jitter_ns
