"""Liveliness tokens without Zenoh: what comes and goes while they are counted."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import zenoh

from farside.link.emulator.crossing.presence import Announcement
from farside.link.emulator.crossing.tokens import COUNT_NS, Tokens

KEY = "tlm/camera"


class Side:
    """A session, and the link and loop behind it, which answers when the test says so."""

    def __init__(self) -> None:
        self.there: set[str] = set()
        self.answers: list[Callable[[], None]] = []
        self.told: list[bool] = []
        self.hear: Callable[[Any], None] = print

    def liveliness(self) -> "Side":
        return self

    def declare_subscriber(self, _key: object, handler: Any, *, history: bool) -> object:
        assert history
        self.hear = handler.callback
        return handler

    def get(self, _key: object, handler: Any) -> None:
        found = sorted(self.there)

        def answer() -> None:
            for key in found:
                handler.callback(SimpleNamespace(ok=SimpleNamespace(key_expr=key)))
            handler.drop()

        self.answers.append(answer)

    def set(self, key: str, *, present: bool) -> None:
        """A program declares a token, or takes it back."""
        (self.there.add if present else self.there.discard)(key)
        kind = zenoh.SampleKind.PUT if present else zenoh.SampleKind.DELETE
        self.hear(SimpleNamespace(key_expr=zenoh.KeyExpr(key), kind=kind))

    def announce(
        self, _time_ns: int, announcement: Announcement, _matters: Callable[[], bool]
    ) -> None:
        self.told.append(announcement.present)

    def later(self, task: Callable[[int], None]) -> None:
        task(0)


def begun(near: Side) -> Tokens:
    """The tokens of a side, taken from now on."""
    session = cast("zenoh.Session", near)
    tokens, opposite = (
        Tokens(session, session, [zenoh.KeyExpr("tlm/*")], near, lambda *_: None) for _ in range(2)
    )
    tokens.begin(opposite)
    return tokens


def test_a_token_that_appears_while_tokens_are_counted_is_not_gone_until_twice_not_found() -> None:
    near = Side()
    tokens = begun(near)
    tokens.count(COUNT_NS)
    near.set(KEY, present=True)
    near.answers.pop()()
    assert near.told == [True]
    tokens.count(2 * COUNT_NS)
    near.answers.pop()()
    near.there.discard(KEY)  # of which Zenoh tells nothing
    for number, told in ((3, [True]), (4, [True, False])):
        tokens.count(number * COUNT_NS)
        near.answers.pop()()
        assert near.told == told


def test_a_token_that_vanishes_while_tokens_are_counted_does_not_come_back() -> None:
    near = Side()
    tokens = begun(near)
    near.set(KEY, present=True)
    tokens.count(COUNT_NS)
    near.set(KEY, present=False)
    near.answers.pop()()
    assert near.told == [True, False]
    near.there.add(KEY)  # of which Zenoh tells nothing
    tokens.count(2 * COUNT_NS)
    near.answers.pop()()
    assert near.told == [True, False, True]
