"""`farside dem learn --plain` gives the lists of the seed, read as plainly as can be.

The reading below is of the rules in docs/dem.md that are the seed's, not of the model: one pass
over the cycles, and lists searched from end to end.
"""

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from farside.dem import DynamicExpectancyModel, Parameters
from farside.dem.parameters import OWN_RULES
from farside.missions.commands import dem

Sign = tuple[str, ...]
Cycle = tuple[Sequence[str], str | None]

ALPHA, BETA, INITIAL = 0.5, 0.2, 0.5
COSTS = {"E": 2.66, "N": 1.0, "dig": 7.5}


class Seed:
    """Learns from a stream, and has no rule but the seed's."""

    def __init__(self, goals: Sequence[Sign], reach: int, probability: float, seed: int) -> None:
        self.signs = list(dict.fromkeys(goal for goal in goals if len(goal) > 1))
        self.met: list[Sign] = []
        self.hypotheses: dict[tuple[Sign, str, Sign, int], list[float]] = {}
        self.reach, self.probability = reach, probability
        self.rng = np.random.default_rng(seed)

    def live(self, stream: Sequence[Cycle]) -> None:
        past: list[tuple[list[Sign], str | None]] = []
        predictions: list[tuple[int, tuple[Sign, str, Sign, int]]] = []
        for now, (tokens, action) in enumerate(stream):
            for token in sorted(set(tokens)):
                if (token,) not in self.signs:
                    self.signs.append((token,))
            active = [sign for sign in self.signs if set(sign) <= set(tokens)]
            due = [which for when, which in predictions if when == now]
            for which in due:
                h = self.hypotheses[which]
                h[1] += 1
                if which[2] in active:
                    h[0], h[2] = h[0] + ALPHA * (1 - h[0]), h[2] + 1
                else:
                    h[0] -= BETA * h[0]
            novel = [sign for sign in active if sign not in self.met]
            unexpected = [s for s in active if s in self.met and s not in [w[2] for w in due]]
            self.met += novel
            for outcome in novel + unexpected:
                self.explain(outcome, past)
            predictions += [
                (now + which[3], which)
                for which in self.hypotheses
                if which[0] in active and which[1] == action
            ]
            past = [(active, action), *past][: self.reach]

    def explain(self, outcome: Sign, past: Sequence[tuple[list[Sign], str | None]]) -> None:
        for delay, (then, action) in enumerate(past, start=1):
            for context in then if action is not None else ():
                which = (context, str(action), outcome, delay)
                if which not in self.hypotheses and self.rng.random() < self.probability:
                    self.hypotheses[which] = [INITIAL, 0, 0]

    def values(self, goal: Sign) -> dict[Sign, float]:
        """P_v(s) = min over s ∧ a → s′ of C_e + P_v(s′), where C_e = action cost / C_m."""
        value = {goal: 0.0} if goal in self.signs else {}
        changed = True
        while changed:
            changed = False
            for (context, action, outcome, _), (cm, _, _) in self.hypotheses.items():
                total = COSTS[action] / cm + value.get(outcome, math.inf)
                if total < value.get(context, math.inf):
                    value[context], changed = total, True
        return value


def learned(stream: Sequence[Cycle], *options: str) -> Any:
    text = "".join(json.dumps({"tokens": [*t], "action": a}) + "\n" for t, a in stream)
    costs = [f"--action-cost={action}={cost}" for action, cost in COSTS.items()]
    result = CliRunner().invoke(dem.app, ["learn", "-", "--json", *costs, *options], input=text)
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)


tokens = st.frozensets(st.sampled_from(["at:A", "at:B", "at:C", "lamp", "dust"]), max_size=3)
cycles = st.tuples(tokens.map(sorted), st.sampled_from([*COSTS, None]))
goals = st.frozensets(st.sampled_from(["at:A", "at:B", "lamp", "new"]), min_size=1, max_size=2)


@settings(max_examples=60)
@given(
    stream=st.lists(cycles, max_size=60),
    wanted=st.lists(goals.map(lambda goal: tuple(sorted(goal))), max_size=3, unique=True),
    reach=st.integers(1, 3),
    probability=st.sampled_from([1.0, 0.6]),
    seed=st.integers(0, 9),
)
def test_plain_is_the_seed_to_the_last_bit(
    stream: Sequence[Cycle], wanted: Sequence[Sign], reach: int, probability: float, seed: int
) -> None:
    plain = Seed(wanted, reach, probability, seed)
    plain.live(stream)
    found = learned(
        stream,
        *("--plain", f"--reach={reach}", f"--seed={seed}"),
        f"--learning-probability={probability}",
        *[f"--goal={' '.join(goal)}" for goal in wanted],
    )
    assert list(map(tuple, found["signs"])) == plain.signs
    assert [
        ((tuple(h["context"]), h["action"], tuple(h["outcome"]), h["delay"]), h["cm"])
        for h in found["hypotheses"]
    ] == [(which, cm) for which, (cm, _, _) in plain.hypotheses.items()]
    assert [[h["predictions"], h["successes"]] for h in found["hypotheses"]] == [
        counts for _, *counts in plain.hypotheses.values()
    ]
    for goal, policy in zip(wanted, found["policies"], strict=True):
        values = plain.values(goal)
        assert {tuple(row["sign"]): row["value"] for row in policy["values"]} == values
        for row in policy["values"]:
            assert row["sign"] == list(goal) or row["value"] in {
                COSTS[action] / cm + values.get(outcome, math.inf)
                for (context, action, outcome, _), (cm, _, _) in plain.hypotheses.items()
                if (list(context), action) == (row["sign"], row["action"])
            }


def option(rule: str) -> str:
    return f"--no-{rule.removeprefix('own_').replace('_', '-')}"


STREAM: list[Cycle] = [
    ([f"at:{at}", "dust", *["lamp"] * (at == 2)], action)
    for at, action in [(0, "E"), (1, "E"), (2, "N"), (1, "E"), (1, "N"), (0, "E"), (2, "dig")] * 20
]


def test_plain_is_all_own_rules_off_one_by_one() -> None:
    all_off = [option(rule) for rule in OWN_RULES]
    goal = ["--goal", "at:2 lamp"]
    plain = learned(STREAM, "--plain", *goal)
    assert learned(STREAM, *all_off, *goal) == plain != learned(STREAM, *goal)


@pytest.mark.parametrize("rule", OWN_RULES)
def test_each_rule_can_be_switched_off_alone(monkeypatch: pytest.MonkeyPatch, rule: str) -> None:
    made: list[Parameters] = []

    class Witnessed(DynamicExpectancyModel):
        def __init__(self, costs: dict[str, float], parameters: Parameters, **others: Any) -> None:
            made.append(parameters)
            super().__init__(costs, parameters, **others)

    monkeypatch.setattr(dem, "DynamicExpectancyModel", Witnessed)
    learned(STREAM, option(rule))
    assert [own for own in OWN_RULES if not getattr(made[0], own)] == [rule]


def test_rates_that_are_given_hold_with_plain_too() -> None:
    given_rates = learned(STREAM, "--plain", "--alpha=0.25", "--beta=0.5")
    assert given_rates != learned(STREAM, "--plain")
    assert given_rates == learned(STREAM, "--plain", "--alpha=0.25", "--beta=0.5", "--seed=3")
