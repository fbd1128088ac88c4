"""Parameters and cycles with which much happens quickly, for tests of saving and shadowing."""

import msgspec
import numpy as np
from hypothesis import strategies as st

from farside.dem import Delta, DynamicExpectancyModel, Exploration, Parameters, ShadowModel

COSTS = {"go": 2.5, "turn": 1}
TOKENS = "abcdef"
PARAMETERS = Parameters(
    maturity=8,
    reach=2,
    learning_probability=0.7,
    ineffective=0.3,
    break_multiple=1.1,
    recovery=10,
)

signs = st.frozensets(st.sampled_from(TOKENS), min_size=1, max_size=3).map(sorted)
changes = st.one_of(
    st.none(),
    st.tuples(st.just("set"), signs, st.integers(0, 3)),
    st.tuples(st.just("withdraw"), signs, st.just(0)),
)
cycles = st.tuples(
    st.frozensets(st.sampled_from(TOKENS), max_size=4).map(sorted),
    st.sampled_from(["go", "turn", "as it chooses", None]),
    changes,
)
parameters = st.builds(
    Parameters,
    beta=st.sampled_from([0.2, 0.6]),
    learning_probability=st.sampled_from([0.5, 1]),
    reach=st.integers(1, 3),
    own_credit=st.booleans(),
    whole_implies_parts=st.booleans(),
    put_aside=st.booleans(),
    break_point=st.booleans(),
    maturity=st.integers(1, 6),
    ineffective=st.sampled_from([0.02, 0.3]),
    break_multiple=st.just(1.2),
    recovery=st.integers(1, 5),
    exploration=st.sampled_from(Exploration),
)
cuts = st.sampled_from(["delta", "whole", "nothing", "nothing"])


def sent(delta: Delta) -> Delta:
    """A delta as it arrives after crossing a link."""
    return msgspec.msgpack.decode(msgspec.msgpack.encode(delta), type=Delta)


def lists(model: ShadowModel | DynamicExpectancyModel) -> tuple[object, ...]:
    """Everything that a shadow has to hold too, with floats equal to the last bit."""
    return model.signs, model.hypotheses, model.goals, model.policy_map()


def recorded(
    parameters: Parameters = PARAMETERS, seed: int = 1
) -> tuple[DynamicExpectancyModel, ShadowModel]:
    model = DynamicExpectancyModel(COSTS, parameters, rng=np.random.default_rng(seed))
    model.record_changes()
    return model, ShadowModel(COSTS, parameters)
