"""Liveliness tokens through the emulator, between two Zenoh domains."""

import time

import pytest
import zenoh
from relaying import Between, between, until

from farside.link.profile.config import LinkConfig, OneWay
from farside.node import Direction

pytestmark = pytest.mark.processes


class Watch:
    """The tokens of the ground as a program there hears of them, with the times.

    It is a program of its own, for Zenoh may keep from a session what another `get` of the same
    session has found; and it hears once what Zenoh tells twice.
    """

    def __init__(self, both: Between, key: str) -> None:
        session = both.domains[Direction.DOWN].join()
        self.heard: list[str] = []
        self.times_ns: list[int] = []
        self._latest: dict[str, str] = {}
        # Kept, because it ends with the object.
        self._subscriber = session.liveliness().declare_subscriber(key, self._hear, history=True)

    def _hear(self, sample: zenoh.Sample) -> None:
        sign = "+" if sample.kind == zenoh.SampleKind.PUT else "-"
        key = str(sample.key_expr)
        if self._latest.get(key) != sign:
            self._latest[key] = sign
            self.times_ns.append(time.monotonic_ns())
            self.heard.append(f"{sign}{key}")


def there(session: zenoh.Session, key: str) -> list[str]:
    """The tokens that a `get` finds; Zenoh may tell of one twice."""
    replies = session.liveliness().get(key)
    return sorted({str(reply.ok.key_expr) for reply in replies if reply.ok})


def test_a_token_appears_and_vanishes_one_light_time_later() -> None:
    with between(LinkConfig(down=OneWay(delay_s=0.1)), down=["tlm/**"]) as both:
        ground = Watch(both, "tlm/**")
        began_ns = time.monotonic_ns()
        token = both.rover.liveliness().declare_token("tlm/camera")
        until(lambda: ground.heard == ["+tlm/camera"])
        assert ground.times_ns.pop() - began_ns >= 100_000_000
        until(lambda: there(both.ground, "tlm/**") == ["tlm/camera"])
        late = Watch(both, "tlm/**")
        until(lambda: late.heard == ["+tlm/camera"])
        began_ns = time.monotonic_ns()
        token.undeclare()
        until(lambda: ground.heard == ["+tlm/camera", "-tlm/camera"])
        assert ground.times_ns.pop() - began_ns >= 100_000_000
        assert there(both.ground, "tlm/**") == []
        assert both.state().down.counters.announcements == 2


def test_tokens_that_were_there_before_cross_too_and_only_in_the_direction_of_their_key() -> None:
    with between(up=["cmd/**"], down=["tlm/*", "*/camera"]) as both:
        near = both.ground.liveliness().declare_token("tlm/arm")
        tokens = [both.rover.liveliness().declare_token(f"{one}/camera") for one in ("tlm", "cmd")]
        until(lambda: there(both.ground, "**") == ["cmd/camera", "tlm/arm", "tlm/camera"])
        assert both.state().up.counters.announcements == 0
        assert both.state().down.counters.announcements == 2
        del near, tokens


def test_the_tokens_of_a_program_that_ends_vanish() -> None:
    with between(down=["tlm/**"]) as both:
        other = both.domains[Direction.UP].join()
        token = other.liveliness().declare_token("tlm/camera")
        ground = Watch(both, "tlm/**")
        until(lambda: ground.heard == ["+tlm/camera"])
        other.close()
        until(lambda: ground.heard == ["+tlm/camera", "-tlm/camera"])
        del token


def test_a_key_that_passes_both_ways_does_not_keep_itself_alive() -> None:
    """One token on each side, and one on both: each is gone when its own programs are."""
    with between(up=["@ros2_lv/**"], down=["@ros2_lv/**"]) as both:
        key = "@ros2_lv/**"
        tokens = {
            (side, name): session.liveliness().declare_token(f"@ros2_lv/{name}")
            for side, session in (("rover", both.rover), ("ground", both.ground))
            for name in (side, "both")
        }
        three = ["@ros2_lv/both", "@ros2_lv/ground", "@ros2_lv/rover"]
        until(lambda: there(both.rover, key) == there(both.ground, key) == three)
        tokens["rover", "both"].undeclare()
        tokens["rover", "rover"].undeclare()
        two = ["@ros2_lv/both", "@ros2_lv/ground"]
        until(lambda: there(both.rover, key) == there(both.ground, key) == two)
        tokens["ground", "both"].undeclare()
        tokens["ground", "ground"].undeclare()
        until(lambda: there(both.rover, key) == there(both.ground, key) == [])


def test_what_changes_during_an_outage_is_known_after_it_and_nothing_else_changes() -> None:
    with between(down=["tlm/**"]) as both:
        ground = Watch(both, "tlm/**")
        stays, goes = (both.rover.liveliness().declare_token(f"tlm/{one}") for one in ("a", "b"))
        until(lambda: sorted(ground.heard) == ["+tlm/a", "+tlm/b"])
        both.control(down={"out": True})
        goes.undeclare()
        comes = both.rover.liveliness().declare_token("tlm/c")
        flickers = both.rover.liveliness().declare_token("tlm/d")
        until(lambda: both.state().down.counters.outage == 3)
        flickers.undeclare()
        until(lambda: both.state().down.counters.outage == 4)
        assert len(ground.heard) == 2
        both.control(down={"out": False})
        until(lambda: len(ground.heard) == 4)
        assert sorted(ground.heard) == ["+tlm/a", "+tlm/b", "+tlm/c", "-tlm/b"]
        until(lambda: there(both.ground, "tlm/**") == ["tlm/a", "tlm/c"])
        del stays, comes
