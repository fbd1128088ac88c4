"""How long the rover's moves take, as far as the ground has seen."""

import math
from typing import NamedTuple

from farside.messages import Telemetry
from farside.node import NS_PER_S, to_ns

_QUARTERS = "NESW"
_SETTLING_S = 1.0  # to gather speed and to stop
_PRIOR_WEIGHT = 2
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


class _Mean:
    def __init__(self, prior_ns: int) -> None:
        self._sum_ns, self._count = prior_ns * _PRIOR_WEIGHT, _PRIOR_WEIGHT

    def add(self, value_ns: int) -> None:
        self._sum_ns += value_ns
        self._count += 1

    @property
    def value_ns(self) -> int:
        return self._sum_ns // self._count


class MoveTimes:
    """The mean duration of a move, by how far the rover has to turn for it.

    It begins with what the drive is made for, which counts as two moves, and goes on with what
    telemetry shows (project defaults).

    Args:
        terms: of the moves.
    """

    def __init__(self, terms: MoveTerms) -> None:
        self._means = [
            _Mean(
                to_ns(
                    terms.cell_m / terms.speed_m_s
                    + _SETTLING_S
                    + quarters * math.pi / 2 / terms.turn_rate_rad_s
                )
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
            if telemetry.time_ns - before.time_ns < _SEEN_NS:
                quarters = _quarters(self._facing, before.action)
                self._means[quarters].add(telemetry.since_ns - before.since_ns)
            self._facing = before.action

    def expected_ns(self, facing: str | None, action: str) -> int:
        """How long a move is expected to take.

        Args:
            facing: the action before, after which the rover faces that way; `None` if not known.
            action: the move.
        """
        return self._means[_quarters(facing, action)].value_ns

    @property
    def facing(self) -> str | None:
        """The last move known to be over; `None` before the first."""
        return self._facing


def _quarters(facing: str | None, action: str) -> int:
    """By how many quarter turns the rover turns."""
    if facing is None or facing not in _QUARTERS or action not in _QUARTERS:
        return 1
    turn = abs(_QUARTERS.index(facing) - _QUARTERS.index(action))
    return min(turn, 4 - turn)
