"""What the mission asked of the link: light time, loss in the long run, and rate."""

from typing import Any, Self

import msgspec

from farside.link.profile.config import BitErrorEffect, LinkChange, LinkConfig, OneWay
from farside.link.profile.rate import planning_rate
from farside.logs.file.reading import LogFile
from farside.logs.report.model import Series
from farside.logs.report.thinning import ms, rounded, steps
from farside.node import Direction, to_ns


class _Mission(msgspec.Struct):
    """What is read of `mission.json`."""

    link: LinkConfig


class Asked:
    """The link of the resolved mission in a log; nothing where the log has none.

    Args:
        link: the link, resolved.
        until_ns: the end of the run.
        problems: what could not be read, as sentences.
    """

    def __init__(self, link: LinkConfig | None, until_ns: int, problems: list[str]) -> None:
        self._link, self._until_ns = link, until_ns
        self.problems = problems

    @classmethod
    def of(cls, log: LogFile) -> Self:
        """Read it from a log."""
        attached = log.attachments.get("mission.json")
        if attached is None:
            return cls(None, log.end_ns, [])
        try:
            return cls(msgspec.json.decode(attached.data, type=_Mission).link, log.end_ns, [])
        except (msgspec.MsgspecError, ValueError) as error:
            text = f"The link that the mission asked for cannot be read from mission.json: {error}"
            return cls(None, log.end_ns, [text])

    def overhead_byte(self, direction: Direction) -> int:
        """Bytes sent with each frame on top of its own."""
        return 0 if self._link is None else self._link.way(direction).overhead_byte

    def delay(self, direction: Direction) -> list[Series]:
        """The light time of what is sent at a time."""
        if self._link is None:
            return []
        way = self._link.way(direction)
        points = [(0.0, way.delay_s or 0.0)]
        if way.delay_table:
            points = [(point.t_s, point.delay_s) for point in way.delay_table]
        name = "light time" if way.jitter is None else "light time, before jitter"
        return [self._curve(name, points, "line")]

    def loss(self, direction: Direction, mean_byte: float) -> list[Series]:
        """The share of frames of mean length that are lost in the long run."""
        from farside.link.profile.statistics import loss_statistics  # noqa: PLC0415 - numpy

        points = []
        for t_s, way in self._ways(direction):
            wrong = 0.0
            if way.bit_errors is BitErrorEffect.LOSE:
                wrong = 1 - (1 - way.bit_error_rate) ** (8 * mean_byte)
            points.append((t_s, loss_statistics(way.loss, wrong).rate))
        return [self._curve("asked", points, "steps")] if points else []

    def rate(self, direction: Direction) -> list[Series]:
        """The rate cap; nothing where there is none."""
        points: list[tuple[float, float]] = []
        for t_s, way in self._ways(direction):
            if (rate := planning_rate(way)) is None:
                continue
            starts_s = [t_s, *(step.t_s for step in way.rate_table if step.t_s > t_s)]
            points = [point for point in points if point[0] < t_s]
            points += [(start_s, rate.at(to_ns(start_s))) for start_s in starts_s]
        return [self._curve("allowed", points, "steps")] if points else []

    def _ways(self, direction: Direction) -> list[tuple[float, OneWay]]:
        """The direction as it is asked for, from when on."""
        if self._link is None:
            return []
        changes = sorted(self._link.changes, key=_at_s)
        ways = [(0.0, self._link.way(direction))]
        for change in changes:
            if change.direction.includes(direction):
                ways.append((change.at_s, change.applied_to(ways[-1][1])))
        return ways

    def _curve(self, name: str, points: list[tuple[float, float]], look: str) -> Series:
        until = ms(self._until_ns)
        shown = [(ms(to_ns(t_s)), rounded(value)) for t_s, value in points]
        within = [point for point in shown if point[0] <= until] or shown[:1]
        if look == "line":
            within = within + [point for point in shown if point[0] > until][:1]
            within = within if len(within) > 1 else [*within, (until, within[0][1])]
        times = steps([t for t, _ in within])
        return Series(name, times, [value for _, value in within], look=look, asked=True)


def _at_s(change: LinkChange) -> Any:
    return change.at_s
