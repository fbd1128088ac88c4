"""What the mission asked of the link: light time, loss in the long run, and rate."""

from collections.abc import Iterator, Sequence
from itertools import pairwise
from operator import itemgetter
from typing import NamedTuple, Self

import msgspec

from farside.link.profile.config import BitErrorEffect, LinkConfig, OneWay
from farside.link.profile.rate import planning_rate
from farside.link.profile.schedule import Delay
from farside.logs.file.reading import LogFile
from farside.logs.report.model import Series
from farside.logs.report.thinning import ms, rounded, steps
from farside.node import Direction, to_ns, to_s

_Points = list[tuple[int, float | None]]


class _Mission(msgspec.Struct):
    """What is read of `mission.json`."""

    link: LinkConfig


class _Change(msgspec.Struct):
    """What is read of a change in `changes.json`."""

    at_ns: int
    mission: _Mission


class _Span(NamedTuple):
    """A direction is asked for in one way from `begin_ns` up to `end_ns`."""

    begin_ns: int
    end_ns: int
    way: OneWay


class Asked:
    """The link of the resolved mission in a log, and what it became where that changed in the run.

    Args:
        links: the links, resolved, each with the time in ns from which on; none where the log has
            no mission.
        until_ns: the end of the run.
        problems: what could not be read, as sentences.
    """

    def __init__(
        self, links: Sequence[tuple[int, LinkConfig]], until_ns: int, problems: Sequence[str] = ()
    ) -> None:
        self._links, self._until_ns = links, until_ns
        self.problems = problems

    @classmethod
    def of(cls, log: LogFile) -> Self:
        """Read it from a log."""
        links: list[tuple[int, LinkConfig]] = []
        found = log.attachments
        name = "mission.json"
        try:
            if name in found:
                links.append((0, msgspec.json.decode(found[name].data, type=_Mission).link))
            name = "changes.json"
            if links and name in found:
                changes = msgspec.json.decode(found[name].data, type=list[_Change])
                links += [(change.at_ns, change.mission.link) for change in changes]
        except (msgspec.MsgspecError, ValueError, RecursionError) as error:
            text = f"The link that the mission asked for cannot be read from {name}: {error}"
            return cls([], log.end_ns, [text])
        return cls(links, log.end_ns)

    def overheads(self, direction: Direction) -> list[tuple[int, int]]:
        """Bytes sent with each frame on top of its own, and from when on in ns, the last first."""
        found = [(at_ns, link.way(direction).overhead_byte) for at_ns, link in self._links]
        return found[::-1]

    def delay(self, direction: Direction) -> list[Series]:
        """The light time of what is sent at a time."""
        points: _Points = []
        for begin_ns, end_ns, link in self._in_force():
            way = link.way(direction)
            light = Delay(way)
            within = light.turns_ns(begin_ns, end_ns)
            points += [(at_ns, to_s(light.at(at_ns))) for at_ns in (begin_ns, *within, end_ns)]
        jitters = any(span.way.jitter is not None for span in self._spans(direction))
        name = "light time, before jitter" if jitters else "light time"
        return _series(name, points, "line")

    def loss(self, direction: Direction, mean_byte: float) -> list[Series]:
        """The share of frames of mean length that are lost in the long run."""
        from farside.link.profile.statistics import loss_statistics  # noqa: PLC0415 - numpy

        points: _Points = []
        for begin_ns, _, way in self._spans(direction):
            wrong = 0.0
            if way.bit_errors is BitErrorEffect.LOSE:
                wrong = 1 - (1 - way.bit_error_rate) ** (8 * (mean_byte + way.overhead_byte))
            points.append((begin_ns, loss_statistics(way.loss, wrong).rate))
        return _series("asked", points, "steps")

    def rate(self, direction: Direction) -> list[Series]:
        """The rate cap, of a trace its mean; nothing where there is none."""
        points: _Points = []
        spans = list(self._spans(direction))
        for begin_ns, end_ns, way in spans:
            if (rate := planning_rate(way)) is None:
                points.append((begin_ns, None))
                continue
            within = (time_ns for time_ns in rate.times_ns if begin_ns < time_ns < end_ns)
            points += [(at_ns, rate.at(at_ns)) for at_ns in (begin_ns, *within)]
        if all(value is None for _, value in points):
            return []
        traced = any(span.way.rate_trace is not None for span in spans)
        return _series("allowed, of a trace the mean" if traced else "allowed", points, "steps")

    def _in_force(self) -> Iterator[tuple[int, int, LinkConfig]]:
        """The links, each with the times in ns from which on, and up to which, it is in force."""
        begins_ns = [min(at_ns, self._until_ns) for at_ns, _ in self._links]
        for (begin_ns, end_ns), (_, link) in zip(
            pairwise([*begins_ns, self._until_ns]), self._links, strict=True
        ):
            if begin_ns < end_ns or not begin_ns:
                yield begin_ns, end_ns, link

    def _spans(self, direction: Direction) -> Iterator[_Span]:
        """The ways in which a direction is asked for, one after the other."""
        for from_ns, until_ns, link in self._in_force():
            ways = [(from_ns, link.way(direction))]
            own = [change for change in link.changes if change.direction.includes(direction)]
            for at_ns, change in sorted(((to_ns(one.at_s), one) for one in own), key=itemgetter(0)):
                # What a change asked for before this link was in force, it asks for from then on.
                ways.append((max(at_ns, from_ns), change.applied_to(ways[-1][1])))
            ends_ns = [*(at_ns for at_ns, _ in ways[1:]), until_ns]
            for (begin_ns, way), end_ns in zip(ways, ends_ns, strict=True):
                if begin_ns < min(end_ns, until_ns) or not until_ns:
                    yield _Span(begin_ns, min(end_ns, until_ns), way)


def _series(name: str, points: _Points, look: str) -> list[Series]:
    if not points:
        return []
    times = steps([ms(time_ns) for time_ns, _ in points])
    values = [None if value is None else rounded(value) for _, value in points]
    return [Series(name, times, values, look=look, asked=True)]
