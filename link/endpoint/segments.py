"""What the reliable service puts into frames: segments of messages, and reception reports."""

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
    """Part of a message.

    Attributes:
        number: its number in the stream of all segments.
        index: its index in the message.
        last: whether it is the last of the message.
        data: its part of the message.
    """

    number: _Natural
    index: _Natural
    last: bool
    data: bytes


class ReceptionReport(msgspec.Struct, frozen=True, array_like=True, tag=2):
    """Which segments had arrived when the report was made.

    Attributes:
        made_ns: when it was made.
        base: the first segment that has not arrived.
        skipped: how many segments from `base` on another report covers.
        runs: lengths of the runs after those: missing, arrived, missing, ..., arrived.
        rest: whether all segments after the runs are missing; if not, another report covers them.
    """

    made_ns: _Natural
    base: _Natural
    skipped: _Natural
    runs: tuple[Annotated[int, Meta(ge=1)], ...]
    rest: bool


encode_part = msgspec.msgpack.Encoder().encode
"""Encode a segment or a reception report (MessagePack)."""

_decoder: msgspec.msgpack.Decoder[Segment | ReceptionReport] = msgspec.msgpack.Decoder(
    Segment | ReceptionReport
)


def decode_part(payload: bytes) -> Segment | ReceptionReport:
    """The segment or reception report that `encode_part` encoded.

    Raises:
        FrameError: if it is neither.
    """
    return unpack(payload, _decoder)


class Coverage:
    """A reception report, indexed by segment number.

    Attributes:
        end: no segment from this number on is reported to have arrived.
    """

    def __init__(self, report: ReceptionReport) -> None:
        self._report = report
        self._first = report.base + report.skipped
        self._ends = list(accumulate(report.runs, initial=self._first))
        self.end = self._ends[-1] if report.runs else report.base

    def has(self, number: int) -> bool | None:
        """Whether a segment has arrived; `None` if another report covers it."""
        if number < self._report.base:
            return True
        if number < self._first:
            return None
        if number >= self._ends[-1]:
            return False if self._report.rest else None
        return bisect_right(self._ends, number) % 2 == 0


def reception_reports(
    base: int, beyond: Collection[int], made_ns: int, size_byte: int
) -> list[ReceptionReport]:
    """What has arrived, in as many reports as needed to keep each within `size_byte`.

    Args:
        base: the first segment that has not arrived.
        beyond: the segments after it that have.
        made_ns: the time now.
        size_byte: the longest report, at least 64.
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
        reports.append(ReceptionReport(made_ns, base, skipped, part, rest))
        skipped += sum(part)
    return reports


class PartialMessage:
    """The segments of one message that have arrived so far."""

    def __init__(self) -> None:
        self._data: dict[int, bytes] = {}
        self._count: int | None = None

    def add(self, segment: Segment) -> tuple[bytes, int] | None:
        """Add a segment that is new; returns the message and its segment count once complete.

        Raises:
            FrameError: if it contradicts the segments that have arrived.
        """
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
