"""Where the rover was: in truth, by its own estimate, and what it ran into."""

from typing import Any

from farside.logs.file.reading import LogEntry
from farside.logs.report.model import Panel, Side, Track, View
from farside.logs.report.thinning import (
    Curve,
    Rows,
    Waypoints,
    ms,
    steps,
    thinning_note,
)
from farside.node import Topic
from farside.topics import (
    GROUND_CHART,
    ROVER_ESTIMATE,
    TRUTH_BUMP,
    TRUTH_POSE,
    TRUTH_YARD,
    Bump,
    Estimate,
    Pose,
    Yard,
)

_ROWS = 40_000
_BUMPS = 2000

_Row = tuple[int, int, int]


class _Path:
    """A track without the rows in which nothing moved: they lie on the line between others."""

    def __init__(self, most: int) -> None:
        self.way: Waypoints[_Row] = Waypoints(most)
        self._last: _Row | None = None
        self._stood = False

    def add(self, time_ns: int, x_m: float, y_m: float) -> None:
        row = ms(time_ns), round(x_m * 100), round(y_m * 100)
        if self._last is not None and self._last[1:] == row[1:]:
            self._last, self._stood = row, True
            return
        if self._stood and self._last is not None:
            self.way.add(self._last)
        self.way.add(row)
        self._last, self._stood = row, False

    def track(self) -> Track:
        rows = self.way.rows
        return Track(steps([t for t, _, _ in rows]), [x for _, x, _ in rows], [y for *_, y in rows])


class Tracks:
    """The map, the tracks, the bumps, and the battery's true charge."""

    topics: tuple[Topic[Any], ...] = (
        TRUTH_YARD,
        GROUND_CHART,
        TRUTH_POSE,
        ROVER_ESTIMATE,
        TRUTH_BUMP,
    )

    def __init__(self, side: Side) -> None:
        self._chart_topic = GROUND_CHART.name if side.is_ground else TRUTH_YARD.name
        self._chart: Yard | None = None
        self._true, self._estimated = _Path(_ROWS), _Path(_ROWS)
        self._charge = Curve(side.until_ns)
        self._bumps: Rows[tuple[int, int, int]] = Rows(_BUMPS)

    def take(self, entry: LogEntry) -> None:
        """See `Gatherer`."""
        match entry.message:
            case Pose() as pose:
                self._true.add(entry.log_time_ns, pose.x_m, pose.y_m)
                self._charge.add(entry.log_time_ns, pose.battery)
            case Estimate() as estimate:
                self._estimated.add(entry.log_time_ns, estimate.x_m, estimate.y_m)
            case Bump() as bump:
                spot = round(bump.x_m * 100), round(bump.y_m * 100)
                self._bumps.add((ms(entry.log_time_ns), *spot))
            case Yard() as yard if entry.topic == self._chart_topic:
                self._chart = yard

    def fill(self, view: View) -> None:
        """See `Gatherer`."""
        if self._chart is not None:
            view.rows, view.cell_m = list(self._chart.rows), self._chart.cell_m
        view.bumps = self._bumps.rows
        if not self._true.way.rows:
            return
        view.track, view.believed = self._true.track(), self._estimated.track()
        charge = self._charge.series("true charge")
        view.panels.append(Panel("Battery", "%", [charge], top=1.0))
        view.notes += thinning_note("Battery", [self._charge])
        view.notes += self._true.way.note("The track")
        view.notes += self._estimated.way.note("The track by the rover's own estimate")
        if self._bumps.every > 1:
            view.notes.append(f"Bumps: 1 of {self._bumps.every}")
