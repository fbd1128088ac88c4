"""The memory Token on board: the controller alone senses it, and nobody takes it for a place."""

from collections.abc import Callable

from farside.messages import Drive, SetGoal
from farside.topics import ROVER_CYCLE, ROVER_POLICY_MAP
from tests.rover.conftest import Bench

LANDMARKS = (
    "########",
    "#A....B#",
    "#.####.#",
    "#D....C#",
    "########",
)


def test_the_controller_senses_what_was_and_what_was_done(bench: Callable[..., Bench]) -> None:
    rover = bench(LANDMARKS, memory=1)
    rover.do("EE")
    assert [cycle.tokens for cycle in rover.of(ROVER_CYCLE)] == [
        ("at:D", "on_charge"),
        ("at:2,1", "was:at:D on_charge|did:E"),
        ("at:3,1", "was:at:2,1|did:E"),
    ]


def test_memory_reaches_as_far_back_as_is_asked_for(bench: Callable[..., Bench]) -> None:
    rover = bench(LANDMARKS, memory=2)
    rover.do("EE")
    assert rover.of(ROVER_CYCLE)[-1].tokens == (
        "at:3,1",
        "was:at:2,1|did:E|was:at:D on_charge|did:E",
    )


def test_nobody_else_takes_it_for_what_is_so(bench: Callable[..., Bench]) -> None:
    rover = bench(LANDMARKS, memory=1)
    rover.do("E")
    rover.run_s(3)
    assert rover.telemetry.tokens == ("at:2,1",)
    assert len(rover.of(ROVER_CYCLE)) == 2, "who stands has done nothing since"


def test_a_bump_is_remembered_where_it_was_whatever_led_there(bench: Callable[..., Bench]) -> None:
    rover = bench(LANDMARKS, memory=1)
    first = rover.order(Drive("S"))
    rover.run_s(15)
    again = rover.order(Drive("S"))
    rover.run_s(15)
    assert rover.end_of(first).why == "its move was blocked, or given up"
    assert rover.end_of(again).why == "S was blocked here just now"


def test_a_goal_at_a_place_is_reached_on_a_map_with_memory(bench: Callable[..., Bench]) -> None:
    rover = bench(LANDMARKS, memory=1)
    rover.do("EEWWE")
    rover.order(SetGoal(("at:D",), 1.0))
    rover.run_s(2)
    signs = {place.sign for place in rover.of(ROVER_POLICY_MAP)[-1].places}
    assert signs >= {("at:2,1",), ("was:at:D on_charge|did:E",)}
    rover.do("W")
    rover.run_s(2)
    assert rover.rover.parts.goals.listed == ()


def test_the_same_moves_are_remembered_alike(bench: Callable[..., Bench]) -> None:
    def checks() -> list[object]:
        rover = bench(LANDMARKS, memory=1)
        rover.do("NNES")
        return [rover.rover.parts.cycle.lists_check, *rover.of(ROVER_CYCLE)]

    assert checks() == checks()
