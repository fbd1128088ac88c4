"""Train, then judge: how well a model does after it has learned, over episodes and seeds."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from statistics import fmean, stdev

import msgspec
from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from scipy.special import stdtrit  # type: ignore[import-untyped]

from farside.dem.lab.metrics import Watcher
from farside.dem.lab.playing import Episode, Player
from farside.dem.lab.worlds import REWARDED, World
from farside.dem.model import DynamicExpectancyModel
from farside.dem.parameters import Parameters

PATIENCE_S = 2.0
"""Progress is shown of what takes longer than this (project default)."""

_LEVEL = 0.975  # of the upper end: 95 % lie between both
_Z = 1.959964  # the normal distribution's quantile for it


class Estimate(msgspec.Struct, frozen=True):
    """A mean and its 95 % interval.

    Attributes:
        mean: the mean of the samples.
        low, high: the interval; infinitely wide where a single sample says nothing of it.
        samples: how many there are: seeds, or the episodes of a single seed.
    """

    mean: float
    low: float
    high: float
    samples: int


class Judged(msgspec.Struct, frozen=True):
    """One seed: what training took, and the episodes that were judged.

    Attributes:
        seed: the seed.
        trained_steps, trained_episodes: what was used up; the episode in which the steps run out
            is completed.
        first_reached: steps until the end of the first episode of training in which the goal was
            reached, `None` without one.
        episodes: those judged, each to its end or until the goal is reached.
    """

    seed: int
    trained_steps: int
    trained_episodes: int
    first_reached: int | None
    episodes: tuple[Episode, ...]

    @property
    def success_rate(self) -> float:
        """The share of the judged episodes in which the goal was reached, 0 to 1."""
        return fmean(episode.reached > 0 for episode in self.episodes)

    @property
    def steps(self) -> float | None:
        """Mean steps of the successful episodes, `None` without one."""
        steps = [episode.steps for episode in self.episodes if episode.reached]
        return fmean(steps) if steps else None


class Judgement(msgspec.Struct, frozen=True):
    """What `train_then_judge` found.

    The intervals are Student's t over the seeds' means, or over the episodes of a single seed. That
    of the success rate includes Wilson's interval over all episodes, so that it has a width even
    where every episode of every seed succeeds.

    Attributes:
        seeds: the results by seed.
        success_rate: of the judged episodes, 0 to 1.
        steps: of the successful episodes, `None` without one. Seeds without one do not count.
        reward: sum of rewards in an episode.
    """

    seeds: tuple[Judged, ...]
    success_rate: Estimate
    steps: Estimate | None
    reward: Estimate

    def __str__(self) -> str:
        rate, episodes = self.success_rate, sum(len(seed.episodes) for seed in self.seeds)
        words = f"{rate.mean:.1%} ({rate.low:.1%} to {rate.high:.1%}) of {episodes} episodes"
        if self.steps is not None:
            words += (
                f", {self.steps.mean:.1f} steps ({self.steps.low:.1f} to {self.steps.high:.1f})"
            )
        return words


def train_then_judge(
    model: DynamicExpectancyModel | Callable[[int], DynamicExpectancyModel],
    world: World,
    *,
    steps: int | None = None,
    episodes: int | None = None,
    judge_by: Parameters | None = None,
    judged: int = 100,
    seeds: Sequence[int] = (0,),
    goal: Iterable[str] = (REWARDED,),
    watch: Watcher | None = None,
    progress: bool = True,
) -> Judgement:
    """Train a model in a world, then judge it there by other parameters, seed by seed.

    An episode is judged to its end, or until the goal is reached. One in which the model knows
    nothing to do has failed. Of what takes longer than two seconds a terminal shows the progress,
    on its standard error.

    Args:
        model: a model as it is for training, or what makes one from a seed, which is also that of
            the world.
        world: the world.
        steps: how long to train, or else give `episodes`; 0 judges the model as it is.
        episodes: how long to train, or else give `steps`.
        judge_by: the parameters while it is judged; those of training by default. For a model that
            does not explore then, give `exploration="none"`; for one that does not learn, either,
            what `still` returns.
        judged: the number of episodes to judge, 1 or more.
        seeds: one or more; a single one for a single model.
        goal: a Sign of the world's Tokens.
        watch: is told of every cycle, in training and while judged; numbers begin anew by seed.
        progress: whether progress may be shown.

    Raises:
        ValueError: if not exactly one of `steps` and `episodes` is given, a number is too small,
            there are more seeds than models, or `judge_by` differs in what cannot change while a
            model lives; see `DynamicExpectancyModel.change`.
    """
    _check(model, steps, episodes, judged, seeds)
    wanted = tuple(goal)
    found = []
    with _progress(len(seeds), shown=progress) as advance:
        for number, seed in enumerate(seeds):
            made = model if isinstance(model, DynamicExpectancyModel) else model(seed)
            player = Player(made, world, wanted, watch)
            trained, reached_at, share = 0, None, 0.0
            begin_with: int | None = seed
            while (player.episodes if steps is None else trained) < (steps or episodes or 0):
                episode = player.episode(begin_with)
                begin_with = None
                trained += episode.steps
                if episode.reached and reached_at is None:
                    reached_at = trained
                if episode.is_stuck and not episode.steps and steps is not None:
                    raise ValueError(
                        "exploration: expected a model that explores while it is trained, found "
                        "one with no known way to the goal and nothing else to do"
                    )
                share = trained / steps if steps else player.episodes / (episodes or 1)
                advance(number + min(share, 1.0) / 2)
            practised = player.episodes
            if judge_by is not None:
                made.change(judge_by)
            results = []
            for rest in range(judged):
                results.append(player.episode(begin_with, until_reached=True))
                begin_with = None
                advance(number + (1 + (rest + 1) / judged) / 2)
            found.append(Judged(seed, trained, practised, reached_at, tuple(results)))
    return _judgement(tuple(found))


def still(parameters: Parameters) -> Parameters:
    """The same parameters for a model that neither learns nor explores.

    New Signs still come on its list; nothing is predicted of them.
    """
    return msgspec.structs.replace(
        parameters,
        alpha=0.0,
        beta=0.0,
        averaging=False,
        learning_probability=0.0,
        differentiation=False,
        removal=False,
        exploration="none",
    )


def _check(
    model: object,
    steps: int | None,
    episodes: int | None,
    judged: int,
    seeds: Sequence[int],
) -> None:
    if (steps is None) == (episodes is None):
        raise ValueError(
            f"expected either steps or episodes to train for, found steps={steps}, "
            f"episodes={episodes}"
        )
    if (steps or episodes or 0) < 0:
        raise ValueError(f"expected training of 0 or more, found {steps or episodes}")
    if judged < 1:
        raise ValueError(f"judged: expected 1 episode or more, found {judged}")
    if not seeds:
        raise ValueError("seeds: expected one or more, found none")
    if isinstance(model, DynamicExpectancyModel) and len(seeds) > 1:
        raise ValueError(
            f"model: expected what makes one from a seed, as there are {len(seeds)} seeds, found "
            "a single model"
        )


# --- estimates ---------------------------------------------------------------------------------


def estimate(samples: Sequence[float]) -> Estimate:
    """The mean of one or more samples with Student's t interval."""
    mean, count = fmean(samples), len(samples)
    if count == 1:
        return Estimate(mean, -math.inf, math.inf, 1)
    half = float(stdtrit(count - 1, _LEVEL)) * stdev(samples) / math.sqrt(count)
    return Estimate(mean, mean - half, mean + half, count)


def _judgement(seeds: tuple[Judged, ...]) -> Judgement:
    if len(seeds) == 1:
        (only,) = seeds
        rates = [float(episode.reached > 0) for episode in only.episodes]
        steps = [float(episode.steps) for episode in only.episodes if episode.reached]
        rewards = [episode.reward for episode in only.episodes]
    else:
        rates = [seed.success_rate for seed in seeds]
        steps = [seed.steps for seed in seeds if seed.steps is not None]
        rewards = [fmean(episode.reward for episode in seed.episodes) for seed in seeds]
    return Judgement(
        seeds=seeds,
        success_rate=_rate(rates, sum(len(seed.episodes) for seed in seeds)),
        steps=estimate(steps) if steps else None,
        reward=estimate(rewards),
    )


def _rate(rates: Sequence[float], trials: int) -> Estimate:
    """Wilson's interval, with Student's where there are several seeds, within 0 and 1."""
    mean = fmean(rates)
    widened = 1 + _Z**2 / trials
    middle = (mean + _Z**2 / (2 * trials)) / widened
    half = _Z * math.sqrt(mean * (1 - mean) / trials + (_Z / (2 * trials)) ** 2) / widened
    spread = estimate(rates) if 1 < len(rates) < trials else Estimate(mean, mean, mean, trials)
    return Estimate(
        mean,
        max(0.0, min(spread.low, middle - half, mean)),
        min(1.0, max(spread.high, middle + half, mean)),
        len(rates),
    )


# --- progress ----------------------------------------------------------------------------------


class _Patient(Progress):
    """A bar that shows only after `PATIENCE_S`."""

    def get_renderables(self) -> Iterator[RenderableType]:
        if any((task.elapsed or 0.0) >= PATIENCE_S for task in self.tasks):
            yield from super().get_renderables()


@contextmanager
def _progress(seeds: int, *, shown: bool) -> Iterator[Callable[[float], None]]:
    console = Console(stderr=True)
    columns = (TextColumn("training and judging"), BarColumn(), TimeRemainingColumn())
    off = not (shown and console.is_terminal)
    with _Patient(*columns, console=console, transient=True, disable=off) as bar:
        task = bar.add_task("", total=float(seeds))
        yield lambda done: bar.update(task, completed=done)
