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


def test_a_sign_is_its_tokens_once_each_and_sorted() -> None:
    assert to_sign(["b", "a", "b"]) == ("a", "b")


def test_a_string_is_not_taken_for_its_letters() -> None:
    with pytest.raises(TypeError, match=r"write \['at:A'\]"):
        to_sign("at:A")


def test_a_token_makes_its_sign_once(signs: SignList) -> None:
    assert signs.sense(("a", "b")) == ([0, 1], [0, 1])
    assert signs.sense(("b", "c")) == ([1, 2], [2])
    assert signs.names == [("a",), ("b",), ("c",)]


def test_a_conjunction_is_novel_when_first_active_not_when_made_known(signs: SignList) -> None:
    assert signs.add(("a", "b")) == signs.add(("a", "b")) == 0
    assert signs.sense(("a",)) == ([1], [1])
    assert signs.sense(("a", "b")) == ([0, 1, 2], [0, 2])
    assert signs.sense(("a", "b")) == ([0, 1, 2], [])


def test_an_id_is_used_again_for_a_sign_that_is_the_youngest(signs: SignList) -> None:
    signs.sense(("a", "b"))
    pair = signs.add(("a", "b"))
    signs.sense(("c",))
    signs.remove(pair)
    assert signs.find(("a", "b")) is None
    assert signs.add(("b", "c")) == pair
    assert signs.sense(("a", "b", "c")) == ([0, 1, 3, pair], [pair])
    assert signs.by_age() == [0, 1, 3, pair]


def test_a_conjunction_that_was_forgotten_is_novel_once_more(signs: SignList) -> None:
    signs.add(("a", "b"))
    signs.sense(("a", "b"))
    signs.remove(0)
    signs.add(("a", "b"))
    assert signs.sense(("a", "b")).novel == [0]


def test_the_map_is_told_of_what_came_and_went_and_of_what_held_it(signs: SignList) -> None:
    pair = signs.add(("a", "b"))
    three = signs.add(("a", "b", "c"))
    assert signs.changed == [pair, three]
    before = signs.structure
    signs.changed.clear()
    signs.remove(pair)
    assert sorted(signs.changed) == [pair, three]
    assert signs.structure > before


def test_finding_again_what_is_known_changes_nothing(signs: SignList) -> None:
    signs.add(("a", "b"))
    signs.sense(("a", "b"))
    before = signs.structure
    signs.changed.clear()
    signs.add(("a", "b"))
    signs.sense(("a", "b"))
    assert signs.structure == before
    assert signs.changed == []


def test_a_conjunction_is_looked_at_only_when_one_of_its_tokens_is_sensed(signs: SignList) -> None:
    """With a Token that is in every conjunction, the watches fall on the others."""
    for place in range(100):
        signs.add(to_sign([f"at:{place}", "battery:ok"]))
    assert max(len(watched) for watched in signs._watched.values()) == 1


@given(events)
def test_active_are_exactly_the_signs_whose_tokens_are_all_sensed_in_order_of_age(
    events: Sequence[tuple[str, Any]],
) -> None:
    """Beside the list runs a plain one: Signs, the oldest first, and whether each was active."""
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
def test_parts_have_some_of_the_tokens_and_wholes_have_more(
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
