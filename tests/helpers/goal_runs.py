"""A model left alone with its goals, for tests that ask what came of them."""

from collections.abc import Sequence

from farside.dem import Aside, DynamicExpectancyModel, Sensed
from tests.dem.conftest import Grid


def drive(model: DynamicExpectancyModel, world: Grid, patience: int) -> list[Sensed]:
    """Leave the model alone until it has no goals, and return what it sensed."""
    story = []
    for _ in range(patience):
        story.append(model.sense(world.tokens()))
        if not model.goals:
            model.perform(None)
            return story
        choice = model.choose()
        model.perform(None if choice is None else world.do(choice.action))
    raise AssertionError(f"{model.goals} not reached from {world.at} in {patience} cycles")


def reached(story: Sequence[Sensed]) -> list[tuple[str, ...]]:
    return [goal.tokens for sensed in story for goal in sensed.reached]


def suspended(story: Sequence[Sensed]) -> list[tuple[str, ...]]:
    return [goal.tokens for sensed in story for goal in sensed.suspended]


def reasons(story: Sequence[Sensed]) -> list[Aside]:
    return [goal.aside for sensed in story for goal in sensed.suspended if goal.aside]
