"""States and numbers of a run as viewers plot them: flat, with units, and never null.

Foxglove has no schemas of its own for these.
"""

import msgspec

UNKNOWN, NONE, OPEN = "unknown", "none", "open"
"""What stands in a state where nothing is known yet, where there is nothing, and for no outage."""


class TruthNumbers(msgspec.Struct, frozen=True):
    """The true state of charge (0 to 1) and speed from now on."""

    battery: float
    speed_m_s: float


class RoverState(msgspec.Struct, frozen=True):
    """The state of the rover from now on, as it knows it.

    Attributes:
        mode, failsafe, battery: their states, or `unknown`.
        stuck: whether it is stuck.
        action: the action under way, or `none`.
        goal: the top-goal, its Tokens joined by plus signs, or `none`.
    """

    mode: str
    failsafe: str
    battery: str
    stuck: bool
    action: str
    goal: str


class RoverNumbers(msgspec.Struct, frozen=True):
    """Counts of the DEM on board, after a cycle.

    Attributes:
        signs, hypotheses: sizes of its lists.
        mean_cm: mean C_m of all hypotheses, 0 to 1.
        surprises: novel and unexpected Signs so far.
        failed_predictions: of all due so far.
    """

    signs: int
    hypotheses: int
    mean_cm: float
    surprises: int
    failed_predictions: int


class LinkState(msgspec.Struct, frozen=True):
    """Whether each direction of the link is open from now on.

    Attributes:
        up, down: `open`, or the reason of the outage, such as `blackout`.
    """

    up: str
    down: str


class LinkNumbers(msgspec.Struct, frozen=True):
    """What the link did of late, every five seconds at most, when a frame's fate is known.

    Attributes:
        up_delay_s, down_delay_s: of the last frame delivered, from being queued; 0 before one was.
        up_rate_bit_s, down_rate_bit_s: bits sent since the last message, by the time since then.
        up_queue_s, down_queue_s: how long the last frame sent had waited.
        up_lost_frames, down_lost_frames: frames not delivered so far, whatever became of them.
    """

    up_delay_s: float
    down_delay_s: float
    up_rate_bit_s: int
    down_rate_bit_s: int
    up_queue_s: float
    down_queue_s: float
    up_lost_frames: int
    down_lost_frames: int


class GroundState(msgspec.Struct, frozen=True):
    """The state of the rover from now on, as the ground believes it to be.

    Attributes:
        mode, failsafe: their states, or `unknown`.
        action: the action under way, or `none`.
        goal: the top-goal, its Tokens joined by plus signs, or `none`.
        link: `heard`; `silent`; `expected silence`, which the contact plan explains.
        stale: whether something newer was due of any of this.
        shadow: of the model on board: `in step`, `out of step`, or `none` where it is not kept.
    """

    mode: str
    failsafe: str
    action: str
    goal: str
    link: str
    stale: bool
    shadow: str


class GroundNumbers(msgspec.Struct, frozen=True):
    """What the ground last heard, and how sure it is of where the rover is, every five seconds.

    Attributes:
        battery: state of charge as last heard, 0 to 1.
        telemetry_age_s: age of the newest telemetry.
        commands_underway: commands sent and not known to be over.
        place_probability: of the most probable place that the rover is predicted to be at.
    """

    battery: float
    telemetry_age_s: float
    commands_underway: int
    place_probability: float
