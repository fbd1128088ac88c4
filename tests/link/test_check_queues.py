"""The check of the transmit queue: limits, drop policies, priorities and lifetimes."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import msgspec
import numpy as np
import pytest

from farside.link import Channel, LinkConfig, OneWay
from farside.link.check import CheckVerdict, check_link
from farside.link.profile.config import DropPolicy, Trace
from farside.link.profile.impairments import GilbertElliott, Jitter
from farside.node import Direction, Frame, Step

Rngs = Mapping[Direction, np.random.Generator]
Factory = Callable[[LinkConfig, Rngs], Any]

SLOW: dict[str, Any] = {"delay_s": 0.5, "rate_bit_s": 8000}
TRACE: dict[str, Any] = {
    "delay_s": 0.5,
    "rate_trace": Trace(times_ms=(30, 31, 90)),
    "queue_byte": 200_000,
}


def up(**keys: Any) -> LinkConfig:
    return LinkConfig(up=OneWay(**keys), down=OneWay(delay_s=0.1))


def outside(link: LinkConfig, factory: Factory = Channel) -> set[str]:
    report = check_link(link, factory, frames=200)
    found = [one for one in report.measurements if one.verdict is CheckVerdict.OUTSIDE]
    assert {one.direction for one in found} <= {Direction.UP}
    return {one.impairment for one in found}


def given_else(**keys: Any) -> Factory:
    """An emulator that uses other settings for the uplink than the profile."""

    def make(config: LinkConfig, rngs: Rngs) -> Channel:
        up = msgspec.structs.replace(config.up, **keys)
        return Channel(msgspec.structs.replace(config, up=up), rngs)

    return make


class Refusing:
    """A right channel that nothing passes which is larger than the queue."""

    def __init__(self, channel: Channel) -> None:
        self.channel = channel

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        fitting = [frame for frame in arrivals if len(frame.payload) <= 4096]
        return self.channel.advance(until_ns, fitting)


class Blind:
    """A right channel that does not see something of the frames."""

    def __init__(self, channel: Channel, unseen: Mapping[str, Any]) -> None:
        self.channel, self.unseen = channel, unseen

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        seen = [msgspec.structs.replace(frame, **self.unseen) for frame in arrivals]
        return self.channel.advance(until_ns, seen)


def blind_to(**unseen: Any) -> Factory:
    return lambda config, rngs: Blind(Channel(config, rngs), unseen)


KINDS: dict[str, dict[str, Any]] = {
    "at a rate": SLOW,
    "on a trace": TRACE,
    "by number": SLOW | {"queue_frame": 70},
    "with losses": SLOW | {"loss": 0.2},
    "with losses in bursts": SLOW | {"loss": GilbertElliott(p=0.05, r=0.3)},
    "with jitter": SLOW | {"jitter": Jitter(spread_s=3.0)},
}
RIGHT: dict[str, LinkConfig] = {
    f"{drop} dropped, {name}": up(**keys, drop=drop, lifetime_s=2.0)
    for drop in DropPolicy
    for name, keys in KINDS.items()
}


@pytest.mark.parametrize("name", RIGHT)
def test_a_right_queue_passes(name: str) -> None:
    assert outside(RIGHT[name]) == set()


@pytest.mark.parametrize("asked", DropPolicy)
@pytest.mark.parametrize("given", DropPolicy)
@pytest.mark.parametrize("keys", [SLOW, TRACE], ids=["at a rate", "on a trace"])
def test_another_drop_policy_is_caught(
    asked: DropPolicy, given: DropPolicy, keys: dict[str, Any]
) -> None:
    found = outside(up(**keys, drop=asked), given_else(drop=given))
    assert (f"queue, delivered though dropped ({asked})" in found) is (asked is not given)


def test_a_policy_that_is_wrong_only_by_number_is_caught() -> None:
    """The last of the queue's limits to be looked at."""
    found = outside(up(**SLOW, queue_frame=70, drop="lowest"), given_else(drop=DropPolicy.NEWEST))
    assert "queue, by number, delivered though dropped (lowest)" in found


@pytest.mark.parametrize("number", [69, 71])
def test_a_frame_too_many_or_too_few_in_the_queue_is_caught(number: int) -> None:
    link = up(**SLOW, queue_byte=10_000, queue_frame=70)
    found = outside(link, given_else(queue_frame=number))
    assert "queue, by number" in found


@pytest.mark.parametrize("size", [4096 - 205, 4096 + 205])
def test_room_for_a_twentieth_more_or_less_in_the_queue_is_caught(size: int) -> None:
    assert "queue" in outside(up(**SLOW), given_else(queue_byte=size))


@pytest.mark.parametrize("keys", [SLOW, TRACE], ids=["at a rate", "on a trace"])
def test_priorities_that_are_not_minded_are_caught(keys: dict[str, Any]) -> None:
    assert outside(up(**keys), blind_to(priority=0)) == {"queue, sent out of turn"}


def test_a_policy_that_does_not_mind_priorities_is_caught() -> None:
    found = outside(up(**SLOW, drop="lowest"), blind_to(priority=0))
    assert "queue, delivered though dropped (lowest)" in found


@pytest.mark.parametrize("lifetime_s", [1.9, 2.1, None])
@pytest.mark.parametrize("keys", [SLOW, TRACE], ids=["at a rate", "on a trace"])
def test_another_lifetime_is_caught(lifetime_s: float | None, keys: dict[str, Any]) -> None:
    found = outside(up(**keys, lifetime_s=2.0), given_else(lifetime_s=lifetime_s))
    assert "lifetime" in found


def test_the_lifetime_of_a_frame_that_is_not_minded_is_caught() -> None:
    """Frames that may wait for ever expire like all others, so the queue seems too short."""
    assert "queue" in outside(up(**SLOW, lifetime_s=2.0), blind_to(lifetime_ns=None))


def test_what_expired_and_was_sent_all_the_same_is_caught_beside_losses() -> None:
    found = outside(up(**SLOW, loss=0.9, lifetime_s=2.0), given_else(lifetime_s=None))
    assert "lifetime, delivered though expired" in found


def test_a_hidden_limit_on_the_size_of_a_frame_is_caught() -> None:
    found = outside(up(**SLOW), lambda config, rngs: Refusing(Channel(config, rngs)))
    assert "loss of what is larger than the queue" in found


def test_a_frame_larger_than_the_queue_that_waits_behind_another_is_caught() -> None:
    assert "larger than the queue, on a busy line" in outside(
        up(**SLOW), given_else(queue_byte=4097)
    )
