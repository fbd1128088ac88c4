"""The mazes in which learners are compared, and the four tasks.

A place is (row, column), with rows counted from the top. A move into a wall or off the maze has no
effect. Reaching the goal gives a reward of 1 and ends the episode; the next one begins at the
start.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

Place = tuple[int, int]

MOVES = {"N": (-1, 0), "E": (0, 1), "S": (1, 0), "W": (0, -1)}
ROAMING_STEPS = 2000


class Player(Protocol):
    """A learner in a maze."""

    def begin(self, goal: Place | None) -> None:
        """An episode begins. The player is told its goal, `None` if it is only to roam."""

    def act(self, place: Place) -> str:
        """The move to make at `place`."""

    def learn(self, place: Place, action: str, after: Place, reward: float) -> None:
        """Learn from the result of a move. A reward above 0 ends the episode."""

    def end(self, place: Place) -> None:
        """The episode ended at `place`; the next observation is not a result of any move."""


@dataclass(frozen=True)
class Maze:
    """6 rows of 9 places, minus the walls."""

    start: Place
    goal: Place
    walls: frozenset[Place]
    rows: int = 6
    columns: int = 9

    def after(self, place: Place, action: str) -> Place:
        """The place where a move from `place` ends."""
        row, column = place[0] + MOVES[action][0], place[1] + MOVES[action][1]
        inside = 0 <= row < self.rows and 0 <= column < self.columns
        return (row, column) if inside and (row, column) not in self.walls else place

    def distances(self, start: Place) -> dict[Place, int]:
        """Least number of moves from `start` to every reachable place."""
        steps, frontier = {start: 0}, [start]
        for place in frontier:
            for action in MOVES:
                beside = self.after(place, action)
                if beside not in steps:
                    steps[beside] = steps[place] + 1
                    frontier.append(beside)
        return steps


def _row_3(columns: Iterable[int]) -> frozenset[Place]:
    return frozenset((3, column) for column in columns)


DYNA = Maze((2, 0), (0, 8), frozenset([(1, 2), (2, 2), (3, 2), (0, 7), (1, 7), (2, 7), (4, 5)]))
BLOCKING = Maze((5, 3), (0, 8), _row_3(range(8))), Maze((5, 3), (0, 8), _row_3(range(1, 9)))
SHORTCUT = Maze((5, 3), (0, 8), _row_3(range(1, 9))), Maze((5, 3), (0, 8), _row_3(range(1, 8)))


def dyna_maze(player: Player) -> int:
    """Steps for 50 episodes. The shortest path has 14 steps, so 700 is the minimum."""
    return sum(_episode(player, DYNA, DYNA.goal) for _ in range(50))


def blocking_maze(player: Player) -> int:
    """Reward in 3000 steps; after 1000 of them the wall moves and blocks the path."""
    return _reward(player, BLOCKING, change=1000, steps=3000)


def shortcut_maze(player: Player) -> int:
    """Reward in 6000 steps; after 3000 of them a shorter path opens."""
    return _reward(player, SHORTCUT, change=3000, steps=6000)


def new_goal(player: Player, seed: int) -> int:
    """Steps beyond the fewest possible in the first episode to a new goal in a learned maze.

    The player first roams the Dyna maze without a goal, then plays 50 episodes to the goal of that
    maze. The new goal is any other place, the same for every player with this seed.
    """
    place = DYNA.start
    player.begin(None)
    for _ in range(ROAMING_STEPS):
        place = _step(player, DYNA, place, goal=None)
    player.end(place)
    dyna_maze(player)
    fewest = DYNA.distances(DYNA.start)
    others = sorted(set(fewest) - {DYNA.start, DYNA.goal})
    goal = others[np.random.default_rng(seed).integers(len(others))]
    return _episode(player, DYNA, goal) - fewest[goal]


def _episode(player: Player, maze: Maze, goal: Place) -> int:
    place, steps = maze.start, 0
    player.begin(goal)
    while place != goal:
        place = _step(player, maze, place, goal)
        steps += 1
    player.end(place)
    return steps


def _reward(player: Player, mazes: tuple[Maze, Maze], *, change: int, steps: int) -> int:
    start, goal = mazes[0].start, mazes[0].goal
    place, reward = start, 0
    player.begin(goal)
    for step in range(steps):
        place = _step(player, mazes[step >= change], place, goal)
        if place == goal:
            reward += 1
            player.end(place)
            player.begin(goal)
            place = start
    return reward


def _step(player: Player, maze: Maze, place: Place, goal: Place | None) -> Place:
    action = player.act(place)
    after = maze.after(place, action)
    player.learn(place, action, after, float(after == goal))
    return after
