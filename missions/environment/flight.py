"""A run that an agent goes through step by step, in this process and without a clock."""

import time
from collections.abc import Sequence
from operator import attrgetter
from pathlib import Path

from farside.acts import Act
from farside.logs import Recorder
from farside.missions.build import build_channel, build_ground, build_operator, build_rover
from farside.missions.crew.crew import by_receiver
from farside.missions.extensions.kinds import searching
from farside.missions.loading import LoadedMission
from farside.missions.results import conclude, describe
from farside.node import Frame, Record, Role, to_ns

_log_time_ns = attrgetter("log_time_ns")


class EpisodeLog:
    """Writes the log of an episode: that of any run, which `farside verify` can prove.

    Args:
        loaded: the mission.
        folder: where logs go, created if missing.

    Attributes:
        path: of the log.

    Raises:
        LogError: if it cannot be created.
    """

    def __init__(self, loaded: LoadedMission, folder: Path) -> None:
        mission = self._mission = loaded.mission
        self._recorder = Recorder.in_folder(folder, f"{mission.name}-seed{mission.seed}")
        self._began_s = time.monotonic()
        self.path = self._recorder.path
        describe(self._recorder, loaded)

    def write(self, records: Sequence[Record]) -> None:
        """Write the records of a window."""
        self._recorder.write(records)
        self._recorder.flush()

    def close(self, now_ns: int) -> None:
        """The run ended at this simulated time."""
        conclude(self._recorder, self._mission, now_ns, time.monotonic() - self._began_s)
        self._recorder.close()


class Flight:
    """Rover, link and ground of a mission, and how far they have come.

    Within a window no longer than the link's lookahead, rover and ground cannot reach each other.
    So the rover may go ahead tick by tick, and the others follow when the window is full, or when
    somebody wants to `settle` them.

    Args:
        loaded: the mission.
        logs: folder for a log; `None` for none.

    Attributes:
        rover, ground: the live nodes.
        now_ns: simulated time that the rover has reached.
        tick_ns: period of physics and decisions.
        end_ns: the end of the mission.
        log: the log; `None` without one.
    """

    def __init__(self, loaded: LoadedMission, logs: Path | None = None) -> None:
        mission, extensions = loaded.mission, loaded.extensions
        self._path = extensions.path
        with searching(self._path):
            self.rover = build_rover(mission, extensions)
            self._link = build_channel(mission)
            self.ground = build_ground(mission, build_operator(mission, extensions))
        self.tick_ns, self._window_ns = mission.tick_ns, mission.window_ns
        self.now_ns = self._settled_ns = 0
        self.end_ns = to_ns(mission.duration_s)
        self._arrivals = by_receiver([])
        self._sent: list[Frame] = []
        self._noted: list[Record] = []
        self.log = None if logs is None else EpisodeLog(loaded, logs)

    def tick(self) -> list[Record]:
        """Let the rover live for a tick; its records."""
        records = self._live(self.now_ns + self.tick_ns)
        if self.now_ns - self._settled_ns >= self._window_ns:
            self.settle()
        return records

    def advance(self, until_ns: int, acts: Sequence[Act] = ()) -> None:
        """Let all three live up to this time, or to the end; `acts` are given at its start."""
        self.settle()
        if acts:
            self.ground.order(acts)
        with searching(self._path):  # for what code of one's own imports later on
            while self.now_ns < min(until_ns, self.end_ns):
                self._live(min(self.now_ns + self._window_ns, until_ns))
                self.settle()

    def _live(self, until_ns: int) -> list[Record]:
        until_ns = min(until_ns, self.end_ns)
        arrivals, self._arrivals[Role.ROVER] = self._arrivals[Role.ROVER], []
        step = self.rover.advance(until_ns, arrivals)
        self._sent += step.frames
        self._noted += step.records
        self.now_ns = until_ns
        return step.records

    def settle(self) -> None:
        """Let link and ground come to where the rover is."""
        if self._settled_ns == self.now_ns:
            return
        ground = self.ground.advance(self.now_ns, self._arrivals[Role.GROUND])
        link = self._link.advance(self.now_ns, self._sent + ground.frames)
        if self.log is not None:
            # As any run is recorded: in order of time, and at one time the rover's first.
            self.log.write(sorted([*self._noted, *link.records, *ground.records], key=_log_time_ns))
        self._arrivals = by_receiver(link.frames)
        self._sent, self._noted = [], []
        self._settled_ns = self.now_ns

    def close(self) -> None:
        """Finish the log; closing again does nothing."""
        self.settle()
        log, self.log = self.log, None
        if log is not None:
            log.close(self.now_ns)
