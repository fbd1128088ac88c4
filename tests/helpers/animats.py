"""Mazes of the classifier-system literature, their animat, and the way it is trained and judged.

Each maze is drawn with `#` for a wall, `.` for a free cell and `F` for food. The animat stands on a
free cell, steps to one of eight sides, and senses one Token for each: `N:wall`, `NE:free`,
`E:food`. An episode begins at a free cell, drawn at random, and ends with food: `rewarded` is
sensed there too.
"""

from collections.abc import Sequence
from statistics import mean
from typing import NamedTuple

import numpy as np

from farside.dem import DynamicExpectancyModel, Parameters

SIDES = {
    "N": (0, -1),
    "NE": (1, -1),
    "E": (1, 0),
    "SE": (1, 1),
    "S": (0, 1),
    "SW": (-1, 1),
    "W": (-1, 0),
    "NW": (-1, -1),
}
LOOKS = {"#": "wall", ".": "free", "F": "food"}
FOOD = ("rewarded",)
PATIENCE = 50
"""The number of steps after which an episode is given up when a model is judged."""

MAZE4 = "######## #..#..F# ##..#..# ##.#..## #......# ##.#...# #....#.# ########"
"""26 free cells, 3.5 steps from food on average. Source: Lanzi (1999), An Analysis of
Generalization in the XCS Classifier System, Evolutionary Computation 7(2)."""

WOODS1 = "..... .##F. .###. .###. ....."
"""16 free cells on a torus, 1.69 steps from food. Source: Wilson (1994), ZCS: A Zeroth Level
Classifier System, Evolutionary Computation 2(1)."""

MAZE5 = "######### #......F# #..#.##.# #.#.....# #...##..# #.#.#..## #.#..#..# #.....#.# #########"
"""36 free cells. Source: as Maze4."""

MAZE6 = "######### #.....#F# #..#.##.# #.#.....# #...##..# #.#.#..## #.#..#..# #.......# #########"
"""36 free cells, food behind a narrow passage. Source: as Maze4."""

MAZE_F4 = "####### #....F# #.##### #....## #.##### #######"
"""10 free cells, two of which look alike. Source: Stolzmann (2000), An Introduction to Anticipatory
Classifier Systems, LNAI 1813."""

# In these, cells look alike that are at different distances from food, as for MazeF4.

WOODS101 = "####### #.....# #.#.#.# #.#F#.# #######"
"""10 free cells, 2.7 steps from food. Source: Cliff and Ross (1994), Adding Temporary Memory to
ZCS, Adaptive Behavior 3(2)."""

WOODS102 = "####### #.#F#.# #.#.#.# #.....# #.#.#.# ####### #.#.#.# #.....# #.#.#.# #.#F#.# #######"
"""26 free cells in two halves, 2.77 steps from food. Source: as Woods101."""

MAZE7 = "##### #...# #.#.# #.#.# #.#.# #F### #####"
"""9 free cells, 4.11 steps from food. Source: Lanzi (1998), Adding Memory to XCS, ICEC 98."""

LITTMAN57 = "############# #...........# ###.#.#.#F### #############"
"""14 free cells along a hallway, 3.71 steps from food. Source: Littman, Cassandra and Kaelbling
(1995), Learning Policies for Partially Observable Environments: Scaling Up, ICML 95."""

LITTMAN89 = "######### ##.....## #..#.#..# ##.#.#.## #..#.#.F# ##.....## #########"
"""22 free cells around an office floor, 3.77 steps from food. Source: as Littman57."""

ALIASED = {
    "Woods101": WOODS101,
    "Woods102": WOODS102,
    "Maze7": MAZE7,
    "MazeF4": MAZE_F4,
    "Littman57": LITTMAN57,
    "Littman89": LITTMAN89,
}
"""The mazes where what is seen does not tell where one is, by name."""

Place = tuple[int, int]


class Animat:
    """A maze with an animat in it; one that is drawn without a border is a torus.

    Args:
        drawing: the maze, row by row, with spaces between.

    Attributes:
        actions: the eight steps. One against a wall has no effect.
        free: the cells where an episode may begin.
        state: where the animat stands, (column, row).
    """

    actions = tuple(SIDES)

    def __init__(self, drawing: str) -> None:
        self._rows = drawing.split()
        places = [(x, y) for y, row in enumerate(self._rows) for x in range(len(row))]
        self.free: list[Place] = [place for place in places if self._look(place) == "free"]
        self.state = self.free[0]

    def _look(self, place: Place) -> str:
        x, y = place
        return LOOKS[self._rows[y % len(self._rows)][x % len(self._rows[0])]]

    def _beside(self, place: Place, side: str) -> Place:
        (x, y), (east, south) = place, SIDES[side]
        return (x + east) % len(self._rows[0]), (y + south) % len(self._rows)

    @property
    def has_food(self) -> bool:
        """Whether the animat has reached food, which ends an episode."""
        return self._look(self.state) == "food"

    def tokens(self) -> set[str]:
        """What is sensed here."""
        around = {f"{side}:{self._look(self._beside(self.state, side))}" for side in SIDES}
        return around | set(FOOD) if self.has_food else around

    def do(self, action: str) -> None:
        """Step to one side, unless a wall is there."""
        self.state = self.after(self.state, action)

    def after(self, place: Place, action: str) -> Place:
        """The cell that a step leads to."""
        aside = self._beside(place, action)
        return place if self._look(aside) == "wall" else aside

    def begin(self, rng: np.random.Generator) -> None:
        """Begin an episode at a free cell."""
        self.state = self.free[rng.integers(len(self.free))]

    def optimum(self) -> float:
        """The mean over the free cells of the fewest steps to food."""
        steps = dict.fromkeys((cell for cell in self.free if self._food_beside(cell)), 1)
        frontier = list(steps)
        for cell in frontier:
            for side in SIDES:
                aside = self._beside(cell, side)
                if self._look(aside) == "free" and aside not in steps:
                    steps[aside] = steps[cell] + 1
                    frontier.append(aside)
        return mean(steps[cell] for cell in self.free)

    def _food_beside(self, place: Place) -> bool:
        return any(self._look(self._beside(place, side)) == "food" for side in SIDES)


def new_animat_model(parameters: Parameters, seed: int) -> DynamicExpectancyModel:
    """A model for an animat: every step costs 1."""
    costs = dict.fromkeys(SIDES, 1.0)
    return DynamicExpectancyModel(costs, parameters, rng=np.random.default_rng(seed))


def train(
    model: DynamicExpectancyModel,
    maze: Animat,
    steps: int,
    rng: np.random.Generator,
    *,
    own_choice: bool = False,
) -> None:
    """Let a model watch random steps, or take its own, without a goal.

    Args:
        model: the model.
        maze: where it is.
        steps: how many; the last episode may be left unfinished.
        rng: draws the beginnings of episodes, and the random steps.
        own_choice: whether the model chooses.
    """
    maze.begin(rng)
    for _ in range(steps):
        model.sense(maze.tokens())
        if maze.has_food:
            model.perform(None)
            maze.begin(rng)
            model.sense(maze.tokens())
        choice = model.choose() if own_choice else None
        action = choice.action if choice else maze.actions[rng.integers(len(SIDES))]
        model.perform(action)
        maze.do(action)
    model.sense(maze.tokens())
    model.perform(None)


def steps_to_food(
    model: DynamicExpectancyModel, maze: Animat, start: Place, rng: np.random.Generator
) -> int:
    """The steps from a cell to food as the map says, up to `PATIENCE`.

    Where the map says nothing, the step is random.
    """
    maze.state = start
    model.set_goal(FOOD, priority=1.0)
    for steps in range(PATIENCE):
        model.sense(maze.tokens())
        if maze.has_food:
            model.perform(None)
            return steps
        choice = model.choose(explore=False)
        action = choice.action if choice else maze.actions[rng.integers(len(SIDES))]
        model.perform(action)
        maze.do(action)
    model.sense(maze.tokens())
    model.perform(None)
    return PATIENCE


class Judged(NamedTuple):
    """How a model did in a maze.

    Attributes:
        steps: mean over the free cells of the steps to food.
        ratio: the same, over the fewest possible.
        signs, hypotheses: lengths of the lists, before it was judged.
    """

    steps: float
    ratio: float
    signs: int
    hypotheses: int


def judge(model: DynamicExpectancyModel, maze: Animat, rng: np.random.Generator) -> Judged:
    """Send a model to food once from every free cell; it goes on learning."""
    signs, hypotheses = model.sign_count, model.hypothesis_count
    walks: Sequence[int] = [steps_to_food(model, maze, cell, rng) for cell in maze.free]
    return Judged(mean(walks), mean(walks) / maze.optimum(), signs, hypotheses)


def train_then_judge(
    drawing: str, parameters: Parameters, seed: int, *, steps: int, own_choice: bool = False
) -> tuple[DynamicExpectancyModel, Judged]:
    """Train a new model in a maze, then judge it."""
    maze, rng = Animat(drawing), np.random.default_rng(seed)
    model = new_animat_model(parameters, seed + 1000)
    train(model, maze, steps, rng, own_choice=own_choice)
    return model, judge(model, maze, rng)
