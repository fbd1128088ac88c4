"""A check of the lists tells whether a shadow holds what its model does; memory is bounded."""

import sys
from array import array
from collections.abc import Callable, Sequence

import msgspec
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from restless import COSTS, PARAMETERS, cuts, cycles, lists, recorded, sent
from restless import parameters as restless_parameters

from farside.dem import Parameters, ShadowModel
from farside.dem.lists.packing import crc_of
from tests.dem.conftest import Event, Eventful, Live


@given(parameters=restless_parameters, stream=st.lists(st.tuples(cycles, cuts)))
def test_model_and_shadow_have_the_same_check_whenever_they_hold_the_same(
    eventful: Eventful, live: Live, parameters: Parameters, stream: Sequence[tuple[Event, str]]
) -> None:
    model, shadow = recorded(parameters)
    live(model, eventful(60))
    shadow.apply(sent(model.take_delta()))
    for cycle, cut in stream:
        live(model, [cycle])
        # Wanted by two, in one order and then in the other.
        for source in ("rule book", "operator") if cut == "whole" else ("operator", "rule book"):
            model.withdraw_goal(["f"], source)
            model.set_goal(["f"], 1, source)
        if cut != "nothing":
            shadow.apply(sent(model.take_delta() if cut == "delta" else model.whole()))
        same = lists(shadow) == lists(model)
        assert (shadow.lists_check() == model.lists_check()) is same or cut == "nothing"
        assert same or cut == "nothing"


def test_any_difference_shows_in_the_check(eventful: Eventful, live: Live) -> None:
    model, _ = recorded()
    live(model, eventful(300))
    model.set_goal(["a"], 1)
    whole, delta = sent(model.whole()), sent(model.take_delta())

    def damaged(damage: Callable[[ShadowModel], object]) -> int:
        shadow = ShadowModel(COSTS, PARAMETERS)
        shadow.apply(whole)
        shadow.apply(delta)
        assert shadow.lists_check() == model.lists_check()
        damage(shadow)
        return shadow.lists_check()

    def nudge(shadow: ShadowModel) -> None:
        shadow._hypotheses.cm[3] = np.nextafter(shadow._hypotheses.cm[3], 2)

    def forget(shadow: ShadowModel) -> None:
        shadow._goals = ()

    checks = [
        damaged(nudge),
        damaged(forget),
        damaged(lambda shadow: shadow._hypotheses.fail(3)),
        damaged(lambda shadow: shadow._hypotheses.remove(3)),
        damaged(lambda shadow: shadow._signs.add(("new",))),
        damaged(lambda shadow: shadow._hypotheses._free.reverse()),
        damaged(lambda shadow: shadow._signs.names.reverse()),
    ]
    assert len(model._hypotheses._free) > 1
    assert len({model.lists_check(), *checks}) == len(checks) + 1


def test_the_check_is_the_same_on_a_machine_of_the_other_byte_order(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    column = array("i", [1, 2**30])
    turned = array("i", column)
    turned.byteswap()
    here = crc_of([column])
    monkeypatch.setattr(sys, "byteorder", {"little": "big", "big": "little"}[sys.byteorder])

    assert crc_of([turned]) == here
    assert turned.tolist() != column.tolist()


def test_changes_that_nobody_takes_do_not_pile_up(eventful: Eventful, live: Live) -> None:
    model, shadow = recorded()
    shadow.apply(sent(model.take_delta()))
    kept = 0
    for cycle in eventful(3000):
        live(model, [cycle])
        kept = max(kept, len(model._signs.recorded or ()))
    assert 900 < kept < 1200 + 5 * model.hypothesis_count

    delta = sent(model.take_delta())
    assert delta.whole is not None
    shadow.apply(delta)
    assert lists(shadow) == lists(model)


def test_a_whole_goes_out_where_it_is_shorter_than_the_changes(
    eventful: Eventful, live: Live
) -> None:
    model, shadow = recorded()
    shadow.apply(sent(model.take_delta()))
    # Fewer changes than are kept in any case, so that none has been forgotten.
    live(model, eventful(80))
    changes = len(msgspec.msgpack.encode(model._signs.recorded))
    delta = sent(model.take_delta())

    assert delta.whole is not None
    assert len(delta.whole) < changes
    assert (delta.changes, delta.follows) == ((), None)
    shadow.apply(delta)
    live(model, eventful(3))
    assert model.take_delta().whole is None


def test_a_shadow_that_nobody_asks_keeps_no_list_of_what_has_changed(
    eventful: Eventful, live: Live
) -> None:
    model, shadow = recorded()
    for cycle in eventful(1000):
        live(model, [cycle])
        shadow.apply(sent(model.take_delta()))
        assert len(shadow._hypotheses.cost_changes) < 1100
    model.set_goal(["a"], 1)
    shadow.apply(sent(model.take_delta()))
    assert lists(shadow) == lists(model)
