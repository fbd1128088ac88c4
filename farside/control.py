"""The words of shared control, in messages, in the log and on screens: who drives, and why."""

from enum import StrEnum


class Mode(StrEnum):
    """Who drives: the operator, the DEM with the operator's consent, or the DEM alone."""

    GUIDED = "guided"
    SHARED = "shared"
    AUTONOMOUS = "autonomous"


class ModeCause(StrEnum):
    """What brought the rover into a mode.

    The start of the run, the operator's order, a drive by which the operator took over, or the
    rover itself since the link was lost.
    """

    START = "start"
    OPERATOR = "operator"
    TAKEN_OVER = "taken over by a drive"
    LINK_LOST = "link lost"


class Failsafe(StrEnum):
    """The failsafe's state, told beside the mode; see `farside.rover.failsafe.table`.

    Nominal; hold: the rover ends its move and begins nothing of its own; alone: the link is lost,
    and the rover pursues the goals that it has; safe: it stands, since something is wrong with it.
    """

    NOMINAL = "nominal"
    HOLD = "hold"
    ALONE = "alone"
    SAFE = "safe"


class Cause(StrEnum):
    """What the failsafe looks at: each is so or not so at any moment.

    Attributes:
        EXPECTED_SILENCE: nothing is heard, and the contact plan explains it.
        SILENCE: nothing was heard for `hold_after_s`, though the plan has the uplink open.
        LOST: the countdown of such silence is used up.
        UNCONFIRMED: the rover took over when the link was lost, and the operator has not yet said
            who drives.
        FORBIDDEN: the mission or the operator forbids autonomy on loss.
        EXHAUSTED: there is no goal, neither the operator's nor the mission's nor the rover's own.
        RESERVE: the charge just suffices to reach the dock.
        NO_SIGNAL: terrain hides the other end of the link.
        STUCK: the rover cannot move any more.
        TILT: the rover tilts more than it may.
        SENSOR_DEAD: the rover does not know where it is.
    """

    EXPECTED_SILENCE = "expected silence"
    SILENCE = "silence"
    LOST = "link lost"
    UNCONFIRMED = "not confirmed"
    FORBIDDEN = "autonomy forbidden"
    EXHAUSTED = "no goal left"
    RESERVE = "battery reserve"
    NO_SIGNAL = "no signal"
    STUCK = "stuck"
    TILT = "tilt"
    SENSOR_DEAD = "position sensor dead"


class OnLoss(StrEnum):
    """What the rover does when the link is lost: act alone if it has a goal, or hold."""

    AUTONOMY = "autonomy"
    HOLD = "hold"


class Signal(StrEnum):
    """The strength of the radio's signal: in the open, beside terrain shadow, in it."""

    STRONG = "strong"
    WEAK = "weak"
    NONE = "none"


class CommandStage(StrEnum):
    """A stage in a command's life on board. The last six end it.

    Taken: received. Waiting: for the rover to stand still. Begun: its action is under way. Done:
    the work is done. Failed: its action was blocked. Refused: with a reason. Expired: too late to
    begin. Withdrawn: taken back by the operator. Superseded: by a later order, or by the loss of
    the link.
    """

    TAKEN = "taken"
    WAITING = "waiting"
    BEGUN = "begun"
    DONE = "done"
    FAILED = "failed"
    REFUSED = "refused"
    EXPIRED = "expired"
    WITHDRAWN = "withdrawn"
    SUPERSEDED = "superseded"

    @property
    def is_last(self) -> bool:
        """Whether the command is over."""
        return self not in {CommandStage.TAKEN, CommandStage.WAITING, CommandStage.BEGUN}


class BatteryState(StrEnum):
    """What the battery does: enough charge; wants charging; charges at the dock; no charge left.

    With a flat battery the rover does not move.
    """

    NOMINAL = "nominal"
    LOW = "low"
    CHARGING = "charging"
    FLAT = "flat"


class Chooser(StrEnum):
    """Who chose an action: the operator, the policy map, exploration, or the failsafe.

    The failsafe's is the way back along the rover's own track, to where the link works.
    """

    GUIDED = "guided"
    GOAL_DIRECTED = "goal-directed"
    EXPLORATORY = "exploratory"
    RETURNING = "returning"


class Verdict(StrEnum):
    """What the ground can say of a stage that is due on board.

    Attributes:
        ON_TIME: it is known to have come when it was due, or before.
        LATE: it is known to have come after it was due.
        OVERDUE: word of it was due, and has not come.
        UNKNOWN: nothing can have been heard yet, whether it came or not.
    """

    ON_TIME = "on time"
    LATE = "late"
    OVERDUE = "overdue"
    UNKNOWN = "unknown"


class TakeBackChance(StrEnum):
    """Whether a command can still be taken back.

    Attributes:
        HERE: it has not left the ground.
        SURE: a withdrawal given now comes before it begins, if it arrives when it is due.
        OPEN: it may come too late: nothing can be promised.
        TOO_LATE: the command is known to have begun, or to be over.
    """

    HERE = "not sent yet"
    SURE = "can be taken back"
    OPEN = "maybe too late"
    TOO_LATE = "too late"
