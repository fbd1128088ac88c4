"""What came of a run: the object that `farside run --json` prints and the log keeps."""

from enum import StrEnum

import msgspec

from farside.logs.views import LinkCounters
from farside.messages import Mode, ModeCause, Tokens
from farside.topics import GoalSource


class Outcome(StrEnum):
    """Success: it ran to its end and met all expectations. Aborted: it did not run to its end."""

    SUCCESS = "success"
    FAILURE = "failure"
    ABORTED = "aborted"


class Judgement(msgspec.Struct, frozen=True):
    """One expectation, whether it was met, and what was found."""

    name: str
    met: bool
    detail: str


class ModeResult(msgspec.Struct, frozen=True):
    """The rover was in `mode` from `t_s` on; `why` says what brought it there."""

    t_s: float
    mode: Mode
    why: ModeCause


class GoalResult(msgspec.Struct, frozen=True):
    """A goal: whose, and when it was set and reached (`None`: never)."""

    tokens: Tokens
    source: GoalSource
    set_s: float
    reached_s: float | None


class LinkResult(msgspec.Struct, frozen=True):
    """The frames of both directions."""

    uplink: LinkCounters
    downlink: LinkCounters


class DemResult(msgspec.Struct, frozen=True):
    """The DEM's lists at the end: how many Signs and hypotheses, and their mean C_m."""

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
    when the script is over. See `farside.topics.OperatorEntry`.
    """

    step: int
    of: int
    waiting_for: str | None
    since_s: float


class LostProcess(msgspec.Struct, frozen=True):
    """A process that ended before the run did: which, how, and from when the run missed it."""

    role: str
    how: str
    since_s: float


class RunResult(msgspec.Struct, frozen=True, kw_only=True):
    """The result of one run. Times are in seconds; `speedup` is simulated over wall time."""

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
    dem: DemResult
    rover: RoverResult
    operator: OperatorResult | None
    lost_processes: tuple[LostProcess, ...] = ()
