"""`farside link` on a wall clock, between two plain Zenoh programs."""

import json
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, cast

import pytest

pytestmark = pytest.mark.processes

PATIENCE_S = 30.0

PROGRAM = """
import json, sys, time, zenoh

config = zenoh.Config()
config.insert_json5("mode", '"router"')
config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
config.insert_json5("scouting/multicast/enabled", "false")
config.insert_json5("adminspace/enabled", "true")

def tell(**what):
    # In one write, because two threads print.
    sys.stdout.write(json.dumps(what) + "\\n")
    sys.stdout.flush()

def hear(sample):
    attachment = sample.attachment
    tell(
        time_ns=time.monotonic_ns(),
        key=str(sample.key_expr),
        kind=str(sample.kind),
        payload=sample.payload.to_bytes().hex(),
        encoding=str(sample.encoding),
        priority=str(sample.priority),
        attachment=None if attachment is None else attachment.to_bytes().hex(),
    )

def put(key, payload, times=1, **how):
    publisher = session.declare_publisher(key)
    while not publisher.matching_status.matching:
        time.sleep(0.001)
    for name in ("priority",):
        if name in how:
            how[name] = getattr(zenoh.Priority, how[name])
    began_ns = time.monotonic_ns()
    for _ in range(times):
        session.put(key, payload, congestion_control=zenoh.CongestionControl.BLOCK, **how)
    return began_ns

def delete(key, **how):
    session.delete(key, **how)

def ask(key):
    session.get(key, lambda reply: None, timeout=1000)

def get(key, payload=None):
    while not (replies := list(session.get(key, payload=payload))):
        pass
    [reply] = replies
    if reply.ok is None:
        return {"error": reply.err.payload.to_string()}
    return json.loads(reply.ok.payload.to_bytes())

with zenoh.open(config) as session:
    [about] = session.get(f"@/{session.info.zid()}/router")
    tell(locator=json.loads(about.ok.payload.to_bytes())["locators"][0])
    for key in sys.argv[1:]:
        session.declare_subscriber(key, hear)
    for line in sys.stdin:
        name, how = json.loads(line)
        tell(answer=globals()[name](**how))
"""


class Program:
    """One of the two programs: a Zenoh router that publishes and subscribes on request."""

    def __init__(self, process: "subprocess.Popen[str]") -> None:
        self._process = process
        self._input = process.stdin
        self._output = process.stdout
        self._heard: list[dict[str, Any]] = []
        self.locator: str = self._read("locator")

    def _read(self, name: str) -> Any:
        while name not in (line := json.loads(self._output.readline())):
            self._heard.append(line)
        return line[name]

    def _do(self, name: str, **how: object) -> Any:
        self._input.write(json.dumps([name, how]) + "\n")
        self._input.flush()
        return self._read("answer")

    def put(self, key: str, payload: str, **how: object) -> int:
        """Publish once there is a subscriber; returns the time, on the clock of all processes."""
        began_ns: int = self._do("put", key=key, payload=payload, **how)
        return began_ns

    def delete(self, key: str, **how: object) -> None:
        self._do("delete", key=key, **how)

    def ask(self, key: str) -> None:
        """Query without waiting for a reply."""
        self._do("ask", key=key)

    def get(self, key: str, payload: str | None = None) -> dict[str, Any]:
        """Query until there is a reply, and return it."""
        answer: dict[str, Any] = self._do("get", key=key, payload=payload)
        return answer

    def heard(self) -> dict[str, Any]:
        """Wait for the next message and return it."""
        if not self._heard:
            return cast("dict[str, Any]", json.loads(self._output.readline()))
        return self._heard.pop(0)

    def leave(self) -> list[dict[str, Any]]:
        """End the program and return the messages not yet taken."""
        rest, _ = self._process.communicate(timeout=PATIENCE_S)
        return self._heard + [json.loads(line) for line in rest.splitlines()]


@contextmanager
def program(*keys: str) -> Iterator[Program]:
    """A plain Zenoh program that subscribes to `keys`."""
    process = subprocess.Popen(  # noqa: S603 - the program above
        [sys.executable, "-c", PROGRAM, *keys],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        yield Program(process)
    finally:
        process.kill()
        process.communicate()


def command(rover: str, ground: str, *options: str) -> list[str]:
    """The command line of the emulator between two locators."""
    start = [sys.executable, "-m", "farside", "link"]
    return [*start, "--rover-side", rover, "--ground-side", ground, *options]


class Link:
    """The emulator between the two programs."""

    def __init__(self, rover: Program, ground: Program, process: "subprocess.Popen[str]") -> None:
        self.rover, self.ground, self._process = rover, ground, process

    def counters(self, way: str) -> dict[str, int]:
        """The counters of a direction once nothing is in flight in it."""
        while True:
            counters: dict[str, int]
            counters = self.ground.get("farside/link/counters")[way]["counters"]
            if counters["in_flight"] == 0:
                return counters

    def control(self, **change: object) -> dict[str, Any]:
        return self.ground.get("farside/link/control", json.dumps(change))

    def interrupt(self) -> dict[str, Any]:
        """Press Ctrl-C and return the state that it prints at its end."""
        self._process.send_signal(signal.SIGINT)
        output, errors = self._process.communicate(timeout=PATIENCE_S)
        assert self._process.returncode == 0, errors
        state: dict[str, Any] = json.loads(output)
        return state


@contextmanager
def link(
    *settings: str,
    up: Sequence[str] = ("cmd/**",),
    down: Sequence[str] = ("tlm/**",),
    start: str | None = None,
) -> Iterator[Link]:
    """Two programs with the emulator between them."""
    options = [f"--set={setting}" for setting in settings]
    options += [] if start is None else [f"--start={start}"]
    options += [f"--up={key}" for key in up] + [f"--down={key}" for key in down]
    with program(*up) as rover, program(*down) as ground:
        process = subprocess.Popen(  # noqa: S603 - our own
            command(rover.locator, ground.locator, "--json", *options),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        try:
            assert "passing messages" in process.stderr.readline()
            yield Link(rover, ground, process)
        finally:
            process.kill()
            process.communicate()


def test_nothing_arrives_before_its_delay() -> None:
    with link("up.delay_s=0.2", "down.delay_s=0.1") as between:
        began_ns = between.ground.put("cmd/drive", "N")
        assert between.rover.heard()["time_ns"] - began_ns >= 200_000_000
        began_ns = between.rover.put("tlm/pose", "0,0")
        assert between.ground.heard()["time_ns"] - began_ns >= 100_000_000


def test_only_the_messages_that_the_link_does_not_lose_arrive() -> None:
    with link("down.loss=0.5") as between:
        between.rover.put("tlm/count", "x", times=200)
        while (counters := between.counters("down"))["received"] < 200:
            pass
        for _ in range(counters["delivered"]):
            between.ground.heard()
        state = between.interrupt()
        more = between.ground.leave()
    assert state["down"]["counters"] == counters
    assert counters["delivered"] + counters["lost"] == 200
    assert 60 < counters["lost"] < 140
    assert more == []
    assert state["up"]["counters"]["received"] == 0


def test_corruption_flips_one_bit_of_the_payload() -> None:
    with link("up.corrupt=1.0") as between:
        between.ground.put("cmd/drive", "north", attachment="why")
        heard = between.rover.heard()
    flipped = int(heard["payload"], 16) ^ int(b"north".hex(), 16)
    assert flipped.bit_count() == 1
    assert heard["attachment"] == b"why".hex()


def test_a_manual_outage_begins_and_ends_at_once() -> None:
    with link() as between:
        state = between.control(down={"out": True})
        assert state["down"]["outage"] == {"reason": "control", "left_s": None}
        between.rover.put("tlm/pose", "unheard")
        between.ground.put("cmd/drive", "heard")
        assert between.rover.heard()["payload"] == b"heard".hex()
        while between.counters("down")["outage"] == 0:
            pass
        between.control(both={"out": False})
        between.rover.put("tlm/pose", "heard")
        assert between.ground.heard()["payload"] == b"heard".hex()


def test_settings_change_while_it_runs() -> None:
    with link("preset=moon", "up.delay_s=0.01", "down.jitter.spread_s=0.1") as between:
        settings = between.ground.get("farside/link/counters")["down"]["settings"]
        assert (settings["rate_bit_s"], settings["jitter"]["spread_s"]) == (32_000, 0.1)
        state = between.control(both={"loss": 1.0}, up={"delay_s": 0.02})
        assert state["up"]["settings"] | {"loss": 1.0, "delay_s": 0.02} == state["up"]["settings"]
        assert state["down"]["settings"]["loss"] == 1.0
        between.ground.put("cmd/drive", "N")
        while between.counters("up")["lost"] == 0:
            pass


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"down": {"loss": 2}}, "down.loss: expected a number >= 0 and <= 1, found 2"),
        ({"down": {"lost": 1}}, "down.lost: expected one of the keys delay_s, "),
        ({"left": {"loss": 1}}, "left: expected one of the keys up, down, "),
        ({}, "expected a change such as"),
    ],
)
def test_an_invalid_change_is_refused_in_words(change: dict[str, object], reason: str) -> None:
    with link() as between:
        before = between.ground.get("farside/link/counters")
        assert reason in between.control(**change)["error"]
        after = between.ground.get("farside/link/counters")
    assert after["down"] == before["down"]


def test_a_key_that_passes_in_both_directions_does_not_loop() -> None:
    with link(up=["chat/**"], down=["chat/**"]) as between:
        between.ground.put("chat/a", "hello")
        assert between.rover.heard()["payload"] == b"hello".hex()
        between.rover.put("chat/a", "yes?")
        # The first is not an echo: the program subscribes to the key on which it publishes.
        payloads = [between.ground.heard()["payload"] for _ in range(2)]
        assert payloads == [b"hello".hex(), b"yes?".hex()]
        assert between.counters("up")["received"] == between.counters("down")["received"] == 1


def test_a_message_that_matches_two_key_expressions_passes_once() -> None:
    with link(up=["cmd/*", "*/drive"]) as between:
        between.ground.put("cmd/drive", "N")
        between.ground.put("arm/drive", "E")
        while (counters := between.counters("up"))["received"] < 2:
            pass
    assert counters["received"] == 2


def ends_with(*line: str) -> tuple[int, str]:
    """Exit status and standard error of an emulator that cannot start."""
    done = subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE_S, check=False)  # noqa: S603
    return done.returncode, done.stderr


def test_one_network_on_both_sides_is_refused() -> None:
    with program() as both:
        status, words = ends_with(*command(both.locator, both.locator, "--up=cmd/**"))
    assert status == 2
    assert "two Zenoh domains" in words


@pytest.mark.parametrize(
    "options",
    [
        ["--up=/cmd"],
        [],
        ["--up=cmd", "--set=up.loss=2"],
        ["--up=cmd", "--preset=unheard-of"],
        ["--up=cmd", "--start=tomorrow"],
        ["--up=cmd", "--start=now"],  # of a link with nothing that has dates
    ],
)
def test_bad_input_is_status_2_before_any_connection(options: list[str]) -> None:
    status, _ = ends_with(*command("tcp/127.0.0.1:1", "tcp/127.0.0.1:1", *options))
    assert status == 2


def test_a_plan_with_dates_starts_at_the_wall_clock(tmp_path: Path) -> None:
    def date(minutes: float) -> str:
        return f"{datetime.now(UTC) + timedelta(minutes=minutes):%Y/%m/%d-%H:%M:%S}"

    plan = tmp_path / "today.ionrc"
    plan.write_text(
        f"a contact {date(-60)} {date(60)} 1 2 125000\n"
        f"a contact {date(60)} {date(120)} 2 1 125000\n"
    )
    contacts = f"contacts={{file='{plan}', ground=1, rover=2}}"
    with link(contacts, start="now") as between:
        between.ground.put("cmd/drive", "N")
        assert between.rover.heard()["key"] == "cmd/drive"
        between.rover.put("tlm/pose", "0,0")
        while between.counters("down")["outage"] == 0:
            pass
        outage = between.ground.get("farside/link/counters")["down"]["outage"]
    assert outage["reason"] == "contact"
    assert 0 < outage["left_s"] <= 3600


def test_messages_to_a_side_without_programs_are_counted_and_reported() -> None:
    with link() as between:
        while between.ground.get("farside/link/counters")["rover_side"]["connected"] == 0:
            pass
        between.rover.leave()
        words = "rover side: nobody is connected any more"
        assert words in between._process.stderr.readline()
        between.ground.put("cmd/drive", "N", times=3)
        while between.counters("up")["delivered"] < 3:
            pass
        state = between.ground.get("farside/link/counters")
    assert state["rover_side"] == {"connected": 0, "unheard": 3}
    assert state["ground_side"] == {"connected": 1, "unheard": 0}
    assert state["up"]["counters"]["delivered"] == 3


def test_the_programs_may_connect_to_the_emulator() -> None:
    with program("cmd/**") as rover:
        process = subprocess.Popen(  # noqa: S603 - our own
            command(rover.locator, "listen/tcp/127.0.0.1:0", "--up=cmd/**", "--json"),
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert "listen/tcp/127.0.0.1:0" in process.stderr.readline()
        process.send_signal(signal.SIGTERM)
        output, _ = process.communicate(timeout=PATIENCE_S)
    assert json.loads(output)["up"]["counters"]["received"] == 0
    assert process.returncode == 0


def test_queries_that_are_still_open_do_not_hold_up_the_end() -> None:
    """One is lost on its way, so it stays open for as long as its caller may wait."""
    with link("up.loss=1.0") as between:
        between.ground.ask("tlm/**")
        while between.counters("up")["lost"] == 0:
            pass
        state = between.interrupt()
    assert state["up"]["counters"]["queries"] == 1
