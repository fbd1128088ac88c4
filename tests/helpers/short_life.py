"""A short mission to be lived again, and orders for it from outside."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mcap.reader import make_reader
from numpy.random import Generator

from farside.acts import Act
from farside.control import Mode
from farside.ground import Situation
from farside.logs import LogFile, Recorder
from farside.messages import Drive, SetGoal, SetMode
from farside.node import Record, Topic, to_ns
from farside.topics import OperatorEntry

SHORT: dict[str, Any] = {
    "duration_s": 75.0,
    "tick_s": 0.1,
    "world.map": "#####\n#A.B#\n#.#.#\n#D.C#\n#####",
    "rover.start": "D",
    "link.up.delay_s": 0.3,
    "link.down.delay_s": 0.3,
    "rover.failsafe": {"hold_after_s": 5.0, "lost_after_s": 15.0},
    "rover.goals": [{"place": "C"}],
    "ground.script": [
        {"do": "tour", "places": ["C", "B", "D"]},
        {"do": "mode", "mode": "shared"},
        {"do": "goal", "place": "A"},
        {"do": "goal", "place": "B"},
        {"do": "goal", "place": "D"},
    ],
    "link.up.loss": 0.05,
    "link.down.loss": 0.05,
    "link.blackouts": [{"start_s": 42.0, "end_s": 67.0}],
    "expect": [{"what": "reached", "place": "B"}],
}
"""A tour, goals, and a blackout that is long enough for the rover to go on alone."""

ORDERS: Sequence[tuple[float, Act]] = (
    (3.0, Drive("E")),
    (3.0, Drive("E")),
    (17.3, SetMode(Mode.SHARED)),
    (17.31, SetGoal(("at:D",), 1.0)),
    (25.0, SetMode(Mode.GUIDED)),
    (33.5, Drive("N")),
)

QUEUED: dict[str, Any] = {
    **SHORT,
    "duration_s": 40.0,
    "ground.operator": "queued",
    "ground.script": [],
}
"""The same, of half the length, for orders from outside."""


class Failing:
    """An operator who orders a drive at the start, and fails at 20 s."""

    progress = OperatorEntry(0, 0, None)

    def __init__(self, chart: object, rng: Generator) -> None:
        del chart, rng

    def act(self, situation: Situation) -> Sequence[Act]:
        if situation.now_ns >= to_ns(20):
            raise RuntimeError("out of ideas")
        return [Drive("E")] if situation.now_ns == 0 else []


def forged(
    log: Path,
    path: Path,
    records: Iterable[Record] | None = None,
    metadata: Mapping[str, dict[str, str]] = {},
    attachments: Mapping[str, bytes] = {},
) -> Path:
    """A copy of a log with other records, other metadata, or other attachments."""
    original = LogFile(log)
    with Recorder(path) as recorder:
        for name, attachment in original.attachments.items():
            data = attachments.get(name, attachment.data)
            recorder.attach(name, attachment.media_type, data)
        recorder.write(original.records() if records is None else records)
        for group, values in {**original.metadata, **metadata}.items():
            recorder.metadata(group, dict(values))
    return path


def damaged(log: Path, path: Path, topic: Topic[Any] | None = None) -> Path:
    """A copy of a log with one byte changed in the last chunk, or the last that has `topic`."""
    with log.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    numbers = {channel.topic: number for number, channel in summary.channels.items()}
    last = [
        chunk
        for chunk in summary.chunk_indexes
        if topic is None or numbers[topic.name] in chunk.message_index_offsets
    ][-1]
    content = bytearray(log.read_bytes())
    content[last.chunk_start_offset + last.chunk_length - 5] ^= 1
    path.write_bytes(content)
    return path
