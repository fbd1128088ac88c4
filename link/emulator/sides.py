"""The two Zenoh domains: sessions with other people's programs."""

import json
from collections.abc import Iterator
from contextlib import contextmanager

import zenoh

from farside.node import Role

_LISTEN = "listen/"


@contextmanager
def open_side(side: Role, locator: str) -> Iterator[zenoh.Session]:
    """A session with the domain on one side, closed at the end; see `open_session`.

    Args:
        side: the rover's or the ground's.
        locator: its address.

    Raises:
        ConnectionError: if nobody answers there, or the address is not free.
    """
    with open_session(locator, f"the {side} side") as session:
        yield session


@contextmanager
def open_session(locator: str, domain: str) -> Iterator[zenoh.Session]:
    """A session with other Zenoh programs, closed at the end.

    Args:
        locator: a router or peer to connect to, such as `tcp/192.0.2.1:7447`; with the prefix
            `listen/`, the address on which to be a router that others connect to.
        domain: whose it is, in the words of a message.

    Raises:
        ConnectionError: if nobody answers there, or the address is not free.
    """
    listen_at = locator.removeprefix(_LISTEN)
    if listen_at != locator:
        settings: dict[str, object] = {"mode": "router", "listen/endpoints": [listen_at]}
        failure = f"expected a free address to listen on for {domain}, found {listen_at}"
    else:
        settings = {
            "mode": "client",
            "connect/endpoints": [locator],
            "connect/timeout_ms": 0,
            "connect/exit_on_failure": True,
        }
        failure = f"expected a Zenoh router or peer of {domain} at {locator}, found none"
    config = zenoh.Config()
    config.insert_json5("scouting/multicast/enabled", "false")
    try:
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
        session = zenoh.open(config)
    except zenoh.ZError as error:
        reason = str(error).partition(" at /")[0].strip()
        raise ConnectionError(f"{failure}: {reason}") from error
    with session:
        yield session
