"""The state of a run at a moment, built from its log entries and drawn by `screen`."""

from collections import deque
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any, Self

import msgspec

from farside.control import Failsafe, Mode
from farside.frames import Fate, FrameFate, LinkOutage
from farside.logs.events import EVENT_TOPICS, EventLine, event_line
from farside.logs.file.reading import LogEntry
from farside.logs.known import COMMAND_TOPICS, KnownCommands
from farside.messages import Proposal, Telemetry, Tokens
from farside.node import NS_PER_S, Direction, Topic
from farside.places import Chart, is_place_token
from farside.topics import (
    GROUND_BELIEF,
    GROUND_CHART,
    GROUND_OPERATOR,
    GROUND_PREDICTION,
    GROUND_PROPOSAL,
    GROUND_SHADOW,
    GROUND_SILENCE,
    GROUND_STORED_TELEMETRY,
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
    ROVER_PROPOSAL_ENDED,
    TRUTH_POSE,
    TRUTH_YARD,
    ActionEnded,
    ActionStarted,
    BeliefEntry,
    Cycle,
    FailsafeEntry,
    GoalChange,
    GoalEntry,
    LifeEntry,
    ModeEntry,
    OperatorEntry,
    Pose,
    Prediction,
    ProposalEnded,
    ShadowEntry,
    Silence,
    Yard,
)

RECENT_NS = 600 * NS_PER_S
"""How far a picture looks back for the track, the events and the frames: ten minutes.

So a picture of any moment of a long run is made without reading all that came before (project
default).
"""

_LINES_KEPT = 100


@dataclass
class LinkPicture:
    """One direction of the link: whether it is down, and the frames of late by fate.

    Duplicates do not count.

    Attributes:
        down: whether an outage is on.
        delivered: frames that arrived.
        lost: frames with any other fate, lost to an outage or a full queue included.
    """

    down: bool = False
    delivered: int = 0
    lost: int = 0

    def count(self, frames: int, *, arrived: bool) -> None:
        """Add `frames` to those that arrived, or to the others."""
        if arrived:
            self.delivered += frames
        else:
            self.lost += frames


def recent_since_ns(now_ns: int) -> int:
    """From when on things are recent at `now_ns`: a whole second of simulated time."""
    return max(0, now_ns - RECENT_NS) // NS_PER_S * NS_PER_S


@dataclass
class Picture:
    """The whole state of a run, on both sides of the link; `None` where nothing is logged yet.

    Of what adds up, it holds what came in the `RECENT_NS` before, once `settle` has been called.
    As ground, all of it is what the ground knew, and what it did not know is `None` or empty.

    Attributes:
        now_ns: log time of the last entry, or the moment for which it was settled.
        as_ground: whether it is the run as the ground had it.
        chart: the yard; as ground, the ground's map of it.
        pose: the true pose of the rover.
        visited: Tokens of the places where it has been of late, or was heard to be, and when last.
        mode, failsafe: of the rover; as ground, as believed.
        action: the action in progress, `None` while the rover stands; of what the ground takes it
            to do `belief` tells.
        goals: the Goal List: each Sign with its priority, top-goal first; the ground does not know
            priorities.
        cycle: the DEM's last cycle.
        proposal: the DEM's proposal that stands, until it ends or its goal leaves the Goal List; as
            ground, until telemetry says that it does not stand any more.
        telemetry: the latest that the ground has received, by the time it was measured.
        silent: whether the rover counts as silent at the ground.
        commands: those on their way and the last that ended, as the ground knows them.
        belief: what the ground believes of the rover, as it was noted last.
        prediction: where the ground predicts the rover to be by now.
        shadow: the shadow of the model on board.
        operator: how far the operator is.
        link: the two directions; empty as ground.
        lines: the last 100 events of late, newest last.
        frames: how many of late by direction and whether they arrived, in each second.
    """

    as_ground: bool = False
    now_ns: int = 0
    chart: Chart | None = None
    pose: Pose | None = None
    visited: dict[str, int] = field(default_factory=dict)
    mode: Mode | None = None
    failsafe: Failsafe | None = None
    action: ActionStarted | None = None
    goals: dict[Tokens, float | None] = field(default_factory=dict)
    cycle: Cycle | None = None
    proposal: Proposal | None = None
    telemetry: Telemetry | None = None
    silent: bool = False
    commands: KnownCommands = field(default_factory=KnownCommands)
    belief: BeliefEntry | None = None
    prediction: Prediction | None = None
    shadow: ShadowEntry | None = None
    operator: OperatorEntry | None = None
    link: dict[Direction, LinkPicture] = field(
        default_factory=lambda: {direction: LinkPicture() for direction in Direction}
    )
    lines: deque[EventLine] = field(default_factory=lambda: deque(maxlen=_LINES_KEPT))
    frames: dict[int, dict[tuple[Direction, bool], int]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.as_ground:
            self.link.clear()

    def apply(self, entry: LogEntry) -> EventLine | None:
        """Update the state with the next entry of the log; returns its event line, if any."""
        self.now_ns = entry.log_time_ns
        if isinstance(entry.message, LifeEntry):
            self.commands.forget(recent_since_ns(self.now_ns))
        line = event_line(entry) if self._is_news(entry.message) else None
        if line is not None:
            self.lines.append(line)
        updates = _GROUND_UPDATE_OF if self.as_ground else _UPDATE_OF
        if (update := updates.get(entry.topic)) is not None:
            update(self, entry.message)
        self.commands.apply(entry.message, entry.log_time_ns)
        return line

    def settle(self, now_ns: int) -> None:
        """Let time pass up to `now_ns` without an entry, and forget what is not recent then."""
        self.now_ns = now_ns
        since_ns = recent_since_ns(now_ns)
        while self.lines and self.lines[0].t_ns < since_ns:
            self.lines.popleft()
        for place, there_ns in list(self.visited.items()):
            if there_ns < since_ns:
                del self.visited[place]
        for second in [second for second in self.frames if second * NS_PER_S < since_ns]:
            for (direction, arrived), count in self.frames.pop(second).items():
                self.link[direction].count(-count, arrived=arrived)
        self.commands.forget(since_ns)

    def copy(self) -> Self:
        """The same picture, which changes by itself."""
        return replace(
            self,
            visited=dict(self.visited),
            goals=dict(self.goals),
            commands=self.commands.copy(),
            link={direction: copy(side) for direction, side in self.link.items()},
            lines=self.lines.copy(),
            frames={second: dict(counts) for second, counts in self.frames.items()},
        )

    def _is_news(self, message: msgspec.Struct) -> bool:
        """Whether a message says more than what was so before."""
        match message:
            case GoalEntry(tokens=tokens, change=GoalChange.SET):
                # A goal on the list is set again: the battery's is, whenever its charge falls.
                return tokens not in self.goals
            case LifeEntry():
                return self.commands.says_news(message)
            case ShadowEntry(in_step=in_step):
                return in_step != (self.shadow is None or self.shadow.in_step)
            case OperatorEntry(left=(*_, last)):
                return self.operator is None or last not in self.operator.left
            case _:
                return True


# --- how a message of each topic updates the picture ------------------------------------------


def _yard(picture: Picture, message: Yard) -> None:
    picture.chart = Chart(message.rows, message.cell_m)


def _pose(picture: Picture, message: Pose) -> None:
    picture.pose = message
    picture.visited[message.place] = picture.now_ns


def _mode_entry(picture: Picture, message: ModeEntry) -> None:
    picture.mode = message.mode


def _failsafe_entry(picture: Picture, message: FailsafeEntry) -> None:
    picture.failsafe = message.state


def _action_started(picture: Picture, message: ActionStarted) -> None:
    picture.action = message


def _action_ended(picture: Picture, _message: ActionEnded) -> None:
    picture.action = None


def _goal_entry(picture: Picture, message: GoalEntry) -> None:
    if message.change is GoalChange.SET:
        goals = {**picture.goals, message.tokens: message.priority}
        picture.goals = dict(sorted(goals.items(), key=lambda goal: -(goal[1] or 0)))
        return
    if message.change in {GoalChange.SUSPENDED, GoalChange.RECOVERED}:
        return
    picture.goals.pop(message.tokens, None)
    if picture.proposal is not None and picture.proposal.goal == message.tokens:
        picture.proposal = None


def _cycle(picture: Picture, message: Cycle) -> None:
    picture.cycle = message


def _proposal(picture: Picture, message: Proposal) -> None:
    picture.proposal = message


def _proposal_ended(picture: Picture, message: ProposalEnded) -> None:
    if picture.proposal is not None and picture.proposal.number == message.number:
        picture.proposal = None


def _telemetry(picture: Picture, message: Telemetry) -> None:
    if picture.telemetry is None or message.time_ns >= picture.telemetry.time_ns:
        picture.telemetry = message


def _silence(picture: Picture, message: Silence) -> None:
    picture.silent = message.silent


def _belief(picture: Picture, message: BeliefEntry) -> None:
    picture.belief = message


def _prediction(picture: Picture, message: Prediction) -> None:
    picture.prediction = message


def _shadow(picture: Picture, message: ShadowEntry) -> None:
    picture.shadow = message


def _operator(picture: Picture, message: OperatorEntry) -> None:
    picture.operator = message


def _frame_fate(picture: Picture, message: FrameFate) -> None:
    if message.copy:
        return
    arrived = message.fate is Fate.DELIVERED
    picture.link[message.direction].count(1, arrived=arrived)
    counts = picture.frames.setdefault(picture.now_ns // NS_PER_S, {})
    key = message.direction, arrived
    counts[key] = counts.get(key, 0) + 1


def _link_outage(picture: Picture, message: LinkOutage) -> None:
    picture.link[message.direction].down = message.down


# --- as ground ---------------------------------------------------------------------------------


def _heard(picture: Picture, message: Telemetry) -> None:
    _telemetry(picture, message)
    picture.visited |= dict.fromkeys(filter(is_place_token, message.tokens), picture.now_ns)
    _drop_proposal(picture)


def _proposed(picture: Picture, message: Proposal) -> None:
    picture.proposal = message
    _drop_proposal(picture)


def _drop_proposal(picture: Picture) -> None:
    """Without a proposal that, by telemetry measured since, does not stand any more."""
    proposal, heard = picture.proposal, picture.telemetry
    if proposal is None or heard is None or heard.time_ns < proposal.time_ns:
        return
    if heard.proposal != proposal.number:
        picture.proposal = None


def _believed(picture: Picture, message: BeliefEntry) -> None:
    picture.belief = message
    picture.mode = None if message.mode is None else message.mode.value
    picture.failsafe = None if message.failsafe is None else message.failsafe.value
    picture.goals = dict.fromkeys(() if message.goals is None else message.goals.value)


_UPDATES: dict[Topic[Any], Callable[[Picture, Any], None]] = {
    TRUTH_YARD: _yard,
    TRUTH_POSE: _pose,
    ROVER_MODE: _mode_entry,
    ROVER_FAILSAFE: _failsafe_entry,
    ROVER_ACTION_STARTED: _action_started,
    ROVER_ACTION_ENDED: _action_ended,
    ROVER_GOAL: _goal_entry,
    ROVER_CYCLE: _cycle,
    ROVER_PROPOSAL: _proposal,
    ROVER_PROPOSAL_ENDED: _proposal_ended,
    GROUND_TELEMETRY: _telemetry,
    GROUND_STORED_TELEMETRY: _telemetry,
    GROUND_SILENCE: _silence,
    GROUND_BELIEF: _belief,
    GROUND_PREDICTION: _prediction,
    GROUND_SHADOW: _shadow,
    GROUND_OPERATOR: _operator,
    LINK_FRAME: _frame_fate,
    LINK_OUTAGE: _link_outage,
}
_UPDATE_OF = {topic.name: update for topic, update in _UPDATES.items()}
_GROUND_UPDATE_OF: dict[str, Callable[[Picture, Any], None]] = {
    **_UPDATE_OF,
    GROUND_CHART.name: _yard,
    GROUND_TELEMETRY.name: _heard,
    GROUND_STORED_TELEMETRY.name: _heard,
    GROUND_PROPOSAL.name: _proposed,
    GROUND_BELIEF.name: _believed,
}

PICTURE_TOPICS: tuple[Topic[Any], ...] = tuple(
    dict.fromkeys((*_UPDATES, GROUND_CHART, GROUND_PROPOSAL, *COMMAND_TOPICS, *EVENT_TOPICS))
)
"""The topics that a picture is made from."""
