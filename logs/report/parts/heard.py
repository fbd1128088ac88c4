"""What came down to the ground, with when it was so and when it was known; and its prediction."""

from collections import Counter
from typing import Any

from farside.frames import FrameEvent, FrameStage
from farside.logs.events import sign_text
from farside.logs.file.reading import LogEntry
from farside.logs.report.model import Heard, Panel, Predicted, Side, View
from farside.logs.report.parts.link import Buckets
from farside.logs.report.thinning import (
    Curve,
    Rows,
    Waypoints,
    ms,
    steps,
    thinning_note,
)
from farside.messages import Telemetry
from farside.node import Direction, Topic, to_s
from farside.topics import (
    GROUND_FRAME,
    GROUND_PREDICTION,
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    Prediction,
)

_ROWS = 30_000
_PREDICTED = 2000
_LIKELY = 6
_GAPS, _LEAST_GAP = 5, 5000  # of the usual distance between two measurements; ms


class _Words:
    """Words with numbers, in the order in which they first came."""

    def __init__(self) -> None:
        self.numbers: dict[str, int] = {}

    def number(self, word: str) -> int:
        return self.numbers.setdefault(word, len(self.numbers))


class HeardAtGround:
    """Telemetry and predictions."""

    topics: tuple[Topic[Any], ...] = (
        GROUND_TELEMETRY,
        GROUND_STORED_TELEMETRY,
        GROUND_PREDICTION,
        GROUND_FRAME,
    )

    def __init__(self, side: Side) -> None:
        self._words = _Words()
        # Mode, failsafe and goals stay to the row; battery and action go with the place.
        self._rows: Waypoints[tuple[int, ...]] = Waypoints(_ROWS, t=1, same=(5, 6, 8))
        self._last: dict[str, int] = {}
        self._distances: Counter[int] = Counter()
        self._charge, self._delay = Curve(side.until_ns), Curve(side.until_ns)
        self._bits = Buckets(side.until_ns)
        self._predicted: Rows[Predicted] = Rows(_PREDICTED)
        self._likely: tuple[Any, ...] = ()

    def take(self, entry: LogEntry) -> None:
        """See `Gatherer`."""
        match entry.message:
            case Telemetry() as telemetry:
                self._take_telemetry(telemetry, entry)
            case Prediction() as predicted if predicted.command is None:
                self._take_prediction(predicted, entry.log_time_ns)
            case FrameEvent(stage=FrameStage.USED, direction=Direction.DOWN, size_byte=size_byte):
                self._bits.add(entry.log_time_ns, size_byte * 8)

    def _take_telemetry(self, told: Telemetry, entry: LogEntry) -> None:
        known_ns, live = entry.log_time_ns, entry.topic == GROUND_TELEMETRY.name
        action = "standing" if told.action is None else told.action
        words = told.mode, told.failsafe, action, ", ".join(map(sign_text, told.goals)) or "none"
        numbers = tuple(map(self._words.number, words))
        last = self._last.get(entry.topic)
        so = ms(told.time_ns)
        place = round(told.x_m * 100), round(told.y_m * 100)
        row = (ms(known_ns), so, *place, round(told.battery * 1000), *numbers)
        self._rows.add(row)
        if last is not None:
            self._distances[(so - last) // 100] += 1
        self._last[entry.topic] = so
        self._charge.add(told.time_ns, told.battery, known_ns)
        if live:
            self._delay.add(told.time_ns, to_s(known_ns - told.time_ns), known_ns)

    def _take_prediction(self, predicted: Prediction, now_ns: int) -> None:
        if predicted.likely == self._likely:
            return
        self._likely = predicted.likely
        places = [
            (sign_text(likely.sign), round(likely.probability, 3))
            for likely in predicted.likely[:_LIKELY]
        ]
        row = Predicted(ms(now_ns), ms(predicted.from_ns), places, round(predicted.unknown, 3))
        self._predicted.add(row)

    def fill(self, view: View) -> None:
        """See `Gatherer`."""
        rows = self._rows.rows
        columns: list[list[int]] = [list(column) for column in zip(*rows, strict=True)] or [
            [] for _ in range(9)
        ]
        usual = max(((n, -apart) for apart, n in self._distances.items()), default=(0, 0))
        gap = max(_LEAST_GAP, _GAPS * -usual[1] * 100) + self._rows.apart_ms
        known, so, x, y, battery, mode, failsafe, action, goals = columns
        view.heard = Heard(
            known=steps(known),
            so=steps(so),
            x=x,
            y=y,
            battery=battery,
            mode=mode,
            failsafe=failsafe,
            action=action,
            goals=goals,
            words=list(self._words.numbers),
            gap=gap,
        )
        view.predicted = self._predicted.rows
        view.notes += self._rows.note("Telemetry")
        if self._predicted.every > 1:
            view.notes.append(f"Predictions of the ground: 1 of {self._predicted.every}")
        view.panels += [
            Panel("Battery, as told", "%", [self._charge.series("charge on board")], top=1.0),
            Panel("Delay of live telemetry", "s", [self._delay.series("from measured to heard")]),
            Panel(
                f"Rate received, in spans of {self._bits.width_text}",
                "bit/s",
                [self._bits.rates("downlink", known=True)],
            ),
        ]
        view.notes += thinning_note("Battery and delay", [self._charge, self._delay])
