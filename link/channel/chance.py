"""What chance does to frames: loss, bit errors, jitter, reordering and duplication.

Every purpose has a random stream of its own, with one draw for every frame in the order in which
frames are handed over, needed or not. So no impairment moves the luck of another, and neither does
what becomes of the frames before.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import msgspec
import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from farside.link.profile.config import BitErrorEffect, OneWay
from farside.link.profile.impairments import (
    FourState,
    GilbertElliott,
    Jitter,
    JitterShape,
    LossModel,
)
from farside.node import Frame, to_ns
from farside.topics import Fate

_NO_FLIPS: tuple[int, ...] = ()
_CATCH_UP = 1 << 16
_SQRT_HALF = math.sqrt(0.5)


class Luck(msgspec.Struct, gc=False):
    """What chance has in store for a frame, if it is sent, besides jitter.

    Attributes:
        loss: `LOST` or `BIT_ERROR`, if either comes over it.
        flips: the bits of its payload that will be wrong, counted from 0, least significant first.
        hold_ns: for how long it is held back.
        copy_ns: jitter of its copy, if it arrives twice.
    """

    loss: Fate | None = None
    flips: tuple[int, ...] = _NO_FLIPS
    hold_ns: int = 0
    copy_ns: int | None = None


CALM = Luck()
"""The luck of most frames: nothing happens to them."""


class Draw(NamedTuple):
    """What chance has in store for the next frames, in order of hand-over.

    Attributes:
        jitters_ns: for each frame, its delay on top of the propagation.
        lucks: by place, the frames that meet with anything else: few as a rule.
    """

    jitters_ns: list[int]
    lucks: dict[int, Luck]


class Stream:
    """One purpose's random numbers. A number that nobody needs is drawn when the next one is."""

    def __init__(self, draw: Callable[[int], Any]) -> None:
        self._draw = draw
        self._missed = 0

    def take(self, count: int) -> NDArray[Any]:
        """The numbers of the next `count` frames."""
        while self._missed:
            burnt = min(self._missed, _CATCH_UP)
            self._draw(burnt)
            self._missed -= burnt
        numbers: NDArray[Any] = self._draw(count)
        return numbers

    def miss(self, count: int) -> None:
        """The next `count` frames do without."""
        self._missed += count


class Chain(NamedTuple):
    """A Markov chain that moves with every frame, and then may lose it.

    Attributes:
        moves: for each state, chances to go elsewhere: (sum of them so far, next state).
        losses: for each state, the chance to lose a frame.
    """

    moves: tuple[tuple[tuple[float, int], ...], ...]
    losses: tuple[float, ...]

    @classmethod
    def of(cls, model: LossModel) -> "Chain":
        """The chain of a loss model; it starts in state 0, the good one or the gap."""
        match model:
            case GilbertElliott():
                return cls((((model.p, 1),), ((model.r, 0),)), (model.good_loss, model.bad_loss))
            case FourState():
                p31 = 1.0 - model.p13 if model.p31 is None else model.p31
                return cls(
                    (
                        ((model.p14, 3), (model.p14 + model.p13, 2)),
                        ((model.p23, 2),),
                        ((model.p32, 1), (model.p32 + p31, 0)),
                        ((1.0, 0),),
                    ),
                    (0.0, 0.0, 1.0, 1.0),
                )
            case chance:
                return cls(((),), (chance,))


class Loss:
    """Which frames are lost on the way, by a model with or without a memory."""

    def __init__(self, moves: Generator, losses: Generator) -> None:
        self._move = Stream(moves.random)
        self._lose = Stream(losses.random)
        self._model: LossModel = 0.0
        self._chain = Chain.of(self._model)
        self._state = 0

    def configure(self, model: LossModel) -> None:
        """Go by `model` from the next frame on, from its first state if it is another."""
        if model != self._model:
            self._model, self._chain, self._state = model, Chain.of(model), 0

    def draw(self, count: int) -> list[int]:
        """The places among the next `count` frames of those that are lost."""
        moves, losses = self._chain
        if len(moves) == 1:
            self._move.miss(count)
            return _hits(self._lose, losses[0], count)
        moving, losing = self._move.take(count), self._lose.take(count)
        # Only where the number would move some state can the chain move at all.
        restless = _places(moving < max(leaving[-1][0] for leaving in moves))
        state, places, chances = self._state, [0], [losses[self._state]]
        for place, move in zip(restless, moving[restless].tolist(), strict=True):
            for below, following in moves[state]:
                if move < below:
                    state = following
                    places.append(place)
                    chances.append(losses[state])
                    break
        self._state = state
        if len(chances) == 1:
            return _places(losing < chances[0])
        runs = [end - begin for begin, end in pairwise((*places, count))]
        return _places(losing < np.array(chances).repeat(runs))


class Delays:
    """Jitter: correlated from frame to frame, of any shape (a Gaussian copula)."""

    def __init__(self, rng: Generator) -> None:
        self._noise = Stream(rng.standard_normal)
        self._score: float | None = None

    def draw(
        self, jitter: Jitter | None, count: int, places: Sequence[int] | None = None
    ) -> list[int]:
        """The delays of the next `count` frames in nanoseconds, or of those at `places` alone."""
        if jitter is None:
            self._noise.miss(count)
            self._score = None
            return [0] * (count if places is None else len(places))
        spread_ns, erfc, log = to_ns(jitter.spread_s), math.erfc, math.log
        scores = self._scores(jitter.correlation, count)
        if places is not None:
            scores = [scores[place] for place in places]
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
    """Which bits are wrong on arrival, each on its own, and one of the payload's now and then."""

    def __init__(self, rngs: Sequence[Generator]) -> None:
        first, rest, corrupt, where = rngs
        self._first = Stream(first.random)
        self._rest = Stream(rest.bit_generator.random_raw)
        self._corrupt = Stream(corrupt.random)
        self._where = Stream(where.random)

    def draw(self, config: OneWay, sizes_byte: Sequence[int]) -> dict[int, tuple[int, ...] | None]:
        """The wrong bits by the place in `sizes_byte` of the frames concerned; `None` if lost."""
        wrong = self._by_rate(config, sizes_byte)
        for place, bit in self._corrupted(config.corrupt, sizes_byte).items():
            found = wrong.get(place, _NO_FLIPS)
            if found is not None:
                # The same bit wrong twice is right again.
                wrong[place] = tuple(sorted({*found} ^ {bit}))
        return wrong

    def _by_rate(
        self, config: OneWay, sizes_byte: Sequence[int]
    ) -> dict[int, tuple[int, ...] | None]:
        count, rate = len(sizes_byte), config.bit_error_rate
        if not rate:
            self._first.miss(count)
            self._rest.miss(count)
            return {}
        # A geometric variable: how many bits are right before the first wrong one.
        log_right = math.log1p(-min(rate, 1 - 2**-53))
        bits = {size: (size + config.overhead_byte) * 8 for size in set(sizes_byte)}
        chances = {size: -math.expm1(count * log_right) for size, count in bits.items()}
        draws, seeds = self._first.take(count), self._rest.take(count)
        near = _places(draws < max(chances.values()))
        wrong: dict[int, tuple[int, ...] | None] = {}
        for place, first in zip(near, draws[near].tolist(), strict=True):
            size, found = sizes_byte[place], None
            if first >= chances[size]:
                continue
            if config.bit_errors is BitErrorEffect.FLIP:
                right = min(int(math.log1p(-first) / log_right), bits[size] - 1)
                found = _wrong_bits(right, bits[size], rate, int(seeds[place]))
                if found[-1] >= size * 8:
                    found = None
            wrong[place] = found
        return wrong

    def _corrupted(self, chance: float, sizes_byte: Sequence[int]) -> dict[int, int]:
        count = len(sizes_byte)
        if not chance:
            self._corrupt.miss(count)
            self._where.miss(count)
            return {}
        where = self._where.take(count)
        return {
            place: int(where[place] * sizes_byte[place] * 8)
            for place in _hits(self._corrupt, chance, count)
            if sizes_byte[place]
        }


def _wrong_bits(first: int, bits: int, rate: float, seed: int) -> tuple[int, ...]:
    """The first wrong bit and those that follow it, in order."""
    rng = np.random.default_rng(seed)
    after = bits - first - 1
    count = int(rng.binomial(after, rate))
    rest = np.sort(rng.choice(after, count, replace=False)) if count else np.empty(0, np.int64)
    return first, *(first + 1 + rest).tolist()


def _hits(stream: Stream, chance: float, count: int) -> list[int]:
    """The places among the next `count` frames of those that an event of this chance comes over."""
    if not chance:
        stream.miss(count)
        return []
    return _places(stream.take(count) < chance)


def _places(hit: NDArray[np.bool_]) -> list[int]:
    places: list[int] = hit.nonzero()[0].tolist()
    return places


class Chance:
    """All that chance does in one direction.

    Args:
        rng: the direction's generator, from which each purpose's is spawned.
        config: the direction.
    """

    def __init__(self, rng: Generator, config: OneWay) -> None:
        # The order says which child is whose, and so is part of what a seed means.
        move, lose, hold, repeat, jitter, copy, *bits = rng.spawn(10)
        self._loss = Loss(move, lose)
        self._hold = Stream(hold.random)
        self._repeat = Stream(repeat.random)
        self._jitter = Delays(jitter)
        self._copy = Delays(copy)
        self._bits = BitErrors(bits)
        self.configure(config)

    def configure(self, config: OneWay) -> None:
        """Go by `config` from the next frame on."""
        self._config = config
        self._loss.configure(config.loss)

    def draw(self, frames: Sequence[Frame]) -> Draw:
        """The luck of the next frames, in order of hand-over."""
        if not frames:
            return Draw([], {})
        config, count = self._config, len(frames)
        lucks: defaultdict[int, Luck] = defaultdict(Luck)
        for place in self._loss.draw(count):
            lucks[place].loss = Fate.LOST
        for place, wrong in self._bits.draw(config, [len(f.payload) for f in frames]).items():
            luck = lucks[place]
            if wrong is not None:
                luck.flips = wrong
            elif luck.loss is None:
                luck.loss = Fate.BIT_ERROR
        self._hold_back(lucks, count)
        self._copy_some(lucks, count)
        return Draw(self._jitter.draw(config.jitter, count), lucks)

    def _hold_back(self, lucks: defaultdict[int, Luck], count: int) -> None:
        reorder = self._config.reorder
        if reorder is None:
            self._hold.miss(count)
            return
        hold_ns = to_ns(reorder.hold_s)
        for place in _hits(self._hold, reorder.share, count):
            lucks[place].hold_ns = hold_ns

    def _copy_some(self, lucks: defaultdict[int, Luck], count: int) -> None:
        repeats = _hits(self._repeat, self._config.duplicate, count)
        jitter = self._config.jitter if self._config.duplicate else None
        delays_ns = self._copy.draw(jitter, count, repeats)
        for place, delay_ns in zip(repeats, delays_ns, strict=True):
            lucks[place].copy_ns = delay_ns
