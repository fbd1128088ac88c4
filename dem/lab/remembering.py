"""A world with a memory Token."""

from collections.abc import Mapping

from farside.dem.lab.worlds import Situation, World
from farside.dem.recall import Recall


class _Remembering:
    """A world with a memory Token; see `memory`."""

    def __init__(self, world: World, steps: int) -> None:
        self._world, self._recall = world, Recall(steps)

    @property
    def action_costs(self) -> Mapping[str, float]:
        return self._world.action_costs

    def begin(self, seed: int | None) -> Situation:
        self._recall.forget()
        return self._with_memory(self._world.begin(seed))

    def act(self, action: str) -> Situation:
        self._recall.did(action)
        return self._with_memory(self._world.act(action))

    def _with_memory(self, now: Situation) -> Situation:
        sensed = tuple(now.tokens)
        self._recall.sense(sensed)
        return now._replace(tokens=[*sensed, *self._recall.tokens])


def memory(world: World, steps: int = 1) -> World:
    """A world in which what was sensed and done before is sensed too, as one Token.

    For worlds where several places look alike and only the way to them tells them apart; see
    `farside.dem.Recall`. The memory begins anew with every episode.

    Args:
        world: the world.
        steps: how many steps the memory goes back; 0 adds nothing.

    Raises:
        ValueError: if `steps` is negative.
    """
    return _Remembering(world, steps)
