"""The store: what is kept while the link is out, what is dropped, and in what order it is sent."""

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from farside.link.endpoint.store import ITEM_BYTE, Store, Stored

items = st.lists(
    st.tuples(st.binary(max_size=20), st.integers(0, 50), st.integers(0, 3)), max_size=60
)


def filled(*entries: tuple[bytes, int, int], capacity_byte: int = 10_000) -> Store:
    store = Store(capacity_byte)
    for payload, made_ns, priority in entries:
        store.add(payload, made_ns, priority)
    return store


def emptied(store: Store) -> list[bytes]:
    return [store.pop() for _ in range(len(store))]


def payloads(found: list[Stored]) -> list[bytes]:
    return [item.payload for item in found]


def test_the_highest_priority_is_sent_first_and_of_equals_the_oldest() -> None:
    store = filled((b"late", 9, 0), (b"alarm", 8, 5), (b"early", 1, 0), (b"old alarm", 2, 5))
    assert emptied(store) == [b"old alarm", b"alarm", b"early", b"late"]


def test_a_full_store_drops_the_oldest_of_the_lowest_priority() -> None:
    full = [(b"old", 1, 0), (b"new", 2, 0), (b"alarm", 0, 5)]
    store = filled(*full, capacity_byte=11 + 3 * ITEM_BYTE)
    assert payloads(store.add(b"now", 3, 0)) == [b"old"]
    assert payloads(store.add(b"big!!!", 4, 5)) == [b"new", b"now"]
    assert store.dropped == 3


def test_an_item_of_the_lowest_priority_is_itself_dropped() -> None:
    store = filled((b"alarm", 1, 5), capacity_byte=5 + ITEM_BYTE)
    assert payloads(store.add(b"chat", 2, 0)) == [b"chat"]
    assert emptied(store) == [b"alarm"]


def test_an_item_that_can_never_fit_displaces_nothing() -> None:
    store = filled((b"kept", 1, 0), capacity_byte=100)
    assert payloads(store.add(bytes(100), 2, 5)) == [bytes(100)]
    assert emptied(store) == [b"kept"]


@given(items, st.integers(0, 400))
def test_a_store_is_bounded_and_accounts_for_every_item(
    entries: Sequence[tuple[bytes, int, int]], capacity_byte: int
) -> None:
    store, gone = Store(capacity_byte), []
    for payload, made_ns, priority in entries:
        gone += store.add(payload, made_ns, priority)
        assert store.held_byte <= capacity_byte
        assert len(store) * ITEM_BYTE <= store.held_byte
    assert store.dropped == len(gone)
    left = emptied(store)
    assert (len(store), store.held_byte) == (0, 0)
    assert sorted(payloads(gone) + left) == sorted(payload for payload, _, _ in entries)


@given(items)
def test_items_are_sent_by_priority_and_then_oldest_first(
    entries: Sequence[tuple[bytes, int, int]],
) -> None:
    store = filled(*entries)
    by_rank = sorted(entries, key=lambda entry: (-entry[2], entry[1]))
    assert store.next == by_rank[0][0] if entries else not store
    assert emptied(store) == [payload for payload, _, _ in by_rank]


@given(items, st.integers(ITEM_BYTE, 400))
def test_what_is_dropped_never_has_a_higher_priority_than_what_stays(
    entries: Sequence[tuple[bytes, int, int]], capacity_byte: int
) -> None:
    store = Store(capacity_byte)
    for payload, made_ns, priority in entries:
        gone = [item for item in store.add(payload, made_ns, priority) if len(item.payload) < 20]
        kept = [entry[2] for heap in store._of_priority.values() for entry in heap]
        for item in gone:
            if item.size_byte <= capacity_byte:
                assert all(item[:2] <= other[:2] for other in kept)
