"""What crosses beside samples, without clock and Zenoh: tokens as a state, queries with replies."""

from hypothesis import given
from hypothesis import strategies as st

from farside.link.emulator import Emulator, Kind
from farside.link.emulator.crossing.exchanges import Exchanges
from farside.link.emulator.crossing.presence import Announcement, Presence
from farside.link.emulator.crossing.ros import service_key
from farside.link.profile.config import Blackout, LinkConfig, OneWay
from farside.node import Direction

UP, DOWN = Direction.UP, Direction.DOWN
S = 1_000_000_000


def send(subject: Emulator[str], cargo: str, *, matters: bool = True) -> None:
    """Send what must arrive, while it `matters`."""
    subject.send(UP, 0, b"", cargo, kind=Kind.ANNOUNCEMENT, matters=lambda: matters)


def arrivals(subject: Emulator[str], until_ns: int) -> list[tuple[int, str]]:
    """When what arrives until then, in steps as a relay would make them."""
    came = []
    now_ns = 0
    while now_ns < until_ns:
        next_ns = subject.next_ns
        now_ns = until_ns if next_ns is None else min(max(next_ns, now_ns) + 1, until_ns)
        came += [(at_ns, cargo) for at_ns, _, _, cargo in subject.advance(now_ns)]
    return came


def test_what_must_arrive_is_sent_again_after_an_outage() -> None:
    """Out from 0 to 5 s at the rover's end: sent at 0, lost, and sent again once it is over."""
    blackouts = (Blackout(start_s=0.0, end_s=5.0),)
    subject: Emulator[str] = Emulator(LinkConfig(up=OneWay(delay_s=0.5), blackouts=blackouts))
    send(subject, "token")
    [(at_ns, cargo)] = arrivals(subject, 20 * S)
    assert cargo == "token"
    assert 5 * S < at_ns < 7 * S
    counters = subject.state().up.counters
    assert (counters.outage, counters.delivered, counters.announcements) == (1, 1, 2)


def test_what_must_arrive_is_sent_until_it_does() -> None:
    subject: Emulator[str] = Emulator(LinkConfig(up=OneWay(loss=0.9)), seed=1)
    for number in range(20):
        send(subject, str(number))
    came = arrivals(subject, 600 * S)
    assert sorted(int(cargo) for _, cargo in came) == list(range(20))
    assert subject.next_ns is None


def test_what_does_not_matter_any_more_is_not_sent_again() -> None:
    subject: Emulator[str] = Emulator(LinkConfig(up=OneWay(loss=1.0)))
    send(subject, "old", matters=False)
    assert arrivals(subject, 10 * S) == []
    assert subject.state().up.counters.announcements == 1
    assert subject.next_ns is None


def test_any_other_message_is_sent_once() -> None:
    subject: Emulator[str] = Emulator(LinkConfig(up=OneWay(loss=1.0)))
    subject.send(UP, 0, b"x", "sample")
    assert arrivals(subject, 10 * S) == []
    assert subject.state().up.counters.received == 1


Step = tuple[str, int]
KEYS = ("a", "b")


@given(
    st.lists(st.tuples(st.sampled_from(["toggle", "arrive", "copy", "lose"]), st.integers(0, 9)))
)
def test_the_other_side_knows_in_the_end_whatever_is_lost_doubled_or_overtaken(
    steps: list[Step],
) -> None:
    subject = Presence()
    under_way: list[Announcement] = []
    lost: list[Announcement] = []
    arrived: list[Announcement] = []
    known: set[str] = set()

    def arrive(one: Announcement) -> None:
        if subject.arrive(one):
            # Only news are told, so nothing appears or vanishes twice.
            assert (one.key in known) is not one.present
            (known.add if one.present else known.discard)(one.key)

    for what, number in steps:
        if what == "toggle":
            key = KEYS[number % 2]
            made = subject.change(key, present=key not in subject.here)
            under_way += [made] if made else []
        elif what == "copy" and arrived:
            arrive(arrived[number % len(arrived)])
        elif under_way:
            one = under_way.pop(number % len(under_way))
            if what == "lose":
                lost.append(one)
            else:
                arrived.append(one)
                arrive(one)
    for one in [*under_way, *(one for one in lost if subject.is_latest(one))]:
        arrive(one)
    for one in arrived:
        arrive(one)
    assert known == subject.known == subject.here


def test_a_query_ends_when_all_its_replies_have_arrived_whatever_overtakes_them() -> None:
    subject: Exchanges[str] = Exchanges()
    number = subject.begin("query", 0)
    assert subject.ask(number)
    assert not subject.ask(number)
    first, second = subject.reply(number), subject.reply(number)
    assert (first, second, subject.end(number)) == (1, 2, 2)
    assert subject.finish(number, 5, total=2) is None
    assert subject.receive(number, 2, 6) == "query"
    assert subject.receive(number, 2, 7) is None
    assert subject.finish(number, 7) is None
    assert subject.receive(number, 1, 9) == "query"
    assert subject.finish(number, 9) == "query"
    assert not subject.is_open(number)
    assert subject.longest_ns == 9


def test_a_query_of_which_a_reply_is_lost_stays_open() -> None:
    subject: Exchanges[str] = Exchanges()
    number = subject.begin("query", 0)
    subject.ask(number)
    subject.reply(number)
    assert subject.finish(number, 1, total=1) is None
    assert subject.is_open(number)


def test_of_too_many_open_queries_the_oldest_is_closed() -> None:
    subject: Exchanges[str] = Exchanges(max_open=2)
    numbers = [subject.begin(name, 0) for name in ("a", "b")]
    assert subject.overflow() is None
    subject.begin("c", 0)
    assert subject.overflow() == (numbers[0], "a")
    assert subject.overflow() is None
    late = numbers[0]
    assert not subject.ask(late)
    assert (subject.reply(late), subject.end(late)) == (None, None)
    assert (subject.receive(late, 1, 0), subject.finish(late, 0)) == (None, None)


def test_a_services_token_tells_its_key() -> None:
    entity = "@ros2_lv/7/{0}/1/2/{1}/%/%ns/node/%ns%arm%move/srv::dds_::Move_/RIHS01_ab/::,:,"
    assert service_key(entity.format("z", "SS")) == "7/ns/arm/move/srv::dds_::Move_/RIHS01_ab"
    assert service_key(entity.format("z", "SC")) is None
    assert service_key(entity.format("z", "SS").replace("@ros2_lv", "lv")) is None
    assert service_key("@ros2_lv/7/z/1/1/NN/%/%/node") is None
