"""From observations to Tokens: small functions to compose, each from an observation to Tokens.

    tokens = fields({"position": bins("x", [-1.2, -0.07], [0.6, 0.07], 12), "mode": label("mode")})

Any function `observation -> list[str]` can stand beside them.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, SupportsInt

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    import gymnasium

Tokeniser = Callable[[Any], list[str]]
"""Gives the Tokens of an observation, whatever type the world's observations have."""

BINS = 8
"""Into so many bins `tokens_of` divides every number (project default)."""


def label(name: str) -> Tokeniser:
    """The value itself, as of a discrete observation: 3 is `NAME:3`."""
    return lambda value: [f"{name}:{value}"]


def each(names: str | Sequence[str]) -> Tokeniser:
    """Every element as a Token, as of a multi-discrete observation: `NAME0:3`, `NAME1:2`.

    Args:
        names: of the elements; a single name is numbered.
    """
    return lambda values: [
        f"{name}:{value}" for name, value in _named(names, np.ravel(values).tolist())
    ]


def one_hot(name: str) -> Tokeniser:
    """The indices of what is not 0, as of a one-hot or multi-binary observation: `NAME:2`."""
    return lambda flags: [f"{name}:{index}" for index in np.flatnonzero(flags).tolist()]


def bins(
    names: str | Sequence[str], low: ArrayLike, high: ArrayLike, counts: int | Sequence[int]
) -> Tokeniser:
    """Every number by the bin that it falls into, from 0: `NAME0:5`, `NAME1:0`.

    All bins of a dimension are equally wide. What lies outside the bounds counts to the first bin
    or the last.

    Args:
        names: of the dimensions; a single name is numbered.
        low: lower bound of each dimension, finite.
        high: upper bound of each dimension, finite.
        counts: the number of bins, 1 or more, of each dimension or of all.

    Raises:
        ValueError: if the bounds are not finite, or in the wrong order, or there are no bins.
    """
    grid = _Grid(low, high, counts)

    def tokens(observation: ArrayLike) -> list[str]:
        found = np.minimum(np.floor(grid.scaled(observation)), grid.counts - 1)
        return [f"{name}:{index:.0f}" for name, index in _named(names, found.tolist())]

    return tokens


def tiles(
    name: str,
    low: ArrayLike,
    high: ArrayLike,
    counts: int | Sequence[int],
    *,
    tilings: int = 8,
) -> Tokeniser:
    """Tile coding: a Token for the tile of each tiling, `NAME0:3,1`, `NAME1:3,2` and so on.

    Every tiling is a grid over all dimensions, shifted against the others by fractions of a tile:
    by 1, 3, 5 ... of them along the first, second, third ... dimension (Miller and Glanz 1996, as
    in Sutton and Barto). So nearby observations have many tiles in common.

    Args:
        name: of the tilings, which are numbered.
        low: lower bound of each dimension, finite.
        high: upper bound of each dimension, finite.
        counts: the number of tiles within the bounds, 1 or more, of each dimension or of all.
        tilings: the number of tilings, 1 or more.

    Raises:
        ValueError: if the bounds are not finite, or in the wrong order, or there are no tiles.
    """
    if tilings < 1:
        raise ValueError(f"tilings: expected 1 or more, found {tilings}")
    grid = _Grid(low, high, counts)
    shifts = np.outer(np.arange(tilings), 2 * np.arange(len(grid.counts)) + 1) % tilings / tilings

    def tokens(observation: ArrayLike) -> list[str]:
        found = np.floor(grid.scaled(observation) + shifts).astype(int)
        rows = (",".join(map(str, row)) for row in found.tolist())
        return [f"{name}{number}:{row}" for number, row in enumerate(rows)]

    return tokens


def fields(by_key: Mapping[Any, Tokeniser]) -> Tokeniser:
    """The Tokens of some parts of a dictionary or tuple, each by a function of its own.

    Args:
        by_key: the functions, by key or by index. What has none is not sensed.
    """
    return lambda observation: [
        token for key, tokens in by_key.items() for token in tokens(observation[key])
    ]


def as_one(tokens: Callable[[Any], Iterable[str]]) -> Tokeniser:
    """All Tokens of a function together as one, separated by spaces: the whole view at once."""
    return lambda observation: [" ".join(tokens(observation))]


def tokens_of(space: "gymnasium.Space[Any]", name: str = "", *, count: int = BINS) -> Tokeniser:
    """The functions above, chosen by a gymnasium space and whatever it is composed of.

    Args:
        space: the space of the observations.
        name: what Tokens begin with; parts of a dictionary or tuple add their keys to it.
        count: the number of bins for every dimension of a `Box` of real numbers.

    Raises:
        ValueError: if a `Box` has no finite bounds.
        TypeError: if there is none for the space.
    """
    from gymnasium import spaces  # noqa: PLC0415 - whoever has a space has it

    match space:
        case spaces.Discrete():
            return label(name or "state")
        case spaces.MultiDiscrete():
            return each(name or "part")
        case spaces.MultiBinary():
            return one_hot(name or "on")
        case spaces.Box() if np.issubdtype(space.dtype, np.integer):
            return each(name or "cell")
        case spaces.Box():
            return bins(name or "x", space.low.ravel(), space.high.ravel(), count)
        case spaces.Dict() | spaces.Tuple():
            parts = space.items() if isinstance(space, spaces.Dict) else enumerate(space)
            begin = f"{name}." if name else ""
            return fields(
                {key: tokens_of(part, f"{begin}{key}", count=count) for key, part in parts}
            )
        case _:
            raise TypeError(
                f"space: expected Discrete, MultiDiscrete, MultiBinary, Box, Dict or Tuple, found "
                f"{space}: write a function from an observation to Tokens for it"
            )


class _Grid:
    """Equal cells between bounds."""

    def __init__(self, low: ArrayLike, high: ArrayLike, counts: int | Sequence[int]) -> None:
        self._low = np.atleast_1d(np.asarray(low, dtype=float))
        width = np.atleast_1d(np.asarray(high, dtype=float)) - self._low
        if not (np.isfinite(self._low).all() and np.isfinite(width).all() and (width > 0).all()):
            raise ValueError(
                f"bounds: expected finite ones with low < high, found {low!r} and {high!r}: give "
                "bounds that the observations are mostly within"
            )
        self.counts: NDArray[Any] = np.broadcast_to(counts, width.shape)
        if (self.counts < 1).any():
            raise ValueError(f"counts: expected 1 or more in each dimension, found {counts}")
        self._per_unit = self.counts / width

    def scaled(self, observation: ArrayLike) -> NDArray[np.float64]:
        """An observation in cells, from 0 to the counts."""
        values = np.ravel(np.asarray(observation, dtype=float))
        if values.shape != self._low.shape or np.isnan(values).any():
            raise ValueError(
                f"observation: expected a number for each of {len(self._low)} dimensions, found "
                f"{observation!r}"
            )
        scaled: NDArray[np.float64] = (values - self._low) * self._per_unit
        return scaled.clip(0.0, self.counts)


def _named(
    names: str | Sequence[str], values: Sequence[SupportsInt]
) -> Iterable[tuple[str, SupportsInt]]:
    if isinstance(names, str):
        names = [f"{names}{number}" for number in range(len(values))]
    if len(names) != len(values):
        raise ValueError(f"names: expected {len(values)}, one for each number, found {names}")
    return zip(names, values, strict=True)
