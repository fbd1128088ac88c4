"""Samples through the emulator, between two Zenoh domains, with all that they carry."""

from typing import Any

import pytest
import zenoh
import zenoh.ext
from relaying import between, until

from farside.node import Direction

pytestmark = pytest.mark.processes


def described(sample: zenoh.Sample) -> dict[str, object]:
    """All that Zenoh shows of a sample."""
    attachment, source = sample.attachment, sample.source_info
    return {
        "key": str(sample.key_expr),
        "kind": sample.kind,
        "payload": sample.payload.to_bytes(),
        "encoding": str(sample.encoding),
        "attachment": None if attachment is None else attachment.to_bytes(),
        "priority": sample.priority,
        "express": sample.express,
        "congestion control": sample.congestion_control,
        "timestamp": sample.timestamp,
        "source": source and (str(source.source_id.zid), source.source_id.eid, source.source_sn),
    }


def matches(publisher: zenoh.Publisher) -> bool:
    """Whether Zenoh knows of a subscriber."""
    # Zenoh declares this a bool, and gives an object that is always true.
    status: bool = publisher.matching_status.matching  # type: ignore[attr-defined]
    return status


def test_all_that_a_sample_carries_crosses() -> None:
    with between(up=["cmd/**"]) as both:
        # Those of the near side hear what was sent, those of the far side what arrived.
        sent: list[dict[str, object]] = []
        came: list[dict[str, object]] = []
        near = both.ground
        near.declare_subscriber("**", lambda sample: sent.append(described(sample)))
        both.rover.declare_subscriber("**", lambda sample: came.append(described(sample)))
        publisher = near.declare_publisher("cmd/x", allowed_destination=zenoh.Locality.REMOTE)
        until(lambda: matches(publisher))
        for number, priority in enumerate(
            (zenoh.Priority.REAL_TIME, zenoh.Priority.DATA_HIGH, zenoh.Priority.BACKGROUND)
        ):
            how: dict[str, Any] = {
                "priority": priority,
                "express": bool(number % 2),
                "attachment": b"\x00why",
                "timestamp": near.new_timestamp(),
                "congestion_control": zenoh.CongestionControl.BLOCK,
                "source_info": zenoh.SourceInfo(near.id, number),
            }
            near.put(f"cmd/arm/{number}", b"\x00up", encoding="application/cdr;a.type", **how)
            near.delete(f"cmd/arm/{number}", **how)
        near.put("cmd/plain", "")
        until(lambda: len(came) == 7)
    # What has a higher priority may overtake others in Zenoh itself.
    came.sort(key=lambda sample: str(sample["key"]))
    # The emulator drops nothing, whatever the publisher allows.
    assert sent[-1]["congestion control"] == zenoh.CongestionControl.DROP
    sent[-1]["congestion control"] = zenoh.CongestionControl.BLOCK
    assert came == sent
    assert sent[0]["source"] == (str(near.info.zid()), near.id.eid, 0)


MISSES_TOLD = zenoh.ext.MissDetectionConfig(heartbeat=0.02, sporadic_heartbeat=None)


def test_an_advanced_subscriber_is_told_of_each_sample_that_the_link_loses() -> None:
    """40 samples, half of them lost: what has not arrived is told as missed."""
    with between(down=["tlm/**"]) as both:
        came: list[int] = []
        missed: list[int] = []
        subscriber = zenoh.ext.declare_advanced_subscriber(
            both.ground,
            "tlm/pose",
            lambda sample: came.append(int(sample.payload.to_string())),
            recovery=zenoh.ext.RecoveryConfig(heartbeat=True, periodic_queries=None),
        )
        misses = subscriber.sample_miss_listener(lambda miss: missed.append(miss.nb))
        publisher = zenoh.ext.declare_advanced_publisher(
            both.rover, "tlm/pose", sample_miss_detection=MISSES_TOLD
        )
        # Both routers know who listens: the relay on the one side, the subscriber on the other.
        other = both.domains[Direction.DOWN].join()
        ready = [one.declare_publisher("tlm/pose") for one in (both.rover, other)]
        until(lambda: all(map(matches, ready)))
        # Zenoh tells of what is missing between two samples that have arrived.
        publisher.put("0")
        until(lambda: came == [0])
        both.control(down={"loss": 0.5})
        for number in range(1, 41):
            publisher.put(str(number))
        until(lambda: both.state().down.counters.received > 40)
        both.control(down={"loss": 0.0})
        publisher.put("41")
        until(lambda: len(came) + sum(missed) == 42)
        assert 8 < len(came) < 34
        assert came == sorted(came)
        del misses


def test_a_late_advanced_subscriber_gets_what_was_published_before() -> None:
    with between(down=["tlm/*"]) as both:
        publisher = zenoh.ext.declare_advanced_publisher(
            both.rover,
            "tlm/map",
            cache=zenoh.ext.CacheConfig(3),
            sample_miss_detection=MISSES_TOLD,
            publisher_detection=True,
        )
        live: list[str] = []
        both.ground.declare_subscriber("tlm/map", lambda one: live.append(one.payload.to_string()))
        until(lambda: bool(publisher.put("x") or live))
        for number in range(5):
            publisher.put(str(number))
        until(lambda: live[-1] == "4")
        came: list[str] = []
        found: list[str] = []
        subscriber = zenoh.ext.declare_advanced_subscriber(
            both.ground,
            "tlm/map",
            lambda sample: came.append(sample.payload.to_string()),
            history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
            subscriber_detection=True,
        )
        detection = subscriber.detect_publishers(
            lambda sample: found.append(str(sample.key_expr)), history=True
        )
        until(lambda: list(dict.fromkeys(came)) == ["2", "3", "4"] and bool(found))
        publisher.put("5")
        until(lambda: "5" in came)
        # Twice where it comes both live and as history: a reply does not say whose it is.
        assert list(dict.fromkeys(came)) == ["2", "3", "4", "5"]
        assert len(set(found)) == 1
        # The publisher's side finds the subscriber, too.
        pattern = "tlm/map/@adv/sub/**"
        until(lambda: bool(list(both.rover.liveliness().get(pattern))))
        del detection
