"""What a log says of its run at a glance."""

import msgspec

from farside.logs.file.reading import LogFile
from farside.logs.result import GoalResult, Judgement, LinkResult, ModeResult, Outcome, RunResult
from farside.logs.views.run import RunView
from farside.node import Direction


class TopicSize(msgspec.Struct, frozen=True):
    """How many messages a topic has, and the length of all their payloads in bytes."""

    messages: int
    bytes: int


class Information(msgspec.Struct, frozen=True, kw_only=True):
    """What a log says of its run. Times are simulated seconds.

    Attributes:
        log: path of the log.
        bytes: its length.
        complete: whether its writer finished it, and its index is whole.
        damage: see `LogFile.damage`; inside a finished log it is found only as that is read.
        mission: name of the mission; `None` where the log does not say.
        seed: the seed of the run; likewise.
        versions: of Farside and what it rests on, by name.
        sim_seconds: simulated time reached.
        outcome: how the run ended; `None` where it did not, or the log does not say.
        expectations: likewise, empty then.
        modes: the rover's modes in order.
        goals: every goal in the order in which it was set.
        link: counters of the frames.
        digest: digest of the run; `None` without an outcome.
        topics: those with messages, by name, the largest first.
    """

    log: str
    bytes: int
    complete: bool
    damage: tuple[str, ...]
    mission: str | None
    seed: int | None
    versions: dict[str, str]
    sim_seconds: float
    outcome: Outcome | None
    expectations: tuple[Judgement, ...]
    modes: tuple[ModeResult, ...]
    goals: tuple[GoalResult, ...]
    link: LinkResult
    digest: str | None
    topics: dict[str, TopicSize]


def information(view: RunView) -> Information:
    """What a log says of its run: of a finished one from its index and result, without reading it.

    Any other is read once or twice.

    Raises:
        LogError: if the result in it is not of this version.
        ValueError: as ground.
    """
    log, result = view.file, view.result
    told = _told(view) if result is None else result
    topics = _topics(log)
    mission, seed, versions = origin(log)
    return Information(
        log=str(log.path),
        bytes=log.size_byte,
        complete=log.complete,
        damage=log.damage,
        mission=mission,
        seed=seed,
        versions=versions,
        sim_seconds=view.duration_s if result is None else result.sim_seconds,
        outcome=None if result is None else result.outcome,
        expectations=() if result is None else result.expectations,
        modes=told.modes,
        goals=told.goals,
        link=told.link,
        digest=None if result is None else result.digest,
        topics=topics,
    )


class _Told(msgspec.Struct, frozen=True):
    """What a log without a result tells of its run, as a result would."""

    modes: tuple[ModeResult, ...]
    goals: tuple[GoalResult, ...]
    link: LinkResult


def _told(view: RunView) -> "_Told | RunResult":
    return _Told(
        modes=tuple(ModeResult(mode.t_s, mode.mode, mode.why) for mode in view.modes),
        goals=tuple(
            GoalResult(goal.tokens, goal.source, goal.set_s, goal.reached_s) for goal in view.goals
        ),
        link=LinkResult(view.link_counters(Direction.UP), view.link_counters(Direction.DOWN)),
    )


def _topics(log: LogFile) -> dict[str, TopicSize]:
    sizes = {name: TopicSize(*size) for name, size in log.sizes().items()}
    return dict(sorted(sizes.items(), key=lambda entry: (-entry[1].bytes, entry[0])))


def origin(log: LogFile) -> tuple[str | None, int | None, dict[str, str]]:
    """Mission, seed and versions of a run, as far as its log says."""
    said = dict(log.metadata.get("farside.run", {}))
    mission, seed = said.pop("mission", None), said.pop("seed", "")
    return mission, int(seed) if seed.isdecimal() else None, said
