"""The drive controller: moves the rover to the next place, or back to where it started."""

import math
from enum import Enum, auto
from typing import NamedTuple

from farside.rover.config import BodyConfig, DriveConfig
from farside.rover.senses.estimate import PoseEstimate

_FACING_RAD = 0.03
_STEER_PER_S = 3.0
_TURN_PER_S = 4.0
_GRIP_SHARE = 0.8


class WheelCommand(NamedTuple):
    """Set points of the wheels: speed (negative backwards) and yaw rate."""

    speed_m_s: float
    yaw_rad_s: float


STAND = WheelCommand(0.0, 0.0)


class _Phase(Enum):
    TURN = auto()
    AHEAD = auto()
    BACK = auto()
    STOP = auto()


class Move:
    """One move to a neighbouring place, controlled from the pose estimate.

    The rover turns on the spot towards the target, drives to it and stops. After a bump it backs
    up to where it started, so a move against a wall leaves the rover where it was.

    Attributes:
        blocked: whether the move was given up before the target.
    """

    def __init__(
        self,
        home_m: tuple[float, float],
        target_m: tuple[float, float],
        drive: DriveConfig,
        body: BodyConfig,
        step_s: float,
    ) -> None:
        self._home_m, self._target_m = home_m, target_m
        self._drive = drive
        # Wheels that are asked for more than the soil gives spin, and odometry with them.
        self._ramp_m_s2 = _GRIP_SHARE * min(
            body.friction * body.gravity_m_s2, body.motor_force_n / body.mass_kg
        )
        self._step_s = step_s
        self._speed_m_s = 0.0
        self._phase = _Phase.TURN
        self.blocked = False

    @property
    def stopping(self) -> bool:
        """Whether the move is over except for coming to rest."""
        return self._phase is _Phase.STOP

    def bumped(self) -> None:
        """Respond to a bump: back up, or stop if already backing up."""
        self.blocked = True
        self._speed_m_s = 0.0
        self._phase = _Phase.BACK if self._phase is _Phase.AHEAD else _Phase.STOP

    def abandon(self) -> None:
        """Give up: stop where the rover is."""
        self.blocked = True
        self._phase = _Phase.STOP

    def command(self, pose: PoseEstimate) -> WheelCommand:
        """The set points for this tick."""
        if self._phase is _Phase.STOP:
            return STAND
        backwards = self._phase is _Phase.BACK
        goal_m = self._home_m if backwards else self._target_m
        east_m, north_m = goal_m[0] - pose.x_m, goal_m[1] - pose.y_m
        distance_m = math.hypot(east_m, north_m)
        bearing = math.atan2(north_m, east_m) + (math.pi if backwards else 0.0)
        error_rad = math.remainder(bearing - pose.heading_rad, math.tau)
        if self._phase is _Phase.TURN:
            if abs(error_rad) > _FACING_RAD:
                return WheelCommand(0.0, self._turn(_TURN_PER_S * error_rad))
            self._phase = _Phase.AHEAD
        if distance_m < self._drive.tolerance_m or abs(error_rad) > math.pi / 2:
            self._phase = _Phase.STOP
            return STAND
        # v = √(2as): the fastest from which the wheels can still stop there.
        self._speed_m_s = min(
            self._drive.speed_m_s,
            self._speed_m_s + self._ramp_m_s2 * self._step_s,
            math.sqrt(2 * self._ramp_m_s2 * distance_m),
        )
        speed_m_s = -self._speed_m_s if backwards else self._speed_m_s
        return WheelCommand(speed_m_s, self._turn(_STEER_PER_S * error_rad))

    def _turn(self, rate_rad_s: float) -> float:
        limit = self._drive.turn_rate_rad_s
        return max(-limit, min(limit, rate_rad_s))
