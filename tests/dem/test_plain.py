"""The model against its plain twin: from the same random stream, the same lists."""

from collections.abc import Iterator, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plain import PlainModel
from worlds import AliasedWorld

from farside.dem import DynamicExpectancyModel, Parameters

ACTIONS = ("E", "N")

# Few places, and Tokens that come and go beside them, so that much is created, differentiated and
# removed within a short stream.
places = st.sampled_from(["at:A", "at:B"])
beside = st.frozensets(st.sampled_from(["dust", "gate", "lamp"]))
cycles = st.tuples(st.builds(lambda place, more: {place, *more}, places, beside), st.booleans())
streams = st.lists(st.tuples(cycles, st.sampled_from([*ACTIONS, None])), max_size=60)
seeds = st.integers(0, 99)
learning = st.builds(
    Parameters,
    alpha=st.floats(0, 1),
    beta=st.floats(0, 1),
    averaging=st.booleans(),
    learning_probability=st.sampled_from([0.3, 0.7, 1.0]),
    initial_cm=st.sampled_from([0.5, 0.3]),
    reach=st.integers(1, 3),
    own_credit=st.booleans(),
    situations=st.booleans(),
    differentiation=st.booleans(),
    removal=st.booleans(),
    maturity=st.integers(1, 4),
    ineffective=st.sampled_from([0.02, 0.3, 0.5]),
)
EAGER = Parameters(maturity=8, ineffective=0.2, reach=2, learning_probability=0.8)
GOALS = (("lamp",), ("at:B", "gate"))


class Pair:
    """The model and its twin, with the same seed and the same goals."""

    def __init__(
        self, parameters: Parameters, seed: int = 0, actions: tuple[str, ...] = ACTIONS
    ) -> None:
        costs = dict.fromkeys(actions, 1.0)
        self.model = DynamicExpectancyModel(costs, parameters, rng=np.random.default_rng(seed))
        self.twin = PlainModel(parameters, np.random.default_rng(seed))
        self.removed = 0

    def cycle(self, tokens: set[str], action: str | None, *, wants_goals: bool = False) -> None:
        for goal in GOALS if wants_goals else ():
            self.model.set_goal(goal, priority=1.0)
            if len(goal) > 1:
                self.twin.know(goal).on_probation = False
        goals = [goal.tokens for goal in self.model.goals]
        self.removed += self.model.sense(tokens).removed
        self.twin.sense(tokens, goals)
        self.model.perform(action)
        self.twin.perform(action, [goal.tokens for goal in self.model.goals])

    def agree(self) -> bool:
        assert self.model.signs == tuple(sign.tokens for sign in self.twin.signs)
        assert [
            (h.context, h.action, h.outcome, h.delay, h.cm, h.credit, h.predictions, h.successes)
            for h in self.model.hypotheses
        ] == [
            (
                *(h.context.tokens, h.action, h.outcome.tokens, h.delay),
                *(h.cm, h.credit, h.predictions, h.successes),
            )
            for h in self.twin.hypotheses
        ]
        return True


@settings(max_examples=300)
@given(stream=streams, parameters=learning, seed=seeds)
def test_the_model_and_its_twin_agree_to_the_last_bit(
    stream: Sequence[tuple[tuple[set[str], bool], str | None]], parameters: Parameters, seed: int
) -> None:
    pair = Pair(parameters, seed)
    for (tokens, wants_goals), action in stream:
        pair.cycle(tokens, action, wants_goals=wants_goals)
    pair.agree()


def random_stream(rng: np.random.Generator, length: int) -> Iterator[tuple[set[str], str | None]]:
    """E leads from A to B only while the gate is sensed: something to differentiate."""
    at = "at:A"
    for _ in range(length):
        tokens = {at, *(token for token in ("dust", "gate") if rng.random() < 0.5)}
        action = ACTIONS[rng.integers(2)] if rng.random() < 0.9 else None
        yield tokens, action
        if action == "E":
            at = "at:B" if at == "at:A" and "gate" in tokens else "at:A"


@pytest.mark.parametrize("seed", range(2))
def test_they_agree_in_every_cycle_while_much_is_differentiated_and_removed(seed: int) -> None:
    pair = Pair(EAGER, seed)
    conjunctions: set[tuple[str, ...]] = set()
    for number, (tokens, action) in enumerate(random_stream(np.random.default_rng(seed), 400)):
        pair.cycle(tokens, action)
        if number % 10 == 0:
            pair.agree()
        conjunctions.update(sign for sign in pair.model.signs if len(sign) > 1)
    assert ("at:A", "gate") in conjunctions
    assert pair.removed > 20


def test_they_agree_after_a_long_walk_through_an_aliased_world() -> None:
    """Far shorter than the runs in `test_worlds`, because the twin searches all its lists."""
    world = AliasedWorld(2)
    pair = Pair(Parameters(), actions=world.actions)
    rng = np.random.default_rng(1)
    for _ in range(1500):
        action = world.actions[rng.integers(len(world.actions))]
        pair.cycle(world.tokens(), action)
        world.do(action)
    pair.agree()
    assert any(len(sign) > 1 for sign in pair.model.signs)
