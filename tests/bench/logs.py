"""`python tests/bench/logs.py`: what a log costs to write, to summarise, and to look into.

The large logs are the blackout mission over and over, shifted in time, so that they hold what
Farside's logs hold, pictures included. Times are the processor's, so that other work on the machine
counts little; only that of a command is by the clock. Both sides of a ratio are measured in one
run, one after the other, so that a drift in the machine's speed affects both.
"""

import random
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from itertools import zip_longest
from pathlib import Path

import msgspec
import numpy as np
from mcap.opcode import Opcode
from mcap.reader import make_reader
from rich.console import Console
from rich.table import Table

from farside.logs import LogFile, Recorder, RunView, picture_at
from farside.logs.file.mcap_bytes import HEAD, MESSAGE_HEAD
from farside.logs.file.packing import pack
from farside.logs.file.parts import Block
from farside.messages import Telemetry
from farside.missions import load_mission, run_mission
from farside.missions.expectations import judge
from farside.node import Direction, to_ns
from farside.topics import (
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    ROVER_GOAL,
    ROVER_MODE,
    TRUTH_POSE,
)

MESSAGES = 1_000_000
BYTES = 1 << 30
ROUNDS = 3
SEEKS = 9
PERIOD_NS = to_ns(1200)
_TIME_AT = HEAD.size + 2 + 4  # of a message: behind its head, its channel and its sequence


class Repeated(LogFile):
    """A log whose run happens again and again, one after the other, `times` times."""

    def __init__(self, path: Path, times: int) -> None:
        super().__init__(path)
        self._times = times

    def contents(self) -> Iterator[tuple[Block, bytes]]:
        """See `LogFile.contents`."""
        chunks = [(block, Shifted(data, self)) for block, data in super().contents()]
        for number in range(self._times):
            for block, shifted in chunks:
                yield block, shifted.by(number * PERIOD_NS)


class Shifted:
    """The records of a chunk, whose times can be moved: log times, and those inside telemetry.

    Args:
        data: the records.
        log: the log that they are of.
    """

    def __init__(self, data: bytes, log: LogFile) -> None:
        heard = {GROUND_TELEMETRY.name, GROUND_STORED_TELEMETRY.name}
        telling = {n for n, channel in log.index.channels.items() if channel.topic in heard}
        self._telemetry: list[tuple[tuple[int, ...], Telemetry]] = []
        self._rows: list[bytes] = []
        starts, at, row = [], 0, 0
        while at < len(data):
            head = MESSAGE_HEAD.unpack_from(data, at)
            begin, end = at + MESSAGE_HEAD.size, at + HEAD.size + head[1]
            if head[0] == Opcode.MESSAGE and head[2] in telling:
                self._rows.append(data[row:at])
                self._telemetry.append((head, GROUND_TELEMETRY.decode(data[begin:end])))
                row = end
            elif head[0] == Opcode.MESSAGE:
                starts.append(sum(map(len, self._rows)) + at - row + _TIME_AT)
            at = end
        self._rows.append(data[row:])
        self._places = np.array(starts, np.int64)[:, None] + np.arange(8)
        self._joined = np.frombuffer(b"".join(self._rows), np.uint8)

    def by(self, shift_ns: int) -> bytes:
        """The records, `shift_ns` later."""
        shifted = self._joined.copy()
        times_ns = shifted[self._places].view(np.uint64) + np.uint64(shift_ns)
        shifted[self._places] = times_ns.view(np.uint8)
        joined, parts, at = shifted.tobytes(), [], 0
        for row, told in zip_longest(self._rows, self._telemetry):
            parts.append(joined[at : at + len(row)])
            at += len(row)
            if told is not None:
                parts.append(_later(told[0], told[1], shift_ns))
        return b"".join(parts)


def _later(head: tuple[int, ...], told: Telemetry, shift_ns: int) -> bytes:
    """A message of telemetry, `shift_ns` later."""
    opcode, _, channel, sequence, log_time_ns, publish_time_ns = head
    payload = msgspec.json.encode(msgspec.structs.replace(told, time_ns=told.time_ns + shift_ns))
    length = MESSAGE_HEAD.size - HEAD.size + len(payload)
    times_ns = log_time_ns + shift_ns, publish_time_ns + shift_ns
    return MESSAGE_HEAD.pack(opcode, length, channel, sequence, *times_ns) + payload


def large_log(run: Path, times: int, path: Path) -> LogFile:
    """A packed log of so many runs."""
    pack(Repeated(run, times), path)
    return LogFile(path)


# --- summarising -------------------------------------------------------------------------------


def bare_reader(path: Path) -> float:
    """Seconds in which the `mcap` library goes over all messages."""
    began = time.process_time()
    with path.open("rb") as file:
        for _ in make_reader(file).iter_messages():
            pass
    return time.process_time() - began


def summary(path: Path) -> float:
    """Seconds in which a log is opened, and all is asked that the result of a run says."""
    began = time.process_time()
    view = RunView(LogFile(path))
    for expectation in load_mission("blackout").mission.expect:
        judge(expectation, view)
    _ = view.goals, view.modes, view.store, view.dem, view.shadow, view.operator
    _ = view.least_charge, view.flat_since_s, view.stuck_since_s
    for direction in Direction:
        view.link_counters(direction)
    return time.process_time() - began


def glance(path: Path) -> float:
    """Seconds of `farside info`, its start included."""
    began = time.perf_counter()
    subprocess.run(  # noqa: S603
        [sys.executable, "-m", "farside", "info", path], check=True, stdout=subprocess.DEVNULL
    )
    return time.perf_counter() - began


# --- seeking -----------------------------------------------------------------------------------


def seek_s(log: LogFile, look: Callable[[LogFile, int], object]) -> float:
    """The longest time that a look at a random moment took, each in a log just opened."""
    times_ns = random.Random(1).sample(range(log.end_ns), SEEKS)  # noqa: S311
    took = []
    for time_ns in times_ns:
        began = time.process_time()
        look(LogFile(log.path), time_ns)
        took.append(time.process_time() - began)
    return max(took)


def latest(log: LogFile, time_ns: int) -> None:
    """The last word on some topics, rare and frequent."""
    for topic in (TRUTH_POSE, GROUND_TELEMETRY, ROVER_MODE, ROVER_GOAL):
        log.latest(topic, time_ns)


# --- recording ---------------------------------------------------------------------------------


def recording_share(folder: Path, *, in_process: bool) -> float:
    """Share of the time of a run that `Recorder` takes, packing included, in %.

    Of the time of the processor in one process, by the clock where the nodes have their own.
    """
    clock = time.process_time if in_process else time.perf_counter
    spent = 0.0

    def timed(name: str) -> Callable[..., object]:
        inner = getattr(Recorder, name)

        def call(*arguments: object, **named: object) -> object:
            nonlocal spent
            began = clock()
            try:
                return inner(*arguments, **named)
            finally:
                spent += clock() - began

        return call

    names = ("__init__", "attach", "metadata", "write", "flush", "close")
    kept = {name: Recorder.__dict__[name] for name in names}
    try:
        for name in names:
            setattr(Recorder, name, timed(name))
        began = clock()
        run_mission(load_mission("blackout"), in_process=in_process, out=folder)
        whole = clock() - began
    finally:
        for name, method in kept.items():
            setattr(Recorder, name, method)
    return 100 * spent / whole


def table(folder: Path) -> Table:
    """Measure, and tabulate the figures."""
    shares = {
        in_process: [recording_share(folder, in_process=in_process) for _ in range(ROUNDS)]
        for in_process in (False, True)
    }
    run = next(folder.glob("*.mcap"))
    one = LogFile(run)
    count = sum(messages for messages, _ in one.sizes().values())
    found = Table("measure", "figure", "limit")
    for in_process, found_shares in shares.items():
        how = "in one process" if in_process else "in four processes"
        what = f"recording, share of a run {how} (%)"
        found.add_row(what, f"{statistics.median(found_shares):.1f}", "10")
    log = large_log(run, -(-MESSAGES // count), folder / "million.mcap")
    ratios, bare = [], []
    for _ in range(ROUNDS):
        bare.append(bare_reader(log.path))
        ratios.append(summary(log.path) / bare[-1])
    messages = sum(number for number, _ in log.sizes().values())
    found.add_row(
        f"opening and summarising {messages:,} messages / bare mcap reader "
        f"({statistics.median(bare):.1f} s)",
        f"{statistics.median(ratios):.2f}",
        "1.3",
    )
    # A tenth of a run's log is what it holds once, such as schemas.
    large = large_log(run, -(-10 * BYTES // (9 * run.stat().st_size)), folder / "gigabyte.mcap")
    size = f"{large.size_byte / 1e9:.2f} GB"
    found.add_row(f"opening {size} (s)", f"{seek_s(large, lambda *_: None):.2f}")
    found.add_row(f"farside info of {size} (s)", f"{glance(large.path):.2f}", "0.3")
    found.add_row(f"latest of four topics in {size} (s)", f"{seek_s(large, latest):.2f}", "1")
    found.add_row(f"picture_at in {size} (s)", f"{seek_s(large, picture_at):.2f}", "1")
    found.add_row(
        f"picture_at as ground in {size} (s)",
        f"{seek_s(large, lambda log, time_ns: picture_at(log.as_ground(time_ns), time_ns)):.2f}",
        "1",
    )
    return found


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as name:
        Console().print(table(Path(name)))
