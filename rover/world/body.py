"""The rover's true motion: a body with mass on soil with friction, among obstacles (pymunk)."""

import math
from typing import NamedTuple

import pymunk
from numpy.random import Generator

from farside.places import Chart
from farside.rover.config import BodyConfig
from farside.rover.world.noise import Wander
from farside.rover.world.terrain import OBSTACLE, obstacles

_YAW_ACCELERATION_RAD_S2 = 4.0


class TruePose(NamedTuple):
    """The true pose: metres east and north, heading in radians from east towards north."""

    x_m: float
    y_m: float
    heading_rad: float


class World:
    """A skid-steered rover seen from above, stepped on a fixed grid.

    The wheels accelerate the body towards the commanded speed, less the slip in the soil, and
    resist sideways drift. Both accelerations are bounded by µ·g (Coulomb friction), the forward
    one by the motor as well. Walls and rocks are rigid shapes that stop the body.
    """

    def __init__(
        self, chart: Chart, config: BodyConfig, start: TruePose, step_s: float, rng: Generator
    ) -> None:
        self._chart = chart
        self._step_s = step_s
        self._slip = Wander(rng, config.slip_mean, config.slip_sd, step_s, config.slip_time_s)
        grip_m_s2 = config.friction * config.gravity_m_s2
        self._grip_m_s = grip_m_s2 * step_s
        self._push_m_s = min(grip_m_s2, config.motor_force_n / config.mass_kg) * step_s
        self._space = pymunk.Space()
        self._body = pymunk.Body(
            config.mass_kg, pymunk.moment_for_circle(config.mass_kg, 0, config.radius_m)
        )
        self._body.position = start.x_m, start.y_m
        self._body.angle = start.heading_rad
        hull = pymunk.Circle(self._body, config.radius_m)
        hull.friction = config.friction
        self._space.add(self._body, hull, *obstacles(self._space, chart, config.friction))
        self._space.on_collision(OBSTACLE, None, begin=self._touch)
        self._bump_m_s: float | None = None

    @property
    def pose(self) -> TruePose:
        """The true pose now."""
        x_m, y_m = self._body.position
        return TruePose(x_m, y_m, self._body.angle)

    @property
    def in_shadow(self) -> bool:
        """Whether terrain hides the other end of the link from here."""
        if not self._chart.shadow:
            return False
        x_m, y_m, _ = self.pose
        return self._chart.cell_at(x_m, y_m) in self._chart.shadow

    @property
    def speed_m_s(self) -> float:
        """Speed over ground."""
        return self._body.velocity.length

    def step(self, wheel_m_s: float, yaw_rad_s: float) -> float | None:
        """Step the physics with these wheel commands.

        Returns:
            the speed of impact if the body hit an obstacle in this step, otherwise `None`.
        """
        body = self._body
        cos, sin = math.cos(body.angle), math.sin(body.angle)
        vx, vy = body.velocity
        forward, sideways = vx * cos + vy * sin, vy * cos - vx * sin
        wanted = wheel_m_s * (1 - self._slip.draw())
        forward += _clamp(wanted - forward, self._push_m_s)
        sideways -= _clamp(sideways, self._grip_m_s)
        body.velocity = (forward * cos - sideways * sin, forward * sin + sideways * cos)
        turn = body.angular_velocity
        body.angular_velocity = turn + _clamp(
            yaw_rad_s - turn, _YAW_ACCELERATION_RAD_S2 * self._step_s
        )
        self._bump_m_s = None
        self._space.step(self._step_s)
        return self._bump_m_s

    @property
    def at_rest(self) -> bool:
        """Whether the body is at rest: a step without commands would change nothing."""
        return self._body.velocity == (0.0, 0.0) and self._body.angular_velocity == 0.0

    def _touch(self, _arbiter: pymunk.Arbiter, _space: pymunk.Space, _data: object) -> None:
        self._bump_m_s = self._body.velocity.length


def _clamp(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))
