"""The check of a link by way of other nodes: right ones pass, wrong routers are caught."""

from collections.abc import Mapping

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import Generator
from relayed import GROUND, NODES, ROVER, apart, hop, relayed

from farside.link import Channel, LinkConfig, OneWay
from farside.link.channel.forwarding import Forwarder
from farside.link.channel.relays import Bundle, Relay
from farside.link.check import CheckVerdict, check_link
from farside.link.profile.hops.graph import Way
from farside.link.profile.impairments import Jitter
from farside.node import Direction

TWO_WAYS = [
    *(hop(0, 900, ROVER, orbiter, 8000, 1.0) for orbiter in (4, 5)),
    *(hop(0, 900, orbiter, ROVER, 8000, 1.0) for orbiter in (4, 5)),
    *(
        hop(100, 2000, orbiter, GROUND, 4000, light_s)
        for orbiter, light_s in ((4, 30.0), (5, 40.0))
    ),
    *(hop(0, 800, GROUND, orbiter, 4000, light_s) for orbiter, light_s in ((4, 30.0), (5, 40.0))),
]


def outside(config: LinkConfig, factory: type[Channel] = Channel) -> set[str]:
    report = check_link(config, factory, frames=400)
    return {one.impairment for one in report.measurements if one.verdict is CheckVerdict.OUTSIDE}


def test_a_right_link_is_inside_and_says_what_was_not_measured() -> None:
    way = OneWay(loss=0.2, duplicate=0.1, corrupt=0.1, jitter=Jitter(spread_s=1.0))
    report = check_link(relayed(TWO_WAYS, way), frames=1000)
    assert report.passed
    down = {one.impairment: one for one in report.measurements if one.direction is Direction.DOWN}
    assert down["delay of the first way"].asked == down["delay of the first way"].measured
    assert down["loss"].verdict is CheckVerdict.INSIDE
    assert down["jitter"].verdict is CheckVerdict.UNKNOWN
    assert "waits" in down["jitter"].why


def test_stores_smaller_than_what_is_sent_are_not_measured() -> None:
    link = relayed(TWO_WAYS, OneWay())
    assert link.routing is not None
    for store_byte in (1, 127):
        routing = msgspec.structs.replace(link.routing, store_byte=store_byte)
        report = check_link(msgspec.structs.replace(link, routing=routing), frames=100)
        assert report.passed
        assert f"hold more than {store_byte} bytes" in " ".join(
            one.why for one in report.measurements
        )


class WithoutTheBest(Forwarder):
    """A router that sets out on the second best way where there is one."""

    def _way(self, relay: Relay, bundle: Bundle, now_ns: int) -> Way | None:
        best = super()._way(relay, bundle, now_ns)
        if best is None or bundle.hop > 1:
            return best
        place = relay.number, self._dest, now_ns, bundle.work
        return self._graph.earliest(*place, without=best.legs[-1]) or best


class SlowAtNodes(Forwarder):
    """A router whose nodes take twice as long to send as the contacts allow."""

    def _route(self, relay: Relay, bundle: Bundle, now_ns: int) -> None:
        super()._route(relay, bundle, now_ns)
        if bundle.hop > 1:
            bundle.work *= 2


@pytest.mark.parametrize("router", [WithoutTheBest, SlowAtNodes])
def test_wrong_routers_are_caught(router: type[Forwarder], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("farside.link.channel.lanes.Forwarder", router)
    assert "frames not at their earliest" in outside(relayed(TWO_WAYS))


def test_light_times_that_do_not_add_up_are_caught() -> None:
    """A channel that takes the light time of the last contact alone."""

    class LastLight(Channel):
        def __init__(self, config: LinkConfig, rngs: Mapping[Direction, Generator]) -> None:
            assert config.routing is not None
            hops = tuple(
                one
                if GROUND in {one.sender, one.receiver}
                else msgspec.structs.replace(one, owlt_s=0.0)
                for one in config.routing.hops
            )
            routing = msgspec.structs.replace(config.routing, hops=hops)
            super().__init__(msgspec.structs.replace(config, routing=routing), rngs)

    assert "delay of the first way" in outside(relayed(TWO_WAYS), LastLight)


def test_lost_frames_are_caught() -> None:
    class Lossier(Channel):
        def __init__(self, config: LinkConfig, rngs: Mapping[Direction, Generator]) -> None:
            lossy = msgspec.structs.replace(config.down, loss=config.down.loss and 0.4)
            super().__init__(msgspec.structs.replace(config, down=lossy), rngs)

    assert outside(relayed(TWO_WAYS, OneWay(loss=0.2)), Lossier) == {"loss"}


contacts = st.builds(
    lambda begin, length, pair, rate, owlt: hop(
        begin, begin + length, pair[0], pair[1], rate, owlt
    ),
    st.integers(0, 90).map(float),
    st.integers(1, 60).map(float),
    st.sampled_from([(a, b) for a in NODES for b in NODES if a != b]),
    st.sampled_from([100, 600, 2000]),
    st.sampled_from([0.0, 1.0, 20.0]),
)


@settings(max_examples=3)
@given(st.lists(contacts, max_size=20).map(apart), st.sampled_from([0.0, 0.3]))
def test_whatever_the_plan_a_right_link_is_inside(hops: list, loss: float) -> None:  # type: ignore[type-arg]
    assert not outside(relayed(hops, OneWay(loss=loss, overhead_byte=10), mtu_byte=128))
