"""What a mission file says of the rover. Defaults without another source are project defaults."""

from farside.dem import Parameters
from farside.settings import Fraction, NonNegative, Positive, Section


class BodyConfig(Section, frozen=True):
    """Body and wheels.

    Attributes:
        mass_kg: mass of the rover.
        radius_m: radius of the round body that walls and rocks stop.
        motor_force_n: greatest force of the wheels on the ground.
        friction: friction coefficient between wheels and soil; with `gravity_m_s2` it bounds
            every acceleration, forward and sideways.
        gravity_m_s2: surface gravity (default: the Moon's).
        slip_mean, slip_sd: share of the wheels' speed that is lost in the soil, and its spread;
            it wanders with a correlation time of `slip_time_s`.
    """

    mass_kg: Positive = 40.0
    radius_m: Positive = 0.3
    motor_force_n: Positive = 60.0
    friction: Positive = 0.8
    gravity_m_s2: Positive = 1.62
    slip_mean: Fraction = 0.05
    slip_sd: Fraction = 0.03
    slip_time_s: Positive = 1.0


class DriveConfig(Section, frozen=True):
    """The controller that steers from place to place.

    Attributes:
        speed_m_s: cruising speed of the wheels.
        turn_rate_rad_s: rate of turning on the spot.
        tolerance_m: how near to the middle of a place counts as there.
        give_up_s: a move that takes longer ends where the rover stands, as blocked.
        move_cost_s: action cost of every move, for the Dynamic Expectancy Model (seed: 2.66).
    """

    speed_m_s: Positive = 0.9
    turn_rate_rad_s: Positive = 1.9
    tolerance_m: Positive = 0.05
    give_up_s: Positive = 20.0
    move_cost_s: Positive = 2.66


class SensorConfig(Section, frozen=True):
    """What the pose estimate is made from, as standard deviations of zero-mean noise.

    Attributes:
        position_sd_m: of a position fix, taken every `fix_every_s` while driving.
        heading_sd_rad: of a heading fix, taken with it.
        gyro_sd_rad_s: of the turning rate, each tick.
        fix_every_s: time between fixes.
    """

    position_sd_m: NonNegative = 0.05
    heading_sd_rad: NonNegative = 0.01
    gyro_sd_rad_s: NonNegative = 0.02
    fix_every_s: Positive = 0.4


class BatteryConfig(Section, frozen=True):
    """The battery.

    Attributes:
        capacity_j: energy when full.
        initial: charge at the start, 0 to 1.
        idle_w, drive_w: drawn always, and drawn in addition while driving.
        charge_w: gained on the dock.
        low: below this charge the Token `battery:low` is sensed, until the charge is `charged`.
        charge_priority: priority that the goal `on_charge` reaches as the battery runs empty; it
            grows from 0 at `low`.
    """

    capacity_j: Positive = 250_000.0
    initial: Fraction = 1.0
    idle_w: NonNegative = 10.0
    drive_w: NonNegative = 60.0
    charge_w: NonNegative = 400.0
    low: Fraction = 0.25
    charged: Fraction = 0.9
    charge_priority: Positive = 10.0

    def __post_init__(self) -> None:
        if self.charged < self.low:
            raise ValueError(
                f"expected charged >= low, found charged = {self.charged:g}, low = {self.low:g}"
            )


class FailsafeConfig(Section, frozen=True):
    """When silence is taken for loss. Silence is the time since any frame came from the ground.

    Attributes:
        hold_after_s: the rover finishes what it does and stands still.
        lost_after_s: the link is lost: the rover acts alone, if it has goals.
    """

    hold_after_s: Positive = 10.0
    lost_after_s: Positive = 30.0

    def __post_init__(self) -> None:
        if self.lost_after_s <= self.hold_after_s:
            raise ValueError(
                f"expected lost_after_s > hold_after_s, found lost_after_s = "
                f"{self.lost_after_s:g}, hold_after_s = {self.hold_after_s:g}"
            )


class MissionGoal(Section, frozen=True):
    """A goal loaded before the start, for when the link is lost."""

    place: str
    priority: Positive = 1.0


class RoverConfig(Section, frozen=True):
    """The `[rover]` table.

    Attributes:
        start: name of the place where the rover begins, such as `D` or `3,4`.
        goals: mission goals, taken up when the link is lost.
        dem: parameters of the Dynamic Expectancy Model.
    """

    start: str
    goals: tuple[MissionGoal, ...] = ()
    body: BodyConfig = BodyConfig()
    drive: DriveConfig = DriveConfig()
    sensors: SensorConfig = SensorConfig()
    battery: BatteryConfig = BatteryConfig()
    failsafe: FailsafeConfig = FailsafeConfig()
    dem: Parameters = Parameters()
