"""A mission as a `gymnasium` environment: an agent on board, or at the ground over the link."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import gymnasium
import msgspec
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from farside.missions.environment import at_ground, on_board
from farside.missions.environment.at_ground import AtGround
from farside.missions.environment.drawing import as_picture, as_text
from farside.missions.environment.flight import Flight
from farside.missions.environment.happening import Reward, minus_time
from farside.missions.environment.on_board import OnBoard
from farside.missions.environment.preparing import ROVER, prepare
from farside.missions.environment.seat import ACTION_NAMES, Bearings, Observation, Seat
from farside.missions.loading import LoadedMission
from farside.node import to_ns, to_s
from farside.validation import shown

_SEEDS = 2**31


class MissionEnv(gymnasium.Env[Observation, np.int64]):
    """A mission in which an agent decides, in place of its controller or of its operator.

    An episode is a run of the mission, simulated in this process as fast as possible. It terminates
    when all goals are reached, or the rover is lost since its battery is flat; it is truncated at
    the end of the mission. What counts is what is known where the agent sits.

    Args:
        mission: path of a mission file, or name of a mission shipped with Farside.
        seat: `rover`: on board, a step is a move; or `ground`: a move is a command that is sent
            over the link now, and a step is a fixed period.
        goals: the places to reach, by name; by default those that the mission expects to be
            reached, or else those that are loaded on board before the start.
        overrides: values by dotted key in place of the mission file's, such as `link.up.delay_s`.
        period_s: what a step takes at the ground, and a step of waiting on board, in simulated
            seconds, to the nearest tick; `rover.drive.move_cost_s` of the mission by default.
        reward: what a step is worth; see `farside.missions.environment.happening`.
        logs: folder for the logs of the episodes, one file each; without it nothing is written.
        render_mode: `ansi` or `rgb_array`.

    Attributes:
        action_names: the actions by number: the moves, then `wait`.
        places: names of the places by number, as in the observation `place`; one number more stands
            for none.
        goals: names of the goals, in the order of the observation `goals`.
        chart: the yard; `chart.way` has the shortest way between two of its cells.
        log: path of the log of this episode, or of the last one; `None` without one.

    Raises:
        MissionError: if the mission cannot be loaded.
        ValueError: if anything else is wrong; says what was expected.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - as gymnasium declares it
        "render_modes": ["ansi", "rgb_array"],
        "render_fps": 4,
    }

    def __init__(
        self,
        mission: str | Path,
        *,
        seat: str = ROVER,
        goals: Sequence[str] | None = None,
        overrides: Mapping[str, object] | None = None,
        period_s: float | None = None,
        reward: Reward = minus_time,
        logs: str | Path | None = None,
        render_mode: str | None = None,
    ) -> None:
        modes = self.metadata["render_modes"]
        if render_mode is not None and render_mode not in modes:
            expected = " or ".join(map(shown, modes))
            raise ValueError(f"render_mode: expected {expected}, found {shown(render_mode)}")
        self.render_mode = render_mode
        self._loaded, self.goals = prepare(mission, seat, goals, overrides or {})
        self._seat_name, self._reward = seat, reward
        self._logs = None if logs is None else Path(logs)
        self.log: Path | None = None
        given = self._loaded.mission
        self.chart = given.world.chart()
        self._period_ns = _period_ns(given.rover.drive.move_cost_s, period_s, given.tick_ns)
        self._bearings = Bearings(given, self.goals)
        self.places, self.action_names = self._bearings.places, ACTION_NAMES
        self.action_space = spaces.Discrete(len(ACTION_NAMES))
        space = (
            on_board.space(self._bearings)
            if seat == ROVER
            else at_ground.space(self._bearings, given)
        )
        self.observation_space = cast("spaces.Space[Observation]", space)
        self._flight: Flight | None = None
        self._seat: Seat | None = None
        self._is_over = True

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin a new run, up to the first decision: on board, until the rover has its goals.

        At the ground that is when the rover is heard for the first time. `seed` in what is told is
        that of the run: given to `reset`, it makes the same run again.

        Args:
            seed: the seed of the mission. Without one the first run has the mission's own, and
                those after it have seeds drawn from the last one that was given.
            options: there are none.

        Raises:
            RuntimeError: if no decision falls due before the end of the mission.
            LogError: if a log is wanted and cannot be written.
        """
        if options:
            raise ValueError(f"options: expected none, found {', '.join(map(str, options))}")
        self.close()
        if seed is None and self._np_random is None:
            seed = self._loaded.mission.seed
        super().reset(seed=seed)
        run_seed = int(self.np_random.integers(_SEEDS)) if seed is None else seed
        loaded = _seeded(self._loaded, run_seed)
        flight = self._flight = Flight(loaded, self._logs)
        self.log = None if flight.log is None else flight.log.path
        seat = self._seat = (
            OnBoard(flight, self._bearings, period_ns=self._period_ns)
            if self._seat_name == ROVER
            else AtGround(flight, self._bearings, loaded.mission, period_ns=self._period_ns)
        )
        if not seat.begin():
            self.close()
            raise RuntimeError(
                f"expected the mission to come to a first decision, found none in all its "
                f"{to_s(flight.end_ns):g} s: at the ground the rover must be heard, and on board "
                f"the goals must arrive"
            )
        self._is_over = False
        return seat.observe(), {"seed": run_seed, **self._told(seat, flight, ())}

    def step(self, action: np.int64 | int) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Act, and go on to the next decision.

        Raises:
            ValueError: if there is no such action.
            RuntimeError: if the episode is over, or none has begun.
        """
        if self._is_over or self._seat is None or self._flight is None:
            raise RuntimeError("expected an episode under way, found none: call reset() first")
        if not self.action_space.contains(action):
            names = ", ".join(f"{number} {name}" for number, name in enumerate(ACTION_NAMES))
            raise ValueError(f"expected an action, {names}, found {action!r}")
        seat, flight = self._seat, self._flight
        happened = seat.act(ACTION_NAMES[int(action)])
        terminated = not seat.wanted or happened.lost
        truncated = not terminated and flight.now_ns >= flight.end_ns
        observation, told = seat.observe(), self._told(seat, flight, happened.reached)
        if terminated or truncated:
            self._is_over = True
            flight.close()
        return observation, float(self._reward(happened)), terminated, truncated, told

    @staticmethod
    def _told(seat: Seat, flight: Flight, reached: tuple[str, ...]) -> dict[str, Any]:
        return {"time_s": to_s(flight.now_ns), "reached": reached, **seat.tell()}

    def render(self) -> str | NDArray[np.uint8] | None:
        """The map, with the goals left and where the rover is taken to be, as `render_mode` says.

        Raises:
            RuntimeError: if no episode has begun.
        """
        if self._seat is None:
            raise RuntimeError("expected an episode, found none: call reset() first")
        if self.render_mode is None:
            return None
        draw = as_text if self.render_mode == "ansi" else as_picture
        return draw(self.chart, self._seat.place, self._seat.wanted)

    def close(self) -> None:
        """Finish the log of the episode, if there is one; closing again does nothing."""
        self._is_over = True
        if self._flight is not None:
            self._flight.close()


def _period_ns(move_s: float, given_s: float | None, tick_ns: int) -> int:
    period_s = move_s if given_s is None else given_s
    if not 0 < period_s < float("inf"):
        raise ValueError(f"period_s: expected a time above 0, found {period_s!r}")
    return max(1, round(to_ns(period_s) / tick_ns)) * tick_ns


def _seeded(loaded: LoadedMission, seed: int) -> LoadedMission:
    """The mission with another seed, as if it had been loaded with it."""
    mission = msgspec.structs.replace(loaded.mission, seed=seed)
    return loaded._replace(mission=mission, overrides=(*loaded.overrides, ("seed", seed)))
