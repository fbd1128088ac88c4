"""What the studies run in: yards, ways over all of their arcs, and models that were taught them."""

import math
import tomllib
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.random import Generator, SeedSequence

from farside.dem import DynamicExpectancyModel, Parameters, Sensed
from farside.ground import Operator
from farside.link.channel.node import Channel
from farside.link.endpoint.endpoint import LinkTerms
from farside.missions import MissionFile, load_mission
from farside.missions.build import build_ground
from farside.missions.crew.crew import InProcessCrew
from farside.missions.loading import shipped_missions
from farside.node import Direction, to_ns
from farside.places import ACTIONS, LINK_UP, ON_CHARGE, Cell, Chart
from farside.rover import Rover, RoverConfig, RoverStreams

Arc = tuple[str, str, str]
"""A place's Token, an action, and the Token of the place that it leads to."""

BLACKOUT = tomllib.loads(shipped_missions()["blackout"].read_text(encoding="utf-8"))


SHADOWED_ROWS = {
    1: "#A..##~~~~##..B##",
    2: "#...##~~o~##...##",
    3: "#...##~~~~##...##",
    5: "#.......~~~.....#",
    7: "#....##~~~#....##",
    8: "#C...##~~~#....##",
}
"""The rows of `blackout`'s yard, from the north, in which terrain hides the link at some places."""


def random_stream(*numbers: int) -> Generator:
    """A random stream of its own for each row of numbers."""
    return np.random.default_rng(SeedSequence(numbers))


def shadowed_map() -> str:
    """The yard of `blackout`, with terrain shadow over some of its places."""
    rows = BLACKOUT["world"]["map"].strip().splitlines()
    return "\n".join(SHADOWED_ROWS.get(number, row) for number, row in enumerate(rows))


def arcs_of(chart: Chart) -> list[Arc]:
    """Every way from a place to the next."""
    return [
        (chart.tokens[cell], action, chart.tokens[beside])
        for cell in chart.places.values()
        for action, beside in chart.neighbours(cell)
    ]


def circuit(chart: Chart, start: Cell, rng: Generator) -> list[Cell]:
    """The places of a walk over every arc once and back to its start: Hierholzer's algorithm.

    There is one, as every arc has one that leads back. Which of many, `rng` decides.
    """
    left = {
        cell: [beside for _, beside in chart.neighbours(cell)] for cell in chart.places.values()
    }
    for ways in left.values():
        rng.shuffle(ways)
    walk, stack = [], [start]
    while stack:
        if left[stack[-1]]:
            stack.append(Cell(*left[stack[-1]].pop()))
        else:
            walk.append(stack.pop())
    return walk[::-1]


def action_between(chart: Chart, cell: Cell, beside: Cell) -> str:
    """The action that leads from a place to the next."""
    return next(action for action, after in chart.neighbours(cell) if after == beside)


class CountingModel(DynamicExpectancyModel):
    """A model that counts what is performed, and remembers which of the yard's arcs it knows.

    Attributes:
        performed: number of actions performed.
        reached: the goals reached, in order.
        places, arcs: the number of actions after which each place and each arc of the yard was
            known, as a Sign, and as a hypothesis from and to the places' own Signs.
    """

    def watch(self, chart: Chart) -> None:
        """Count from now on, in this yard."""
        self.performed = 0
        self.reached: list[tuple[str, ...]] = []
        self.places: list[int] = []
        self.arcs: list[int] = []
        self._unknown_places = set(chart.cells)
        self._all_arcs = set(arcs_of(chart))
        self._unknown_arcs = set(self._all_arcs)
        self._came: tuple[str, str] | None = None

    def perform(self, action: str | None) -> None:
        """See `DynamicExpectancyModel.perform`."""
        super().perform(action)
        self.performed += action is not None
        self._came = None if action is None else (self._here, action)

    def sense(self, tokens: Iterable[str]) -> Sensed:
        """See `DynamicExpectancyModel.sense`."""
        sensed = super().sense(tokens)
        self.reached += [goal.tokens for goal in sensed.reached]
        self._here = next((token for token in sensed.tokens if token.startswith("at:")), "")
        if self._here in self._unknown_places:
            self._unknown_places.remove(self._here)
            self.places.append(self.performed)
        arc = self._came and (*self._came, self._here)
        if arc in self._unknown_arcs and self._knows(arc):
            self._unknown_arcs.remove(arc)
            self.arcs.append(self.performed)
        return sensed

    def _knows(self, arc: Arc) -> bool:
        start, action, end = arc
        return any(
            (known.context, known.action, known.outcome) == ((start,), action, (end,))
            for known in self.hypotheses
        )

    @property
    def is_complete(self) -> bool:
        """Whether every place and every arc is known, looked up in the model's lists once more."""
        if self._unknown_places or self._unknown_arcs:
            return False
        return self._all_arcs <= {
            (known.context[0], known.action, known.outcome[0])
            for known in self.hypotheses
            if len(known.context) == len(known.outcome) == 1
        }


def taught(chart: Chart, rounds: float = 3) -> bytes:
    """The memory of a model that was led over every arc of a yard, several times, to the dock.

    With a part of a round it was led over as many of the arcs.

    It senses what the rover's senses would give it without noise.
    """
    rng = random_stream(1)
    model = DynamicExpectancyModel(
        dict.fromkeys(ACTIONS, RoverConfig(start="D").drive.move_cost_s),
        Parameters(exploration="none"),  # type: ignore[arg-type] # it takes the value, too
        rng=random_stream(2),
    )
    assert chart.dock is not None
    for number in range(math.ceil(rounds)):
        walk = circuit(chart, chart.dock, rng)
        walk = walk[: math.ceil(min(1.0, rounds - number) * len(walk))]
        for cell, beside in zip(walk, [*walk[1:], None], strict=True):
            model.sense(tokens_at(chart, cell))
            model.perform(None if beside is None else action_between(chart, cell, beside))
    return model.save()


def tokens_at(chart: Chart, cell: Cell) -> set[str]:
    """What the rover senses at a place."""
    tokens = {chart.tokens[cell]}
    if cell == chart.dock:
        tokens.add(ON_CHARGE)
    if chart.shadow and cell not in chart.shadow:
        tokens.add(LINK_UP)
    return tokens


class Simulated(NamedTuple):
    """A run to advance window by window, and what is in it."""

    mission: MissionFile
    crew: InProcessCrew

    def run(self, model: CountingModel, *, until_complete: bool = False) -> None:
        """Run to the end, or until the model is complete."""
        end_ns, now_ns = to_ns(self.mission.duration_s), 0
        while now_ns < end_ns and not (until_complete and model.is_complete):
            now_ns = min(now_ns + self.mission.window_ns, end_ns)
            self.crew.advance(now_ns)
        assert not self.crew.lost_processes


def mission_with(seed: int, **values: object) -> MissionFile:
    """`blackout` without its script, expectations and blackout; `values` by dotted key, `_` ..."""
    settings: dict[str, object] = {
        "seed": seed,
        "link.blackouts": [],
        "ground.script": [],
        "expect": [],
        "rover.goals": [],
        "rover.battery.capacity_j": 1e9,  # the studies are not about the battery
        "tick_s": 0.1,  # 9 cm at full speed: enough, and twice as fast as 40 ms
    }
    settings.update({key.replace("__", "."): value for key, value in values.items()})
    return load_mission("blackout", settings).mission


def simulated(mission: MissionFile, operator: Operator, model: CountingModel) -> Simulated:
    """The three nodes of a mission, with an operator and a model of the study's own."""
    chart = mission.world.chart()
    terms = LinkTerms.simulated(mission.link, mission.seed, to_ns(mission.ground.heartbeat_s))
    up, down, soil, sensors, learning = (random_stream(mission.seed, n) for n in range(5))
    rover = Rover(
        mission.rover,
        chart,
        tick_ns=mission.tick_ns,
        terms=terms,
        streams=RoverStreams(soil, sensors, learning),
        controller=lambda _config, _rng: model,
    )
    ground = build_ground(mission, operator)
    channel = Channel(mission.link, {Direction.UP: up, Direction.DOWN: down})
    return Simulated(mission, InProcessCrew(rover, channel, ground))
