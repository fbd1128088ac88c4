"""The Dynamic Policy Map on worked numbers and special cases."""

import math
from itertools import islice

import pytest
from policy_lists import Lists, Persistent, by_scipy

from farside.dem.policy import spread as spread_module

A, B, C, D = range(4)


@pytest.fixture
def lists() -> Lists:
    return Lists()


def test_a_reliable_detour_beats_an_unreliable_shortcut(lists: Lists) -> None:
    """Here a → c costs 8; a → b → c costs 1 + 1."""
    short_cut = lists.link(A, C, 8.0)
    detour = [lists.link(A, B), lists.link(B, C)]
    policy = lists.map(C)
    assert policy.value == [2.0, 1.0, 0.0, math.inf]
    assert list(policy.walk(A)) == detour
    assert [policy.depth(sign) for sign in (A, B, C, D)] == [2, 1, 0, None]
    assert short_cut not in detour


def test_of_equal_totals_the_higher_cm_is_taken_and_then_the_older(lists: Lists) -> None:
    lists.link(A, B, cm=0.25)
    older, younger = lists.link(A, C, cm=0.5), lists.link(A, D, cm=0.5)
    policy = lists.map(B)
    lists.link(C, B, 2.0)
    lists.link(D, B, 2.0)
    lists.reprice(0, 3.0)
    lists.follow(policy)
    assert policy.value[A] == 3.0
    assert policy.best(A) == older
    lists.reprice(younger, lists.hypotheses.cost[younger], cm=1.0)
    lists.follow(policy)
    assert policy.best(A) == younger


def test_age_is_the_order_of_creation_and_not_of_rows(lists: Lists) -> None:
    lists.cut(lists.link(D, D))
    older = lists.link(A, B, cm=0.5)
    spare = lists.link(D, D)
    lists.cut(older)
    middle = lists.link(A, B, cm=0.5)
    lists.cut(spare)
    youngest = lists.link(A, B, cm=0.5, action=1)
    assert lists.map(B).best(A) == middle
    lists.cut(middle)
    reused = lists.link(A, B, cm=0.5)
    assert reused == middle
    assert lists.map(B).best(A) == youngest


def test_of_equally_near_active_signs_the_higher_cm_decides_and_then_age(lists: Lists) -> None:
    lists.link(A, D, cm=0.25)
    lists.link(C, D, cm=0.5)
    lists.link(B, D, cm=0.5)
    policy = lists.map(D)
    assert policy.entry([A, B]) == B
    assert policy.entry([A, B, C]) == C


def test_there_is_no_entry_off_the_map_or_at_the_goal(lists: Lists) -> None:
    lists.link(A, B)
    policy = lists.map(B)
    assert policy.entry([]) is None
    assert policy.entry([C, D]) is None
    assert policy.entry([A, B]) is None
    assert policy.entry([D, A]) == A


def test_the_reason_names_the_best_hypothesis_with_another_action(lists: Lists) -> None:
    best = lists.link(A, D, 2.0)
    lists.link(A, D, 3.0)
    lists.link(A, D, 5.0, action=1)
    rival = lists.link(A, B, 1.0, action=1)
    lists.link(B, D, 3.0)
    assert lists.map(D).why(A) == (best, 2.0, rival, 4.0)


def test_the_reason_has_no_rival_where_no_other_action_leads_to_the_goal(lists: Lists) -> None:
    best = lists.link(A, D, 2.0)
    lists.link(A, B, 1.0, action=1)
    assert lists.map(D).why(A) == (best, 2.0, None, math.inf)


def test_to_reach_a_compound_is_to_reach_its_parts(lists: Lists) -> None:
    """Here a → {b, c} costs 1 and b → d costs 2: reaching {b, c} is reaching b."""
    whole = lists.know(("b", "c"))
    to_whole, onward = lists.link(A, whole), lists.link(B, D, 2.0)
    policy = lists.map(D)
    assert (policy.value[whole], policy.value[A]) == (2.0, 3.0)
    assert list(policy.walk(A)) == [to_whole, onward]
    assert policy.depth(A) == 2


def test_a_compound_acts_on_the_arc_of_its_part_where_that_ties_with_a_higher_cm(
    lists: Lists,
) -> None:
    whole = lists.know(("b", "c"))
    lists.link(whole, D, 2.0, cm=0.25)
    surer = lists.link(B, D, 2.0, cm=1.0)
    policy = lists.map(D)
    table = policy.table()
    assert policy.best(whole) == surer
    assert dict(zip(table.sign.tolist(), table.best.tolist(), strict=True))[whole] == surer


def test_a_compound_that_implies_the_goal_has_value_0(lists: Lists) -> None:
    whole = lists.know(("b", "d"))
    to_whole = lists.link(A, whole)
    policy = lists.map(D)
    assert policy.value[whole] == 0.0
    assert list(policy.walk(A)) == [to_whole]


def test_a_compound_loses_its_value_with_its_part(lists: Lists) -> None:
    whole = lists.know(("b", "c"))
    lists.link(A, whole)
    onward = lists.link(B, D, 2.0)
    policy = lists.map(D, lists.spread(Persistent))
    lists.cut(onward)
    lists.follow(policy)
    assert policy.value == [math.inf, math.inf, math.inf, 0.0, math.inf]


def test_a_compound_loses_the_value_of_a_part_that_was_removed(lists: Lists) -> None:
    """{a, b, c} reaches d only through {a, b}; arc and part are removed before the update."""
    part, whole = lists.know(("a", "b")), lists.know(("a", "b", "c"))
    onward = lists.link(part, D)
    policy = lists.map(D, lists.spread(Persistent))
    assert policy.value[whole] == 1.0
    lists.cut(onward)
    lists.forget(part)
    lists.follow(policy)
    assert policy.value[whole] == math.inf


def test_costs_that_vanish_beside_a_value_do_not_make_the_walk_loop(lists: Lists) -> None:
    """Here a → b and b → a cost 1 beside 10³⁰⁰, so a and b tie; only b → d leads out."""
    there, _, out = lists.link(A, B, cm=1.0), lists.link(B, A, cm=1.0), lists.link(B, D, 1e300)
    policy = lists.map(D)
    assert policy.value[A] == policy.value[B] == 1e300
    assert list(islice(policy.walk(A), 5)) == [there, out]


def test_among_equal_values_the_walk_takes_the_nearest_way_out(lists: Lists) -> None:
    """The way is c → a → b → d; arcs of higher C_m lead from a to c and c to c, all at 10³⁰⁰."""
    lists.link(A, C, cm=1.0)
    lists.link(C, C, cm=1.0)
    walk = [lists.link(C, A, cm=0.5), lists.link(A, B, cm=0.25), lists.link(B, D, 1e300)]
    policy = lists.map(D)
    assert list(islice(policy.walk(C), 5)) == walk
    assert policy.table().depth.tolist() == [0, 2, 1, 3]


def test_signs_of_equal_value_do_not_support_each_other_without_a_way_out(lists: Lists) -> None:
    lists.link(A, B)
    lists.link(B, A)
    out = lists.link(B, D, 1e300)
    policy = lists.map(D, lists.spread(Persistent))
    lists.cut(out)
    lists.follow(policy)
    assert policy.value == [math.inf, math.inf, math.inf, 0.0]


def test_an_arc_that_grew_cheaper_is_useless_without_what_it_led_to(lists: Lists) -> None:
    to_b, onward = lists.link(A, B, 3.0), lists.link(B, D)
    policy = lists.map(D, lists.spread(Persistent))
    lists.reprice(to_b, 2.0)
    lists.cut(onward)
    lists.follow(policy)
    assert policy.value == [math.inf, math.inf, math.inf, 0.0]


@pytest.mark.parametrize("cost", [1.0, 9.0, math.inf])
def test_a_change_reaches_every_sign_even_if_the_repair_gives_up(cost: float) -> None:
    """Of six Signs, one may lose its value and two may spread before a new map is built."""
    lists = Lists("abcdef")
    *_, last = [lists.link(sign, sign + 1, 5.0) for sign in range(5)]
    policy = lists.map(5)
    lists.reprice(last, cost)
    lists.follow(policy)
    assert policy.value == [cost + 20.0, cost + 15.0, cost + 10.0, cost + 5.0, cost, 0.0]


def test_a_removed_arc_whose_row_was_reused_is_gone(lists: Lists) -> None:
    """Here a → d is removed, and c → d takes its row at the same cost, before the update."""
    gone = lists.link(A, D)
    policy = lists.map(D, lists.spread(Persistent))
    lists.cut(gone)
    assert lists.link(C, D) == gone
    lists.follow(policy)
    assert policy.value == [math.inf, math.inf, 1.0, 0.0]


def test_the_goal_never_loses_its_value(lists: Lists) -> None:
    lists.know(("a", "d"))
    policy = lists.map(4, lists.spread(Persistent))
    lists.changed_signs.append(4)
    lists.follow(policy)
    assert policy.value[4] == 0.0


def test_with_scipy_too_the_cheapest_of_parallel_arcs_counts(lists: Lists) -> None:
    for cost in (3.0, 2.0, 4.0):
        lists.link(A, D, cost)
    assert by_scipy(lists, D).value == [2.0, math.inf, math.inf, 0.0]


def test_one_spread_serves_any_number_of_goals_as_the_lists_change(lists: Lists) -> None:
    spread = lists.spread()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(spread_module, "FEW_ARCS", 0)
        arc = lists.link(A, B, 2.0)
        assert lists.map(B, spread).value == [2.0, 0.0, math.inf, math.inf]
        lists.reprice(arc, 3.0)
        assert lists.map(B, spread).value == [3.0, 0.0, math.inf, math.inf]
        lists.link(C, A)
        assert lists.map(A, spread).value == [0.0, math.inf, 1.0, math.inf]
        lists.know(("a", "b"))
        assert lists.map(A, spread).value == [0.0, math.inf, 1.0, math.inf, 0.0]


def test_a_plan_follows_a_part_that_became_known_after_the_walk(lists: Lists) -> None:
    """{a, b, c} leads to d by x; then {a, b} becomes known, and leads there by y for less."""
    whole = lists.know(("a", "b", "c"))
    lists.link(whole, D, 5.0)
    policy = lists.map(D, lists.spread(Persistent))
    assert policy.planned([whole], lists.actions) == 1.0
    part = lists.know(("a", "b"))
    lists.follow(policy)
    assert policy.planned([whole], lists.actions) == 1.0
    lists.link(part, D, 3.0, action=1)
    lists.follow(policy)
    assert policy.planned([whole], lists.actions) == 2.66
