"""Difficult worlds, and measures of how well a model does in them; tests use them too."""

from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple, Protocol, TypeVar

import numpy as np

from farside.dem import DynamicExpectancyModel, Parameters

EVERYWHERE = {"battery:ok", "mode:nominal"}
STEPS = {"N": (0, 1), "E": (1, 0), "S": (0, -1), "W": (-1, 0)}
HEADINGS = "NESW"


State = TypeVar("State")


class World(Protocol[State]):
    """What all of them can do."""

    state: State

    @property
    def actions(self) -> tuple[str, ...]:
        """What can be done here."""

    def tokens(self) -> set[str]:
        """What is sensed here."""

    def goals(self) -> list[tuple[str, ...]]:
        """Every Sign that may be a goal."""

    def do(self, action: str) -> None:
        """Perform an action."""

    def after(self, state: State, action: str) -> State:
        """The state that an action leads to."""

    def is_at(self, state: State, goal: tuple[str, ...]) -> bool:
        """Whether a goal is reached in a state."""


class AliasedWorld:
    """A square room for a robot that drives forward or turns, with place and heading as Tokens.

    Neither predicts the effect of an action by itself: where `forward` leads depends on both.
    """

    actions = ("forward", "left", "right")

    def __init__(self, size: int) -> None:
        self.size = size
        self.state = 0, 0, "N"

    def tokens(self) -> set[str]:
        """What is sensed here."""
        east, north, heading = self.state
        return {f"at:{east},{north}", f"heading:{heading}"}

    def goals(self) -> list[tuple[str, ...]]:
        """Every place, as a Sign."""
        return [(f"at:{e},{n}",) for e in range(self.size) for n in range(self.size)]

    def do(self, action: str) -> None:
        """Perform an action."""
        self.state = self.after(self.state, action)

    def after(self, state: tuple[int, int, str], action: str) -> tuple[int, int, str]:
        """The state that an action leads to."""
        east, north, heading = state
        if action != "forward":
            turned = HEADINGS.index(heading) + (1 if action == "right" else -1)
            return east, north, HEADINGS[turned % 4]
        east, north = east + STEPS[heading][0], north + STEPS[heading][1]
        ends_inside = 0 <= east < self.size and 0 <= north < self.size
        return (east, north, heading) if ends_inside else state

    def is_at(self, state: tuple[int, int, str], goal: tuple[str, ...]) -> bool:
        """Whether a goal is reached in a state."""
        return goal[0] == f"at:{state[0]},{state[1]}"


class Yard:
    """A square of places with walls between some, and Tokens that are sensed in all of them."""

    actions = tuple(STEPS)

    def __init__(self, everywhere: Collection[str] = EVERYWHERE, size: int = 9) -> None:
        self.size = size
        self.everywhere = set(everywhere)
        self.state = 0, 0
        walls = [((2, y), (3, y)) for y in range(3)]
        walls += [((5, y), (6, y)) for y in range(6, 9)]
        walls += [((x, 4), (x, 5)) for x in range(3, 5)]
        self.walls = {*walls, *(wall[::-1] for wall in walls)}

    def tokens(self) -> set[str]:
        """What is sensed here."""
        return {f"at:{self.state[0]},{self.state[1]}", *self.everywhere}

    def goals(self) -> list[tuple[str, ...]]:
        """Every place, as a Sign."""
        return [(f"at:{east},{north}",) for east in range(self.size) for north in range(self.size)]

    def do(self, action: str) -> None:
        """Perform an action."""
        self.state = self.after(self.state, action)

    def after(self, state: tuple[int, int], action: str) -> tuple[int, int]:
        """The place that an action leads to."""
        aside = state[0] + STEPS[action][0], state[1] + STEPS[action][1]
        inside = all(0 <= coordinate < self.size for coordinate in aside)
        return aside if inside and (state, aside) not in self.walls else state

    def is_at(self, state: tuple[int, int], goal: tuple[str, ...]) -> bool:
        """Whether a goal is reached at a place."""
        return goal[0] == f"at:{state[0]},{state[1]}"


def fewest_steps(world: World[State], goal: tuple[str, ...]) -> int:
    """Least number of actions from the current state to a goal, breadth first."""
    steps, frontier = {world.state: 0}, [world.state]
    for state in frontier:
        if world.is_at(state, goal):
            return steps[state]
        for action in world.actions:
            after = world.after(state, action)
            if after not in steps:
                steps[after] = steps[state] + 1
                frontier.append(after)
    raise ValueError(f"no path to {goal}")


def noise(
    rng: np.random.Generator, probability: float = 0.3, tokens: int = 6
) -> Iterator[set[str]]:
    """For each cycle a set of Tokens, each drawn independently."""
    names = [f"noise:{number}" for number in range(tokens)]
    while True:
        yield {name for name in names if rng.random() < probability}


def new_model(world: World[State], parameters: Parameters, seed: int) -> DynamicExpectancyModel:
    """A model for a world in which every action costs 1."""
    costs = dict.fromkeys(world.actions, 1.0)
    return DynamicExpectancyModel(costs, parameters, rng=np.random.default_rng(seed))


def wander(
    model: DynamicExpectancyModel,
    world: World[State],
    cycles: int,
    rng: np.random.Generator,
    beside: Iterator[set[str]] | None = None,
) -> None:
    """Drive a model around a world with random commands."""
    for number in rng.integers(len(world.actions), size=cycles):
        model.sense(world.tokens() | (next(beside) if beside else set()))
        model.perform(world.actions[number])
        world.do(world.actions[number])


def walk_to(
    model: DynamicExpectancyModel,
    world: World[State],
    goal: Sequence[str],
    patience: int,
    beside: Iterator[set[str]] | None = None,
) -> int:
    """Set a goal, leave the model alone and count its steps, up to `patience`."""
    model.set_goal(goal, priority=1.0)
    for steps in range(patience + 1):
        if model.sense(world.tokens() | (next(beside) if beside else set())).reached:
            model.perform(None)
            return steps
        choice = model.choose()
        assert choice is not None, "a model that explores has always something to do"
        model.perform(choice.action)
        world.do(choice.action)
    model.withdraw_goal(goal)
    return patience


class Trial(NamedTuple):
    """Steps of a model over the fewest possible, and the final lengths of its lists."""

    ratio: float
    signs: int
    hypotheses: int


def trial(
    world: World[State],
    parameters: Parameters,
    seed: int,
    *,
    cycles: int,
    goals: int,
    patience: int,
) -> tuple[DynamicExpectancyModel, Trial]:
    """Random actions, then random goals; returns the model and how it did."""
    rng = np.random.default_rng(seed)
    model = new_model(world, parameters, seed + 1000)
    wander(model, world, cycles, rng)
    walked = fewest = 0
    places = world.goals()
    for number in rng.integers(len(places), size=goals):
        fewest += fewest_steps(world, places[number])
        walked += walk_to(model, world, places[number], patience)
    return model, Trial(walked / fewest, model.sign_count, model.hypothesis_count)


def aliased_trial(seed: int, parameters: Parameters) -> tuple[DynamicExpectancyModel, Trial]:
    """4 × 4 places and four headings, after 10,000 random actions."""
    return trial(AliasedWorld(4), parameters, seed, cycles=10_000, goals=20, patience=200)


def phantom_trial(seed: int, parameters: Parameters) -> tuple[DynamicExpectancyModel, Trial]:
    """81 places with two Tokens sensed in all of them, after 4,000 random actions."""
    return trial(Yard(), parameters, seed, cycles=4000, goals=12, patience=400)


class Length(NamedTuple):
    """The lengths of the lists in a cycle."""

    cycle: int
    signs: int
    hypotheses: int


def removal_curve(
    parameters: Parameters, *, cycles: int, every: int, seed: int = 0
) -> tuple[DynamicExpectancyModel, Yard, Iterator[set[str]], list[Length]]:
    """Random actions in a yard with noise; returns model, world, noise and list lengths."""
    rng, world = np.random.default_rng(seed), Yard()
    beside = noise(np.random.default_rng(seed + 1))
    model = new_model(world, parameters, seed + 1000)
    curve = []
    for cycle in range(every, cycles + 1, every):
        wander(model, world, every, rng, beside)
        curve.append(Length(cycle, model.sign_count, model.hypothesis_count))
    return model, world, beside, curve
