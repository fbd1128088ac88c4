"""Two Zenoh domains with the emulator between them, all in one process."""

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager

import msgspec
import zenoh

from farside.link.emulator import Emulator
from farside.link.emulator.control import EmulatorState
from farside.link.emulator.relay import Cargo, Relay
from farside.link.profile.config import LinkConfig
from farside.node import Direction

_TURN_S = 0.02


def session(mode: str, **settings: object) -> zenoh.Session:
    """A session that connects to nothing but what `settings` say: Zenoh's keys.

    In them `_` stands for `/`, and for itself where it has to.
    """
    config = zenoh.Config()
    config.insert_json5("mode", f'"{mode}"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("scouting/delay", "0")
    config.insert_json5("timestamping/enabled", "true")
    for key, value in settings.items():
        path = key if key.startswith("queries") else key.replace("_", "/")
        config.insert_json5(path, msgspec.json.encode(value).decode())
    return zenoh.open(config)


class Domain:
    """One side's Zenoh network: a router in this process, and whoever joins it."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self.router = stack.enter_context(
            session("router", listen_endpoints=["tcp/127.0.0.1:0"], adminspace_enabled=True)
        )
        [about] = self.router.get(f"@/{self.router.info.zid()}/router")
        assert about.ok is not None
        about_it = msgspec.json.decode(about.ok.payload.to_bytes())
        self.locator: str = about_it["locators"][0]

    def join(self, **settings: object) -> zenoh.Session:
        """Another program of this side."""
        joined = session("client", connect_endpoints=[self.locator], **settings)
        return self._stack.enter_context(joined)


class Between:
    """Both domains, each with one program, and the emulator between them."""

    def __init__(
        self,
        stack: ExitStack,
        config: LinkConfig,
        up: Sequence[str],
        down: Sequence[str],
        settings: Mapping[str, object],
    ) -> None:
        self.domains = {direction: Domain(stack) for direction in Direction}
        self.rover = self.domains[Direction.UP].join()
        self.ground = self.domains[Direction.DOWN].join()
        self.told: list[str] = []
        self._emulator: Emulator[Cargo] = Emulator(config)
        self._relay = Relay(
            self.domains[Direction.UP].join(**settings),
            self.domains[Direction.DOWN].join(**settings),
            up=[zenoh.KeyExpr(key) for key in up],
            down=[zenoh.KeyExpr(key) for key in down],
            emulator=self._emulator,
            notify=self.told.append,
        )
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        while not self._over.is_set():
            self._relay.run(_TURN_S)

    def stop(self) -> None:
        """End the emulator."""
        self._over.set()
        self._thread.join()

    def state(self) -> EmulatorState:
        """What the emulator says of itself."""
        return self._relay.state()

    def control(self, **change: object) -> None:
        """Change the link, as anybody on the ground may."""
        payload = msgspec.json.encode(change)
        [reply] = self.ground.get("farside/link/control", payload=payload)
        assert reply.ok is not None, reply.err


@contextmanager
def between(
    config: LinkConfig | None = None,
    *,
    up: Sequence[str] = (),
    down: Sequence[str] = (),
    **settings: object,
) -> Iterator[Between]:
    """Two domains with a link between them, whose own sessions have `settings` as in `session`."""
    with ExitStack() as stack:
        both = Between(stack, config or LinkConfig(), up, down, settings)
        try:
            yield both
        finally:
            both.stop()


def until(happened: Callable[[], bool]) -> None:
    """Wait until something has happened; the test's patience ends it if it never does."""
    while not happened():
        threading.Event().wait(0.002)
