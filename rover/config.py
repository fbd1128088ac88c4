"""The `[rover]` table of a mission file. Defaults without another source are project defaults."""

from enum import StrEnum
from typing import Annotated

from msgspec import Meta, field

from farside.control import OnLoss
from farside.dem import Exploration, Parameters
from farside.messages import Tokens
from farside.places import place_token
from farside.settings import Fraction, NonNegative, Options, PlaceName, Positive, Section

Physical = Annotated[float, Meta(ge=1e-3, le=1e6)]
"""A quantity of the physics, in whatever unit: far smaller or greater ones overflow in it (project
default)."""


QUEUED = "queued"
"""The controller that takes its actions from outside."""

HEARTBEATS = 2.5
"""So many heartbeats without a frame are no silence yet: one may be lost (project default)."""


class BodyConfig(Section, frozen=True):
    """Body and wheels. What is `Physical` goes from 0.001 to 10⁶.

    Attributes:
        mass_kg: mass of the rover.
        radius_m: radius of the round body, 1 cm to 1 km.
        motor_force_n: maximum force of the wheels on the ground.
        friction: friction coefficient of wheels on soil; times `gravity_m_s2` it bounds every
            acceleration, forward and sideways.
        gravity_m_s2: surface gravity (default: the Moon's).
        slip_mean: mean slip, the share of wheel speed lost in the soil.
        slip_sd: standard deviation of slip.
        slip_time_s: correlation time of slip.
    """

    mass_kg: Physical = 40.0
    radius_m: Annotated[float, Meta(ge=0.01, le=1000)] = 0.3
    motor_force_n: Physical = 60.0
    friction: Physical = 0.8
    gravity_m_s2: Physical = 1.62
    slip_mean: Fraction = 0.05
    slip_sd: Fraction = 0.03
    slip_time_s: Physical = 1.0


class DriveConfig(Section, frozen=True):
    """The drive controller.

    Attributes:
        speed_m_s: cruising speed of the wheels, 0.001 to 100.
        turn_rate_rad_s: maximum yaw rate, 0.001 to 100.
        tolerance_m: distance to the middle of a place that counts as arrived.
        give_up_s: time after which a move ends where the rover stands, as blocked.
        move_cost_s: action cost of every move, for the Dynamic Expectancy Model (seed: 2.66).
    """

    speed_m_s: Annotated[float, Meta(ge=1e-3, le=100)] = 0.9
    turn_rate_rad_s: Annotated[float, Meta(ge=1e-3, le=100)] = 1.9
    tolerance_m: Physical = 0.05
    give_up_s: Positive = 20.0
    move_cost_s: Positive = 2.66

    def least_move_s(self, cell_m: float) -> float:
        """What a move takes at least, in seconds, unless it is blocked.

        The rover sees to it, so that the ground can say until when what follows can be taken back:
        from one middle to the next, less the tolerance at both, at cruising speed.
        """
        return max(0.0, cell_m - 2 * self.tolerance_m) / self.speed_m_s


Deviation = Annotated[float, Meta(ge=0, le=1000)]
"""A standard deviation of sensor noise, 1000 at most (project default)."""


class SensorConfig(Section, frozen=True):
    """The sensors of the pose estimate: standard deviations of zero-mean noise, 0 to 1000.

    Attributes:
        position_sd_m: of a position fix.
        heading_sd_rad: of a heading fix.
        gyro_sd_rad_s: of the yaw rate, at each tick.
        fix_every_s: interval between fixes while driving.
    """

    position_sd_m: Deviation = 0.05
    heading_sd_rad: Deviation = 0.01
    gyro_sd_rad_s: Deviation = 0.02
    fix_every_s: Positive = 0.4


class BatteryConfig(Section, frozen=True):
    """The battery.

    Attributes:
        capacity_j: energy when full.
        initial: state of charge at the start, 0 to 1.
        idle_w: power drawn always.
        drive_w: power drawn on top while driving.
        charge_w: charging power on the dock.
        low: state of charge below which the Token `battery:low` is sensed.
        charged: state of charge from which it is not sensed any more.
        charge_priority: priority of the goal `on_charge` when the battery is empty; it grows from
            0 at `low`. Without a dock there is no such goal.
        reserve: the charge counts as reserve when it is less than this many times what the way to
            the dock takes, as far as it is known. Then nothing else is begun that leads
            farther away, unless the operator insists.
    """

    capacity_j: Positive = 250_000.0
    initial: Fraction = 1.0
    idle_w: NonNegative = 10.0
    drive_w: NonNegative = 60.0
    charge_w: NonNegative = 400.0
    low: Fraction = 0.25
    charged: Fraction = 0.9
    charge_priority: Positive = 10.0
    reserve: Annotated[float, Meta(ge=1, le=100)] = 1.5

    def __post_init__(self) -> None:
        if self.charged < self.low:
            raise ValueError(
                f"expected charged >= low, found charged = {self.charged:g}, low = {self.low:g}"
            )


class ReturnTo(StrEnum):
    """How the rover gets out of terrain shadow when the link is lost there.

    Back along its own track; by the ways that its model has learned to where the link works, and
    back along the track where it knows none; or not.
    """

    TRACK = "track"
    SIGNAL = "signal"
    NONE = "none"


class FailsafeConfig(Section, frozen=True):
    """When silence counts as loss of the link, and what happens then.

    Silence is the time since the last frame arrived in which, by the contact plan, one could have
    arrived. Silence of less than `hold_after_s`, or of less than two and a half heartbeats, does
    not count as any: a single lost frame does nothing.

    Attributes:
        hold_after_s: the rover finishes its move and stands still.
        lost_after_s: the countdown to the loss of the link. Silence uses it up; while the ground is
            heard it grows again, at a quarter of that pace. At 0 the link counts as lost.
        on_loss: whether the rover then acts alone if it has goals, or holds: `autonomy` or `hold`.
            The operator may change it.
        return_to: what brings it out of terrain shadow then: `track`, its own track back; `signal`,
            the ways that its model knows to the Token `link:up`; or `none`.
        return_priority: priority of the goal `link:up` then; mission goals have 1 by default.
        tilt_limit_rad: from this tilt on the rover stands.
    """

    hold_after_s: Positive = 10.0
    lost_after_s: Positive = 30.0
    on_loss: OnLoss = OnLoss.AUTONOMY
    return_to: ReturnTo = ReturnTo.TRACK
    return_priority: Positive = 0.5
    tilt_limit_rad: Annotated[float, Meta(gt=0, le=1.6)] = 0.5

    def __post_init__(self) -> None:
        if self.lost_after_s <= self.hold_after_s:
            raise ValueError(
                f"expected lost_after_s > hold_after_s, found lost_after_s = "
                f"{self.lost_after_s:g}, hold_after_s = {self.hold_after_s:g}"
            )


class Consent(StrEnum):
    """How the operator consents in shared mode: by approval, or by not vetoing in time."""

    APPROVAL = "approval"
    VETO = "veto"


class ConsentConfig(Section, frozen=True):
    """Consent to what the DEM proposes in shared mode.

    Attributes:
        by: `approval`: the operator's word; or `veto`: the rover acts if no veto came within the
            veto window.
        veto_window_s: the window runs from when the operator is known to have been shown the
            proposal, and only while the ground is heard. It is a round trip and 4 s at least.
    """

    by: Consent = Consent.APPROVAL
    veto_window_s: Positive = 10.0


class FaultKind(StrEnum):
    """What may go wrong with the rover: no more position fixes, or it stands tilted."""

    POSITION_SENSOR = "position-sensor"
    TILT = "tilt"


class Fault(Section, frozen=True):
    """Something that goes wrong during the run.

    Attributes:
        what: `position-sensor`: there are no fixes, and no place is sensed; or `tilt`.
        start_s: since when.
        end_s: until when; to the end of the run by default.
        tilt_rad: the tilt, with `what = "tilt"`.
    """

    what: FaultKind
    start_s: NonNegative
    end_s: Positive = 1e9
    tilt_rad: Annotated[float, Meta(ge=0, le=1.6)] = 0.8

    def __post_init__(self) -> None:
        if self.end_s <= self.start_s:
            span = f"start_s = {self.start_s:g}, end_s = {self.end_s:g}"
            raise ValueError(f"expected end_s > start_s, found {span}")


class DemConfig(Parameters, frozen=True):
    """The model on board: `farside.dem.Parameters`, without exploration by default.

    Attributes:
        exploration: what the rover does in autonomous mode where its model knows no way to any
            goal: `none`, stand and wait for guidance; `random`; or `curious`, see `curiosity`. In
            shared mode nothing is proposed then.
    """

    exploration: Exploration = Exploration.NONE


class MissionGoal(Section, frozen=True):
    """A goal loaded before the start, pursued when the link is lost.

    Attributes:
        place: the goal.
        priority: its priority; the rover pursues the goal with the highest.
    """

    place: PlaceName
    priority: Positive = 1.0


class Avoided(Section, frozen=True):
    """A place, or anything else that is sensed, which the model on board is to avoid.

    Attributes:
        cost_s: what it costs to get there beside the moves, in seconds; 0 to 10⁹.
        place: the place; or else `token`.
        token: what is sensed, such as `battery:low`.
    """

    cost_s: Annotated[float, Meta(ge=0, le=1e9)]
    place: PlaceName | None = None
    token: Annotated[str, Meta(min_length=1)] | None = None

    def __post_init__(self) -> None:
        if (self.place is None) == (self.token is None):
            found = "neither" if self.place is None else "both"
            raise ValueError(f"expected place or token, found {found}")

    @property
    def tokens(self) -> Tokens:
        """The Sign to be avoided."""
        return (self.token or place_token(self.place or ""),)


class RoverConfig(Section, frozen=True):
    """The rover: where it starts, what it is, and how it decides.

    Attributes:
        start: the place where the rover starts, such as `D` or `3,4`.
        goals: mission goals, pursued when the link is lost.
        avoid: what the model on board avoids in every mode, wherever it chooses; see
            `docs/dem.md`. The costs of its ways contain this. Orders are not affected.
        body: body and wheels.
        drive: the drive controller.
        sensors: the sensors of the pose estimate.
        battery: the battery.
        failsafe: when silence counts as loss of the link, and what happens then.
        consent: how the operator consents to proposals.
        faults: what goes wrong during the run.
        controller: what flies the rover when the operator does not: `dem`, the Dynamic Expectancy
            Model; `queued`, actions from outside, see `docs/gymnasium.md`; the name of an installed
            one; or `module:Class` of one's own, see `docs/extend.md`.
        controller_options: what a controller that is not built in is made with.
        dem: parameters of the Dynamic Expectancy Model.
        memory: how many steps back the controller senses what was sensed and done, as one more
            Token; 0 to 8. For worlds where places look alike, see `docs/dem.md`: learning takes
            longer, and the lists are several times as long.
        shadow: whether the ground holds a shadow of that model: its lists, fed over the downlink,
            with every map and path. Changes are sent in what all else leaves of the rate, some 130
            bytes an update with its frame; the summary of a run states the price.
    """

    start: PlaceName
    goals: tuple[MissionGoal, ...] = ()
    avoid: tuple[Avoided, ...] = ()
    body: BodyConfig = BodyConfig()
    drive: DriveConfig = DriveConfig()
    sensors: SensorConfig = SensorConfig()
    battery: BatteryConfig = BatteryConfig()
    failsafe: FailsafeConfig = FailsafeConfig()
    consent: ConsentConfig = ConsentConfig()
    faults: tuple[Fault, ...] = ()
    controller: str = "dem"
    controller_options: Options = field(default_factory=dict)
    dem: DemConfig = DemConfig()
    memory: Annotated[int, Meta(ge=0, le=8)] = 0
    shadow: bool = True

    @property
    def aversions(self) -> dict[Tokens, float]:
        """What is to be avoided, with its cost in seconds; the last word on a Sign counts."""
        return {avoided.tokens: avoided.cost_s for avoided in self.avoid}

    @property
    def is_shadowed(self) -> bool:
        """Whether rover and ground agree on a shadow: only of the model that Farside brings."""
        return self.shadow and self.controller == "dem"
