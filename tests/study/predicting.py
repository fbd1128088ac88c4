"""How right the predicted rover is, by what was stated."""

from bisect import bisect_left
from collections import deque
from collections.abc import Sequence
from typing import Any

from farside.node import Record
from farside.topics import (
    GROUND_PREDICTION,
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    ROVER_CYCLE,
    Prediction,
)

SURE = 0.9995
"""Stated for a rover that stands."""

BINS = 10
"""Of stated probability, for the reliability diagram."""


class Judge:
    """Compares every prediction of where the rover is now with where it knew itself to be then.

    A prediction of a rover that stands, to which nothing is on its way, is right for nothing. So
    those that are sure of where it was last heard do not count, unless they are wrong.

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
        self._sensed: list[tuple[int, str]] = []

    def add(self, records: Sequence[Record], until_ns: int) -> None:
        """Take the records of a window that ends at `until_ns`."""
        for record in records:
            if record.topic in {GROUND_TELEMETRY.name, GROUND_STORED_TELEMETRY.name}:
                telemetry = GROUND_TELEMETRY.decode(record.payload)
                if telemetry.time_ns > self._heard[0]:
                    place = next((t for t in telemetry.tokens if t.startswith("at:")), None)
                    self._heard = telemetry.time_ns, place
            elif record.topic == GROUND_PREDICTION.name:
                prediction = GROUND_PREDICTION.decode(record.payload)
                if prediction.command is None:
                    self._open.append((prediction, self._heard[1]))
            elif record.topic == ROVER_CYCLE.name:
                tokens = ROVER_CYCLE.decode(record.payload).tokens
                place = next((token for token in tokens if token.startswith("at:")), "")
                self._sensed.append((record.log_time_ns, place))
        while self._open and self._open[0][0].at_ns < until_ns:
            self._judge(*self._open.popleft())
        del self._sensed[:-1]

    def _judge(self, prediction: Prediction, heard: str | None) -> None:
        """By what the rover had last sensed at that moment."""
        after = bisect_left(self._sensed, (prediction.at_ns, ""))
        place = self._sensed[max(0, after - 1)][1]
        top = prediction.likely[0] if prediction.likely else None
        if heard == place and top is not None and top.sign == (place,) and top.probability > SURE:
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
