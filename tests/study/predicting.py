"""How right the predicted rover is: against the true one, by what was stated."""

from bisect import bisect_left
from collections import deque
from collections.abc import Sequence
from typing import Any

from farside.node import Record
from farside.topics import (
    GROUND_PREDICTION,
    GROUND_TELEMETRY,
    TRUTH_POSE,
    Prediction,
)

BINS = 10
"""Of stated probability, for the reliability diagram."""


class Judge:
    """Compares every prediction of where the rover is now with where it truly was.

    A prediction of a rover that stands, to which nothing is on its way, is right for nothing. So
    only those count of which the rover was elsewhere than last heard, or predicted to be.

    Attributes:
        stated, cases, right: per bin of the probability stated for the most probable place: the
            sum of what was stated, the number of cases, and how many of them were right.
        silent: cases in which nothing could be said.
        naive: in how many cases the rover was where it was last heard to be.
    """

    def __init__(self) -> None:
        self.stated = [0.0] * BINS
        self.cases = [0] * BINS
        self.right = [0] * BINS
        self.silent = self.naive = 0
        self._open: deque[tuple[Prediction, str | None]] = deque()
        self._heard: tuple[int, str | None] = (-1, None)
        self._poses: list[tuple[int, str]] = []

    def add(self, records: Sequence[Record]) -> None:
        """Take the records of a window."""
        for record in records:
            if record.topic == GROUND_TELEMETRY.name:
                telemetry = GROUND_TELEMETRY.decode(record.payload)
                if telemetry.time_ns > self._heard[0]:
                    place = next((t for t in telemetry.tokens if t.startswith("at:")), None)
                    self._heard = telemetry.time_ns, place
            elif record.topic == GROUND_PREDICTION.name:
                prediction = GROUND_PREDICTION.decode(record.payload)
                if prediction.command is None:
                    self._open.append((prediction, self._heard[1]))
            elif record.topic == TRUTH_POSE.name:
                pose = TRUTH_POSE.decode(record.payload)
                self._poses.append((record.log_time_ns, pose.place))
        while self._open and self._poses and self._open[0][0].at_ns <= self._poses[-1][0]:
            self._judge(*self._open.popleft())
        earliest_ns = self._open[0][0].at_ns if self._open else self._poses[-1][0]
        keep = max(0, bisect_left(self._poses, (earliest_ns, "")) - 1)
        del self._poses[:keep]

    def _judge(self, prediction: Prediction, heard: str | None) -> None:
        """By the true pose that is nearest in time: there is one a second."""
        after = bisect_left(self._poses, (prediction.at_ns, ""))
        near = self._poses[max(0, after - 1) : after + 1]
        _, place = min(near, key=lambda pose: abs(pose[0] - prediction.at_ns))
        top = prediction.likely[0] if prediction.likely else None
        if heard == place and top is not None and top.sign == (place,):
            return
        self.naive += heard == place
        if top is None:
            self.silent += 1
            return
        index = min(BINS - 1, int(top.probability * BINS))
        self.stated[index] += top.probability
        self.cases[index] += 1
        self.right[index] += top.sign == (place,)

    def told(self) -> dict[str, Any]:
        """What came of it, for the results."""
        return {
            "stated": [round(value, 3) for value in self.stated],
            "cases": self.cases,
            "right": self.right,
            "silent": self.silent,
            "naive": self.naive,
        }
