"""The pose estimate: odometry and gyro, corrected by noisy fixes."""

import math

from numpy.random import Generator

from farside.rover.config import SensorConfig
from farside.rover.world.body import TruePose
from farside.rover.world.noise import Normal

_SLIP_SD = 0.25
_START_SD_M = 0.05


class PoseEstimate:
    """A Kalman filter for position and one for heading, each with one variance.

    Position is predicted from wheel speed, which slip makes too large, and estimated heading;
    heading from the gyro. Fixes of both, at intervals, correct them. Both axes share one variance,
    so the gain is a scalar: K = P/(P + R).
    """

    def __init__(
        self, start: TruePose, config: SensorConfig, step_s: float, rng: Generator
    ) -> None:
        self.x_m, self.y_m, self.heading_rad = start
        self._config = config
        self._step_s = step_s
        self._noise = Normal(rng)
        self._position_var = _START_SD_M**2
        self._heading_var = config.heading_sd_rad**2
        self._steps_to_fix = self._steps_per_fix = max(1, round(config.fix_every_s / step_s))

    def update(
        self, truth: TruePose, wheel_m_s: float, turned_rad: float, *, fixes: bool = True
    ) -> None:
        """Advance by one tick.

        Args:
            truth: the true pose, which fixes measure with noise.
            wheel_m_s: speed of the wheels.
            turned_rad: true change of heading, which the gyro measures with noise.
            fixes: whether the sensor gives fixes.
        """
        step_s = self._step_s
        self.heading_rad += turned_rad + self._config.gyro_sd_rad_s * step_s * self._noise.draw()
        self.x_m += wheel_m_s * step_s * math.cos(self.heading_rad)
        self.y_m += wheel_m_s * step_s * math.sin(self.heading_rad)
        # P ← P + Q; slip makes the wheels' path uncertain by a share of its length.
        self._position_var += (_SLIP_SD * wheel_m_s * step_s) ** 2
        self._heading_var += (self._config.gyro_sd_rad_s * step_s) ** 2
        self._steps_to_fix -= 1
        if self._steps_to_fix == 0:
            self._steps_to_fix = self._steps_per_fix
            if fixes:
                self._fix(truth)

    def _fix(self, truth: TruePose) -> None:
        config, draw = self._config, self._noise.draw
        # K = P/(P + R);  x ← x + K(z − x);  P ← (1 − K)P
        gain = _gain(self._position_var, config.position_sd_m)
        self.x_m += gain * (truth.x_m + config.position_sd_m * draw() - self.x_m)
        self.y_m += gain * (truth.y_m + config.position_sd_m * draw() - self.y_m)
        self._position_var *= 1 - gain
        gain = _gain(self._heading_var, config.heading_sd_rad)
        self.heading_rad += gain * (
            truth.heading_rad + config.heading_sd_rad * draw() - self.heading_rad
        )
        self._heading_var *= 1 - gain


def _gain(variance: float, sensor_sd: float) -> float:
    return variance / (variance + sensor_sd**2) if variance else 0.0
