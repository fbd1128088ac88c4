"""The ranges of the parameters, checked in Python as they are in a mission file."""

import math
from typing import Any, cast

import msgspec
import pytest

from farside.dem import Curiosity, Exploration, Parameters

FRACTIONS = ["alpha", "beta", "learning_probability", "initial_cm", "ineffective"]


@pytest.mark.parametrize("name", FRACTIONS)
@pytest.mark.parametrize("value", [-0.1, 1.1, math.nan])
def test_rates_and_probabilities_lie_between_0_and_1(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=f"{name}: expected a number >= 0 and <= 1, found {value}"):
        Parameters(**{name: value})


@pytest.mark.parametrize("name", FRACTIONS)
@pytest.mark.parametrize("value", [0, 1])
def test_both_ends_of_the_range_are_allowed(name: str, value: Any) -> None:
    assert getattr(Parameters(**{name: value}), name) == value


@pytest.mark.parametrize("name", ["reach", "maturity", "recovery"])
@pytest.mark.parametrize("value", [0, -1, 1.5, 10**10])
def test_counts_are_whole_numbers_from_1(name: str, value: Any) -> None:
    with pytest.raises(ValueError, match=rf"{name}: expected a whole number >= 1 .* found {value}"):
        Parameters(**{name: value})


@pytest.mark.parametrize("value", [1.0, -4.0, math.nan])
def test_a_goal_breaks_only_when_its_value_has_grown(value: float) -> None:
    with pytest.raises(ValueError, match=f"break_multiple: expected a number > 1, found {value}"):
        Parameters(break_multiple=value)


def test_switches_are_true_or_false() -> None:
    with pytest.raises(ValueError, match="removal: expected bool, found 1"):
        Parameters(removal=cast("Any", 1))


def test_a_model_explores_in_one_of_three_ways() -> None:
    assert [Parameters(exploration=how).exploration for how in Exploration] == [*Exploration]
    assert Parameters(exploration=cast("Any", "none")).exploration is Exploration.NONE
    expected = "exploration: expected one of none, random, curious, found bold"
    with pytest.raises(ValueError, match=expected):
        Parameters(exploration=cast("Any", "bold"))


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan])
def test_trying_something_new_has_a_cost(value: float) -> None:
    with pytest.raises(ValueError, match=f"optimistic_cost: expected a number > 0, found {value}"):
        Curiosity(optimistic_cost=value)


@pytest.mark.parametrize("value", [-1.0, math.nan])
def test_restlessness_is_never_negative(value: float) -> None:
    with pytest.raises(ValueError, match=f"restlessness: expected a number >= 0, found {value}"):
        Curiosity(restlessness=value)


@pytest.mark.parametrize("name", ["optimistic_cost", "restlessness"])
def test_curiosity_is_finite(name: str) -> None:
    with pytest.raises(ValueError, match=f"{name}: expected a finite number, found inf"):
        Curiosity(**{name: math.inf})


def test_an_unknown_parameter_is_refused_when_read() -> None:
    with pytest.raises(msgspec.ValidationError, match="unknown field `alpa`"):
        msgspec.convert({"alpa": 0.3}, Parameters)
