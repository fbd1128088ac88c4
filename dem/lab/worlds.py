"""The worlds that a model can be played in: a small protocol, and gymnasium's in its terms."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Generic, NamedTuple, Protocol, TypeVar, runtime_checkable

if TYPE_CHECKING:
    import gymnasium

REWARDED = "rewarded"
"""The Token sensed with the observation that came with a reward."""

FAILED = "failed"
"""The Token sensed with the last observation of an episode that ended without a reward."""

_Observation = TypeVar("_Observation")


class Situation(NamedTuple):
    """What a world presents at the begin of an episode, and after every action.

    Attributes:
        tokens: what is sensed.
        reward: for the action before; the model does not learn from it.
        terminated: whether the world has come to an end, from which only a new episode leads on.
        truncated: whether the episode is broken off without such an end, as by a time limit.
    """

    tokens: Iterable[str]
    reward: float = 0.0
    terminated: bool = False
    truncated: bool = False


@runtime_checkable
class World(Protocol):
    """A world of episodes. Any object with these members is one."""

    @property
    def action_costs(self) -> Mapping[str, float]:
        """The name of every action, with its cost: what a model is made with."""
        ...

    def begin(self, seed: int | None) -> Situation:
        """Begin an episode; a seed begins the world's own randomness anew."""
        ...

    def act(self, action: str) -> Situation:
        """Perform an action, by its name."""
        ...


class GymWorld(Generic[_Observation]):
    """A gymnasium environment as a `World`; requires Farside's extra `gymnasium`.

    Rewards can be sensed: the Token `REWARDED` is sensed with the observation that came with one.
    With this Token as its goal, a model seeks whatever leads to a reward, without being told where
    that is.

    Args:
        env: the environment.
        tokens: gives the Tokens of an observation; see `farside.dem.lab.label` and its companions.
        actions: the environment's actions by name, or only the names of discrete ones, in order.
            Left out, discrete actions are named by their numbers in the environment.
        reward_above: only a greater reward counts as a reward.
        tells_failure: whether the Token `FAILED` is sensed where an episode terminates without a
            reward. A model that is to avoid this has it averted; see
            `DynamicExpectancyModel.avert`.

    Attributes:
        env: the environment.

    Raises:
        TypeError: if the actions are not discrete, and none are given as a mapping.
        ValueError: if there are more names than discrete actions, or fewer, or one twice, or an
            action is not in the environment's space.
    """

    def __init__(
        self,
        env: "gymnasium.Env[_Observation, Any]",
        tokens: Callable[[_Observation], Iterable[str]],
        *,
        actions: "Mapping[str, object] | Sequence[str] | None" = None,
        reward_above: float = 0.0,
        tells_failure: bool = False,
    ) -> None:
        self.env = env
        self._tokens = tokens
        self._reward_above = reward_above
        self._tells_failure = tells_failure
        self._actions = _by_name(env, actions)

    @property
    def action_costs(self) -> dict[str, float]:
        """Every action at a cost of 1."""
        return dict.fromkeys(self._actions, 1.0)

    def begin(self, seed: int | None) -> Situation:
        """Reset the environment; see `World.begin`."""
        observation, _ = self.env.reset(seed=seed)
        return Situation(list(self._tokens(observation)))

    def act(self, action: str) -> Situation:
        """Take a step; see `World.act`.

        Raises:
            ValueError: if there is no action of this name. The message names them.
        """
        if action not in self._actions:
            known = ", ".join(self._actions)
            raise ValueError(f"action: expected one of {known}, found {action!r}")
        observation, paid, terminated, truncated, _ = self.env.step(self._actions[action])
        tokens, reward = list(self._tokens(observation)), float(paid)
        if reward > self._reward_above:
            tokens.append(REWARDED)
        elif terminated and self._tells_failure:
            tokens.append(FAILED)
        return Situation(tokens, reward, terminated, truncated)


def _by_name(
    env: "gymnasium.Env[Any, Any]", actions: Mapping[str, object] | Sequence[str] | None
) -> dict[str, object]:
    from gymnasium.spaces import Discrete  # noqa: PLC0415 - whoever has an environment has it

    space = env.action_space
    if isinstance(actions, Mapping):
        strange = [name for name, action in actions.items() if not space.contains(action)]
        if strange:
            found = ", ".join(f"{name!r}: {actions[name]}" for name in strange)
            raise ValueError(f"actions: expected some of {space}, found {found}")
        return dict(actions)
    if not isinstance(space, Discrete):
        raise TypeError(
            "actions: expected gymnasium.spaces.Discrete, or the environment's actions by name, "
            f"found {space}"
        )
    numbers = [int(space.start) + number for number in range(int(space.n))]
    names = list(map(str, numbers)) if actions is None else list(actions)
    if len(set(names)) != len(numbers) or len(names) != len(numbers):
        raise ValueError(
            f"actions: expected {len(numbers)} different names for {space}, found {names}"
        )
    return dict(zip(names, numbers, strict=True))
