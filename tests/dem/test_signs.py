"""The Sign List on its own."""

from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.dem.lists.signs import SignList, to_sign

LETTERS = "abcdef"

tokens = st.frozensets(st.sampled_from(LETTERS), max_size=6).map(to_sign)
conjunctions = st.frozensets(st.sampled_from(LETTERS), min_size=2, max_size=4).map(to_sign)
events = st.lists(
    st.one_of(
        st.tuples(st.just("sense"), tokens),
        st.tuples(st.just("add"), conjunctions),
        st.tuples(st.just("remove"), st.integers(0, 99)),
    ),
    max_size=30,
)


@pytest.fixture
def signs() -> SignList:
    return SignList()


def test_a_sign_is_its_tokens_sorted_and_without_duplicates() -> None:
    assert to_sign(["b", "a", "b"]) == ("a", "b")


def test_a_string_is_not_taken_for_its_letters() -> None:
    with pytest.raises(TypeError, match=r"write \['at:A'\]"):
        to_sign("at:A")


def test_a_token_becomes_a_sign_once(signs: SignList) -> None:
    assert signs.sense(("a", "b")) == ([0, 1], [0, 1])
    assert signs.sense(("b", "c")) == ([1, 2], [2])
    assert signs.names == [("a",), ("b",), ("c",)]


def test_a_conjunction_is_novel_when_first_active_not_when_added(signs: SignList) -> None:
    assert signs.add(("a", "b")) == signs.add(("a", "b")) == 0
    assert signs.sense(("a",)) == ([1], [1])
    assert signs.sense(("a", "b")) == ([0, 1, 2], [0, 2])
    assert signs.sense(("a", "b")) == ([0, 1, 2], [])


def test_a_sign_with_a_reused_id_is_the_youngest(signs: SignList) -> None:
    signs.sense(("a", "b"))
    pair = signs.add(("a", "b"))
    signs.sense(("c",))
    signs.remove(pair)
    assert signs.find(("a", "b")) is None
    assert signs.add(("b", "c")) == pair
    assert signs.sense(("a", "b", "c")) == ([0, 1, 3, pair], [pair])
    assert signs.by_age() == [0, 1, 3, pair]


def test_a_conjunction_that_was_removed_is_novel_again(signs: SignList) -> None:
    signs.add(("a", "b"))
    signs.sense(("a", "b"))
    signs.remove(0)
    signs.add(("a", "b"))
    assert signs.sense(("a", "b")).novel == [0]


def test_added_and_removed_signs_are_noted_and_what_implied_a_removed_one(signs: SignList) -> None:
    pair = signs.add(("a", "b"))
    three = signs.add(("a", "b", "c"))
    assert signs.changed == [pair, three]
    before = signs.structure
    signs.changed.clear()
    signs.remove(pair)
    assert sorted(signs.changed) == [pair, three]
    assert signs.structure > before


def test_adding_or_sensing_a_known_sign_changes_nothing(signs: SignList) -> None:
    signs.add(("a", "b"))
    signs.sense(("a", "b"))
    before = signs.structure
    signs.changed.clear()
    signs.add(("a", "b"))
    signs.sense(("a", "b"))
    assert signs.structure == before
    assert signs.changed == []


def test_conjunctions_are_indexed_under_their_rarest_tokens(signs: SignList) -> None:
    """A Token that is part of every conjunction is not the one they are found by."""
    for place in range(100):
        signs.add(to_sign([f"at:{place}", "battery:ok"]))
    assert max(len(indexed) for indexed in signs._indexed.values()) == 1


@given(events)
def test_exactly_the_signs_whose_tokens_are_all_sensed_are_active_in_order_of_age(
    events: Sequence[tuple[str, Any]],
) -> None:
    """Against a plain list of Signs, oldest first, and whether each was ever active."""
    signs, plain = SignList(), dict[tuple[str, ...], bool]()
    for event, what in events:
        if event == "sense":
            novel = [name for name, seen in plain.items() if not seen and set(name) <= set(what)]
            novel += [(token,) for token in what if (token,) not in plain]
            plain.update((name, True) for name in novel)
            active = [name for name in plain if set(name) <= set(what)]
            sensed = signs.sense(what)
            assert [signs.names[sign] for sign in sensed.active] == active
            assert [signs.names[sign] for sign in sensed.novel] == novel
        elif event == "add":
            plain.setdefault(what, False)
            signs.add(what)
        elif plain:
            name = list(plain)[what % len(plain)]
            del plain[name]
            gone = signs.find(name)
            assert gone is not None
            signs.remove(gone)
        assert [signs.names[sign] for sign in signs.by_age()] == list(plain)
        assert len(signs) == len(plain)


@given(events)
def test_parts_are_proper_subsets_and_wholes_proper_supersets(
    events: Sequence[tuple[str, Any]],
) -> None:
    signs = SignList()
    for event, what in events:
        if event == "sense":
            signs.sense(what)
        elif event == "add":
            signs.add(what)
        elif len(signs):
            signs.remove(signs.by_age()[what % len(signs)])
    known = {sign: set(signs.names[sign]) for sign in signs.by_age()}
    for sign, mine in known.items():
        assert sorted(signs.parts(sign)) == sorted(s for s in known if known[s] < mine)
        assert sorted(signs.wholes(sign)) == sorted(s for s in known if known[s] > mine)
        assert signs.is_compound(sign) == (len(mine) > 1)
