"""A grid world to learn in, and shorthands that keep the stories short."""

from collections.abc import Callable, Sequence
from typing import Any, Protocol

import numpy as np
import pytest

from farside.dem import Choice, DynamicExpectancyModel, Goal, Parameters, PolicyValue, Sensed

MOVES = {"N": (0, 1), "E": (1, 0), "S": (0, -1), "W": (-1, 0)}
COST = 2.66

Event = tuple[Sequence[str], str | None, tuple[str, Sequence[str], int] | None]
"""A cycle with Tokens, action, and a change of goals: "set" or "withdraw", Sign, priority."""

Said = Sensed | Choice | None | tuple[tuple[PolicyValue, ...], tuple[Goal, ...], float]
RunCycle = Callable[[DynamicExpectancyModel, Sequence[str], str | None], Sensed]
Live = Callable[[DynamicExpectancyModel, Sequence[Event]], list[Said]]


class MakeModel(Protocol):
    """What `make_model` is."""

    def __call__(self, seed: int = 0, **parameters: Any) -> DynamicExpectancyModel: ...


class Grid:
    """Places drawn row by row, northernmost row first. A move off the places has no effect."""

    def __init__(self, *rows: str) -> None:
        self.places = {
            (east, len(rows) - 1 - row)
            for row, line in enumerate(rows)
            for east, character in enumerate(line)
            if character == "."
        }
        self.at = min(self.places)

    def tokens(self) -> list[str]:
        """What is sensed here."""
        return [self.token(self.at)]

    def token(self, place: tuple[int, int]) -> str:
        """The Token of a place."""
        return f"at:{place[0]},{place[1]}"

    def beside(self, place: tuple[int, int], action: str) -> tuple[int, int]:
        """The place where an action at `place` ends."""
        aside = place[0] + MOVES[action][0], place[1] + MOVES[action][1]
        return aside if aside in self.places else place

    def do(self, action: str) -> str:
        """Perform an action and return it."""
        self.at = self.beside(self.at, action)
        return action

    def steps_to(self, goal: tuple[int, int]) -> dict[tuple[int, int], int]:
        """Least number of moves to `goal` from every place, breadth first."""
        steps, frontier = {goal: 0}, [goal]
        for place in frontier:
            for action in MOVES:
                aside = self.beside(place, action)
                if aside not in steps:
                    steps[aside] = steps[place] + 1
                    frontier.append(aside)
        return steps


class Tour(Protocol):
    """What `tour` is."""

    def __call__(
        self, model: DynamicExpectancyModel, world: Grid, cycles: int, seed: int = 1
    ) -> None: ...


class Eventful(Protocol):
    """What `eventful` is."""

    def __call__(self, count: int, seed: int = 5) -> list[Event]: ...


@pytest.fixture
def grid() -> Grid:
    return Grid(
        ".....",
        ".#.#.",
        ".#...",
        "...#.",
    )


@pytest.fixture
def corridor() -> Grid:
    return Grid("......")


@pytest.fixture(scope="session")
def make_model() -> MakeModel:
    def make(seed: int = 0, **parameters: Any) -> DynamicExpectancyModel:
        rng = np.random.default_rng(seed)
        return DynamicExpectancyModel(dict.fromkeys(MOVES, COST), Parameters(**parameters), rng=rng)

    return make


@pytest.fixture(scope="session")
def cycle() -> RunCycle:
    """Run one guided cycle and return what was sensed."""

    def run(model: DynamicExpectancyModel, tokens: Sequence[str], action: str | None) -> Sensed:
        sensed = model.sense(tokens)
        model.perform(action)
        return sensed

    return run


@pytest.fixture(scope="session")
def tour() -> Tour:
    """Drive a model around a world with random commands."""

    def run(model: DynamicExpectancyModel, world: Grid, cycles: int, seed: int = 1) -> None:
        for action in np.random.default_rng(seed).choice(list(MOVES), cycles):
            model.sense(world.tokens())
            model.perform(world.do(str(action)))

    return run


@pytest.fixture(scope="session")
def eventful() -> Eventful:
    """Cycles (Tokens, action, change of goals) in which everything happens that can.

    At first a goal of two Tokens is set, reached, withdrawn, and never active again, so that
    nothing refers to its Sign any more. Then comes noise, in which `e` follows `go` whenever `a`
    and `b` are sensed.
    """
    goal = ["a", "b"]
    forgotten: list[Event] = [
        (["f"], "go", ("set", goal, 1)),
        *[(goal, None, ("set", goal, 1)), (["f"], "go", None)] * 3,
        ([], None, ("withdraw", goal, 0)),
        *[(["f"], "go", None), ([], None, None)] * 12,
    ]

    def stream(count: int, seed: int = 5) -> list[Event]:
        rng = np.random.default_rng(seed)
        cycles, follows = list(forgotten), False
        while len(cycles) < count:
            here = [token for token in "abcd" if rng.random() < 0.4]
            action = str(rng.choice(["go", "turn", "as it chooses"]))
            change = ("set", ["b", "c", "d"], 2) if rng.random() < 0.1 else None
            cycles.append((here + ["e"] * follows, action, change))
            follows = action == "go" and {"a", "b"} <= set(here)
        return cycles[:count]

    return stream


@pytest.fixture(scope="session")
def live() -> Live:
    """Run a model through such cycles and return everything that it reported and chose."""

    def live_through(model: DynamicExpectancyModel, cycles: Sequence[Event]) -> list[Said]:
        said: list[Said] = []
        for tokens, action, change in cycles:
            said.append(model.sense(tokens))
            match change:
                case "set", sign, priority:
                    model.set_goal(sign, priority)
                case "withdraw", sign, _:
                    model.withdraw_goal(sign)
            if action == "as it chooses":
                choice = model.choose()
                said.append(choice)
                action = choice.action if choice else None  # noqa: PLW2901 - as is performed
            model.perform(action)
            said.append((model.policy_map(), model.goals, model.mean_cm))
        return said

    return live_through
