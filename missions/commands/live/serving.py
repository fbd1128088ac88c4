"""A log or a run in progress in Foxglove: `farside replay --live` and `farside run --live`."""

import sys
from collections.abc import Callable, Sequence
from ipaddress import ip_address
from pathlib import Path
from typing import Self

from farside.acts import Act
from farside.escaping import printable
from farside.ground.view.view import Focus, GroundView
from farside.logs import LogFile
from farside.logs.file.following import start_of
from farside.logs.live.feeds import LogFeed, RunFeed
from farside.logs.live.playbar import PlayBar
from farside.logs.live.server import TICK_S, LiveServer, ServerError, offered
from farside.logs.playing import Player
from farside.missions.commands.live.address import Address
from farside.missions.conductor import WallClock, Watcher
from farside.missions.crew.crew import InfrastructureError
from farside.missions.interrupts import Interrupts
from farside.node import Record, Role, to_ns

_LONGEST_TICK_S = 1.0  # a laptop that slept for an hour does not skip one
_WALL_CLOCK = WallClock()


def serve_log(
    log: LogFile,
    address: Address,
    *,
    speed: float,
    start_s: float | None = None,
    clock: WallClock = _WALL_CLOCK,
) -> None:
    """Play a log to Foxglove until Ctrl-C, from when the first viewer has subscribed.

    Args:
        log: whole, or as the ground had it.
        address: where to listen.
        speed: simulated seconds per wall second.
        start_s: simulated time at which to start; by default the beginning.
        clock: wall time.

    Raises:
        InfrastructureError: if the server cannot listen there.
        LogError: if the log is missing by now.
        ValueError: if `start_s` is not within the run.
    """
    feed = LogFeed(log)
    start_ns = start_of(log, start_s, follow=False)
    bar = PlayBar(Player(feed, speed=speed, start_ns=start_ns), feed, feed.end_ns, waiting=True)
    name = f"{log.path.name}, as the ground saw it" if log.is_as_ground else log.path.name
    with _server(bar, address, end_ns=feed.end_ns, name=name, as_ground=log.is_as_ground) as server:
        _say_where(server, address)
        lap = _laps(clock)
        try:
            while True:
                server.tick(lap())
                clock.sleep(TICK_S)
        except KeyboardInterrupt:
            return


class LiveRun(Watcher):
    """Shows a run in progress in Foxglove, whose play bar paces it. A context manager.

    Args:
        beside: another watcher, who sees the same.
        interrupts: end the waiting for a viewer's word.
        address: where to listen.
        name: of the mission.
        end_ns: its duration.
        speed: simulated seconds per wall second, to begin with.
        clock: wall time.

    Raises:
        InfrastructureError: if the server cannot listen there.
    """

    def __init__(
        self,
        beside: Watcher,
        interrupts: Interrupts,
        address: Address,
        *,
        name: str,
        end_ns: int,
        speed: float,
        clock: WallClock = _WALL_CLOCK,
    ) -> None:
        self._beside = beside
        self._interrupts = interrupts
        self._clock = clock
        self._lap = _laps(clock)
        self._feed = RunFeed()
        bar = PlayBar(Player(self._feed, speed=speed), self._feed, end_ns)
        self.server = _server(bar, address, end_ns=end_ns, name=name)
        _say_where(self.server, address)

    def opened(self, log: Path) -> None:
        """See `Watcher.opened`."""
        self._feed.path = log
        self._beside.opened(log)

    def seeing(self, look: Callable[[Focus], GroundView | None]) -> None:
        """See `Watcher.seeing`."""
        self._beside.seeing(look)

    def window_ns(self, now_ns: int) -> int | None:
        """See `Watcher.window_ns`."""
        return self._beside.window_ns(now_ns)

    def orders(self, now_s: float) -> Sequence[Act]:
        """See `Watcher.orders`."""
        return self._beside.orders(now_s)

    def watch(self, now_s: float, records: Sequence[Record]) -> None:
        """See `Watcher.watch`. Returns when playback has caught up with the run."""
        self._beside.watch(now_s, records)
        self._feed.extend(to_ns(now_s), records)
        self._play_while(lambda: not self.server.wants_more)

    def wait(self, roles: Sequence[Role], waited_s: float) -> None:
        """See `Watcher.wait`."""
        self._beside.wait(roles, waited_s)

    def serve(self) -> None:
        """Play the log of the run, now that it is over, until Ctrl-C.

        Raises:
            LogError: if the log is damaged or missing.
        """
        self._feed.finish()
        self.server.finish()
        _say("The run is over. Foxglove still has its log; Ctrl-C ends this.")
        self._play_while(lambda: True)

    def _play_while(self, wanted: Callable[[], bool]) -> None:
        while not self._interrupts.requested:
            self.server.tick(self._lap())
            if not wanted():
                return
            self._clock.sleep(TICK_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.server.stop()


def _server(
    bar: PlayBar, address: Address, *, end_ns: int, name: str, as_ground: bool = False
) -> LiveServer:
    channels = offered(as_ground=as_ground)
    try:
        return LiveServer(
            bar, channels, end_ns=end_ns, name=printable(name), host=address.host, port=address.port
        )
    except ServerError as error:
        raise InfrastructureError(f"{error}: choose another with --listen or --port") from error


def _laps(clock: WallClock) -> Callable[[], float]:
    """A function that gives the seconds since it was called last."""
    last_s = clock.now()

    def lap() -> float:
        nonlocal last_s
        before_s, last_s = last_s, clock.now()
        return min(last_s - before_s, _LONGEST_TICK_S)

    return lap


def _say_where(server: LiveServer, address: Address) -> None:
    host = f"[{address.host}]" if ":" in address.host else address.host
    _say(f"Live at ws://{host}:{server.port}, in a browser at {server.app_url}")
    _say("A layout to import there: farside layout")
    if not _is_loopback(address.host):
        _say(f"Whoever reaches {address.host} can look on, and use the play bar.")


def _is_loopback(host: str) -> bool:
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False


def _say(line: str) -> None:
    print(printable(line), file=sys.stderr, flush=True)  # noqa: T201
