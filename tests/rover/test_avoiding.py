"""What a mission says is to be avoided holds on board, whoever's goal the rover goes for."""

import re
from collections.abc import Callable
from typing import Any

import msgspec
import pytest

from farside.control import Mode
from farside.dem import DynamicExpectancyModel
from farside.messages import SetGoal, SetMode
from farside.rover.config import Avoided
from farside.topics import ROVER_DECISION
from tests.rover.conftest import Bench

ROUND = (
    "######",
    "#A..B#",
    "#.##.#",
    "#D..C#",
    "######",
)
ALONG_THE_NORTH = "NNEEESS"
AND_BACK_IN_THE_SOUTH = "WWW"


@pytest.mark.parametrize(
    ("avoid", "way"),
    [
        ([], "EEE"),
        ([{"place": "3,1", "cost_s": 1.0}], "EEE"),
        ([{"place": "3,1", "cost_s": 100.0}], "NNEEESS"),
        ([{"token": "at:3,1", "cost_s": 100.0}], "NNEEESS"),
    ],
)
def test_the_rover_goes_round_what_is_dear_enough(
    bench: Callable[..., Bench], avoid: list[dict[str, Any]], way: str
) -> None:
    rover = bench(ROUND, avoid=avoid)
    rover.do(ALONG_THE_NORTH + AND_BACK_IN_THE_SOUTH)
    rover.do("EEE" + ALONG_THE_NORTH[::-1].translate(str.maketrans("NES", "SWN")))
    before = len(rover.of(ROVER_DECISION))
    rover.order(SetMode(Mode.AUTONOMOUS))
    rover.order(SetGoal(("at:C",), 1.0))
    rover.until(lambda: "at:C" in rover.rover.parts.cycle.tokens)
    assert "".join(entry.action for entry in rover.of(ROVER_DECISION)[before:]) == way


def test_the_model_on_board_knows_that_the_mission_says_so(bench: Callable[..., Bench]) -> None:
    model = bench(avoid=[{"place": "C", "cost_s": 3.0}]).rover.controller
    assert isinstance(model, DynamicExpectancyModel)
    assert [(one.tokens, one.costs) for one in model.aversions] == [(("at:C",), {"mission": 3.0})]


@pytest.mark.parametrize(
    ("avoided", "found"),
    [({}, "neither"), ({"place": "A", "token": "at:A"}, "both")],
)
def test_one_thing_at_a_time_is_avoided(avoided: dict[str, str], found: str) -> None:
    with pytest.raises(msgspec.ValidationError, match=re.escape(f"place or token, found {found}")):
        msgspec.convert({"cost_s": 1.0, **avoided}, Avoided)
