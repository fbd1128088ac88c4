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
from farside.link.profile.impairments import Jitter, JitterShape, LossModel
from farside.link.profile.loss import LossChain
from farside.node import Frame, to_ns

_NO_FLIPS: tuple[int, ...] = ()
_SKIP_BLOCK = 1 << 16
_SQRT_HALF = math.sqrt(0.5)


class Impairment(msgspec.Struct, gc=False):
    """What happens to one frame, if it is sent, besides jitter.

    Attributes:
        loss: `LOST` or `BIT_ERROR` if the frame is lost to either.
        flips: indices of the payload's bits that will be wrong, from 0, least significant first.
        hold_ns: for how long the frame is held back.
        copy_ns: jitter of its duplicate; `None` without one.
    """

    loss: Fate | None = None
    flips: tuple[int, ...] = _NO_FLIPS
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


class JitterProcess:
    """Jitter: correlated from frame to frame, of either shape (a Gaussian copula)."""

    def __init__(self, rng: Generator) -> None:
        self._noise = Stream(rng.standard_normal)
        self._score: float | None = None

    def draw(
        self, jitter: Jitter | None, count: int, indices: Sequence[int] | None = None
    ) -> list[int]:
        """Jitter of the next `count` frames in nanoseconds, or only of those at `indices`."""
        if jitter is None:
            self._noise.skip(count)
            self._score = None
            return [0] * (count if indices is None else len(indices))
        spread_ns, erfc, log = to_ns(jitter.spread_s), math.erfc, math.log
        scores = self._scores(jitter.correlation, count)
        if indices is not None:
            scores = [scores[index] for index in indices]
        if jitter.shape is JitterShape.UNIFORM:
            # spread · Φ(x)
            half_ns, scale = spread_ns * 0.5, -_SQRT_HALF
            return [round(half_ns * erfc(score * scale)) for score in scores]
        # −spread · ln(1 − Φ(x))
        return [round(-spread_ns * log(0.5 * erfc(score * _SQRT_HALF))) for score in scores]

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

    def draw(self, config: OneWay, sizes_byte: Sequence[int]) -> dict[int, tuple[int, ...] | None]:
        """Wrong bits of the frames that have any, by index in `sizes_byte`; `None` if lost."""
        wrong = self._by_rate(config, sizes_byte)
        for index, bit in self._corrupted(config.corrupt, sizes_byte).items():
            found = wrong.get(index, _NO_FLIPS)
            if found is not None:
                # A bit flipped twice is right again.
                wrong[index] = tuple(sorted({*found} ^ {bit}))
        return wrong

    def _by_rate(
        self, config: OneWay, sizes_byte: Sequence[int]
    ) -> dict[int, tuple[int, ...] | None]:
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
        wrong: dict[int, tuple[int, ...] | None] = {}
        for index, first in zip(candidates, draws[candidates].tolist(), strict=True):
            size, found = sizes_byte[index], None
            if first >= any_wrong[size]:
                continue
            if config.bit_errors is BitErrorEffect.FLIP:
                right = min(int(math.log1p(-first) / log_right), bits[size] - 1)
                found = _wrong_bits(right, bits[size], rate, int(seeds[index]))
                if found[-1] >= size * 8:
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


def _wrong_bits(first: int, bits: int, rate: float, seed: int) -> tuple[int, ...]:
    """Indices of the wrong bits in ascending order, of which `first` is the first."""
    rng = np.random.default_rng(seed)
    after = bits - first - 1
    count = int(rng.binomial(after, rate))
    rest = np.sort(rng.choice(after, count, replace=False)) if count else np.empty(0, np.int64)
    return first, *(first + 1 + rest).tolist()


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
        self._hold = Stream(hold.random)
        self._duplicate = Stream(duplicate.random)
        self._jitter = JitterProcess(jitter)
        self._copy = JitterProcess(copy)
        self._bits = BitErrors(bits)
        self.configure(config)

    def configure(self, config: OneWay) -> None:
        """Use `config` from the next frame on."""
        self._config = config
        self._loss.configure(config.loss)

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
        if reorder is None:
            self._hold.skip(count)
            return
        hold_ns = to_ns(reorder.hold_s)
        for index in _hits(self._hold, reorder.share, count):
            found[index].hold_ns = hold_ns

    def _duplicate_some(self, found: defaultdict[int, Impairment], count: int) -> None:
        duplicated = _hits(self._duplicate, self._config.duplicate, count)
        jitter = self._config.jitter if self._config.duplicate else None
        jitters_ns = self._copy.draw(jitter, count, duplicated)
        for index, jitter_ns in zip(duplicated, jitters_ns, strict=True):
            found[index].copy_ns = jitter_ns
