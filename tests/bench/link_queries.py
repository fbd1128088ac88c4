"""Queries through `farside link`, beside a bare Zenoh relay, and beside nothing in between.

The bare relay is all that Python needs to pass queries on: a queryable whose callback asks on the
other side. Beside it the same queryable is asked directly, by a client of its own router. The
queries are kept `AT_ONCE` open; latencies are those of one at a time. Every figure is the median of
several runs, taken in turn. The limit is that of the issue tracker; nothing here fails.
"""

import json
import statistics
import sys
import threading
import time
from collections.abc import Callable

import zenoh
from bench_zenoh import client, open_router, started
from rich.console import Console
from rich.progress import track
from rich.table import Table

ROUNDS = 5
QUERIES, AT_ONCE = 10_000, 64
ALONE = 1_000
KEY = "tlm/count"

DIRECT, BARE, LINK = "asked directly", "bare relay", "farside link"

Run = tuple[float, float, float]
"""Queries per second, and the median and 99th percentile of the seconds from query to reply."""


def _hear(
    take: Callable[[zenoh.Reply], None], end: Callable[[], None]
) -> "zenoh.handlers.Callback[zenoh.Reply]":
    """A callback in the thread that receives."""
    return zenoh.handlers.Callback(take, end, indirect=False)


def serve() -> None:
    """The rover's side: replies to every query."""
    session, locator = open_router()

    def answer(query: zenoh.Query) -> None:
        with query:
            query.reply(KEY, bytes(64))

    session.declare_queryable(KEY, zenoh.handlers.Callback(answer, indirect=False))
    print(locator, flush=True)  # noqa: T201
    sys.stdin.read()
    session.close()


def ask(locator: str | None) -> None:
    """The ground's side, or a client of the rover's: asks, and says how fast it was answered."""
    session, own = open_router() if locator is None else (client(locator), "")
    print(own, flush=True)  # noqa: T201
    sys.stdin.readline()
    while not list(session.get(KEY)):
        time.sleep(0.01)
    rates_hz = []
    # The first ones are slower.
    for number, at_once in ((ALONE, AT_ONCE), (QUERIES, AT_ONCE), (ALONE, 1)):
        taken_s, late_s = _ask(session, number, at_once)
        rates_hz.append(number / taken_s)
    late_s.sort()
    answer = rates_hz[1], late_s[len(late_s) // 2], late_s[len(late_s) * 99 // 100]
    print(json.dumps(answer), flush=True)  # noqa: T201
    session.close()


def _ask(session: zenoh.Session, number: int, at_once: int) -> tuple[float, list[float]]:
    free, late_s = threading.Semaphore(at_once), list[float]()

    def one() -> None:
        asked_s = time.perf_counter()
        take = _hear(lambda _: late_s.append(time.perf_counter() - asked_s), free.release)
        session.get(KEY, take, payload=bytes(64))

    began_s = time.perf_counter()
    for _ in range(number):
        free.acquire()
        one()
    for _ in range(at_once):
        free.acquire()
    if len(late_s) != number:
        raise RuntimeError(f"expected {number} replies, found {len(late_s)}")
    return time.perf_counter() - began_s, late_s


def relay(rover: str, ground: str) -> None:
    """Passes queries and replies on with nothing in between, until it is told to stop."""
    near, far = client(ground), client(rover)

    def take(query: zenoh.Query) -> None:
        def give(reply: zenoh.Reply) -> None:
            if reply.ok is not None:
                query.reply(reply.ok.key_expr, reply.ok.payload)

        far.get(query.selector, _hear(give, query.drop), payload=query.payload)

    near.declare_queryable("tlm/**", zenoh.handlers.Callback(take, indirect=False))
    sys.stdin.read()
    near.close()
    far.close()


def measure(between: str) -> Run:
    """Start all, and ask."""
    here = [sys.executable, __file__]
    with started(*here, "serve") as rover:
        at = rover.stdout.readline().strip()
        with started(*here, "ask", *([at] if between == DIRECT else [])) as ground:
            own = ground.stdout.readline().strip()
            link = [sys.executable, "-m", "farside", "link", "--down", "tlm/**"]
            line = {
                DIRECT: ["true"],
                BARE: [*here, "relay", at, own],
                LINK: [*link, "--rover-side", at, "--ground-side", own],
            }[between]
            with started(*line):
                ground.stdin.write("\n")
                ground.stdin.flush()
                rate_hz, p50_s, p99_s = json.loads(ground.stdout.readline())
                return rate_hz, p50_s, p99_s


def main() -> None:
    """Measure, and print the table."""
    console = Console()
    runs: dict[str, list[Run]] = {one: [] for one in (DIRECT, BARE, LINK)}
    for _ in track(range(ROUNDS), "measuring", console=console):
        for between, done in runs.items():
            done.append(measure(between))
    medians = {
        between: [statistics.median(column) for column in zip(*done, strict=True)]
        for between, done in runs.items()
    }
    table = Table("queries", "queries/s", "of the bare relay", "of direct", "p50", "p99")
    table.caption = (
        f"limit: 0.5 of the bare relay. {AT_ONCE} open at once; latencies of one at a time."
    )
    for between, (rate_hz, p50_s, p99_s) in medians.items():
        shares = (f"{rate_hz / medians[other][0]:.2f}" for other in (BARE, DIRECT))
        times = (f"{one_s * 1e3:.2f} ms" for one_s in (p50_s, p99_s))
        table.add_row(between, f"{rate_hz:,.0f}", *shares, *times)
    console.print(table)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["serve"]:
            serve()
        case ["ask"]:
            ask(None)
        case ["ask", rover_side]:
            ask(rover_side)
        case ["relay", rover_side, ground_side]:
            relay(rover_side, ground_side)
        case _:
            main()
