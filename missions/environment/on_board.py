"""The seat on board: the agent chooses in the controller's place, one move after the other."""

from typing import Any

import numpy as np
from gymnasium import spaces

from farside.control import Chooser, Failsafe, Mode
from farside.missions.environment.flight import Flight
from farside.missions.environment.happening import Happened
from farside.missions.environment.seat import WAIT, Bearings, Observation, place_in
from farside.node import NS_PER_S, to_s
from farside.places import ON_CHARGE
from farside.rover.control.queued import QueuedController
from farside.topics import (
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_GOAL,
    ActionEnded,
    ActionStarted,
    GoalChange,
    reasons,
)

_LOOKS_NS = NS_PER_S  # a rover that stands looks about once a second whether there is something
_FAILSAFES = tuple(Failsafe)


class OnBoard:
    """An agent in the place of the controller on board.

    The operator leaves it all goals at once, in autonomous mode, and says no more; the ground's
    heartbeats, blackouts and the failsafe are as ever. A decision is due when a move has ended,
    and after a while of waiting. A move begins on the tick after; where the rover may not begin it
    within a second, it is refused, and taken back.

    Args:
        flight: the run, at its start.
        bearings: places and goals.
        period_ns: for how long the agent waits when it waits.
    """

    def __init__(self, flight: Flight, bearings: Bearings, *, period_ns: int) -> None:
        controller = flight.rover.controller
        assert isinstance(controller, QueuedController)  # noqa: S101 - `prepare` saw to it
        self._flight, self._bearings, self._controller = flight, bearings, controller
        self._parts = flight.rover.parts
        self._period_ns = period_ns
        self._moving: ActionStarted | None = None
        self._done: ActionEnded | None = None  # the move that ended this step
        self._begun = False  # whether the agent's move began in this step
        self._refused = ""
        self._reached: list[str] = []

    def begin(self) -> bool:
        """Live until the rover has its goals and asks what to do; see `Seat`."""
        flight = self._flight
        while not self._is_asked and flight.now_ns < flight.end_ns:
            self._tick()
        return self._is_asked

    @property
    def _is_asked(self) -> bool:
        listed = {token for goal in self._controller.goals for token in goal.tokens}
        missing = {token for token, goal in self._bearings.tokens.items() if goal in self.wanted}
        return self._controller.is_asked and listed >= missing

    def act(self, action: str) -> Happened:
        """Make one move, or wait; see `Seat`."""
        flight, battery = self._flight, self._parts.battery
        began_ns, charge_j, reached = flight.now_ns, battery.charge_j, len(self._reached)
        self._done, self._begun, self._refused = None, False, ""
        until_ns = began_ns + self._period_ns
        if action != WAIT:
            until_ns = began_ns + _LOOKS_NS + flight.tick_ns
            if self._moving is None:
                self._controller.put(action)
        while self._done is None and flight.now_ns < flight.end_ns:
            if self._moving is None and flight.now_ns >= until_ns:
                break
            self._tick()
        self._controller.put(None)
        if action != WAIT and not self._begun:
            self._refused = self._why_not()
        return Happened(
            seconds=to_s(flight.now_ns - began_ns),
            energy_j=charge_j - battery.charge_j,
            reached=tuple(self._reached[reached:]),
            blocked=int(self._done is not None and self._done.blocked),
            refused=int(bool(self._refused)),
            lost=battery.empty,
            left_s=to_s(flight.end_ns - flight.now_ns),
        )

    def _tick(self) -> None:
        for record in self._flight.tick():
            if record.topic == ROVER_ACTION_STARTED.name:
                self._moving = ROVER_ACTION_STARTED.decode(record.payload)
                if self._moving.chooser is Chooser.EXPLORATORY:
                    self._begun = True
                else:
                    self._controller.put(None)  # the rover is on a way of its own
            elif record.topic == ROVER_ACTION_ENDED.name:
                self._moving, self._done = None, ROVER_ACTION_ENDED.decode(record.payload)
            elif record.topic == ROVER_GOAL.name:
                entry = ROVER_GOAL.decode(record.payload)
                goal = self._bearings.tokens.get(entry.tokens[0])
                if goal in self.wanted and entry.change is GoalChange.REACHED:
                    self._reached.append(goal)

    def _why_not(self) -> str:
        """Why the agent's move was not begun."""
        parts, mode = self._parts, self._flight.rover.pilot.authority.mode
        if parts.battery.empty:
            return reasons.BATTERY_FLAT.of()
        if not parts.watch.rule.acts:
            return parts.watch.rule.why
        if mode is not Mode.AUTONOMOUS:
            return f"the rover is in mode {mode}"
        if ON_CHARGE in parts.cycle.tokens and parts.battery.low:
            return "the rover stands at the dock until it is charged"
        if not parts.goals.listed:
            return "there is no goal"
        return "the rover is on a way of its own"

    def observe(self) -> Observation:
        """Place, goals that are left, charge, and the failsafe's state; see `Seat`."""
        return {
            **self._bearings.observe(self.place, self.wanted, self._parts.battery.charge),
            "failsafe": np.int64(_FAILSAFES.index(self._parts.watch.state)),
        }

    def tell(self) -> dict[str, Any]:
        """What is sensed, what was done, and why not; see `Seat`."""
        done, watch = self._done, self._parts.watch
        return {
            "tokens": tuple(sorted(self._parts.cycle.tokens)),
            "action": "" if done is None else done.action,
            "blocked": done is not None and done.blocked,
            "refused": self._refused,
            "failsafe": watch.state.value,
            "why": watch.rule.why,
        }

    @property
    def place(self) -> str | None:
        """Where the rover believes to be; see `Seat`."""
        return place_in(self._parts.cycle.tokens)

    @property
    def wanted(self) -> tuple[str, ...]:
        """The goals not yet reached; see `Seat`."""
        return tuple(goal for goal in self._bearings.goals if goal not in self._reached)


def space(bearings: Bearings) -> spaces.Dict:
    """The space of an agent's observations on board."""
    return spaces.Dict({**bearings.spaces, "failsafe": spaces.Discrete(len(_FAILSAFES))})
