"""What the reliable service puts into frames: segments of messages, and reports on them."""

from bisect import bisect_right
from collections.abc import Collection
from itertools import accumulate
from typing import Annotated

import msgspec
from msgspec import Meta

from farside.link.endpoint.wire import FrameError, unpack

_REPORT_HEAD_BYTE = 32
_PAIR_BYTE = 10  # two lengths of runs in MessagePack, at most

_Natural = Annotated[int, Meta(ge=0)]


class Segment(msgspec.Struct, frozen=True, array_like=True, tag=1):
    """Part of a message: number in the stream, place in its message, whether it ends it, data."""

    number: _Natural
    index: _Natural
    last: bool
    data: bytes


class Report(msgspec.Struct, frozen=True, array_like=True, tag=2):
    """What has arrived by the time at which the report was made.

    Attributes:
        made_ns: when it was made.
        base: all segments below have arrived; this one has not.
        skipped: from `base` on, so many are told of in another report.
        runs: lengths of runs after those: missing, arrived, missing, ..., arrived.
        rest: whether all after the runs are missing; otherwise another report tells.
    """

    made_ns: _Natural
    base: _Natural
    skipped: _Natural
    runs: tuple[Annotated[int, Meta(ge=1)], ...]
    rest: bool


encode = msgspec.msgpack.Encoder().encode
"""A segment or a report as bytes."""

_decoder: msgspec.msgpack.Decoder[Segment | Report] = msgspec.msgpack.Decoder(Segment | Report)


def decode(payload: bytes) -> Segment | Report:
    """The segment or report that `encode` encoded.

    Raises:
        FrameError: if it is neither.
    """
    return unpack(payload, _decoder)


class Told:
    """A report, to be asked about single segments.

    Attributes:
        end: it tells of no segment from here on that it has arrived.
    """

    def __init__(self, report: Report) -> None:
        self._report = report
        self._first = report.base + report.skipped
        self._ends = list(accumulate(report.runs, initial=self._first))
        self.end = self._ends[-1] if report.runs else report.base

    def has(self, number: int) -> bool | None:
        """Whether a segment has arrived; `None` where another report tells."""
        if number < self._report.base:
            return True
        if number < self._first:
            return None
        if number >= self._ends[-1]:
            return False if self._report.rest else None
        return bisect_right(self._ends, number) % 2 == 0


def reports_on(base: int, beyond: Collection[int], made_ns: int, size_byte: int) -> list[Report]:
    """What has arrived, in as many reports as it takes to keep each within `size_byte`.

    Args:
        base: all segments below have arrived, this one has not.
        beyond: those that have arrived after it.
        made_ns: the present.
        size_byte: at least 64.
    """
    runs: list[int] = []
    end = base
    for number in sorted(beyond):
        if number > end:
            runs += [number - end, 0]
        runs[-1] += 1
        end = number + 1
    reports, skipped = [], 0
    most = (size_byte - _REPORT_HEAD_BYTE) // _PAIR_BYTE * 2
    for begin in range(0, max(1, len(runs)), most):
        part = tuple(runs[begin : begin + most])
        rest = begin + most >= len(runs)
        reports.append(Report(made_ns, base, skipped, part, rest))
        skipped += sum(part)
    return reports


class Parts:
    """The segments of one message that have arrived."""

    def __init__(self) -> None:
        self._data: dict[int, bytes] = {}
        self._count: int | None = None

    def add(self, segment: Segment) -> tuple[bytes, int] | None:
        """Take a segment that is not here yet. Gives message and count once it is whole."""
        if segment.last:
            count: int | None = segment.index + 1
            contradicted = self._count is not None or any(i > segment.index for i in self._data)
        else:
            count = self._count
            contradicted = count is not None and segment.index >= count
        if contradicted:
            raise FrameError(
                f"segment {segment.number}: expected one message, found two that overlap"
            )
        self._count = count
        self._data[segment.index] = segment.data
        if count is None or len(self._data) < count:
            return None
        return b"".join(self._data[index] for index in range(count)), count
