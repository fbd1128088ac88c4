"""The peers are valid references: they reach their published figures."""

from collections.abc import Callable

import numpy as np
import pytest
from animats import MAZE4, WOODS1
from baselines import DynaQ, DynaQPlus, PrioritizedSweeping, QLearning
from dem_animat import DemAnimat, whole
from dem_player import DemPlayer
from fields import Field, FrozenLake
from fields import Maze as MazeField
from mazes import (
    BLOCKING,
    DYNA,
    MOVES,
    SHORTCUT,
    Maze,
    Player,
    blocking_maze,
    dyna_maze,
    new_goal,
    shortcut_maze,
)

from farside.dem import Parameters


def mean(
    task: Callable[[Player], float], make: Callable[[np.random.Generator], Player], seeds: int
) -> float:
    return float(np.mean([task(make(np.random.default_rng(seed))) for seed in range(seeds)]))


@pytest.mark.parametrize(
    ("maze", "fewest"),
    [
        (DYNA, 14),
        (BLOCKING[0], 10),
        (BLOCKING[1], 16),
        (SHORTCUT[0], 16),
        (SHORTCUT[1], 10),
    ],
)
def test_the_shortest_paths_have_the_lengths_known_from_the_literature(
    maze: Maze, fewest: int
) -> None:
    assert maze.distances(maze.start)[maze.goal] == fewest


@pytest.mark.parametrize("maze", [DYNA, *BLOCKING, *SHORTCUT])
def test_no_move_ends_in_a_wall_or_off_the_maze(maze: Maze) -> None:
    places = {(row, column) for row in range(6) for column in range(9)} - maze.walls
    for place in places:
        for action, (down, right) in MOVES.items():
            aim = place[0] + down, place[1] + right
            assert maze.after(place, action) == (aim if aim in places else place)


@pytest.mark.parametrize(
    ("planning", "known", "seeds"), [(0, 5156, 20), (5, 2147, 20), (50, 1891, 4)]
)
def test_dyna_q_needs_as_many_steps_as_published(planning: int, known: int, seeds: int) -> None:
    steps = mean(dyna_maze, lambda rng: DynaQ(rng, planning=planning), seeds)
    assert steps == pytest.approx(known, rel=0.2)


def test_dyna_q_without_planning_is_q_learning() -> None:
    learners = [QLearning(np.random.default_rng(3)), DynaQ(np.random.default_rng(3), planning=0)]
    assert len({dyna_maze(learner) for learner in learners}) == 1
    assert learners[0].values == learners[1].values


def test_dyna_q_plus_finds_the_way_round_the_block_and_dyna_q_rarely_does() -> None:
    dyna = mean(blocking_maze, lambda rng: DynaQ(rng, planning=10, alpha=1.0), 8)
    plus = mean(blocking_maze, lambda rng: DynaQPlus(rng, planning=10, alpha=1.0, kappa=1e-4), 8)
    assert dyna == pytest.approx(77, rel=0.2)
    assert plus == pytest.approx(136, rel=0.1)


def test_dyna_q_plus_finds_the_shortcut_and_dyna_q_does_not() -> None:
    dyna = mean(shortcut_maze, lambda rng: DynaQ(rng, planning=50, alpha=1.0), 2)
    plus = mean(shortcut_maze, lambda rng: DynaQPlus(rng, planning=50, alpha=1.0, kappa=1e-3), 2)
    assert dyna == pytest.approx(296, rel=0.1)
    assert plus == pytest.approx(367, rel=0.1)


def test_prioritized_sweeping_needs_fewer_steps_with_as_many_updates() -> None:
    dyna = mean(dyna_maze, lambda rng: DynaQ(rng, planning=5), 8)
    swept = mean(dyna_maze, lambda rng: PrioritizedSweeping(rng, planning=5), 8)
    assert swept < 0.9 * dyna


def test_in_a_learned_maze_a_model_takes_a_shortest_path_to_a_new_goal() -> None:
    player = DemPlayer(np.random.default_rng(0), Parameters())
    assert new_goal(player, seed=0) == 0


@pytest.mark.parametrize(
    ("field", "changes"),
    [
        (MazeField(MAZE4, 0), 115),
        (MazeField(WOODS1, 0), 101),
        (FrozenLake(0, slippery=False), 34),
        (FrozenLake(0, slippery=True), 102),
    ],
)
def test_every_change_that_a_field_can_make_is_asked_for_once(field: Field, changes: int) -> None:
    """102 on slippery ice: three sides to go for each of the 34, as one slips to either side."""
    asked = field.transitions()
    assert len(asked) == len(set(asked)) == changes
    made, rng = set(), np.random.default_rng(0)
    field.begin()
    for action in rng.integers(field.actions, size=2000).tolist():
        if field.over:
            field.begin()
        before = field.situation
        field.do(action)
        if field.situation != before:
            made.add((before, action, field.situation))
    assert made <= set(asked)


def test_a_model_knows_what_it_has_seen_often_enough_and_nothing_before() -> None:
    field = MazeField(WOODS1, 0)
    player = DemAnimat(field, 0, whole, Parameters())
    assert player.knowledge(field.transitions()) == (0, 0)
    player.explore(3000)
    reliable, credible = player.knowledge(field.transitions())
    assert 0.9 < reliable <= credible == 1.0
    assert all(player.exploit(start) <= 3 for start in range(field.starts))
