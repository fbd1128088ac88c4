"""Zenoh programs and processes for the measurements of `farside link`."""

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager

import zenoh


def open_router() -> tuple[zenoh.Session, str]:
    """A session that others connect to, and where."""
    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("adminspace/enabled", "true")
    session = zenoh.open(config)
    [about] = session.get(f"@/{session.info.zid()}/router")
    if about.ok is None:
        raise RuntimeError(f"expected the router to tell its locators, found {about.err}")
    return session, json.loads(about.ok.payload.to_bytes())["locators"][0]


def client(locator: str) -> zenoh.Session:
    """A session that connects to a router."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([locator]))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


@contextmanager
def started(*line: str) -> Iterator["subprocess.Popen[str]"]:
    """A process with pipes, ended in the end."""
    pipe = subprocess.PIPE
    process = subprocess.Popen(line, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True)  # noqa: S603
    try:
        yield process
    finally:
        process.terminate()
        process.communicate()
