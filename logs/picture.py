"""The state of a run as one looks on: fed entry by entry, shown by `screen`."""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import msgspec

from farside.logs.reading import LogEntry, LogFile, decoded
from farside.logs.story import TOLD, StoryLine, tell
from farside.messages import Failsafe, Mode, Proposal, Telemetry, Tokens
from farside.node import Direction, Topic
from farside.places import Chart
from farside.topics import (
    GROUND_SILENCE,
    GROUND_TELEMETRY,
    LINK_FRAME,
    LINK_OUTAGE,
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_CYCLE,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_PROPOSAL,
    TRUTH_POSE,
    TRUTH_YARD,
    ActionEnded,
    ActionStarted,
    Cycle,
    FailsafeEntry,
    Fate,
    FrameFate,
    GoalChange,
    GoalEntry,
    LinkOutage,
    ModeEntry,
    Pose,
    Silence,
    Yard,
)

_LINES_KEPT = 100


@dataclass
class LinkPicture:
    """One direction of the link: whether it is down now, and how many frames fared how so far."""

    down: bool = False
    delivered: int = 0
    lost: int = 0


@dataclass
class Picture:
    """What an onlooker who sees everything knows of a run; `None` where nothing is known yet.

    Attributes:
        chart: the yard.
        pose: where the rover really is.
        visited: the Tokens of the places where it has been.
        mode, failsafe: as the rover has them.
        action: what the rover is doing, `None` when it is standing.
        goals: the Goal List: each Sign with its priority, top-goal first.
        cycle: the DEM's last cycle.
        proposal: the DEM's last proposal, as long as its goal stands.
        telemetry: the last that the ground heard.
        silent: whether the ground takes the rover to be silent.
        link: both directions.
        lines: the last events, the newest at the end.
    """

    chart: Chart | None = None
    pose: Pose | None = None
    visited: set[str] = field(default_factory=set)
    mode: Mode | None = None
    failsafe: Failsafe | None = None
    action: ActionStarted | None = None
    goals: dict[Tokens, float] = field(default_factory=dict)
    cycle: Cycle | None = None
    proposal: Proposal | None = None
    telemetry: Telemetry | None = None
    silent: bool = False
    link: dict[Direction, LinkPicture] = field(
        default_factory=lambda: {direction: LinkPicture() for direction in Direction}
    )
    lines: deque[StoryLine] = field(default_factory=lambda: deque(maxlen=_LINES_KEPT))

    def apply(self, logged: LogEntry) -> StoryLine | None:
        """Take in the next entry of the log; gives its line in the story, if it has one."""
        line = None if self._is_old_news(logged.entry) else tell(logged.log_time_ns, logged.entry)
        if line is not None:
            self.lines.append(line)
        if (change := _CHANGE_OF.get(logged.topic)) is not None:
            change(self, logged.entry)
        return line

    def _is_old_news(self, entry: msgspec.Struct) -> bool:
        """A goal whose priority alone changes is set again, and the battery's does all the time."""
        return (
            isinstance(entry, GoalEntry)
            and entry.change is GoalChange.SET
            and entry.tokens in self.goals
        )


# --- what each entry changes; all others change nothing ---------------------------------------


def _yard(picture: Picture, entry: Yard) -> None:
    picture.chart = Chart(entry.rows, entry.cell_m)


def _pose(picture: Picture, entry: Pose) -> None:
    picture.pose = entry
    picture.visited.add(entry.place)


def _mode_entry(picture: Picture, entry: ModeEntry) -> None:
    picture.mode = entry.mode


def _failsafe_entry(picture: Picture, entry: FailsafeEntry) -> None:
    picture.failsafe = entry.state


def _action_started(picture: Picture, entry: ActionStarted) -> None:
    picture.action = entry


def _action_ended(picture: Picture, _entry: ActionEnded) -> None:
    picture.action = None


def _goal_entry(picture: Picture, entry: GoalEntry) -> None:
    if entry.change is GoalChange.SET:
        goals = {**picture.goals, entry.tokens: entry.priority}
        picture.goals = dict(sorted(goals.items(), key=lambda goal: -goal[1]))
        return
    picture.goals.pop(entry.tokens, None)
    if picture.proposal is not None and picture.proposal.goal == entry.tokens:
        picture.proposal = None


def _cycle(picture: Picture, entry: Cycle) -> None:
    picture.cycle = entry


def _proposal(picture: Picture, entry: Proposal) -> None:
    picture.proposal = entry


def _telemetry(picture: Picture, entry: Telemetry) -> None:
    if picture.telemetry is None or entry.time_ns >= picture.telemetry.time_ns:
        picture.telemetry = entry


def _silence(picture: Picture, entry: Silence) -> None:
    picture.silent = entry.silent


def _frame_fate(picture: Picture, entry: FrameFate) -> None:
    side = picture.link[entry.direction]
    if entry.copy:
        return
    if entry.fate is Fate.DELIVERED:
        side.delivered += 1
    else:
        side.lost += 1


def _link_outage(picture: Picture, entry: LinkOutage) -> None:
    picture.link[entry.direction].down = entry.down


_CHANGES: dict[Topic[Any], Callable[[Picture, Any], None]] = {
    TRUTH_YARD: _yard,
    TRUTH_POSE: _pose,
    ROVER_MODE: _mode_entry,
    ROVER_FAILSAFE: _failsafe_entry,
    ROVER_ACTION_STARTED: _action_started,
    ROVER_ACTION_ENDED: _action_ended,
    ROVER_GOAL: _goal_entry,
    ROVER_CYCLE: _cycle,
    ROVER_PROPOSAL: _proposal,
    GROUND_TELEMETRY: _telemetry,
    GROUND_SILENCE: _silence,
    LINK_FRAME: _frame_fate,
    LINK_OUTAGE: _link_outage,
}
_CHANGE_OF = {topic.name: change for topic, change in _CHANGES.items()}

SHOWN: tuple[Topic[Any], ...] = (*_CHANGES, *(topic for topic in TOLD if topic not in _CHANGES))
"""The topics that a picture is made of."""

# Of these only the last entry matters, and there are many.
_OVERWRITTEN = (ROVER_CYCLE, GROUND_TELEMETRY)


def picture_at(log: LogFile, time_ns: int) -> Picture:
    """The picture of a run at a time, without a look at all that was logged before.

    Raises:
        LogError: if the log is damaged before that.
    """
    picture = Picture()
    for record in log.records([t for t in SHOWN if t not in _OVERWRITTEN], end_ns=time_ns):
        picture.apply(decoded(record))
    for topic in _OVERWRITTEN:
        if (latest := log.latest(topic, time_ns)) is not None:
            picture.apply(decoded(latest))
    return picture
