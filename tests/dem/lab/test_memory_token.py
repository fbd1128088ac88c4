"""Memory Tokens: what they say, and a world that cannot be solved without."""

from itertools import islice
from typing import ClassVar

import numpy as np
import pytest

from farside.dem import DynamicExpectancyModel, Recall
from farside.dem.lab import Situation, World, memory, play


class Corridor:
    """Two doors, then a junction that looks the same: the door says which way the goal is."""

    action_costs: ClassVar[dict[str, float]] = {"left": 1.0, "on": 1.0, "right": 1.0}

    def __init__(self) -> None:
        self.doors = np.random.default_rng(0)

    def begin(self, seed: int | None) -> Situation:  # noqa: ARG002 - as a world has it
        self.door, self.through = ("left", "right")[int(self.doors.integers(2))], False
        return Situation([f"door:{self.door}"])

    def act(self, action: str) -> Situation:
        if not self.through:
            self.through = action == "on"
            return Situation(["junction"] if self.through else [f"door:{self.door}"])
        if action == "on":
            return Situation(["junction"])
        return Situation(["goal" if action == self.door else "wall"], terminated=True)


def recalled(recall: Recall, story: str) -> list[str]:
    """What is remembered after a story such as "b a, N, c": what is sensed and done in turn."""
    for number, words in enumerate(story.split(", ")):
        if number % 2:
            recall.did(words)
        else:
            recall.sense(words.split())
    return recall.tokens


def test_the_token_tells_of_the_last_steps_the_latest_first() -> None:
    assert recalled(Recall(), "a") == []
    assert recalled(Recall(), "b a, N, c") == ["was:a b|did:N"]
    assert recalled(Recall(), "b a, N, c, E, d") == ["was:c|did:E"]
    assert recalled(Recall(steps=2), "b a, N, c, E, d") == ["was:c|did:E|was:a b|did:N"]
    assert recalled(Recall(steps=2), "a, N, b, E, c, S, d") == ["was:c|did:S|was:b|did:E"]


def test_what_changes_nothing_is_not_worth_remembering() -> None:
    assert recalled(Recall(), "a, N, b, push, b, push, b") == ["was:a|did:N"]


def test_what_is_sensed_while_nothing_is_done_is_what_a_step_begins_with() -> None:
    recall = Recall()
    recall.sense(["a"])
    recall.sense(["a", "low"])
    recall.did("N")
    recall.sense(["b"])
    assert recall.tokens == ["was:a low|did:N"]


def test_what_is_forgotten_is_no_step_of_what_follows() -> None:
    recall = Recall()
    assert recalled(recall, "a, N, b, E")
    recall.forget()
    recall.sense(["c"])
    assert recall.tokens == []


def test_no_memory_has_no_token_and_less_than_none_is_refused() -> None:
    assert recalled(Recall(steps=0), "a, N, b") == []
    with pytest.raises(ValueError, match="expected 0 or more, found -1"):
        memory(Corridor(), steps=-1)
    with pytest.raises(TypeError, match="found the string 'ab'"):
        Recall().sense("ab")


def test_a_world_with_memory_tells_what_was_and_begins_anew_with_every_episode() -> None:
    world = memory(Corridor())
    assert isinstance(world, World)
    (door,) = world.begin(None).tokens
    assert list(world.act("on").tokens) == ["junction", f"was:{door}|did:on"]
    assert list(world.act("on").tokens) == ["junction", f"was:{door}|did:on"]
    assert len(list(world.begin(None).tokens)) == 1


def test_a_junction_that_looks_the_same_is_told_apart_by_the_way_to_it() -> None:
    """After some episodes at random, as who knows one door's way to the goal tries no other."""

    def reached(world: World) -> int:
        model = DynamicExpectancyModel(world.action_costs, rng=np.random.default_rng(1))
        for _ in islice(play(model, world, goal=["nowhere"]), 60):
            pass
        return sum(episode.reached for episode in islice(play(model, world, goal=["goal"]), 100))

    assert reached(Corridor()) < 75
    assert reached(memory(Corridor())) == 100
