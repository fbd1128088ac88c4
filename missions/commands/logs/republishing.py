"""`farside replay LOG --zenoh ENDPOINT`: the records of a log on Zenoh, as if the run went on.

What was recorded on a topic, such as `/ground/telemetry`, goes out on the key of that name,
`farside/ground/telemetry`: the message as it is in the log, in JSON, and as its attachment when it
became known and when it was so. The keys over which the processes of a run work together,
`farside/ROLE/advance`, `report`, `in` and `out`, are none of these: what went over them is not in
the log, of the frames only what became of each.
"""

from collections.abc import Callable, Iterator
from contextlib import suppress

import msgspec
import zenoh

from farside.link.emulator.sides import open_session
from farside.logs import LogFile
from farside.logs.file.following import followed, start_of
from farside.missions.commands.failures import print_error
from farside.missions.conductor import WallClock
from farside.missions.crew.crew import InfrastructureError
from farside.node import Record, to_s
from farside.topics import TOPICS

_LONGEST_SLEEP_S = 0.1  # a signal does not end a sleep
_DOMAIN = "programs that listen"
_WALL_CLOCK = WallClock()


class Times(msgspec.Struct, frozen=True):
    """The attachment of each sample, in JSON: see `farside.node.Record`."""

    log_time_ns: int
    publish_time_ns: int


def key_of(topic: str) -> str:
    """The Zenoh key of a topic: `farside/rover/mode` of `/rover/mode`."""
    return f"farside{topic}"


def republish_log(
    log: LogFile,
    endpoint: str,
    *,
    speed: float,
    start_s: float | None,
    follow: bool,
    clock: WallClock = _WALL_CLOCK,
) -> None:
    """Publish what a log holds, with the timing that it had, from when anybody subscribes to it.

    Args:
        log: the log; as ground, it holds only what the ground knew.
        endpoint: Zenoh locator of a router or peer; `listen/…` to be the router.
        speed: simulated seconds per wall second; infinite for as fast as they are taken.
        start_s: where to start; by default at the beginning or, to follow, at what was written
            last.
        follow: go on as the log grows, until it is whole.
        clock: wall time.

    Raises:
        InfrastructureError: if there is no session at this endpoint.
        LogError: if the log is damaged.
        ValueError: if `start_s` is not within the run.
    """
    start_ns = start_of(log, start_s, follow=follow)
    records = (
        followed(log, None, clock.sleep, start_ns=start_ns)
        if follow
        else log.records(start_ns=start_ns)
    )
    try:
        with suppress(KeyboardInterrupt), open_session(endpoint, _DOMAIN) as session:
            publishers = {name: session.declare_publisher(key_of(name)) for name in TOPICS}
            print_error(f"waiting for a subscriber to farside/** at {endpoint}")
            # Looked at in turn: listeners, one a publisher, would tell in threads of the library's.
            # Its stub says bool, for an object that holds one.
            while not any(one.matching_status.matching for one in publishers.values()):  # type: ignore[attr-defined]
                clock.sleep(_LONGEST_SLEEP_S)
            print_error("publishing; Ctrl-C ends it")

            def publish(record: Record) -> None:
                times = Times(record.log_time_ns, record.publish_time_ns)
                session.put(
                    key_of(record.topic),
                    record.payload,
                    encoding=zenoh.Encoding.APPLICATION_JSON,
                    attachment=msgspec.json.encode(times),
                    congestion_control=zenoh.CongestionControl.BLOCK,
                )

            count = in_time(records, publish, speed=speed, start_ns=start_ns, clock=clock)
            print_error(f"published {count} messages, up to {to_s(log.end_ns):g} s")
    except ConnectionError as error:
        raise InfrastructureError(str(error)) from error


def in_time(
    records: Iterator[Record],
    publish: Callable[[Record], None],
    *,
    speed: float,
    start_ns: int,
    clock: WallClock = _WALL_CLOCK,
) -> int:
    """Publish each record when it is due; returns how many there were.

    Args:
        records: in log order.
        publish: what to do with one.
        speed: simulated seconds per wall second.
        start_ns: simulated time at which this begins.
        clock: wall time.
    """
    began_s, count = clock.now(), 0
    for record in records:
        # At infinite speed everything is due at once.
        due_s = began_s + to_s(record.log_time_ns - start_ns) / speed
        while (ahead_s := due_s - clock.now()) > 0:
            clock.sleep(min(ahead_s, _LONGEST_SLEEP_S))
        publish(record)
        count += 1
    return count
