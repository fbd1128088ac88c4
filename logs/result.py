"""The result of a run: the object that `farside run --json` prints and the log keeps."""

from enum import StrEnum

import msgspec

from farside.control import Mode, ModeCause
from farside.logs.spans import LinkCounters
from farside.messages import Tokens
from farside.topics import GoalSource


class Outcome(StrEnum):
    """Outcome of a run.

    `SUCCESS`: it reached its end and met all expectations. `FAILURE`: it reached its end and missed
    one. `ABORTED`: it did not reach its end, or lost a process.
    """

    SUCCESS = "success"
    FAILURE = "failure"
    ABORTED = "aborted"


class Judgement(msgspec.Struct, frozen=True):
    """Whether the expectation called `name` was met; `detail` is what was found."""

    name: str
    met: bool
    detail: str


class ModeResult(msgspec.Struct, frozen=True):
    """The rover was in `mode` from `t_s` on; `why` is the cause of the change."""

    t_s: float
    mode: Mode
    why: ModeCause


class GoalResult(msgspec.Struct, frozen=True):
    """A goal, who set it, and when it was set and reached; `None` if never reached."""

    tokens: Tokens
    source: GoalSource
    set_s: float
    reached_s: float | None


class LinkResult(msgspec.Struct, frozen=True):
    """The counters of both directions."""

    uplink: LinkCounters
    downlink: LinkCounters


class StoreResult(msgspec.Struct, frozen=True):
    """The telemetry that the rover stored while the link was out.

    Attributes:
        kept: how many messages were stored.
        arrived: how many are known to have arrived at the ground.
        given_up: how many were dropped since the store was full.
        waiting: how many were still to arrive at the end of the run.
    """

    kept: int
    arrived: int
    given_up: int
    waiting: int


class ShadowResult(msgspec.Struct, frozen=True):
    """The price of the shadow of the model at the ground: see `farside.logs.spans.ShadowPrice`.

    Attributes:
        updates: how many updates were made on board.
        wholes: how many of them were all lists.
        cycles: how many cycles of the model they cover.
        downlink_bytes: of the frames that carried them, repeated ones included.
        downlink_share: their share of all bytes that the rover sent, 0 to 1.
        report_bytes: of the reports of them on the uplink.
        bits_per_cycle: of both together; `None` without a cycle.
        in_step: whether the ground's lists were, at the end, those after its newest update.
    """

    updates: int
    wholes: int
    cycles: int
    downlink_bytes: int
    downlink_share: float
    report_bytes: int
    bits_per_cycle: float | None
    in_step: bool


class DemResult(msgspec.Struct, frozen=True):
    """The DEM's lists at the end: number of Signs and hypotheses, and mean C_m."""

    signs: int
    hypotheses: int
    mean_cm: float


class RoverResult(msgspec.Struct, frozen=True):
    """The rover's condition. Times are in seconds, `None` for never.

    Attributes:
        least_charge: the least true state of charge, 0 to 1; `None` if it was never measured.
        least_charge_s: when the battery first had it.
        flat_since_s: since when the battery has been flat, if it is at the end.
        stuck_since_s: since when the rover has been stuck, if it is at the end.
    """

    least_charge: float | None
    least_charge_s: float | None
    flat_since_s: float | None
    stuck_since_s: float | None


class OperatorResult(msgspec.Struct, frozen=True):
    """Where the operator got to: at `step` of `of`, waiting since `since_s`.

    A run without a script has none of this. `waiting_for` says for what, in words, and is `None`
    when the script is over; `left` what was given up. See `farside.topics.OperatorEntry`.
    """

    step: int
    of: int
    waiting_for: str | None
    since_s: float
    left: tuple[str, ...] = ()


class LostProcessResult(msgspec.Struct, frozen=True):
    """A `LostProcess`: its role, how it ended, and the start of the first window without it."""

    role: str
    how: str
    since_s: float


class RunResult(msgspec.Struct, frozen=True, kw_only=True):
    """The result of one run.

    Attributes:
        mission: name of the mission.
        seed: the seed of the run.
        outcome: success, failure or aborted.
        expectations: judgements in the order of the mission; empty if the run ended early.
        log: path of the log.
        digest: see `farside.logs.Digest`.
        sim_seconds: simulated time reached.
        wall_seconds: wall time taken.
        speedup: their ratio.
        goals: every goal in the order in which it was set.
        modes: the rover's modes in order.
        link: counters of the frames.
        dem: the DEM's lists at the end.
        shadow: what the shadow of them took of the link; `None` without one.
        lost_processes: processes that ended before the run, in order of loss.
    """

    mission: str
    seed: int
    outcome: Outcome
    expectations: tuple[Judgement, ...]
    log: str
    digest: str
    sim_seconds: float
    wall_seconds: float
    speedup: float
    goals: tuple[GoalResult, ...]
    modes: tuple[ModeResult, ...]
    link: LinkResult
    store: StoreResult
    dem: DemResult
    rover: RoverResult
    operator: OperatorResult | None
    shadow: ShadowResult | None = None
    lost_processes: tuple[LostProcessResult, ...] = ()
