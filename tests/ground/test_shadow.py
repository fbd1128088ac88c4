"""The shadow at the ground: whatever arrives, the ground goes on, and says what it holds."""

import zlib
from collections.abc import Sequence
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from restless import COSTS, PARAMETERS, lists, recorded

from farside.dem import Delta, Goal, ShadowModel
from farside.dem.changes import (
    HypothesisAdded,
    HypothesisRemoved,
    ListChange,
    SignAdded,
    SignRemoved,
)
from farside.ground.shadow import Age, Shadow
from farside.messages import ModelHeld, ModelUpdate
from farside.node import Journal
from farside.topics import GROUND_SHADOW, ShadowEntry
from tests.dem.conftest import Eventful, Live

# Whatever decodes as a delta, however little any model can have made it.
ids = st.integers(-(2**63), 2**64 - 1) | st.integers(-3, 60)
tokens = st.lists(st.text(max_size=3) | st.sampled_from("abcdef"), max_size=4).map(tuple)
numbers = st.floats() | st.floats(0, 1)
changes: st.SearchStrategy[ListChange] = st.one_of(
    ids,
    st.builds(SignAdded, tokens),
    st.builds(SignRemoved, ids),
    st.builds(HypothesisAdded, ids, ids, ids, ids, numbers),
    st.builds(HypothesisRemoved, ids),
)
goals = st.builds(Goal, tokens, st.dictionaries(st.text(max_size=3), numbers, max_size=2))


class Station:
    """A model, its shadow at the ground, and what the ground notes."""

    def __init__(self) -> None:
        self.model, _ = recorded()
        self._journal = Journal()
        self.shadow = Shadow(ShadowModel(COSTS, PARAMETERS), self._journal)

    def update(self, delta: Delta | bytes | None = None, **changes: Any) -> ModelUpdate:
        """An update of the model as it is; or of what is given, in place of its delta."""
        delta = self.model.take_delta() if delta is None else delta
        data = delta if isinstance(delta, bytes) else msgspec.msgpack.encode(delta)
        made = ModelUpdate(1, 7_000, 3, self.model.lists_check(), data)
        return msgspec.structs.replace(made, **changes)

    def noted(self) -> list[ShadowEntry]:
        return [GROUND_SHADOW.decode(record.payload) for record in self._journal.take()]


@pytest.fixture
def station(eventful: Eventful, live: Live) -> Station:
    """A ground that holds what a model learned in 40 cycles."""
    station = Station()
    live(station.model, eventful(40))
    station.shadow.apply(station.update())
    station.noted()
    return station


def test_an_update_brings_the_lists_and_says_of_when_they_are(
    eventful: Eventful, live: Live
) -> None:
    there = Station()
    assert (there.shadow.in_step, there.shadow.number, there.shadow.made_ns) == (False, 0, -1)
    assert there.shadow.held() == ModelHeld(0, there.shadow.check), "it asks for nothing yet"
    live(there.model, eventful(40))
    there.shadow.apply(there.update())
    live(there.model, eventful(10))
    there.shadow.apply(there.update(time_ns=9_000, cycles=10))

    shadow = there.shadow
    assert lists(shadow.model) == lists(there.model)
    assert (shadow.in_step, shadow.number, shadow.made_ns, shadow.cycles) == (True, 2, 9_000, 13)
    assert shadow.check == there.model.lists_check()
    sizes = there.model.sign_count, there.model.hypothesis_count
    assert there.noted()[1:] == [ShadowEntry(2, shadow.check, True, None, *sizes, 10)]


def test_how_old_the_lists_are_that_a_proposal_came_from(
    station: Station, eventful: Eventful, live: Live
) -> None:
    shadow, older = station.shadow, station.model.lists_check()
    live(station.model, eventful(5))
    shadow.apply(station.update())
    held = station.model.lists_check()
    live(station.model, eventful(5))
    newer = station.model.lists_check()

    assert [shadow.age_of(one) for one in (older, held, newer)] == [
        Age.OLDER,
        Age.SAME,
        Age.UNKNOWN,
    ]
    assert [shadow.number_of(one) for one in (older, held, newer)] == [1, 2, None]
    for _ in range(300):
        live(station.model, eventful(1))
        shadow.apply(station.update())
    assert shadow.number_of(older) is None, "not for ever"


def test_what_is_held_is_said_when_it_has_changed_and_now_and_then(
    station: Station, eventful: Eventful, live: Live
) -> None:
    first = ModelHeld(1, station.model.lists_check())
    assert [station.shadow.held() for _ in range(7)] == [first, *[None] * 4, first, None]
    live(station.model, eventful(5))
    station.shadow.apply(station.update())
    assert station.shadow.held() == ModelHeld(2, station.model.lists_check())


def test_after_a_gap_it_keeps_what_it_has_and_asks_for_a_whole(
    station: Station, eventful: Eventful, live: Live
) -> None:
    held, shadow = lists(station.shadow.model), station.shadow
    for _ in range(3):
        live(station.model, eventful(5))
        lost = station.update()
    shadow.apply(lost)

    assert lists(shadow.model) == held
    assert (shadow.number, shadow.in_step) == (1, False)
    assert shadow.held() == ModelHeld(1, shadow.check, wants_whole=True)
    (entry,) = station.noted()
    assert entry.why == "expected delta 2, found delta 4: ask for a whole"
    shadow.apply(station.update(station.model.whole()))
    assert (shadow.in_step, lists(shadow.model)) == (True, lists(station.model))


def test_lists_that_are_not_those_on_board_are_noticed_with_the_next_update(
    station: Station, eventful: Eventful, live: Live
) -> None:
    station.shadow.model._hypotheses.fail(0)
    live(station.model, eventful(5))
    station.shadow.apply(station.update())

    assert station.shadow.why == "its lists are not those on board after update 2"
    held = station.shadow.held()
    assert held is not None
    assert held.wants_whole


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"", "an update that cannot be read: Input data was truncated"),
        (b"\xc1", "an update that cannot be read: MessagePack data is malformed"),
        (b"\x90", "an update that cannot be read: Expected `array` of at least length 7, got 0"),
        (b"\x91" * 100_000, "an update that cannot be read"),
    ],
)
def test_what_is_no_update_is_refused_with_a_reason(
    station: Station, data: bytes, why: str
) -> None:
    held = lists(station.shadow.model)
    station.shadow.apply(station.update(data))

    assert str(station.shadow.why).startswith(why)
    assert lists(station.shadow.model) == held
    assert len(str(station.noted()[0].why)) < 300


def test_a_whole_that_unpacks_to_gigabytes_is_refused(station: Station) -> None:
    packer = zlib.compressobj(9)
    bomb = b"".join(packer.compress(bytes(2**20)) for _ in range(512)) + packer.flush()
    whole = msgspec.structs.replace(station.model.whole(), whole=bomb)
    station.shadow.apply(station.update(whole))
    assert "more than" in str(station.shadow.why)


@given(
    follows=st.booleans(),
    listed=st.lists(changes, max_size=8).map(tuple),
    goals=st.none() | st.lists(goals, max_size=3).map(tuple),
    whole=st.none() | st.binary(max_size=40),
    number=st.just(2) | st.integers(0, 2**63),
    check=st.integers(0, 2**32),
)
def test_whatever_decodes_as_an_update_the_ground_goes_on(  # noqa: PLR0917
    eventful: Eventful,
    live: Live,
    follows: bool,
    listed: Sequence[ListChange],
    goals: tuple[Goal, ...] | None,
    whole: bytes | None,
    number: int,
    check: int,
) -> None:
    there = Station()
    live(there.model, eventful(30))
    first = there.model.take_delta()
    there.shadow.apply(there.update(first))
    odd = Delta(number, first.check if follows else 5, check, tuple(listed), goals, None, whole)
    there.shadow.apply(there.update(odd))
    shadow = there.shadow.model
    for _ in shadow.goals:
        shadow.policy_map()
    shadow.policy_path(["a", "b"])
    shadow.why(["a"])
    there.shadow.held()
    there.shadow.apply(there.update(there.model.whole()))
    assert there.shadow.in_step
    assert lists(there.shadow.model) == lists(there.model)
