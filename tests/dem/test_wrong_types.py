"""What is no Token, cost, priority, name or the like is refused where it is given, in words.

And nothing has changed then: a model that refused goes on as if nothing had been said.
"""

import re
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest

import farside.dem
from farside.dem import DynamicExpectancyModel, Parameters, ShadowModel

RNG = np.random.default_rng(0)
dem: Any = farside.dem  # used as no type checker would let it be
NO_TOKENS: list[tuple[Any, str]] = [
    (None, "expected Tokens, strings all of them, found None"),
    (3, "expected Tokens, strings all of them, found 3"),
    ("at:A", "found the string 'at:A': write ['at:A']"),
    (b"at:A", "expected Tokens, strings all of them, found b'at:A'"),
    ([7], "expected Tokens, strings all of them, found [7]"),
    (["a", 7], "expected Tokens, strings all of them, found ['a', 7]"),
    (["a", None], "found ['a', None]"),
    ([("a",)], "found [('a',)]"),
    ([["a"]], "found [['a']]"),
    ([b"a"], "found [b'a']"),
    ([True], "found [True]"),
    (["half \ud800"], "expected Tokens of whole characters, found ['half \\ud800']"),
]
NO_NUMBERS: list[tuple[Any, str]] = [
    ("1", "expected a number, found '1'"),
    (True, "expected a number, found True"),
    (None, "expected a number, found None"),
    (1j, "expected a number, found 1j"),
    (10**400, "expected a number below 1e308, found 1000"),
]
NO_NAMES: list[tuple[Any, str]] = [
    (3, "expected a name, found 3"),
    (["E"], "expected a name, found ['E']"),
    (True, "expected a name, found True"),
    (b"E", "expected a name, found b'E'"),
]


def made(costs: Any = None, parameters: Any = None, **others: Any) -> DynamicExpectancyModel:
    costs = {"E": 1.0, "W": 2.0} if costs is None else costs
    parameters = Parameters() if parameters is None else parameters
    return DynamicExpectancyModel(costs, parameters, **{"rng": RNG, **others})


@pytest.fixture
def model() -> DynamicExpectancyModel:
    """In the middle of a cycle, with something in most lists."""
    model = made(rng=np.random.default_rng(1))
    model.record_changes()
    for tokens, action in [(["a"], "E"), (["b"], "W"), (["a", "c"], "E")]:
        model.sense(tokens)
        model.perform(action)
    model.set_goal(["b"], 2.0)
    model.sense(["a"])
    return model


def refused(call: Callable[[], object], words: str) -> None:
    with pytest.raises((TypeError, ValueError)) as refusal:
        call()
    assert words in str(refusal.value)
    assert len(str(refusal.value)) < 700, "a few lines"


Ask = Callable[[Any, Any], object]
WITH_TOKENS: dict[str, Ask] = {
    "set_goal": lambda model, tokens: model.set_goal(tokens),
    "withdraw_goal": lambda model, tokens: model.withdraw_goal(tokens),
    "goal_priorities": lambda model, tokens: model.goal_priorities(tokens),
    "cost_to": lambda model, tokens: model.cost_to(tokens),
    "cost_to from": lambda model, tokens: model.cost_to(["a"], tokens or [tokens]),
    "when": lambda _, tokens: dem.InherentGoal(tokens, ("a",), 1.0),
    "goal": lambda _, tokens: dem.InherentGoal(("a",), tokens, 1.0),
}


@pytest.mark.parametrize(("tokens", "words"), NO_TOKENS)
@pytest.mark.parametrize("ask", WITH_TOKENS.values(), ids=list(WITH_TOKENS))
def test_what_are_no_tokens(
    model: DynamicExpectancyModel, ask: Ask, tokens: Any, words: str
) -> None:
    before = model.save()
    refused(lambda: ask(model, tokens), "found" if tokens is None else words)
    assert model.save() == before


@pytest.mark.parametrize(("tokens", "words"), NO_TOKENS)
def test_what_cannot_be_sensed(model: DynamicExpectancyModel, tokens: Any, words: str) -> None:
    model.perform("E")
    before = model.save()
    refused(lambda: model.sense(tokens), words)
    assert model.save() == before
    assert model.sense(["b"]).succeeded == 1


@pytest.mark.parametrize(("number", "words"), NO_NUMBERS)
def test_what_is_no_number(model: DynamicExpectancyModel, number: Any, words: str) -> None:
    before = model.save()
    refused(lambda: model.set_goal(["a"], number), f"priority of goal ('a',): {words}")
    refused(lambda: model.set_goal(["b"], number), f"priority of goal ('b',): {words}")
    refused(lambda: model.set_cost("E", number), f"cost of action 'E': {words}")
    refused(lambda: made({"E": number}), f"cost of action 'E': {words}")
    refused(lambda: ShadowModel({"E": number}, Parameters()), f"cost of action 'E': {words}")
    refused(lambda: dem.InherentGoal(("a",), ("b",), number), f"priority of goal ('b',): {words}")
    assert model.save() == before


@pytest.mark.parametrize(("name", "words"), NO_NAMES)
def test_what_is_no_name(model: DynamicExpectancyModel, name: Any, words: str) -> None:
    before = model.save()
    refused(lambda: model.perform(name), f"an action: {words}")
    refused(lambda: model.expected(name), f"an action: {words}")
    refused(lambda: model.set_cost(name, 1.0), f"an action: {words}")
    refused(lambda: model.set_goal(["b"], 1.0, name), f"source of a goal: {words}")
    refused(lambda: model.set_goal(["a"], 1.0, name), f"source of a goal: {words}")
    refused(lambda: model.withdraw_goal(["b"], name), f"source of a goal: {words}")
    if not isinstance(name, list):
        refused(lambda: made({name: 1.0}), f"an action: {words}")
    assert model.save() == before


Wrong = Callable[[Any], object]
OTHERS: list[tuple[Wrong, str]] = [
    (lambda _: made(rng=0), "rng, of numpy.random.default_rng(seed): expected Generator, found 0"),
    (lambda _: made(rng=None), "expected Generator, found None"),
    (lambda _: made(rng=np.random), "expected Generator, found <module 'numpy.random'"),
    (lambda _: made(rng=np.random.RandomState(1)), "expected Generator, found RandomState"),
    (lambda _: made(["E"]), "action costs: expected a cost by name, found ['E']"),
    (lambda _: made("E"), "action costs: expected a cost by name, found 'E'"),
    (
        lambda _: made(iter({"E": 1.0}.items())),
        "expected a cost by name, found <dict",
    ),
    (lambda _: made({"E": 1.0}, True), "parameters: expected Parameters, found True"),
    (lambda _: made({"E": 1.0}, {"alpha": 0.1}), "expected Parameters, found {'alpha': 0.1}"),
    (lambda _: made({"E": 1.0}, Parameters), "parameters: expected Parameters, found <class"),
    (lambda _: made(inherent=3), "inherent: expected rules, found 3"),
    (lambda _: made(inherent=[("a", "b", 1)]), "inherent: expected InherentGoal, found ('a', 'b'"),
    (lambda _: made(inherent=["rule"]), "inherent: expected InherentGoal, found 'rule'"),
    (lambda _: dem.Parameters(curiosity=True), "curiosity: expected Curiosity, found True"),
    (lambda _: dem.Parameters(exploration=True), "exploration: expected one of none"),
    (lambda _: dem.Parameters(alpha="high"), "alpha: expected a number >= 0 and <= 1"),
    (lambda _: dem.Parameters(alpha=True), "alpha: expected a number >= 0 and <= 1, found True"),
    (lambda _: dem.Parameters(plain=1), "plain: expected bool, found 1"),
    (lambda _: dem.Parameters(reach=True), "reach: expected a whole number"),
    (lambda _: dem.Curiosity(optimistic_cost="1"), "optimistic_cost: expected a number"),
    (lambda model: model.change({"alpha": 0.1}), "parameters: expected Parameters, found {'alpha'"),
    (lambda model: model.change(None), "parameters: expected Parameters, found None"),
    (lambda model: model.choose(explore="no"), "explore: expected bool, found 'no'"),
    (
        lambda _: dem.DynamicExpectancyModel.load("text"),
        "bytes of save(), found 'text'",
    ),
    (
        lambda _: dem.DynamicExpectancyModel.load(None),
        "expected the bytes of save(), found None",
    ),
    (lambda model: model.load(model.save(), inherent=[3]), "expected InherentGoal, found 3"),
    (
        lambda _: dem.InherentGoal(("a",), ("b",), "1"),
        "priority of goal ('b',): expected a number",
    ),
    (lambda _: dem.InherentGoal(("a",), (), 1.0), "a goal: expected one Token at least"),
    (lambda model: model.set_goal([]), "a goal: expected one Token at least"),
    (lambda model: model.set_goal(["b"], float("nan")), "expected a finite number, found nan"),
    (lambda model: model.set_goal(["b"], 1.0, "rule"), "expected any but 'rule'"),
    (lambda model: model.set_cost("E", float("nan")), "cost of action 'E': expected above 0"),
    (lambda _: dem.ShadowModel({"E": 1.0}, None), "parameters: expected Parameters, found None"),
    (lambda _: dem.ShadowModel(None, Parameters()), "expected a cost by name, found None"),
]


@pytest.mark.parametrize(("wrong", "words"), OTHERS, ids=[words for _, words in OTHERS])
def test_what_is_of_another_type(model: Any, wrong: Wrong, words: str) -> None:
    before = model.save()
    refused(lambda: wrong(model), words)
    assert model.save() == before


AT_SHADOW: dict[str, Ask] = {
    "value": lambda shadow, tokens: shadow.value(tokens),
    "policy_path": lambda shadow, tokens: shadow.policy_path(tokens),
    "policy_path to": lambda shadow, tokens: shadow.policy_path(["a"], tokens),
    "why": lambda shadow, tokens: shadow.why(tokens),
    "cost_to": lambda shadow, tokens: shadow.cost_to(tokens, ["a"]),
    "cost_to from": lambda shadow, tokens: shadow.cost_to(["b"], tokens),
    "costs_to": lambda shadow, tokens: list(shadow.costs_to(tokens)),
    "expected": lambda shadow, tokens: shadow.expected(tokens, "E"),
    "expectations": lambda shadow, tokens: shadow.expectations(tokens, "E"),
}


@pytest.mark.parametrize("ask", AT_SHADOW.values(), ids=list(AT_SHADOW))
def test_what_a_shadow_is_asked_wrongly(model: DynamicExpectancyModel, ask: Ask) -> None:
    shadow: Any = ShadowModel({"E": 1.0, "W": 2.0}, Parameters())
    shadow.apply(model.take_delta())
    before = shadow.lists_check()
    for tokens, words in NO_TOKENS:
        if tokens is not None:  # is the top-goal, for some
            refused(partial(ask, shadow, tokens), words)
    for action, words in NO_NAMES:
        refused(partial(shadow.expected, ["a"], action), words)
    refused(lambda: shadow.apply("delta"), "delta: expected Delta, found 'delta'")
    refused(lambda: shadow.came_true(None), "delta: expected Delta, found None")
    refused(lambda: shadow.agree({}), "parameters: expected Parameters, found {}")
    assert shadow.lists_check() == before


def test_what_is_of_the_right_type_in_an_unusual_way_is_taken() -> None:
    """Numbers of numpy; Tokens and rules from a generator, which is read once."""

    def tokens() -> Iterator[str]:
        yield from ("b", "a", "b")

    rules = iter([dem.InherentGoal(tokens(), iter(["x"]), np.int32(2))])
    model: Any = made({"E": np.float32(1.5), "W": np.int64(2)}, inherent=rules)
    assert model.actions == {"E": 1.5, "W": 2.0}
    assert model.sense(tokens()).tokens == ("a", "b")
    assert [(goal.tokens, goal.priority) for goal in model.goals] == [(("x",), 2.0)]
    assert model.set_goal(tokens(), np.float64(3)).tokens == ("a", "b")
    assert model.cost_to(tokens(), tokens()) == 0.0


def test_a_message_about_something_endless_is_short(model: Any) -> None:
    endless = ["x" * 1000 for _ in range(1000)]
    refused(lambda: model.set_goal([*endless, 3]), "found [")
    refused(lambda: model.set_goal("x" * 10**6), "found the string")
    refused(lambda: model.set_cost("x" * 10**6, 1.0), "unknown action")
    refused(lambda: model.set_goal(["x" * 10**6], float("inf")), "expected a finite number")
    assert not re.search("x{200}", repr(model))
