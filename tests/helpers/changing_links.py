"""Stories of a link that is changed while messages pass, right and wrong changes alike."""

import json
from contextlib import suppress
from typing import Any

from any_link import any_tables
from hypothesis import strategies as st

from farside.frames import Fate
from farside.link.emulator import Emulator
from farside.link.profile.config import LinkConfig, OneWay
from farside.node import NEVER_NS, Direction

DELAYED = LinkConfig(up=OneWay(delay_s=1.0), down=OneWay(delay_s=1.0))

ChangeStep = tuple[str, Any]
"""What is done, and with what."""

changes = st.lists(
    st.one_of(
        st.tuples(st.just("change"), any_tables(fitting=True)),
        st.tuples(st.just("change both"), any_tables(fitting=True)),
        st.tuples(st.just("change"), any_tables(fitting=False)),
        st.tuples(st.just("out"), st.booleans()),
        st.tuples(st.sampled_from([*map(str, Direction)]), st.sampled_from([0, 1, 100, 5000])),
        st.tuples(st.just("wait"), st.sampled_from([0, 1, 10**6, 10**9, 10**12, 10**18])),
    ),
    max_size=12,
)
"""Messages, by their size in bytes; waits, in nanoseconds; changes."""


def live_through(steps: list[ChangeStep]) -> None:
    """Change a link, send messages and wait, and see that every message has one fate.

    A change that is refused must change nothing. What goes on for ever is looked at for a second
    at a time, all else for decades.
    """
    subject: Emulator[int] = Emulator(DELAYED)
    now_ns = 0
    for step, what in [*steps, ("up", 100), ("down", 100), ("wait", 10**18)]:
        match step:
            case "wait":
                now_ns += min(what, 10**18 if subject.ahead.latest_ns == NEVER_NS else 10**9)
                subject.advance(now_ns)
            case "up" | "down":
                subject.send(Direction(step), now_ns, bytes(what), 0)
            case "out":
                change(subject, json.dumps({"both": {"out": what}}).encode())
            case "change both":
                change(subject, json.dumps({"both": what.get("up", {})}).encode())
            case _:
                change(subject, json.dumps(what).encode())
    for direction in Direction:
        counters = subject.state().way(direction).counters
        fates = [getattr(counters, fate.replace("-", "_")) for fate in Fate]
        assert counters.received == counters.in_flight + sum(fates)


def change(subject: Emulator[int], payload: bytes) -> None:
    """Ask for a change, which is made as a whole or not at all."""
    before = subject.state()
    with suppress(ValueError):
        subject.control(payload)
        return
    assert subject.state() == before, payload
