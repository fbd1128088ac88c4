"""How long the rover's moves take, as far as the ground has seen."""

import math
from typing import NamedTuple

from farside.messages import Telemetry
from farside.node import NS_PER_S, to_ns, to_s

_QUARTERS = "NESW"
_SETTLING_S = 1.0  # to gather speed and to stop
_PRIOR_WEIGHT = 2
_PRIOR_SPREAD = 0.1  # standard deviation, as a share of the mean
_SEEN_NS = 5 * NS_PER_S // 2  # between two reports: in a longer gap a move may have gone unseen


class MoveTerms(NamedTuple):
    """What both ends know beforehand of how the rover moves.

    Attributes:
        cell_m: side of a cell.
        speed_m_s: cruising speed.
        turn_rate_rad_s: maximum yaw rate.
    """

    cell_m: float
    speed_m_s: float
    turn_rate_rad_s: float


class MoveTime(NamedTuple):
    """How long a move is expected to take: mean, and variance in s²."""

    mean_ns: int
    variance_s2: float


class _Times:
    """Mean and variance of durations, from a prior on (Welford's method)."""

    def __init__(self, prior_s: float) -> None:
        self._count, self._mean_s = _PRIOR_WEIGHT, prior_s
        self._squares_s2 = _PRIOR_WEIGHT * (_PRIOR_SPREAD * prior_s) ** 2

    def add(self, value_s: float) -> None:
        self._count += 1
        off_s = value_s - self._mean_s
        self._mean_s += off_s / self._count
        self._squares_s2 += off_s * (value_s - self._mean_s)

    @property
    def value(self) -> MoveTime:
        return MoveTime(to_ns(self._mean_s), self._squares_s2 / self._count)


class MoveTimes:
    """The duration of a move, mean and variance, by how far the rover has to turn for it.

    It begins with what the drive is made for, which counts as two moves, and goes on with what is
    seen: of commands by the events that tell of them, of other moves by telemetry (project
    defaults).

    Args:
        terms: of the moves.
    """

    def __init__(self, terms: MoveTerms) -> None:
        self._times = [
            _Times(
                terms.cell_m / terms.speed_m_s
                + _SETTLING_S
                + quarters * math.pi / 2 / terms.turn_rate_rad_s
            )
            for quarters in range(3)
        ]
        self._before: Telemetry | None = None
        self._facing: str | None = None

    def learn(self, telemetry: Telemetry) -> None:
        """Telemetry has come straight from the rover, newer than all before it."""
        before, self._before = self._before, telemetry
        if before is None or before.since_ns == telemetry.since_ns:
            return
        if before.action is not None:
            # What a command asked for is told of exactly, by events.
            if before.begun is None and telemetry.time_ns - before.time_ns < _SEEN_NS:
                self.add(self._facing, before.action, telemetry.since_ns - before.since_ns)
            self._facing = before.action

    def add(self, facing: str | None, action: str, duration_ns: int) -> None:
        """A move took this long; see `expected`."""
        self._times[_quarters(facing, action)].add(to_s(duration_ns))
        self._facing = action

    def expected(self, facing: str | None, action: str | None) -> MoveTime:
        """How long a move is expected to take.

        Args:
            facing: the action before, after which the rover faces that way; `None` if not known.
            action: the move; `None` if not known.
        """
        return self._times[_quarters(facing, action)].value

    @property
    def facing(self) -> str | None:
        """The last move known to be over; `None` before the first."""
        return self._facing


def _quarters(facing: str | None, action: str | None) -> int:
    """By how many quarter turns the rover turns."""
    if facing is None or action is None or facing not in _QUARTERS or action not in _QUARTERS:
        return 1
    turn = abs(_QUARTERS.index(facing) - _QUARTERS.index(action))
    return min(turn, 4 - turn)
