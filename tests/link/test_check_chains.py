"""How likely losses are: the bound behind the verdicts on loss models with memory."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from farside.link.check.chains import LossLikelihood
from farside.link.check.intervals import correlation_interval
from farside.link.profile.impairments import FourState, GilbertElliott, LossModel
from farside.link.profile.loss import LossChain
from farside.link.profile.statistics import loss_statistics, transition_matrix

MODELS = [
    0.3,
    GilbertElliott(p=0.1, r=0.4),
    GilbertElliott(p=1.0, r=1.0),
    GilbertElliott(p=0.01, r=0.0, bad_loss=0.9, good_loss=0.1),
    FourState(p13=0.2, p31=0.3, p32=0.4, p23=0.5, p14=0.1),
]
FRAMES = 14


def likelihood(model: LossModel, counted: list[bool], starts: list[int]) -> LossLikelihood:
    return LossLikelihood(model, 0.05, np.array(starts), np.array(counted))


def distribution(model: LossModel, counted: list[bool], starts: list[int]) -> np.ndarray:
    """The exact probability of each number of losses in the frames that count, step by step."""
    chain = LossChain.of(model)
    steps, lost = transition_matrix(chain), 1 - (1 - np.array(chain.losses)) * (1 - 0.05)
    chances = np.zeros((len(lost), len(counted) + 1))
    chances[0, 0] = 1.0
    for index, counts in enumerate(counted):
        if index and starts[index] != starts[index - 1]:
            chances = np.vstack([chances.sum(axis=0), np.zeros_like(chances[1:])])
        chances = steps.T @ chances
        if counts:
            once_more = np.roll(chances, 1, axis=1)
            chances = (1 - lost)[:, None] * chances + lost[:, None] * once_more
    total: np.ndarray = chances.sum(axis=0)
    return total


@settings(max_examples=10)
@given(
    st.sampled_from(MODELS),
    st.lists(st.booleans(), min_size=FRAMES, max_size=FRAMES).filter(any),
    st.lists(st.integers(0, 1), min_size=FRAMES, max_size=FRAMES).map(sorted),
)
def test_the_bound_is_never_below_the_exact_probability(
    model: LossModel, counted: list[bool], starts: list[int]
) -> None:
    """Some frames do not count, and in one of them the model may start anew."""
    exact, found = distribution(model, counted, starts), likelihood(model, counted, starts)
    numbers = np.arange(len(exact))
    assert found.expected_share() == pytest.approx(float(exact @ numbers) / sum(counted))
    for lost in range(sum(counted) + 1):
        tail = min(exact[: lost + 1].sum(), exact[lost:].sum())
        assert found.chance(lost) >= min(1.0, 2 * tail) - 1e-9


@pytest.mark.parametrize(("model", "share"), [(0.05, 0.06), (GilbertElliott(p=0.01, r=0.3), 0.045)])
def test_in_many_frames_another_loss_is_all_but_impossible(model: LossModel, share: float) -> None:
    many = np.ones(40_000, dtype=np.bool_)
    found = LossLikelihood(model, 0.0, np.zeros(40_000, dtype=np.int64), many)
    asked = loss_statistics(model).rate
    assert found.chance(round(40_000 * asked)) > 0.5
    assert found.chance(round(40_000 * share)) < 1e-6


def test_losses_that_follow_each_other_too_often_are_all_but_impossible() -> None:
    many = np.ones(40_000, dtype=np.bool_)
    found = LossLikelihood(0.05, 0.0, np.zeros(40_000, dtype=np.int64), many)
    assert found.repeat_chance(100, 2000, 0.05) > 0.5
    assert found.repeat_chance(200, 2000, 0.05) < 1e-6


@pytest.mark.parametrize(("p", "r"), [(1e-12, 3e-12), (1e-9, 1.0), (1.0, 1e-9), (1.0, 1.0)])
def test_rare_changes_of_state_count_for_what_they_are(p: float, r: float) -> None:
    assert loss_statistics(GilbertElliott(p=p, r=r)).rate == pytest.approx(p / (p + r))


@pytest.mark.parametrize("correlation", [0.0, 0.9, 0.999, -0.99])
def test_an_interval_for_a_correlation_misses_as_rarely_as_it_says(correlation: float) -> None:
    rng = np.random.default_rng(0)
    missed = 0
    for _ in range(300):
        scores = [float(rng.standard_normal())]
        for kick in rng.standard_normal(300) * np.sqrt(1 - correlation**2):
            scores.append(correlation * scores[-1] + float(kick))
        each = np.array(scores)
        low, high = correlation_interval(each[:-1], each[1:], correlation, 0.05)
        missed += not low <= correlation <= high
    assert missed <= 0.05 * 300
