"""Queries and their replies through the emulator, between two Zenoh domains."""

import time
from typing import Any

import pytest
import zenoh
from relaying import Between, between, until

from farside.link.profile.config import LinkConfig, OneWay
from farside.node import Direction

pytestmark = pytest.mark.processes

ALL_COMPLETE = zenoh.QueryTarget.ALL_COMPLETE
UNCONSOLIDATED = zenoh.ConsolidationMode.NONE
MOON = LinkConfig(up=OneWay(delay_s=0.05), down=OneWay(delay_s=0.07))
ROUND_TRIP_NS = 120_000_000


def serve(
    session: zenoh.Session, key: str, *texts: str, complete: bool = False
) -> zenoh.Queryable[None]:
    """A queryable that replies with `texts` to each query."""

    def answer(query: zenoh.Query) -> None:
        with query:
            for text in texts:
                query.reply(key, text)

    return session.declare_queryable(key, answer, complete=complete)


def ask(session: zenoh.Session, key: str, **how: Any) -> list[str]:
    """The replies to a query, as texts."""
    replies = session.get(key, **how)
    return sorted(
        f"error {reply.err.payload.to_string()}"
        if reply.ok is None
        else reply.ok.payload.to_string()
        for reply in replies
    )


def find(asker: zenoh.Session, server: zenoh.Session, key: str = "tlm/ready") -> None:
    """Wait until `asker` finds whatever `server` has declared so far, in the same order."""
    last = serve(server, key, "ready")
    until(lambda: ask(asker, key) == ["ready"])
    last.undeclare()


def crossed(both: Between, direction: Direction) -> int:
    """How many queries were sent through the link in a direction."""
    return both.state().way(direction).counters.queries


def test_a_query_and_its_reply_take_the_light_time_of_their_own_ways() -> None:
    with between(MOON, down=["tlm/**"]) as both:
        heard_ns: list[int] = []

        def answer(query: zenoh.Query) -> None:
            heard_ns.append(time.monotonic_ns())
            with query:
                query.reply("tlm/map", "craters")

        both.rover.declare_queryable("tlm/map", answer)
        find(both.ground, both.rover)
        began_ns = time.monotonic_ns()
        assert ask(both.ground, "tlm/map") == ["craters"]
        assert time.monotonic_ns() - began_ns >= ROUND_TRIP_NS
        [only_ns] = heard_ns
        assert only_ns - began_ns >= 50_000_000


def test_a_query_comes_out_as_it_went_in_and_so_do_its_replies() -> None:
    """Parameters, payload, encoding, attachment, source; replies that put, delete and fail."""
    seen: list[dict[str, object]] = []
    with between(down=["tlm/**"]) as both:
        stamp = both.rover.new_timestamp()

        def answer(query: zenoh.Query) -> None:
            assert query.payload is not None
            assert query.attachment is not None
            assert query.source_info is not None
            seen.append(
                {
                    "selector": str(query.selector),
                    "payload": query.payload.to_bytes(),
                    "encoding": str(query.encoding),
                    "attachment": query.attachment.to_bytes(),
                    "accepts": query.accepts_replies(),
                    "source": query.source_info.source_sn,
                }
            )
            with query:
                query.reply(
                    "tlm/map/1",
                    "craters",
                    encoding="text/plain;utf-8",
                    attachment="why",
                    timestamp=stamp,
                )
                query.reply_del("elsewhere", attachment="over")
                query.reply_err("no more", encoding="text/json")

        both.rover.declare_queryable("tlm/map/*", answer)
        find(both.ground, both.rover)
        replies = list(
            both.ground.get(
                "tlm/map/*?x=1;y=a",
                payload=b"\x00where",
                encoding="application/cdr;of.type",
                attachment="who",
                accept_replies=zenoh.ReplyKeyExpr.ANY,
                consolidation=UNCONSOLIDATED,
                source_info=zenoh.SourceInfo(both.ground.id, 7),
            )
        )
    assert seen == [
        {
            # The last is how Zenoh itself marks a query that accepts replies on any key.
            "selector": "tlm/map/*?x=1;y=a;_anyke",
            "payload": b"\x00where",
            "encoding": "application/cdr;of.type",
            "attachment": b"who",
            "accepts": zenoh.ReplyKeyExpr.ANY,
            "source": 7,
        }
    ]
    put, delete, error = replies
    assert put.ok is not None
    assert (str(put.ok.key_expr), put.ok.payload.to_string()) == ("tlm/map/1", "craters")
    assert str(put.ok.encoding) == "text/plain;utf-8"
    assert put.ok.attachment is not None
    assert put.ok.attachment.to_string() == "why"
    assert put.ok.timestamp == stamp
    assert delete.ok is not None
    assert (delete.ok.kind, str(delete.ok.key_expr)) == (zenoh.SampleKind.DELETE, "elsewhere")
    assert delete.ok.attachment is not None
    assert error.err is not None
    assert (error.err.payload.to_string(), str(error.err.encoding)) == ("no more", "text/json")


def test_a_query_that_nobody_on_the_far_side_could_answer_ends_without_crossing() -> None:
    with between(down=["tlm/**"]) as both:
        find(both.ground, both.rover)
        before = crossed(both, Direction.UP)
        assert ask(both.ground, "tlm/nobody") == []
        assert ask(both.ground, "elsewhere") == []
        assert crossed(both, Direction.UP) == before


def test_what_the_near_side_answers_completely_is_not_asked_on_the_far_side() -> None:
    with between(down=["tlm/**"]) as both:
        serve(both.rover, "tlm/map", "far")
        serve(both.ground, "tlm/map", "near", complete=True)
        find(both.ground, both.rover)
        before = crossed(both, Direction.UP)
        other = both.domains[Direction.DOWN].join()
        assert ask(other, "tlm/map") == ["near"]
        assert crossed(both, Direction.UP) == before


def test_a_key_served_on_both_sides_is_answered_once_by_each() -> None:
    with between(up=["chat/**"], down=["chat/**", "chat/*"]) as both:
        serve(both.rover, "chat/a", "rover")
        serve(both.ground, "chat/a", "ground")
        find(both.ground, both.rover, "chat/ready")
        find(both.rover, both.ground, "chat/steady")
        for direction in Direction:
            asker = both.domains[direction].join()
            replies = ask(asker, "chat/a", consolidation=UNCONSOLIDATED)
            assert replies == ["ground", "rover"]


def test_queries_cross_either_way_on_any_key_that_passes() -> None:
    with between(up=["cmd/**"], down=["tlm/**"]) as both:
        serve(both.rover, "cmd/state", "parked")
        serve(both.ground, "tlm/archive", "old")
        find(both.ground, both.rover)
        find(both.rover, both.ground)
        assert ask(both.ground, "cmd/state") == ["parked"]
        assert ask(both.rover, "tlm/archive") == ["old"]


def test_a_key_without_wildcards_is_there_on_the_near_side_as_it_is_on_the_far_side() -> None:
    """Found by whoever looks for it or asks for complete ones only, and gone when it is gone."""
    with between(down=["tlm/map"]) as both:
        looking = both.ground.declare_querier("tlm/map")
        insisting = both.ground.declare_querier("tlm/map", target=ALL_COMPLETE)

        def found() -> tuple[bool, bool]:
            one, other = looking.matching_status, insisting.matching_status
            return one.matching, other.matching  # type: ignore[attr-defined]

        assert found() == (False, False)
        first = serve(both.rover, "tlm/map", "part")
        until(lambda: found() == (True, False))
        assert ask(both.ground, "tlm/map", target=ALL_COMPLETE) == []
        first.undeclare()
        until(lambda: found() == (False, False))
        serve(both.rover, "tlm/map", "all", complete=True)
        until(lambda: found() == (True, True))
        assert ask(both.ground, "tlm/map", target=ALL_COMPLETE) == ["all"]
        assert ask(both.ground, "tlm/*") == ["all"]


def test_a_service_of_ros_is_complete_on_the_near_side_once_its_token_has_crossed() -> None:
    key = "0/arm/move/srv::dds_::Move_/hash"
    life = "@ros2_lv/0/z/0/1/SS/%/%/node/%arm%move/srv::dds_::Move_/hash/qos"
    with between(down=["0/**", "@ros2_lv/**"]) as both:
        service = serve(both.rover, key, "moved", complete=True)
        alive = both.rover.liveliness().declare_token(life)
        until(lambda: ask(both.ground, key, target=ALL_COMPLETE) == ["moved"])
        assert ask(both.ground, "0/**", consolidation=UNCONSOLIDATED) == ["moved"]
        alive.undeclare()
        service.undeclare()
        until(lambda: ask(both.ground, key, target=ALL_COMPLETE) == [])


@pytest.mark.parametrize("lossy", ["up", "down"])
def test_a_lost_query_or_reply_is_no_reply_until_the_callers_time_is_up(lossy: str) -> None:
    with between(down=["tlm/**"]) as both:
        serve(both.rover, "tlm/map", "craters")
        find(both.ground, both.rover)
        both.control(**{lossy: {"loss": 1.0}})
        # Each router on the way may say so.
        assert {*ask(both.ground, "tlm/map", timeout=0.05)} == {"error Timeout"}
        both.control(**{lossy: {"loss": 0.0}})
        assert ask(both.ground, "tlm/map") == ["craters"]


def test_a_lost_end_is_sent_again() -> None:
    """Nobody replies, and word of that is lost: the caller hears of it when the link is back."""
    with between(LinkConfig(up=OneWay(delay_s=0.02)), down=["tlm/**"]) as both:
        both.rover.declare_queryable("tlm/map", lambda query: query.drop())
        find(both.ground, both.rover)
        both.control(down={"out": True})
        replies = both.ground.get("tlm/map")
        until(lambda: both.state().down.counters.outage == 1)
        both.control(down={"out": False})
        assert list(replies) == []


def test_a_query_is_asked_for_as_long_as_its_caller_waits() -> None:
    """However short the emulator's own patience would be."""
    with between(MOON, down=["tlm/**"], queries_default_timeout=20) as both:
        kept: list[zenoh.Query] = []
        both.rover.declare_queryable("tlm/map", kept.append)
        find(both.ground, both.rover)
        replies = both.ground.get("tlm/map")
        until(lambda: bool(kept))
        until(lambda: both.state().elapsed_s > 0.5)
        with kept.pop() as query:
            query.reply("tlm/map", "at last")
        assert [reply.ok.payload.to_string() for reply in replies if reply.ok] == ["at last"]


def test_a_round_trip_that_outlasts_zenohs_patience_is_told_of_once() -> None:
    far_away = OneWay(delay_s=6.0)
    with between(LinkConfig(up=far_away, down=far_away), down=["tlm/**"]) as both:
        queryable = serve(both.rover, "tlm/map", "craters")
        del queryable
        for _ in range(2):
            until(lambda: "error Timeout" in ask(both.ground, "tlm/map", timeout=0.01))
        [line] = both.told
        assert line.startswith("a query and its answer take 12.0 s: whoever asks for no longer")


def test_bits_are_flipped_in_queries_and_in_replies() -> None:
    def echo(query: zenoh.Query) -> None:
        with query:
            assert query.payload is not None
            query.reply("tlm/echo", query.payload)

    for way, flips in (("up", 1), ("down", 1)):
        with between(down=["tlm/**"]) as both:
            both.rover.declare_queryable("tlm/echo", echo)
            find(both.ground, both.rover)
            both.control(**{way: {"corrupt": 1.0}})
            [reply] = both.ground.get("tlm/echo", payload=b"\0\0\0\0")
            assert reply.ok is not None
            echoed = reply.ok.payload.to_bytes()
            assert int.from_bytes(echoed, "big").bit_count() == flips


def test_a_duplicate_is_neither_asked_nor_given_twice() -> None:
    with between(down=["tlm/**"]) as both:
        asked: list[str] = []

        def answer(query: zenoh.Query) -> None:
            with query:
                asked.append(str(query.key_expr))
                query.reply("tlm/map", "craters")

        both.rover.declare_queryable("tlm/map", answer)
        find(both.ground, both.rover)
        both.control(both={"duplicate": 1.0})
        assert ask(both.ground, "tlm/map", consolidation=UNCONSOLIDATED) == ["craters"]
        assert asked == ["tlm/map"]


def test_the_emulators_own_keys_never_cross() -> None:
    with between(up=["**"], down=["**"]) as both:
        heard: list[str] = []
        for session in (both.rover, both.ground):
            session.declare_subscriber("**", lambda sample: heard.append(str(sample.key_expr)))
        find(both.rover, both.ground)
        find(both.ground, both.rover)
        [reply] = both.ground.get("farside/link/counters")
        assert reply.ok is not None
        assert ask(both.rover, "farside/link/counters") == []
        [counters] = both.ground.get("farside/link/*")
        assert counters.ok is not None
        assert str(counters.ok.key_expr) == "farside/link/counters"
        both.rover.put("farside/link/control", "mine")
        both.rover.put("after", "")
        until(lambda: heard.count("after") == 2)
        assert heard.count("farside/link/control") == 1


def test_what_an_advanced_subscriber_missed_it_is_told_after_an_outage() -> None:
    """It waits for the end of its query, and forgets no query by itself."""
    with between(down=["tlm/**"]) as both:
        key = "tlm/map/@adv/pub/1/2/_"

        def recall(query: zenoh.Query) -> None:
            with query:
                for text in ("one", "two"):
                    query.reply("tlm/map", text)

        both.rover.declare_queryable(key, recall)
        find(both.ground, both.rover)
        both.control(both={"out": True})
        replies = both.ground.get(
            "tlm/map/@adv/**",
            accept_replies=zenoh.ReplyKeyExpr.ANY,
            consolidation=UNCONSOLIDATED,
            timeout=60.0,
        )
        until(lambda: both.state().up.counters.outage > 0)
        both.control(both={"out": False})
        assert [reply.ok.payload.to_string() for reply in replies] == ["one", "two"]
