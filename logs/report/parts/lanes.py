"""The rows of the timeline: modes, failsafe, actions, battery, goals and outages, as they were."""

from typing import Any

import msgspec

from farside.control import BatteryState
from farside.frames import LinkOutage
from farside.logs.events import OUTAGES, sign_text
from farside.logs.file.reading import LogEntry
from farside.logs.report.model import Lane, Mark, Side, Span, View
from farside.logs.report.thinning import ms
from farside.messages import Tokens
from farside.node import Direction, Topic
from farside.topics import (
    GROUND_SILENCE,
    LINK_OUTAGE,
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_BATTERY,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_STUCK,
    ActionEnded,
    ActionStarted,
    BatteryEntry,
    FailsafeEntry,
    GoalChange,
    GoalEntry,
    ModeEntry,
    Silence,
    StuckEntry,
)

_GOALS = 10  # rows
_SPANS = 3000  # of a row
_WIDEST = 600_000  # ms


class Row:
    """A row of the timeline in the making: one span lasts until the next, or until it is closed.

    Where there are too many, neighbours of one kind are drawn as one, which says how many it is.

    Attributes:
        lane: the row.
        merged: spans that are nearer than this, in ms, may be drawn as one; 0 while none is.
        left_out: how many spans and marks there were beyond the most that a row has.
    """

    def __init__(self, name: str) -> None:
        self.lane = Lane(name, [], [])
        self.merged = self.left_out = 0
        self._open: Span | None = None

    def open(self, t: int, kind: str, label: str, title: str) -> None:
        """Begin a span, and end the one before."""
        self.close(t)
        spans = self.lane.spans
        while len(spans) >= _SPANS and self.merged < _WIDEST:
            self._merge()
        if len(spans) >= _SPANS:
            self.left_out += 1
            return
        self._open = Span(t, None, kind, label, title)
        spans.append(self._open)

    def close(self, t: int, more: str = "") -> None:
        """End the span that is open, if one is, and add to what is told of it."""
        if self._open is not None:
            self._open.end = t
            self._open.title += more
        self._open = None

    def mark(self, t: int, kind: str, title: str) -> None:
        """Add a mark."""
        if len(self.lane.marks) >= _SPANS:
            self.left_out += 1
            return
        self.lane.marks.append(Mark(t, kind, title))

    def _merge(self) -> None:
        """Join pairs of neighbours of one kind that are near each other."""
        self.merged = max(2000, 2 * self.merged)
        spans = self.lane.spans
        joined: list[Span] = []
        for span in spans:
            last = joined[-1] if joined else None
            if (
                last is not None
                and last.kind == span.kind
                and last.end is not None
                and span.start - last.end <= self.merged
                and span.start - last.start <= 10 * self.merged
            ):
                last.count += span.count
                last.end, last.label = span.end, ""
                last.title = f"{last.count} in turn, {span.kind}"
            else:
                joined.append(span)
        spans[:] = joined

    @property
    def notes(self) -> list[str]:
        """What the page says of spans that it does not show one by one."""
        notes = []
        if self.merged:
            notes.append(
                f"{self.lane.name}: neighbours of one kind, less than {self.merged / 1000:g} s "
                "apart, are drawn as one"
            )
        if self.left_out:
            notes.append(f"{self.lane.name}: {self.left_out} later ones are left out")
        return notes


class Lanes:
    """The rows, each from its topic. At the ground there is one: whether it hears the rover."""

    topics: tuple[Topic[Any], ...] = (
        ROVER_MODE,
        ROVER_FAILSAFE,
        ROVER_ACTION_STARTED,
        ROVER_ACTION_ENDED,
        ROVER_BATTERY,
        ROVER_STUCK,
        ROVER_GOAL,
        LINK_OUTAGE,
        GROUND_SILENCE,
    )

    def __init__(self, side: Side) -> None:
        self._as_ground = side.is_ground
        self._mode, self._failsafe = Row("Mode"), Row("Failsafe")
        self._action, self._battery, self._stuck = Row("Action"), Row("Battery"), Row("Stuck")
        self._ways = {Direction.UP: Row("Uplink"), Direction.DOWN: Row("Downlink")}
        self._heard = Row("Heard")
        self._goals: dict[Tokens, Row] = {}
        self._other_goals = Row("Other goals")

    def take(self, entry: LogEntry) -> None:
        """See `Gatherer`."""
        t = ms(entry.log_time_ns)
        match entry.message:
            case ModeEntry(mode=mode, why=why):
                self._mode.open(t, mode, mode, f"mode {mode}: {why}")
            case FailsafeEntry(state=state, why=why):
                self._failsafe.open(t, state, state, f"failsafe {state}: {why}")
            case ActionStarted() as started:
                self._begin(t, started)
            case ActionEnded(blocked=blocked):
                self._action.close(t, ", blocked" if blocked else "")
                if blocked:
                    self._action.mark(t, "cross", "blocked")
            case GoalEntry() as goal:
                self._take_goal(t, goal)
            case other:
                self._take_condition(t, other)

    def _take_condition(self, t: int, message: msgspec.Struct) -> None:
        """Of the battery, the wheels and the link."""
        match message:
            case BatteryEntry(state=battery, charge=charge):
                self._battery.close(t)
                if battery is not BatteryState.NOMINAL:
                    self._battery.open(t, battery, battery, f"battery {battery}, {charge:.0%}")
            case StuckEntry(stuck=stuck):
                self._stuck.close(t)
                if stuck:
                    self._stuck.open(t, "stuck", "stuck", "stuck")
            case LinkOutage() as outage:
                self._take_outage(t, outage)
            case Silence(silent=silent, expected=expected):
                self._take_silence(t, silent=silent, expected=expected)

    def _begin(self, t: int, started: ActionStarted) -> None:
        title = f"{started.action}, {started.chooser}"
        if started.command is not None:
            title += f", command {started.command}"
        if started.goal is not None:
            title += f", towards {sign_text(started.goal)}"
        self._action.open(t, started.chooser, started.action, title)

    def _take_goal(self, t: int, goal: GoalEntry) -> None:
        name = sign_text(goal.tokens)
        row = self._goals.get(goal.tokens)
        if row is None and len(self._goals) < _GOALS:
            row = self._goals[goal.tokens] = Row(f"Goal {name}")
        row = row or self._other_goals
        told = f"goal {name}, {goal.source}, priority {goal.priority:.3g}"
        match goal.change:
            case GoalChange.SET | GoalChange.RECOVERED:
                row.open(t, f"goal-{goal.source}", goal.source, told)
            case GoalChange.SUSPENDED:
                row.open(t, "aside", "put aside", f"goal {name} put aside: {goal.why}")
            case GoalChange.REACHED:
                row.close(t)
                row.mark(t, "reached", f"goal {name} reached")
            case GoalChange.WITHDRAWN:
                row.close(t)
                row.mark(t, "cross", f"goal {name} withdrawn")

    def _take_outage(self, t: int, outage: LinkOutage) -> None:
        row, words = self._ways[outage.direction], OUTAGES[outage.reason]
        row.close(t)
        if outage.down:
            row.open(t, "planned" if outage.reason.is_foreseen else "outage", words, words)

    def _take_silence(self, t: int, *, silent: bool, expected: bool) -> None:
        self._heard.close(t)
        if silent:
            self._heard.open(t, "outage", "nothing heard", "hears nothing from the rover")
        elif expected:
            words = "nothing heard, as planned"
            self._heard.open(t, "planned", words, words)

    def fill(self, view: View) -> None:
        """See `Gatherer`."""
        if self._as_ground:
            rows = [self._heard]
        else:
            conditions = [row for row in (self._battery, self._stuck) if row.lane.spans]
            others = [self._other_goals] if self._other_goals.lane.spans else []
            rows = [self._mode, self._failsafe, *conditions, self._action]
            rows += [*self._goals.values(), *others, *self._ways.values()]
        view.lanes += [row.lane for row in rows]
        for row in rows:
            view.notes += row.notes
