"""Playing: a model acts and learns in a world, episode after episode."""

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from farside.dem.cycle import Choice
from farside.dem.lab.metrics import Watcher, cycle_metrics
from farside.dem.lab.worlds import REWARDED, Situation, World
from farside.dem.lists.signs import to_sign
from farside.dem.model import DynamicExpectancyModel


class Episode(NamedTuple):
    """The result of an episode.

    Attributes:
        steps: number of actions performed.
        reward: sum of the rewards.
        reached: number of cycles in which the goal was sensed.
        is_stuck: whether it was given up, as the model knew nothing to do.
    """

    steps: int
    reward: float
    reached: int
    is_stuck: bool = False


def play(
    model: DynamicExpectancyModel,
    world: World,
    *,
    goal: Iterable[str] = (REWARDED,),
    seed: int | None = None,
    watch: Watcher | None = None,
    clock: Callable[[], float] | None = None,
) -> Iterator[Episode]:
    """Let the model act and learn, episode after episode, for as long as the caller iterates.

    The goal is set again each time it was reached. From the terminal state of an episode, every
    action leads to the start of the next one. The model learns this like anything else, or else
    curiosity would draw it back to that state for ever. From a truncation at a time limit it
    learns nothing. A model that does not explore ends an episode that goes on beyond the goal.

    Args:
        model: a model with the actions of `world.action_costs`, between two cycles.
        world: the world; `GymWorld` makes one of a gymnasium environment.
        goal: a Sign of the world's Tokens.
        seed: seed of the first episode.
        watch: is told of every cycle; nothing is measured without.
        clock: tells the time in seconds, such as `time.perf_counter`, for `CycleMetrics.seconds`.

    Raises:
        TypeError: if `world` is none, as a bare environment of gymnasium is.
        ValueError: if the model does not explore, and knows no way to the goal: a world does not
            wait.
    """
    player = Player(model, world, goal, watch, clock)
    while True:
        episode = player.episode(seed)
        if episode.is_stuck:
            raise ValueError(
                "exploration: expected a model that explores, random or curious, found one with no "
                "known way to the goal and nothing else to do"
            )
        yield episode
        seed = None


class Player:
    """Plays one episode after the other; see `play`.

    Attributes:
        cycles, episodes: how many were played.
    """

    def __init__(
        self,
        model: DynamicExpectancyModel,
        world: World,
        goal: Iterable[str],
        watch: Watcher | None = None,
        clock: Callable[[], float] | None = None,
    ) -> None:
        if not isinstance(world, World):
            raise TypeError(
                "world: expected action_costs, begin(seed) and act(action), such as "
                f"GymWorld(env, tokens), found {type(world).__name__}"
            )
        self._model, self._world = model, world
        self._goal = to_sign(goal)
        self._watch, self._clock = watch, clock
        self.cycles = self.episodes = 0

    def episode(self, seed: int | None, *, until_reached: bool = False) -> Episode:
        """Play an episode, to its end or until the goal is reached for the first time."""
        model, goal = self._model, self._goal
        self.episodes += 1
        now = self._world.begin(seed)
        steps, total, reached = 0, 0.0, 0
        while True:
            if not model.goal_priorities(goal):
                model.set_goal(goal, priority=1.0)
            is_there, choice = self._cycle(now)
            reached += is_there
            if now.terminated:
                model.perform(None if choice is None else choice.action)
            elif now.truncated or choice is None or (is_there and until_reached):
                model.perform(None)
            else:
                model.perform(choice.action)
                now = self._world.act(choice.action)
                steps, total = steps + 1, total + now.reward
                continue
            is_over = now.terminated or now.truncated or is_there
            return Episode(steps, total, reached, is_stuck=not is_over)

    def _cycle(self, now: Situation) -> tuple[bool, Choice | None]:
        """Whether the goal is sensed, and what the model would do."""
        model, clock = self._model, self._clock
        began = None if clock is None else clock()
        sensed = model.sense(now.tokens)
        choice = None if now.truncated and not now.terminated else model.choose()
        self.cycles += 1
        if self._watch is not None:
            seconds = None if clock is None or began is None else clock() - began
            self._watch(
                cycle_metrics(
                    model,
                    sensed,
                    choice,
                    cycle=self.cycles,
                    episode=self.episodes,
                    seconds=seconds,
                )
            )
        return set(self._goal).issubset(sensed.tokens), choice
