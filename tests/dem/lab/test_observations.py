"""Observations as Tokens: bins, tilings, parts, and what a space is by itself."""

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from hypothesis import given
from hypothesis import strategies as st

from farside.dem.lab import as_one, bins, each, fields, label, one_hot, tiles, tokens_of

finite = st.floats(-3.0, 3.0)


def test_discrete_observations_are_told_by_name() -> None:
    assert label("state")(np.int64(7)) == ["state:7"]
    assert each("part")(np.array([3, 0])) == ["part0:3", "part1:0"]
    assert each(["row", "column"])((4, 1)) == ["row:4", "column:1"]
    assert one_hot("seen")(np.array([0, 1, 0, 1])) == ["seen:1", "seen:3"]


def test_numbers_fall_into_bins_and_what_is_outside_into_the_nearest() -> None:
    speed = bins("speed", -1.0, 1.0, 4)
    found = [speed(value)[0] for value in (-9.0, -1.0, -0.51, -0.5, 0.0, 0.99, 1.0, 9.0)]
    assert [token.removeprefix("speed0:") for token in found] == list("00012333")
    both = bins(["x", "v"], [0.0, -1.0], [1.0, 1.0], [2, 10])
    assert both(np.array([0.7, -0.05])) == ["x:1", "v:4"]


@given(finite, finite, st.integers(1, 9), st.integers(1, 12))
def test_every_tiling_has_one_tile_for_an_observation_and_neighbours_share_most(
    x: float, y: float, count: int, tilings: int
) -> None:
    """A shift by less than a tile's share of the tilings changes one tile at most."""
    tokens = tiles("tile", [-3.0, -3.0], [3.0, 3.0], count, tilings=tilings)
    here = tokens([x, y])
    assert [token.split(":")[0] for token in here] == [f"tile{one}" for one in range(tilings)]
    near = tokens([x + 0.99 * 6.0 / count / tilings, y])
    assert len(set(here) - set(near)) <= 1


def test_tiles_are_as_wide_as_is_said_and_shifted_by_odd_fractions() -> None:
    tokens = tiles("t", [0.0, 0.0], [4.0, 4.0], 4, tilings=4)
    assert tokens([0.5, 0.5]) == ["t0:0,0", "t1:0,1", "t2:1,1", "t3:1,0"]
    assert tokens([4.0, 0.0])[0] == "t0:4,0"


def test_parts_are_told_by_functions_of_their_own_and_the_whole_as_one() -> None:
    tokens = fields({"at": each(["x", "y"]), "mode": label("mode")})
    seen = {"at": (3, 4), "mode": "idle", "noise": 0.3}
    assert tokens(seen) == ["x:3", "y:4", "mode:idle"]
    assert as_one(tokens)(seen) == ["x:3 y:4 mode:idle"]
    assert fields({1: label("second")})(("a", "b")) == ["second:b"]


@pytest.mark.parametrize(
    ("space", "observation", "tokens"),
    [
        (spaces.Discrete(5, start=2), 3, ["state:3"]),
        (spaces.MultiDiscrete([3, 4]), np.array([2, 0]), ["part0:2", "part1:0"]),
        (spaces.MultiBinary(3), np.array([1, 0, 1]), ["on:0", "on:2"]),
        (spaces.Box(0, 9, (2,), np.int64), np.array([4, 9]), ["cell0:4", "cell1:9"]),
        (spaces.Box(-1.0, 1.0, (2, 1)), np.array([[-1.0], [0.5]]), ["x0:0", "x1:6"]),
        (
            spaces.Dict({"b": spaces.Discrete(2), "a": spaces.Tuple([spaces.MultiBinary(2)])}),
            {"a": (np.array([0, 1]),), "b": 1},
            ["a.0:1", "b:1"],
        ),
    ],
)
def test_a_space_says_how_its_observations_become_tokens(
    space: gymnasium.Space[Any], observation: object, tokens: list[str]
) -> None:
    assert tokens_of(space)(observation) == tokens


def test_a_space_that_nobody_knows_is_refused() -> None:
    with pytest.raises(TypeError, match=r"found Text.+ write a function"):
        tokens_of(spaces.Text(5))
    with pytest.raises(ValueError, match="expected finite ones"):
        tokens_of(spaces.Box(-np.inf, np.inf, (1,)))


@pytest.mark.parametrize(
    ("low", "high", "count", "message"),
    [
        (0.0, np.inf, 4, "expected finite ones with low < high, found 0.0 and inf"),
        (1.0, 1.0, 4, "expected finite ones with low < high"),
        (0.0, 1.0, 0, "counts: expected 1 or more in each dimension, found 0"),
    ],
)
def test_bins_without_bounds_or_number_are_refused(
    low: float, high: float, count: int, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        bins("x", low, high, count)


def test_what_does_not_fit_the_bins_is_refused() -> None:
    with pytest.raises(ValueError, match="each of 1 dimensions, found"):
        bins("x", 0.0, 1.0, 4)([0.1, 0.2])
    with pytest.raises(ValueError, match="each of 1 dimensions, found nan"):
        bins("x", 0.0, 1.0, 4)(np.nan)
    with pytest.raises(ValueError, match="names: expected 2"):
        each(["x"])([1, 2])
    with pytest.raises(ValueError, match="tilings: expected 1 or more, found 0"):
        tiles("t", 0.0, 1.0, 4, tilings=0)
