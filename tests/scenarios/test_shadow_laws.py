"""Over any link, the shadow at the ground holds what the model on board held, or knows better."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from restless import cycles, lists
from shadowing import Shadowing

from farside.dem import Parameters
from farside.frames import OutageReason
from farside.link import LinkConfig, OneWay
from farside.link.profile.config import Blackout
from farside.link.profile.impairments import GilbertElliott
from farside.node import Record, to_ns
from farside.topics import GROUND_SHADOW
from tests.dem.conftest import Event

HOUR_S = 3600.0
LOSSES: list[float | GilbertElliott] = [0.0, 0.02, 0.3, GilbertElliott(p=0.05, r=0.3)]
MOON = OneWay(delay_s=1.2, rate_bit_s=64_000)
STREAM: list[Event] = [
    ([token for n, token in enumerate("abcdef") if (k * k + 3 * k) >> n & 1], action, goal)
    for k, action, goal in zip(
        range(60), ["go", "turn", "go"] * 20, [None, None, ("set", ["a", "f"], 1)] * 20, strict=True
    )
]


@st.composite
def ways(draw: st.DrawFn) -> OneWay:
    return OneWay(
        delay_s=draw(st.sampled_from([0.2, 1.4, 9.8])),
        rate_bit_s=draw(st.sampled_from([None, 300, 2_000, 64_000])),
        loss=draw(st.sampled_from(LOSSES)),
        duplicate=draw(st.sampled_from([0.0, 0.2])),
        queue_byte=65_536,
    )


@st.composite
def outages(draw: st.DrawFn) -> tuple[Blackout, ...]:
    """Some long, some that come and go; foreseen by both ends, or by neither."""
    found, begin_s = [], 0.0
    for _ in range(draw(st.integers(0, 8))):
        begin_s += draw(st.sampled_from([1.0, 5.0, 40.0]))
        end_s = begin_s + draw(st.sampled_from([0.6, 3.0, 15.0, 120.0]))
        reason = draw(st.sampled_from([OutageReason.BLACKOUT, OutageReason.CONJUNCTION]))
        found.append(Blackout(start_s=begin_s, end_s=end_s, reason=reason))
        begin_s = end_s
    return tuple(found)


links = st.builds(LinkConfig, up=ways(), down=ways(), blackouts=outages())


@settings(max_examples=40)
@given(
    link=links,
    stream=st.lists(cycles, min_size=5, max_size=60),
    every_s=st.sampled_from([1.0, 7.0]),
    seed=st.integers(0, 9),
)
def test_over_any_link_the_shadow_is_the_model_as_it_was_and_catches_up(
    link: LinkConfig, stream: Sequence[Event], every_s: float, seed: int
) -> None:
    there = Shadowing(link, seed=seed)
    number = 0
    for cycle in stream:
        there.live(every_s, [cycle])
        if there.shadow.number != number:
            number = there.shadow.number
            assert lists(there.shadow.model) == there.held[number]
        assert there.shadow.in_step is (number > 0), "nothing goes missing on the way"
    assert there.catch_up(HOUR_S)
    assert there.shadow.check == there.cycle.lists_check
    assert there.shadow.cycles <= there.cycle.number


@settings(max_examples=15)
@given(
    link=links,
    stream=st.lists(cycles, min_size=20, max_size=30),
    damage=st.sampled_from(["a bit of a C_m", "a hypothesis", "a Sign", "the goals", "all"]),
)
def test_over_any_link_drift_is_noticed_and_mended(
    link: LinkConfig, stream: Sequence[Event], damage: str
) -> None:
    there = Shadowing(link)
    there.live(30.0, stream[:15])
    assert there.catch_up(HOUR_S)
    shadow = there.shadow.model
    match damage:
        case "a bit of a C_m" if shadow.hypotheses:
            living = shadow._hypotheses.by_age()[0]
            shadow._hypotheses.cm[living] = np.nextafter(shadow._hypotheses.cm[living], 0.5)
        case "a hypothesis" if shadow.hypotheses:
            shadow._hypotheses.remove(shadow._hypotheses.by_age()[0])
        case "a Sign":
            shadow._signs.add(("of nobody",))
        case "the goals":
            shadow._goals = ()
        case _:
            shadow._clear()
    # One that changes the lists in any case.
    there.live(30.0, [*stream[15:], (["never seen"], "go", None)])
    assert there.catch_up(HOUR_S)
    assert there.sent[0].whole


def test_drift_costs_one_whole_and_no_more() -> None:
    """The heartbeats that were under way when the whole went out ask for no second one."""
    there = Shadowing(LinkConfig(up=MOON, down=MOON))
    there.live(40.0, STREAM[:30])
    assert there.is_caught_up
    there.shadow.model._hypotheses.fail(0)
    there.live(40.0, STREAM[30:])
    assert there.is_caught_up
    assert [update.whole for update in there.sent].count(True) == 2
    said = [GROUND_SHADOW.decode(r.payload) for r in there.records if r.topic == "/ground/shadow"]
    out = [entry for entry in said if not entry.in_step]
    assert 0 < len(out) < 5
    assert {entry.why for entry in out} == {
        f"its lists are not those on board after update {entry.number}" for entry in out
    }


def test_the_rover_notices_drift_that_the_ground_does_not() -> None:
    """What the ground says it holds is compared on board with what was sent."""
    there = Shadowing(LinkConfig(up=MOON, down=MOON))
    there.live(40.0, STREAM[:30])
    there.shadow.model._hypotheses.fail(0)
    there.shadow.check = there.shadow.model.lists_check()
    there.live(40.0)
    assert there.is_caught_up
    assert [update.whole for update in there.sent].count(True) == 2


def test_where_no_whole_helps_it_is_sent_ever_more_rarely() -> None:
    """A shadow that was made for another model can never be in step."""
    there = Shadowing(LinkConfig(up=MOON, down=MOON))
    there.shadow.model._agreed = [Parameters(alpha=0.9)]
    there.live(HOUR_S, STREAM)
    wholes = [update for update in there.sent if update.whole]
    assert 4 < len(wholes) < 12
    assert not there.shadow.in_step
    assert "another model" in str(there.shadow.why)


@pytest.mark.parametrize("window_ticks", [2, 5, 6])
def test_the_length_of_the_windows_changes_nothing(window_ticks: int) -> None:
    gap = Blackout(start_s=20.0, end_s=60.0)
    bad = OneWay(delay_s=1.2, rate_bit_s=2_000, loss=0.2, duplicate=0.2)
    link = LinkConfig(up=bad, down=bad, blackouts=(gap,))
    one, other = Shadowing(link), Shadowing(link, window_ticks=window_ticks)
    for there in (one, other):
        there.live(180.0, STREAM)
        assert there.is_caught_up
    # In a log, records are ordered by time; of one time, the rover's come first.
    assert set(map(_key, one.records)) == set(map(_key, other.records))
    assert len(one.records) == len(other.records)


def _key(record: Record) -> tuple[object, ...]:
    return record.topic, record.log_time_ns, record.payload


def test_in_an_hour_of_outage_little_is_kept_and_one_whole_tells_it_all() -> None:
    gap = Blackout(start_s=20.0, end_s=20.0 + HOUR_S)
    there = Shadowing(LinkConfig(up=MOON, down=MOON, blackouts=(gap,)))
    there.live(19.0, STREAM[:10])
    sent = len(there.sent)
    for _ in range(36):
        there.live(100.0, STREAM * 2)
        assert len(there.model._signs.recorded or ()) < 1200 + 5 * there.model.hypothesis_count
    assert len(there.sent) < sent + 20, "only until the silence counts as one"
    there.live(60.0)
    assert there.is_caught_up
    assert there.sent[-1].whole


def test_updates_hold_up_nothing_else() -> None:
    """On a link that telemetry fills as far as it may, it comes as often as without a shadow."""
    slow = OneWay(delay_s=1.2, rate_bit_s=1_500, queue_byte=65_536)
    came = []
    for stream in (STREAM * 10, []):
        there = Shadowing(LinkConfig(up=MOON, down=slow))
        there.live(300.0, stream, every_s=0.4)
        came.append(len(there.arrived))
        late_ns = max(now_ns - one.time_ns for now_ns, one in there.arrived)
        assert late_ns < to_ns(1.2 + 2.0 + 2.0)
        assert there.catch_up(300.0)
    assert came[0] > 0.97 * came[1]
    # Of 600 cycles, each of which changes the lists.
    assert len(there.sent) < 10
