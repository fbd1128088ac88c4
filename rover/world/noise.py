"""Random numbers in blocks: one draw at a time from a generator costs more than a physics step."""

import math

from numpy.random import Generator

_BLOCK = 512


class Normal:
    """Independent standard normal numbers from one stream, in the stream's order."""

    def __init__(self, rng: Generator) -> None:
        self._rng = rng
        self._block: list[float] = []

    def draw(self) -> float:
        """The next number: mean 0, standard deviation 1."""
        if not self._block:
            self._block = self._rng.standard_normal(_BLOCK).tolist()[::-1]
        return self._block.pop()


class Wander:
    """A first-order autoregressive process: a value that wanders about a mean.

    xₜ₊₁ = µ + φ(xₜ − µ) + σ√(1 − φ²)·n, with φ = exp(−Δt/τ) and n standard normal, so that it has
    mean µ and standard deviation σ at any time step.
    """

    def __init__(
        self, rng: Generator, mean: float, sd: float, step_s: float, time_s: float
    ) -> None:
        self._noise = Normal(rng)
        self._mean = mean
        self._keep = math.exp(-step_s / time_s)
        self._kick = sd * math.sqrt(1 - self._keep**2)
        self._offset = sd * self._noise.draw()

    def draw(self) -> float:
        """The value one step later."""
        # x − µ ← φ(x − µ) + σ√(1 − φ²)·n
        self._offset = self._keep * self._offset + self._kick * self._noise.draw()
        return self._mean + self._offset
