"""The seat at the ground: the agent drives over the link, and knows what has come down."""

from typing import Any

import numpy as np
from gymnasium import spaces

from farside.acts import Act
from farside.control import CommandStage
from farside.ground.commands.life import Life
from farside.ground.operators.operator import Situation
from farside.messages import Drive, SetGoal
from farside.missions.environment.flight import Flight
from farside.missions.environment.happening import Happened
from farside.missions.environment.seat import (
    ACTION_NAMES,
    WAIT,
    Bearings,
    Observation,
    place_in,
)
from farside.missions.schema import MissionFile
from farside.node import to_s
from farside.places import place_token

AHEAD = 8
"""The most moves that may be on their way, sent and not known to be over: so they can be observed
one by one (project default, as of the operator `guide`)."""


class AtGround:
    """An agent in the place of the operator.

    It sets all goals at the start, so that the rover knows them if it is left alone, and then
    drives: a move is a command that is sent now. A decision is due after a fixed period, whether
    anything was heard or not. What the agent sees, and what its rewards are for, is what the ground
    knows by then.

    Args:
        flight: the run, at its start.
        bearings: places and goals.
        mission: the mission.
        period_ns: from one decision to the next.
    """

    def __init__(
        self, flight: Flight, bearings: Bearings, mission: MissionFile, *, period_ns: int
    ) -> None:
        self._flight, self._bearings = flight, bearings
        self._period_ns = period_ns
        self._capacity_j = mission.rover.battery.capacity_j
        self._over: set[int] = set()  # the moves known to be over, by number of command
        self._ended: tuple[Life, ...] = ()  # those of which that was learned in this step
        self._refused = ""

    def begin(self) -> bool:
        """Set the goals, and listen until the rover is heard; see `Seat`."""
        flight, goals = self._flight, self._bearings.goals
        acts: list[Act] = [
            SetGoal((place_token(goal),), float(len(goals) - number))
            for number, goal in enumerate(goals)
        ]
        while self._situation.belief.telemetry is None and flight.now_ns < flight.end_ns:
            flight.advance(flight.now_ns + flight.tick_ns, acts)
            acts = []
        return self._situation.belief.telemetry is not None

    @property
    def _situation(self) -> Situation:
        return self._flight.ground.situation

    @property
    def _outstanding(self) -> tuple[Life, ...]:
        return tuple(life for life in self._situation.commands.live if life.is_action)

    def act(self, action: str) -> Happened:
        """Send one move, or nothing, and listen for a period; see `Seat`."""
        flight = self._flight
        began_ns, charge, wanted = flight.now_ns, self._charge, self.wanted
        acts: list[Act] = []
        self._refused = ""
        if action != WAIT:
            if len(self._outstanding) < AHEAD:
                acts.append(Drive(action))
            else:
                self._refused = f"{AHEAD} moves are on their way, and none is known to be over"
        flight.advance(began_ns + self._period_ns, acts)
        self._ended = tuple(
            life
            for life in self._situation.commands.over
            if life.is_action and life.command.number not in self._over
        )
        self._over.update(life.command.number for life in self._ended)
        ends = [life.end.stage for life in self._ended if life.end is not None]
        blocked = ends.count(CommandStage.FAILED)
        return Happened(
            seconds=to_s(flight.now_ns - began_ns),
            energy_j=(charge - self._charge) * self._capacity_j,
            reached=tuple(goal for goal in wanted if goal not in self.wanted),
            blocked=blocked,
            refused=len(ends) - ends.count(CommandStage.DONE) - blocked + bool(self._refused),
            lost=self._charge <= 0,
            left_s=to_s(flight.end_ns - flight.now_ns),
        )

    @property
    def _charge(self) -> float:
        known = self._situation.belief.now.battery
        return 1.0 if known is None else known.value

    def observe(self) -> Observation:
        """What is known, how old it is, and what is on its way; see `Seat`."""
        place = self._situation.belief.now.place
        age_s = 0.0 if place is None else to_s(self._flight.now_ns - place.so_ns)
        moves = [ACTION_NAMES.index(life.action) + 1 for life in self._outstanding if life.action]
        return {
            **self._bearings.observe(self.place, self.wanted, self._charge),
            "age_s": np.array([age_s], np.float32),
            "link": np.int64(self._is_heard),
            "outstanding": np.array([*moves, *[0] * (AHEAD - len(moves))], np.int64),
        }

    @property
    def _is_heard(self) -> bool:
        silence = self._flight.ground.silence
        return not (silence.silent or silence.expected)

    def tell(self) -> dict[str, Any]:
        """What was heard, what is on its way, what became of it, and why; see `Seat`."""
        now = self._situation.belief.now
        telemetry = self._situation.belief.telemetry
        return {
            "tokens": () if telemetry is None else telemetry.tokens,
            "outstanding": tuple(str(life.action) for life in self._outstanding),
            "ended": tuple(
                (str(life.action), life.end.stage.value, life.end.why or "")
                for life in self._ended
                if life.end is not None
            ),
            "refused": self._refused,
            "mode": "" if now.mode is None else now.mode.value.value,
            "failsafe": "" if now.failsafe is None else now.failsafe.value.value,
        }

    @property
    def place(self) -> str | None:
        """The place that the newest telemetry tells of; see `Seat`."""
        telemetry = self._situation.belief.telemetry
        return None if telemetry is None else place_in(telemetry.tokens)

    @property
    def wanted(self) -> tuple[str, ...]:
        """The goals that are not known at the ground to be reached; see `Seat`."""
        belief = self._situation.belief
        return tuple(
            goal for token, goal in self._bearings.tokens.items() if not belief.reached((token,))
        )


def space(bearings: Bearings, mission: MissionFile) -> spaces.Dict:
    """The space of an agent's observations at the ground."""
    return spaces.Dict(
        {
            **bearings.spaces,
            "age_s": spaces.Box(0.0, mission.duration_s, (1,), np.float32),
            "link": spaces.Discrete(2),
            "outstanding": spaces.MultiDiscrete([len(ACTION_NAMES)] * AHEAD),
        }
    )
