"""What is measured of a cycle, for those who watch a model learn."""

from collections.abc import Callable

import msgspec

from farside.dem.cycle import Choice, Sensed
from farside.dem.lists.signs import Sign
from farside.dem.model import DynamicExpectancyModel


class CycleMetrics(msgspec.Struct, frozen=True):
    """A cycle in numbers, after the model has chosen.

    Attributes:
        cycle: number of the cycle, from 1.
        episode: number of the episode, from 1.
        tokens: what was sensed, sorted.
        novel, unexpected: the number of Signs that were; their sum is the surprise of the cycle.
        succeeded, failed: the number of due predictions that came true, or did not.
        created, removed: the number of hypotheses created, or removed.
        signs, hypotheses: lengths of the lists.
        mean_cm: mean C_m of all hypotheses, 0 if there are none.
        action: what is performed, `None` for nothing.
        value: P_v of the Sign that is acted from, `None` where the choice is random.
        is_guided: whether the action is on the way to a goal.
        seconds: time that the model took to sense and to choose; `None` without a clock.
    """

    cycle: int
    episode: int
    tokens: Sign
    novel: int
    unexpected: int
    succeeded: int
    failed: int
    created: int
    removed: int
    signs: int
    hypotheses: int
    mean_cm: float
    action: str | None
    value: float | None
    is_guided: bool
    seconds: float | None = None

    @property
    def surprise(self) -> int:
        """The number of Signs that no prediction had named."""
        return self.novel + self.unexpected


Watcher = Callable[[CycleMetrics], object]
"""Is told of every cycle; what it returns is not used."""


def cycle_metrics(
    model: DynamicExpectancyModel,
    sensed: Sensed,
    choice: Choice | None,
    *,
    cycle: int,
    episode: int = 1,
    seconds: float | None = None,
) -> CycleMetrics:
    """The numbers of the cycle that `sensed` began, for a loop of one's own; `play` makes them too.

    Args:
        model: between `sense` and `perform`.
        sensed: what its `sense` returned.
        choice: what its `choose` returned.
        cycle: number of the cycle, from 1.
        episode: number of the episode, from 1.
        seconds: time that the model took.
    """
    return CycleMetrics(
        cycle=cycle,
        episode=episode,
        tokens=sensed.tokens,
        novel=len(sensed.novel),
        unexpected=len(sensed.unexpected),
        succeeded=sensed.succeeded,
        failed=sensed.failed,
        created=sensed.created,
        removed=sensed.removed,
        signs=model.sign_count,
        hypotheses=model.hypothesis_count,
        mean_cm=model.mean_cm,
        action=None if choice is None else choice.action,
        value=None if choice is None else choice.cost_to_go,
        is_guided=choice is not None and choice.goal is not None,
        seconds=seconds,
    )
