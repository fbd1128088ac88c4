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
    lost_processes: tuple[LostProcess, ...] = ()
