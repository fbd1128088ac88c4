"""`make bench`: how soon a hand on a stick feels what the ground thinks of where it goes.

SDL's own virtual pad is moved and tells when it is made to rumble; everything between is what
`farside console --stick` runs. The rover is 20 minutes of light time away.
"""

import random
import statistics
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from queue import SimpleQueue

from rich.console import Console
from rich.table import Table
from virtual_stick import StationStub, VirtualStick, options, screen_of

from farside.console.stick.device import HostStick

MOVEMENTS = 200
LIMIT_MS = 50.0


def stick_latency() -> list[float]:
    """Wall milliseconds from each movement of the stick to the call that makes it rumble."""
    station = StationStub(screen_of(options(E="problematic", W="invalid")))
    said: SimpleQueue[str] = SimpleQueue()
    chance = random.Random(1)  # noqa: S311 - no secret
    latencies_ms = []
    with VirtualStick() as pad, HostStick(station, None, say=said.put):
        said.get(timeout=10)
        for number in range(MOVEMENTS):
            time.sleep(chance.uniform(0.0, 0.02))  # anywhere between two polls
            moved_ns = time.perf_counter_ns()
            pad.push(0.6 if number % 2 else -0.6, 0.0)
            _, felt_ns = pad.wait(lambda level: level > 0)
            latencies_ms.append((felt_ns - moved_ns) / 1e6)
            pad.push(0.0, 0.0)
            pad.wait(lambda level: level == 0)
            while not pad.rumbles.empty():
                pad.rumbles.get()
    return latencies_ms


@contextmanager
def _busy() -> Iterator[None]:
    """A thread of this process that never pauses, as of a run in it that cannot keep its pace."""
    over = threading.Event()

    def reckon() -> None:
        while not over.is_set():
            sum(range(1000))

    working = threading.Thread(target=reckon)
    working.start()
    try:
        yield
    finally:
        over.set()
        working.join()


def main() -> None:
    """Print the latencies."""
    table = Table("stick to rumble", "median", "p99", "worst", "line")
    for name, beside in (("nothing else", nullcontext()), ("a busy thread", _busy())):
        with beside:
            latencies_ms = stick_latency()
        p99_ms = statistics.quantiles(latencies_ms, n=100)[98]
        table.add_row(
            name,
            f"{statistics.median(latencies_ms):.1f} ms",
            f"{p99_ms:.1f} ms",
            f"{max(latencies_ms):.1f} ms",
            f"{LIMIT_MS:g} ms",
        )
    Console().print(table)


if __name__ == "__main__":
    main()
