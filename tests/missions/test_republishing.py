"""A recorded run on Zenoh, where any program can listen to it."""

import json
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from queue import SimpleQueue

import msgspec
import pytest
import zenoh
from noting import records_of

from farside.control import Mode, ModeCause
from farside.logs import LogFile, Recorder
from farside.missions.commands.logs.republishing import Times, in_time
from farside.missions.conductor import WallClock
from farside.node import Record, to_ns
from farside.topics import ModeEntry, Pose, Silence


@pytest.fixture
def records() -> list[Record]:
    """Ten seconds of a run, with a message on each side that was so long before it was known."""
    poses = [(t_s, Pose(1.5, 1.5, 0.0, 0.0, "at:A", 1.0)) for t_s in range(10)]
    noted = records_of(
        [(0, ModeEntry(Mode.GUIDED, ModeCause.START)), *poses, (10, Silence(silent=True))]
    )
    return [*noted[:-1], msgspec.structs.replace(noted[-1], publish_time_ns=to_ns(4))]


@pytest.fixture
def log(records: list[Record], tmp_path: Path) -> LogFile:
    with Recorder(tmp_path / "run.mcap") as recorder:
        recorder.write(records)
    return LogFile(recorder.path)


class FakeClock:
    """Wall time that passes while somebody sleeps."""

    def __init__(self) -> None:
        self.now_s = 1000.0

    def sleep(self, seconds: float) -> None:
        assert seconds > 0
        self.now_s += seconds


def test_each_record_goes_out_when_it_is_due(records: list[Record]) -> None:
    clock, out = FakeClock(), list[tuple[float, Record]]()

    count = in_time(
        iter(records[3:]),
        lambda record: out.append((clock.now_s, record)),
        speed=2.0,
        start_ns=to_ns(1),
        clock=WallClock(lambda: clock.now_s, clock.sleep),
    )

    assert [record for _, record in out] == records[3:]
    assert count == len(out)
    assert [now_s for now_s, _ in out] == pytest.approx(
        [1000 + (record.log_time_ns / 1e9 - 1) / 2 for record in records[3:]]
    )


def test_at_maximum_speed_nothing_waits(records: list[Record]) -> None:
    clock = FakeClock()

    in_time(
        iter(records),
        lambda _record: None,
        speed=math.inf,
        start_ns=0,
        clock=WallClock(lambda: clock.now_s, clock.sleep),
    )

    assert clock.now_s == 1000


@contextmanager
def listening(key: str) -> Iterator[tuple[str, SimpleQueue[zenoh.Sample]]]:
    """A router on loopback that hears `key`: its locator, and what it heard."""
    config = zenoh.Config()
    for name, value in {
        "mode": "router",
        "listen/endpoints": ["tcp/127.0.0.1:0"],
        "scouting/multicast/enabled": False,
        "adminspace/enabled": True,
    }.items():
        config.insert_json5(name, json.dumps(value))
    heard: SimpleQueue[zenoh.Sample] = SimpleQueue()
    with zenoh.open(config) as session:
        session.declare_subscriber(key, heard.put)
        (reply,) = session.get(f"@/{session.info.zid()}/router")
        yield json.loads(reply.ok.payload.to_bytes())["locators"][0], heard


@pytest.mark.processes
@pytest.mark.parametrize("as_", [(), ("--as", "ground")], ids=["so", "as ground"])
def test_any_zenoh_program_hears_the_run_in_order_with_its_times(
    farside: Callable[..., tuple[int, str, str]], log: LogFile, as_: tuple[str, ...]
) -> None:
    view = log.as_ground() if as_ else log
    with listening("farside/**") as (locator, heard):
        status, _, err = farside(
            "replay", str(log.path), "--zenoh", locator, "--speed", "max", *as_
        )
        samples = [heard.get(timeout=30) for _ in view.records()]

    assert status == 0
    assert f"published {len(samples)} messages, up to 10 s" in err
    found = []
    for sample in samples:
        assert str(sample.encoding) == "application/json"
        times = msgspec.json.decode(sample.attachment.to_bytes(), type=Times)
        topic = str(sample.key_expr).removeprefix("farside")
        found.append(
            Record(topic, times.log_time_ns, times.publish_time_ns, sample.payload.to_bytes())
        )
    assert found == list(view.records())


@pytest.mark.processes
def test_an_endpoint_where_nobody_answers_is_named(
    farside: Callable[..., tuple[int, str, str]], log: LogFile
) -> None:
    status, _, err = farside("replay", str(log.path), "--zenoh", "tcp/127.0.0.1:1")

    assert status == 3
    assert (
        "expected a Zenoh router or peer of the programs that listen at tcp/127.0.0.1:1, found none"
    ) in err


def test_live_and_zenoh_do_not_go_together(
    farside: Callable[..., tuple[int, str, str]], log: LogFile
) -> None:
    status, _, err = farside("replay", str(log.path), "--zenoh", "tcp/127.0.0.1:1", "--live")

    assert (status, "expected it without --zenoh" in err) == (2, True)
