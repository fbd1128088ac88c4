"""`farside link` on a wall clock, beside a bare Zenoh relay between the same two programs.

The bare relay is all that Python needs to pass messages on: a subscriber whose callback puts. Every
figure is the median of several runs, the emulators and the bare relay taken in turn. The limits are
those of the issue tracker; nothing here fails.
"""

import json
import statistics
import struct
import subprocess
import sys
import time
from pathlib import Path
from typing import NamedTuple

import zenoh
from bench_zenoh import client, open_router, started
from rich.console import Console
from rich.progress import track
from rich.table import Table

ROUNDS = 5
FLOOD = 100_000
PACED, PACE_HZ = 5_000, 1_000
IN_FLIGHT = 1_000_000
DELAY_S = 0.1

BARE = "bare relay"
DELAYED = f"farside link, {DELAY_S:g} s"
AFAR = "farside link, 20 min"
IMPAIRED = f"farside link, {DELAY_S:g} s, rate, bursts of loss, jitter, duplicates, bit errors"
SETTINGS = {
    DELAYED: [f"down.delay_s={DELAY_S}"],
    AFAR: ["down.delay_s=1200"],
    IMPAIRED: [
        f"down.delay_s={DELAY_S}",
        "down.rate_bit_s=1000000000",
        "down.queue_byte=1000000000",
        'down.loss={model="gilbert-elliott", p=0.001, r=0.3}',
        "down.jitter={spread_s=0.0001}",
        "down.duplicate=0.001",
        "down.bit_error_rate=0.000001",
    ],
}


class Run(NamedTuple):
    """What a relay did: messages per second, and seconds from put to callback beyond the delay."""

    rate_hz: float
    p50_s: float
    p99_s: float


def source() -> None:
    """The rover's side: sends a flood, or at a pace, as standard input says."""
    session, locator = open_router()
    print(locator, flush=True)  # noqa: T201
    for line in sys.stdin:
        publisher = session.declare_publisher("tlm/count")
        # Zenoh declares this a bool, and gives an object that is always true.
        while not publisher.matching_status.matching:  # type: ignore[attr-defined]
            time.sleep(0.001)
        number, pause_s = json.loads(line)
        due_s = time.monotonic()
        for _ in range(number):
            if pause_s:
                due_s += pause_s
                time.sleep(max(0.0, due_s - time.monotonic()))
            session.put(
                "tlm/count",
                struct.pack("<q56x", time.monotonic_ns()),
                congestion_control=zenoh.CongestionControl.BLOCK,
            )
    session.close()


def sink() -> None:
    """The ground's side: says how many came, how fast, and how late."""
    session, locator = open_router()
    print(locator, flush=True)  # noqa: T201
    came: list[tuple[int, int]] = []

    def hear(sample: zenoh.Sample) -> None:
        came.append((time.monotonic_ns(), struct.unpack_from("<q", sample.payload.to_bytes())[0]))

    session.declare_subscriber("tlm/count", hear)
    for line in sys.stdin:
        expected = json.loads(line)
        # Some are lost; whoever is still under way then comes within this time.
        while len(came) < expected:
            before = len(came)
            time.sleep(1.0)
            if before and len(came) == before:
                break
        late_s = sorted((heard_ns - sent_ns) / 1e9 for heard_ns, sent_ns in came)
        taken_s = (came[-1][0] - came[0][0]) / 1e9
        answer = len(came) / taken_s, late_s[len(late_s) // 2], late_s[len(late_s) * 99 // 100]
        came.clear()
        print(json.dumps(answer), flush=True)  # noqa: T201
    session.close()


def bare_relay(rover: str, ground: str) -> None:
    """Passes messages on with nothing in between, until it is told to stop."""
    near, far = (client(locator) for locator in (rover, ground))
    near.declare_subscriber(
        "tlm/**",
        lambda sample: far.put(
            sample.key_expr, sample.payload, congestion_control=zenoh.CongestionControl.BLOCK
        ),
    )
    sys.stdin.read()
    near.close()
    far.close()


def command(relay: str, rover: str, ground: str) -> list[str]:
    """The command line that starts a relay."""
    if relay == BARE:
        return [sys.executable, __file__, "relay", rover, ground]
    sides = ["--rover-side", rover, "--ground-side", ground, "--down", "tlm/**"]
    settings = [f"--set={setting}" for setting in SETTINGS[relay]]
    return [
        sys.executable,
        "-m",
        "farside",
        "link",
        *sides,
        "--json",
        *settings,
    ]


def measure(relay: str) -> Run:
    """Start all, send a flood, then at a pace."""
    with (
        started(sys.executable, __file__, "source") as rover,
        started(sys.executable, __file__, "sink") as ground,
    ):
        locators = [process.stdout.readline().strip() for process in (rover, ground)]
        with started(*command(relay, *locators)):
            delay_s = 0.0 if relay == BARE else DELAY_S
            _send(rover, ground, 100, 0.001)
            rate_hz, _, _ = _send(rover, ground, FLOOD, 0.0)
            _, p50_s, p99_s = _send(rover, ground, PACED, 1 / PACE_HZ)
            return Run(rate_hz, p50_s - delay_s, p99_s - delay_s)


def _send(
    rover: "subprocess.Popen[str]", ground: "subprocess.Popen[str]", number: int, pause_s: float
) -> list[float]:
    for process, order in ((ground, number), (rover, (number, pause_s))):
        process.stdin.write(json.dumps(order) + "\n")
        process.stdin.flush()
    answer: list[float] = json.loads(ground.stdout.readline())
    return answer


def growth_mib() -> float:
    """Resident memory of the emulator for a million messages that have not yet arrived."""
    with (
        started(sys.executable, __file__, "source") as rover,
        started(sys.executable, __file__, "sink") as ground,
    ):
        locators = [process.stdout.readline().strip() for process in (rover, ground)]
        with started(*command(AFAR, *locators)) as link:
            figures_mib = []
            # The first few tell that it is there.
            for number in (100, IN_FLIGHT):
                rover.stdin.write(json.dumps((number, 0.0)) + "\n")
                rover.stdin.flush()
                _await_in_flight(locators[1], number)
                figures_mib.append(_resident_mib(link.pid))
            return figures_mib[1] - figures_mib[0]


def _await_in_flight(locator: str, number: int) -> None:
    session, counted = client(locator), 0
    while counted < number:
        for reply in session.get("farside/link/counters"):
            state = json.loads(reply.ok.payload.to_bytes())
            counted = state["down"]["counters"]["in_flight"]
        time.sleep(0.1)
    session.close()


def _resident_mib(pid: int) -> float:
    status = Path(f"/proc/{pid}/status").read_text(encoding="ascii")
    return int(status.partition("VmRSS:")[2].split()[0]) / 1024


def main() -> None:
    """Measure, and print the table."""
    console = Console()
    runs: dict[str, list[Run]] = {relay: [] for relay in (BARE, DELAYED, IMPAIRED)}
    for _ in track(range(ROUNDS), "measuring", console=console):
        for relay, done in runs.items():
            done.append(measure(relay))
    medians = {
        relay: Run(*map(statistics.median, zip(*done, strict=True))) for relay, done in runs.items()
    }
    table = Table("what", "messages/s", "of the bare relay", "late p50", "late p99")
    table.caption = (
        f"limits: 0.5 of the bare relay; p99 below 2 ms at {PACE_HZ} messages/s. "
        "Late is from put to callback beyond the delay asked for."
    )
    for relay, run in medians.items():
        table.add_row(
            relay,
            f"{run.rate_hz:,.0f}",
            f"{run.rate_hz / medians[BARE].rate_hz:.2f}",
            f"{run.p50_s * 1e3:.2f} ms",
            f"{run.p99_s * 1e3:.2f} ms",
        )
    console.print(table)
    console.print(f"a million messages in flight: {growth_mib():,.0f} MiB (limit: below 1,024)")


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["source"]:
            source()
        case ["sink"]:
            sink()
        case ["relay", rover_side, ground_side]:
            bare_relay(rover_side, ground_side)
        case _:
            main()
