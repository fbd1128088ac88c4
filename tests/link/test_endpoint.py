"""Messages in, frames across, messages out."""

from collections.abc import Callable, Sequence
from typing import Any

import msgspec.inspect as mi
import pytest
from any_message import values
from hypothesis import given
from hypothesis import strategies as st

from farside.control import Failsafe, Mode
from farside.frames import Carried, FrameEvent, FrameStage
from farside.link import LinkConfig, LinkTerms, OneWay, ground_endpoint, rover_endpoint
from farside.link.endpoint.stored import StoreState
from farside.logs import decode
from farside.messages import (
    Command,
    Downlink,
    Drive,
    Event,
    GoalReached,
    Heartbeat,
    ModelUpdate,
    Proposal,
    ProposedStep,
    SetGoal,
    Shown,
    Telemetry,
    Uplink,
)
from farside.node import Direction, Frame, Journal, to_ns

SECOND = to_ns(1)


def config(rate_bit_s: int | None = None, **changes: Any) -> LinkConfig:
    one_way = OneWay(delay_s=1.0, rate_bit_s=rate_bit_s)
    return LinkConfig(up=one_way, down=one_way, **changes)


class Pair:
    """Both ends, and a link of one second between them that loses what it is told to."""

    def __init__(self, seed: int = 1, **changes: Any) -> None:
        terms = LinkTerms.simulated(config(**changes), seed)
        self.journal = Journal()
        self.rover = rover_endpoint(terms, self.journal)
        self.ground = ground_endpoint(terms, self.journal)
        self.now_ns = 0
        self.at_rover: list[Any] = []
        self.at_ground: list[Any] = []
        self._events: list[FrameEvent] = []

    def live(self, time_s: float, loses: Callable[[Frame], bool] = lambda _: False) -> None:
        """Go on for some seconds, tenth by tenth."""
        for _ in range(round(10 * time_s)):
            for end, other, heard in (
                (self.rover, self.ground, self.at_ground),
                (self.ground, self.rover, self.at_rover),
            ):
                end.pump(self.now_ns)
                other.expect(arriving(frame) for frame in end.take_sent() if not loses(frame))
                heard.extend(arrival.message for arrival in other.received(self.now_ns))
            self.now_ns += SECOND // 10

    @property
    def events(self) -> list[FrameEvent]:
        for record in self.journal.take():
            event = decode(record)
            assert isinstance(event, FrameEvent)
            self._events.append(event)
        return self._events

    def stages(self, direction: Direction) -> list[FrameStage]:
        return [event.stage for event in self.events if event.direction is direction]


def arriving(frame: Frame) -> Frame:
    return Frame(frame.direction, frame.sequence, frame.time_ns + SECOND, frame.payload)


def telemetry(time_ns: int = 0) -> Telemetry:
    return Telemetry(
        time_ns=time_ns,
        tokens=("at:A",),
        x_m=0.0,
        y_m=0.0,
        heading_rad=0.0,
        battery=1.0,
        mode=Mode.GUIDED,
        failsafe=Failsafe.NOMINAL,
        action=None,
        goals=(),
        commands_done=0,
    )


def test_messages_come_out_as_they_went_in() -> None:
    pair = Pair()
    order = Command(1, 99, SetGoal(("at:A",), 2.0))
    pair.ground.send(order, 0)
    pair.ground.send(Heartbeat(), 0)
    pair.ground.send(Shown(1), 0)
    pair.live(2)
    assert pair.at_rover == [order, Heartbeat(), Shown(1)]


@given(st.one_of(*(values(mi.type_info(kind)) for kind in (Command, Heartbeat, Shown))))
def test_whatever_the_ground_says_the_rover_hears(message: Uplink) -> None:
    pair = Pair()
    pair.ground.send(message, 0)
    pair.live(2)
    assert pair.at_rover == [message]


@given(st.one_of(*(values(mi.type_info(kind)) for kind in (Event, Proposal, Telemetry))))
def test_whatever_the_rover_says_the_ground_hears(message: Downlink) -> None:
    pair = Pair()
    pair.rover.send(message, 0)
    pair.live(2)
    assert pair.at_ground == [message]


def test_nothing_is_read_before_it_arrives() -> None:
    pair = Pair()
    pair.ground.send(Heartbeat(), 0)
    pair.live(1)
    assert pair.at_rover == []
    pair.live(0.1)
    assert pair.at_rover == [Heartbeat()]


def test_commands_arrive_in_order_and_once_whatever_is_lost() -> None:
    pair = Pair()
    commands = [Command(number, 99, Drive("N")) for number in range(1, 20)]
    for command in commands:
        pair.ground.send(command, pair.now_ns)
    pair.live(60, loses=lambda frame: frame.sequence % 3 == 0)
    pair.live(60)
    assert pair.at_rover == commands


def test_that_a_proposal_was_shown_arrives_whatever_is_lost() -> None:
    """Without it no veto window would ever run."""
    pair = Pair()
    pair.ground.send(Shown(1), 0)
    pair.live(5, loses=lambda _: True)
    pair.live(60)
    assert pair.at_rover == [Shown(1)]


def test_telemetry_and_heartbeats_are_never_retransmitted() -> None:
    pair = Pair()
    pair.rover.send(telemetry(), 0)
    pair.ground.send(Heartbeat(), 0)
    pair.live(60, loses=lambda _: True)
    assert pair.events[-1].stage is FrameStage.MADE
    assert len(pair.events) == 2


def test_a_message_longer_than_a_frame_is_cut_and_reassembled() -> None:
    pair = Pair(mtu_byte=128)
    path = tuple(ProposedStep((f"at:{n},0",), "E", float(n)) for n in range(30))
    proposal = Proposal(1, 0, ("at:30,0",), "E", path)
    wide = msg_with_many_goals()
    pair.rover.send(proposal, 0)
    pair.rover.send(wide, 0)
    pair.live(20)
    assert sorted(pair.at_ground, key=lambda message: type(message).__name__) == [proposal, wide]
    assert all(event.size_byte <= 128 for event in pair.events)


def test_the_record_of_a_frame_says_which_part_of_which_message_it_carries() -> None:
    """And how often that was sent; the receiver names what it has whole, reports carry nothing."""
    pair = Pair(mtu_byte=128)
    path = tuple(ProposedStep((f"at:{n},0",), "E", float(n)) for n in range(6))
    pair.rover.send(Proposal(4, 0, ("at:6,0",), "E", path), 0)
    pair.live(0.1, loses=lambda frame: frame.sequence == 1)
    pair.live(20)
    made = [event for event in pair.events if event.stage is FrameStage.MADE]
    parts = [one for event in made if event.direction is Direction.DOWN for one in event.carries]
    count = parts[0].parts
    assert [one.part for one in parts] == [*range(1, count + 1), 2]
    assert parts[-1] == Carried("proposal", 4, 0, part=2, parts=count, attempt=2)
    assert {event.what for event in made if not event.carries} == {"report"}
    used = [one for event in pair.events if event.stage is FrameStage.USED for one in event.carries]
    assert used == [Carried("proposal", 4, 0)]


def msg_with_many_goals() -> Telemetry:
    values = telemetry()
    return Telemetry(
        **{name: getattr(values, name) for name in values.__struct_fields__ if name != "goals"},
        goals=tuple((f"at:{n},{n}",) for n in range(40)),
    )


def test_what_waited_for_the_link_arrives_marked_as_stored_oldest_first() -> None:
    pair = Pair()
    for number in range(5):
        pair.rover.store(telemetry(number), number)
    assert pair.rover.take_sent() == []
    pair.rover.forward(SECOND)
    pair.live(3)
    assert [message.time_ns for message in pair.at_ground] == list(range(5))
    assert {event.stored for event in pair.events} == {True}


def test_a_full_store_drops_the_oldest() -> None:
    pair = Pair(store_byte=1000)
    dropped = [pair.rover.store(telemetry(number), number) for number in range(20)]
    assert sum(dropped) > 0
    pair.rover.forward(SECOND)
    pair.live(3)
    assert pair.at_ground[-1].time_ns == 19
    assert pair.at_ground[0].time_ns == sum(dropped)


def test_what_was_stored_arrives_though_frames_of_it_are_lost() -> None:
    pair = Pair()
    for number in range(40):
        pair.rover.store(telemetry(number), number)
    lossy = iter([True, False, False] * 1000)
    for _ in range(600):
        pair.rover.forward(pair.now_ns)
        pair.live(0.1, loses=lambda _: next(lossy))
    assert [message.time_ns for message in pair.at_ground] == list(range(40))
    assert pair.rover.store_state == StoreState(kept=40, given_up=0, waiting=0)


def test_a_stored_frame_is_genuine_however_many_others_overtake_it() -> None:
    """It waits in the transmit queue below thousands of live frames that leave before it."""
    pair = Pair()
    pair.rover.store(telemetry(7), 7)
    pair.rover.forward(0)
    (stored,) = pair.rover.take_sent()
    pair.live(1)
    for _ in range(3000):
        pair.rover.send(telemetry(), pair.now_ns)
    pair.live(2)
    assert pair.at_ground.count(telemetry()) == 3000

    pair.ground.expect([Frame(stored.direction, stored.sequence, pair.now_ns, stored.payload)])
    assert [one.message for one in pair.ground.received(pair.now_ns)] == [telemetry(7)]


def test_stored_messages_take_only_what_live_ones_leave_of_the_rate() -> None:
    pair = Pair(rate_bit_s=2000)
    for number in range(40):
        pair.rover.store(telemetry(number), number)
    pair.rover.send(telemetry(), 0)
    pair.rover.forward(0)
    sent = pair.rover.take_sent()
    assert [frame.priority for frame in sent] == [1], "the transmitter is busy with the live one"
    interval_ns = pair.rover.telemetry_interval_ns(0)
    assert interval_ns == pytest.approx(2 * 8 * len(sent[0].payload) / 2000 * 1e9, rel=0.05)


def test_what_expires_in_the_transmit_queue_holds_up_nothing() -> None:
    """In silence, telemetry is made faster than this link could ever send it."""
    pair = Pair(rate_bit_s=300)
    pair.rover.store(telemetry(7), 7)
    for _ in range(60):
        pair.rover.send(telemetry(), pair.now_ns)
        pair.live(1, loses=lambda _: True)
    pair.live(20)
    pair.rover.forward(pair.now_ns)
    assert [frame.priority for frame in pair.rover.take_sent()] == [0]


def update(number: int, size_byte: int = 10) -> ModelUpdate:
    return ModelUpdate(number, 0, 1, 99, bytes(size_byte))


def test_what_is_sent_aside_goes_before_what_is_stored_and_takes_none_of_the_store() -> None:
    pair = Pair()
    for number in range(3):
        pair.rover.store(telemetry(number), number)
    state = pair.rover.store_state
    assert pair.rover.send_aside(update(1), 0)
    assert pair.rover.send_aside(update(2, 3000), 0), "in place of the first, which has not begun"
    assert pair.rover.aside_waits
    for _ in range(10):
        pair.rover.forward(pair.now_ns)
        pair.live(0.1)
    assert not pair.rover.aside_waits
    assert (state, pair.rover.store_state) == (StoreState(3, 0, 3), StoreState(3, 0, 3))
    pair.live(10)
    assert pair.at_ground == [update(2, 3000), *(telemetry(number) for number in range(3))]
    assert pair.rover.store_state == StoreState(3, 0, 0)
    made = [e.what for e in pair.events if e.stage is FrameStage.MADE and e.stored]
    assert made[:4] == ["ModelUpdate segment"] * 4
    assert made.count("ModelUpdate segment") == 4


def test_what_is_longer_than_any_message_may_be_is_not_taken() -> None:
    pair = Pair()
    assert not pair.rover.send_aside(update(1, 5_000_000), 0)
    assert not pair.rover.aside_waits
    assert pair.rover.send_aside(update(2, 3_000_000), 0)


def test_updates_of_the_model_leave_telemetry_its_share_of_the_rate() -> None:
    pair = Pair(rate_bit_s=2000)
    pair.rover.send(telemetry(), 0)
    alone_ns = pair.rover.telemetry_interval_ns(0)
    pair.live(5)
    pair.rover.send_aside(update(1), 0)
    pair.rover.forward(pair.now_ns)
    assert pair.rover.telemetry_interval_ns(pair.now_ns) == alone_ns


def test_in_terrain_shadow_nothing_goes_out_and_nothing_comes_in() -> None:
    pair = Pair()
    pair.rover.in_shadow = True
    pair.rover.send(telemetry(), 0)
    pair.ground.send(Heartbeat(), 0)
    pair.live(2)
    assert (pair.at_rover, pair.at_ground) == ([], [])
    assert pair.stages(Direction.DOWN) == [FrameStage.MADE, FrameStage.SHADOWED]
    assert pair.stages(Direction.UP) == [FrameStage.MADE, FrameStage.SHADOWED]
    assert pair.rover.heard_ns is None


def test_an_event_made_in_shadow_arrives_after_it() -> None:
    pair = Pair()
    pair.rover.in_shadow = True
    pair.rover.send(event := Event(1, 0, GoalReached(("at:A",))), 0)
    pair.live(30)
    pair.rover.in_shadow = False
    pair.live(60)
    assert pair.at_ground == [event]


def replayed(frame: Frame, _: Pair) -> Frame:
    return frame


def turned_back(frame: Frame, pair: Pair) -> Frame:
    pair.rover.send(telemetry(), 0)
    (down,) = pair.rover.take_sent()
    return Frame(Direction.UP, 0, 0, down.payload)


def flipped(frame: Frame, _: Pair) -> Frame:
    payload = bytearray(frame.payload)
    payload[5] ^= 4
    return Frame(Direction.UP, 0, 0, bytes(payload))


def cut_short(frame: Frame, _: Pair) -> Frame:
    return Frame(Direction.UP, 0, 0, frame.payload[:10])


def of_another_mission(frame: Frame, _: Pair) -> Frame:
    other = Pair(seed=2)
    other.ground.send(Heartbeat(), 0)
    return other.ground.take_sent()[0]


@pytest.mark.parametrize(
    ("attack", "reason"),
    [
        (replayed, "replayed"),
        (turned_back, "forged"),
        (flipped, "corrupted"),
        (cut_short, "truncated"),
        (of_another_mission, "forged"),
    ],
)
def test_what_the_other_end_did_not_send_is_refused_and_recorded(
    attack: Callable[[Frame, Pair], Frame], reason: str
) -> None:
    pair = Pair()
    pair.ground.send(Heartbeat(), 0)
    (frame,) = pair.ground.take_sent()
    pair.rover.expect([frame])
    assert len(list(pair.rover.received(0))) == 1
    pair.rover.expect([attack(frame, pair)])
    assert list(pair.rover.received(0)) == []
    assert (pair.events[-1].stage, pair.events[-1].what) == (FrameStage.REFUSED, reason)


@given(st.lists(st.binary(max_size=80), max_size=5))
def test_no_bytes_stop_an_endpoint(payloads: Sequence[bytes]) -> None:
    pair = Pair()
    pair.rover.expect(Frame(Direction.UP, n, 0, payload) for n, payload in enumerate(payloads))
    assert list(pair.rover.received(0)) == []
    assert pair.rover.heard_ns is None
