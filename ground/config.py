"""The `[ground]` table of a mission file. Defaults are project defaults."""

from enum import StrEnum
from typing import Annotated

from msgspec import Meta, MsgspecError, field
from msgspec.structs import asdict

from farside.control import Mode
from farside.settings import (
    ActionName,
    Count,
    Fraction,
    NonNegative,
    Options,
    PlaceName,
    Positive,
    Section,
)
from farside.topics import GROUND_OPERATOR, GROUND_ORDER

QUEUED = "queued"
"""The operator that takes orders from outside."""


class OverrideAt(Section, frozen=True):
    """Answer one proposal with an action of the operator's own instead of approval.

    Attributes:
        proposal: which one, counted from 1 since the goal was sent.
        action: the action to perform instead: `N`, `E`, `S` or `W`.
    """

    proposal: Count
    action: ActionName


class Tour(Section, frozen=True, tag="tour", tag_field="do"):
    """Drive the rover by commands from place to place, one move at a time.

    Attributes:
        places: where to, in this order.
    """

    places: tuple[PlaceName, ...]


class SwitchMode(Section, frozen=True, tag="mode", tag_field="do"):
    """Change the mode and wait until telemetry confirms it.

    Attributes:
        mode: the mode to change to.
    """

    mode: Mode


class Pursue(Section, frozen=True, tag="goal", tag_field="do"):
    """Send a goal; answer proposals until it is known to be reached.

    They are approved, except for `overrides`. What would be carried out without a veto needs no
    approval.

    Attributes:
        place: the goal.
        priority: its priority; the rover pursues the goal with the highest.
        overrides: the proposals to answer with another action.
    """

    place: PlaceName
    priority: Positive = 2.0
    overrides: tuple[OverrideAt, ...] = ()


class AwaitReached(Section, frozen=True, tag="await", tag_field="do"):
    """Wait until a goal that someone else set is known to be reached.

    Attributes:
        place: that goal.
        already: whether it counts, too, if that was known before this step began.
    """

    place: PlaceName
    already: bool = False


class WaitUntil(Section, frozen=True, tag="wait", tag_field="do"):
    """Wait until a time.

    Attributes:
        until_s: that simulated time.
    """

    until_s: NonNegative


class WantedPlace(Section, frozen=True):
    """A goal of the operator's.

    Attributes:
        place: the goal, a place that the rover can reach.
        priority: its priority; the rover pursues the goal with the highest.
    """

    place: PlaceName
    priority: Positive = 2.0


class Leave(Section, frozen=True, tag="leave", tag_field="do"):
    """Leave the rover alone with goals: autonomous mode, all goals at once, and not a word more.

    The step is over when telemetry confirms the mode and the goals are known to have been taken.

    Attributes:
        goals: the goals.
    """

    goals: tuple[WantedPlace, ...]


class GuideConfig(Section, frozen=True):
    """A tour that teaches all that can be reached.

    The operator drives until every move from a place to the next one was made, in each direction,
    except into terrain shadow, where no order arrives. A move that is blocked is put off, and
    given up when it was blocked three times. With a low battery it drives to the dock first.

    Attributes:
        times: how often each move is to be made.
        ahead: how many moves are sent at a time; each is begun only if the one before was done.
    """

    times: Annotated[int, Meta(ge=1, le=1000)] = 1
    ahead: Annotated[int, Meta(ge=1, le=100)] = 8


class Teach(GuideConfig, frozen=True, tag="teach", tag_field="do"):
    """Drive a tour that teaches the rover all that can be reached: see `[ground.guide]`."""


class Supervision(StrEnum):
    """How a supervisor has the rover act: with its consent to each action, or alone."""

    SHARED = "shared"
    AUTONOMOUS = "autonomous"


class SupervisorConfig(Section, frozen=True):
    """Goals and rules, and no driving.

    The goals are sent one at a time, the highest priority first. In shared mode each proposal is
    approved if it meets all `[[ground.rules]]`, and vetoed otherwise. In autonomous mode a goal is
    sent only if the way to it meets them. A goal is taken back when a proposal for it was vetoed,
    when nothing is proposed, or when it takes too long. What was not reached is tried once more in
    the end.

    Attributes:
        goals: the goals.
        mode: `shared` or `autonomous`.
        patience_s: in shared mode a goal is taken back when nothing was proposed for this long,
            while the rover was heard and stood still; in autonomous mode when it was not reached
            after this long, and three times the cost of the way to it on top.
    """

    goals: tuple[WantedPlace, ...] = ()
    mode: Supervision = Supervision.SHARED
    patience_s: Positive = 60.0


class Supervise(SupervisorConfig, frozen=True, tag="supervise", tag_field="do"):
    """Send goals and answer proposals by the rules: see `[ground.supervisor]`."""


ScriptStep = Tour | Teach | SwitchMode | Pursue | Leave | Supervise | AwaitReached | WaitUntil


class CostRule(Section, frozen=True, tag="cost", tag_field="rule"):
    """What the path is expected to cost from its beginning to the goal.

    Attributes:
        below: it must be less, in the unit of action costs.
    """

    below: Positive


class ProbabilityRule(Section, frozen=True, tag="probability", tag_field="rule"):
    """The probability that the path goes as planned: the product of the C_m of its steps.

    That is the model's own caution: a way that was gone once or twice has little of it.

    Attributes:
        above: it must be greater, 0 to 1. Where none is known, the rule is broken.
    """

    above: Fraction


class ChanceRule(Section, frozen=True, tag="chance", tag_field="rule"):
    """The probability that the path goes as planned, by how often such moves came true.

    Attributes:
        above: it must be greater, 0 to 1. Where none is known, the rule is broken.
    """

    above: Fraction


class AvoidsRule(Section, frozen=True, tag="avoids", tag_field="rule"):
    """Where the path must not lead.

    Attributes:
        places: these places.
    """

    places: tuple[PlaceName, ...]


class AgeRule(Section, frozen=True, tag="age", tag_field="rule"):
    """How old what the path was computed from may be.

    Attributes:
        below_s: it must be younger.
    """

    below_s: Positive


class ConflictRule(Section, frozen=True, tag="conflict", tag_field="rule"):
    """Nothing that was learned or sent since the path was computed stands against it."""


Rule = CostRule | ProbabilityRule | ChanceRule | AvoidsRule | AgeRule | ConflictRule
"""What a path must meet for an automatic reviewer to agree to it."""


class RecordedLine(Section, frozen=True):
    """A message of a log.

    Attributes:
        time_ns: simulated time, in nanoseconds.
        json: the message as it stands in the log.
    """

    time_ns: Annotated[int, Meta(ge=0)]
    json: str


class RecordedConfig(Section, frozen=True):
    """The orders of another run.

    With the mission and the seed of that run, it is the same run again.

    Attributes:
        log: its log, relative to the mission file. When the mission is loaded the orders are read
            from there into `orders` and `progress`.
        orders: the orders, messages of `/ground/order`, in place of `log`.
        progress: how far that operator had come, messages of `/ground/operator`.
    """

    log: str | None = None
    orders: tuple[RecordedLine, ...] | None = None
    progress: tuple[RecordedLine, ...] = ()

    def __post_init__(self) -> None:
        for topic, lines in ((GROUND_ORDER, self.orders or ()), (GROUND_OPERATOR, self.progress)):
            before_ns = 0
            for number, line in enumerate(lines):
                where = f"{topic.name} in line {number}"
                if line.time_ns < before_ns:
                    raise ValueError(f"expected {where} not before {before_ns} ns")
                before_ns = line.time_ns
                try:
                    topic.decode(line.json.encode())
                except (MsgspecError, ValueError, RecursionError) as error:
                    raise ValueError(f"expected a message of {where}, found: {error}") from error


class GroundConfig(Section, frozen=True):
    """The ground station: its operator, and what it sends by itself.

    Attributes:
        operator: who decides at the ground: `scripted`; `guide`, a tour that teaches; `supervisor`,
            goals and rules; `absent`, nobody; `queued`, orders from outside; `recorded`, the orders
            of a log; the name of an installed operator; or `module:Class` of one's own, see
            `docs/extend.md`.
        operator_options: what an operator that is not built in is made with.
        script: the steps of the scripted operator, in order.
        guide: the tour of the operator `guide`.
        supervisor: goals of the operator `supervisor`.
        recorded: the orders of the operator `recorded`.
        rules: what a path must meet, all of them, for the operator to agree to it: where the
            supervisor answers proposals, or the step `goal` of a script does.
        heartbeat_s: interval between heartbeats on the uplink.
        silent_after_s: the rover counts as silent when no frame has arrived for this long beyond a
            round trip; no drive command is sent then.
        command_lifetime_s: a command expires this long, plus a round trip, after it was given.
            After one that expired the next ones may take four times as long, up to sixteen times,
            until one is done.
    """

    operator: str = "scripted"
    operator_options: Options = field(default_factory=dict)
    script: tuple[ScriptStep, ...] = ()
    guide: GuideConfig = GuideConfig()
    supervisor: SupervisorConfig = SupervisorConfig()
    recorded: RecordedConfig = RecordedConfig()
    rules: tuple[Rule, ...] = ()
    heartbeat_s: Positive = 2.0
    silent_after_s: Positive = 6.0
    command_lifetime_s: Positive = 20.0

    @property
    def steps(self) -> tuple[ScriptStep, ...] | None:
        """The steps that the operator goes through; `None` where the mission does not say."""
        match self.operator:
            case "scripted":
                return self.script
            case "guide":
                return (Teach(**asdict(self.guide)),)
            case "supervisor":
                return (Supervise(**asdict(self.supervisor)),)
            case "absent":
                return ()
            case _:
                return None
