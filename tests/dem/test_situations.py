"""Many Tokens at once: what belongs to a situation, and what explains a surprise."""

from collections.abc import Sequence

import numpy as np
import pytest
from animats import FOOD, WOODS1, Animat, judge, new_animat_model, train, train_then_judge
from hypothesis import given, settings
from hypothesis import strategies as st
from worlds import noise

from farside.dem import DynamicExpectancyModel, Exploration, Parameters
from farside.dem.learning.situations import CASES, REMEMBERED, Situations
from farside.dem.lists.chains import Chains
from tests.dem.conftest import MakeModel


def test_with_eight_tokens_a_maze_is_learned_in_short_lists() -> None:
    model, judged = train_then_judge(WOODS1, Parameters(), 0, steps=1500)
    assert judged.ratio <= 1.1
    assert judged.hypotheses < 2000
    assert max(len(sign) for sign in model.signs) == 9


def test_curiosity_learns_it_sooner() -> None:
    curious = Parameters(exploration=Exploration.CURIOUS)
    _, judged = train_then_judge(WOODS1, curious, 0, steps=500, own_choice=True)
    assert judged.ratio <= 1.1


def test_without_situations_conjunctions_explode() -> None:
    _, judged = train_then_judge(WOODS1, Parameters(situations=False), 0, steps=400)
    _, short = train_then_judge(WOODS1, Parameters(), 0, steps=400)
    assert judged.hypotheses > 1.5 * short.hypotheses


def test_tokens_that_come_and_go_at_random_are_no_part_of_a_situation() -> None:
    """Those that were, at first, are forgotten."""

    class Noisy(Animat):
        def tokens(self) -> set[str]:
            return super().tokens() | next(beside)

    beside = noise(np.random.default_rng(7), tokens=2)
    maze, rng = Noisy(WOODS1), np.random.default_rng(1)
    model = new_animat_model(Parameters(differentiation=False), 1)
    train(model, maze, 300, rng)
    assert {len(sign) for sign in model.signs} - {1, 7, 8, 9} == set()
    assert not [sign for sign in model.signs if len(sign) > 1 and "noise:0" in sign]
    train(model, maze, 900, rng)
    assert judge(model, maze, rng).ratio <= 1.1


def walked(model: DynamicExpectancyModel, cycles: Sequence[tuple[str, str | None]]) -> None:
    for tokens, action in cycles:
        model.sense(tokens.split())
        model.perform(action)


def test_what_a_token_alone_explains_needs_no_situation(make_model: MakeModel) -> None:
    """The lamp goes out once: places lead to places as before, and new ones are learned."""
    model = make_model()
    walked(model, [("at:A lamp", "E"), ("at:B lamp", "N")] * 5)
    walked(model, [("at:A", "E"), ("at:B", "N")] * 5 + [("at:A", "S"), ("at:C", None)])
    known = {(h.context, h.action, h.outcome) for h in model.hypotheses}
    assert {(("at:A",), "E", ("at:B",)), (("at:A",), "S", ("at:C",))} <= known
    assert sum(len(sign) > 1 for sign in model.signs) <= 1


def test_where_a_credible_prediction_fails_the_whole_situation_explains_the_next(
    make_model: MakeModel,
) -> None:
    """With the door shut, E leads nowhere."""
    model = make_model()
    walked(model, [("at:A open", "E"), ("at:B open", "S"), ("at:A open", "E"), ("at:B shut", "S")])
    walked(model, [("at:A shut", "E"), ("at:A shut", None)])
    known = {(h.context, h.action, h.outcome) for h in model.hypotheses}
    assert (("at:A", "shut"), "E", ("at:A", "shut")) in known
    model.set_goal(["at:B"], priority=1.0)
    model.sense(["at:A", "open"])
    assert model.expected("E").outcome == ("at:B",)
    model.perform(None)
    model.sense(["at:A", "shut"])
    assert {*model.expected("E").outcome} <= {"at:A", "shut"}


def test_to_foresee_a_whole_is_to_foresee_its_parts(make_model: MakeModel) -> None:
    model = make_model()
    walked(model, [("x", None), ("a b", "E"), ("c d", None), ("a b", "E"), ("a b", None)])
    walked(model, [("a b", "E")])
    assert model.sense(["c", "d"]).unexpected == ()


@pytest.mark.parametrize("rate", [0.1, 0.3, 0.7])
def test_chance_is_told_from_what_an_action_brings(rate: float) -> None:
    """Token 1 follows from the context, token 2 comes by chance, token 3 is always there."""
    rng, situations, turned = np.random.default_rng(0), Situations(), []
    trials = [0, 0]
    context = 10
    for _ in range(1500):
        tokens = [1] * (context == 10) + [2] * (rng.random() < rate) + [3]
        turned += situations.note([context], [max(1, trials[context - 10])], 0, tokens)
        assert 3 not in situations.tell(tokens)
        context = 10 + int(rng.integers(2))
        trials[context - 10] += 1
    assert turned == [2]
    assert [situations.is_random(token) for token in (1, 2, 3)] == [False, True, False]


def test_nothing_is_called_random_before_there_are_cases_enough() -> None:
    rng, situations = np.random.default_rng(0), Situations()
    for number in range(CASES):
        tokens = [1] if rng.random() < 0.5 else []
        assert not situations.note([0], [number + 1], 0, tokens)


def test_what_followed_is_remembered_of_the_latest_causes_only() -> None:
    situations = Situations()
    for context in range(REMEMBERED + 10):
        situations.note([context], [1], 0, [0])
    followed = situations.state().followed
    assert len(followed) == REMEMBERED
    assert followed[0][0] == 10


@settings(max_examples=100)
@given(st.lists(st.tuples(st.integers(0, 3), st.integers(0, 9)), max_size=60))
def test_chains_are_lists_from_which_any_row_is_taken_out(calls: list[tuple[int, int]]) -> None:
    """A row that is in a chain is taken out; any other is added."""
    chains, plain = Chains(), dict[int, list[int]]()
    for key, row in calls:
        holder = next((one for one, rows in plain.items() if row in rows), None)
        if holder is None:
            chains.append(key, row)
            plain.setdefault(key, []).append(row)
        else:
            chains.remove(holder, row)
            plain[holder].remove(row)
        for one, rows in plain.items():
            assert list(chains.of(one)) == rows
            assert chains.is_single(one) == (len(rows) == 1)


def test_a_goal_that_is_part_of_a_situation_is_reached_through_it() -> None:
    model, _ = train_then_judge(WOODS1, Parameters(), 2, steps=800)
    model.set_goal(FOOD, priority=1.0)
    values = {row.sign: row.value for row in model.policy_map()}
    whole = next(sign for sign in values if len(sign) == 9 and FOOD[0] in sign)
    assert values[whole] == 0.0
