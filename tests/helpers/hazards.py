"""Missions, links, outages and operators at random, for what must hold in all of them."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from hypothesis import strategies as st
from numpy.random import Generator

from farside.acts import Act
from farside.control import Mode, OnLoss
from farside.ground import ScriptedOperator, Situation
from farside.ground.config import Pursue, ScriptStep, SwitchMode, Tour
from farside.messages import (
    Approve,
    Drive,
    Order,
    Override,
    SetGoal,
    SetMode,
    SetOnLoss,
    TakeBack,
    Veto,
    WithdrawGoal,
)
from farside.missions import FinishedRun, Rehearsal
from farside.node import to_ns
from farside.places import Chart
from farside.topics import OperatorEntry

YARDS = {
    "corridor": ("########", "#D....B#", "########"),
    "rooms": (
        "#########",
        "#A..#..B#",
        "#...#...#",
        "#.......#",
        "##.###.##",
        "#.D.#.C.#",
        "#########",
    ),
    "rocks": ("########", "#A.o..B#", "#..o...#", "#D....C#", "########"),
    "no dock": ("######", "#A..B#", "#.##.#", "#....#", "######"),
    "shadow": ("########", "#D.~~.B#", "#A.~..C#", "########"),
}
DURATION_S = 240.0
ANSWERS = ("approve", "approve", "approve", "override", "veto", "twice", "late")


class Hazard(NamedTuple):
    """A mission to run, and what its operator does.

    Attributes:
        values: the mission's, by dotted key.
        script: what the operator means to do.
        orders: what comes in between, and when.
        answers: how the operator answers one proposal after the other, over and over.
    """

    values: dict[str, Any]
    script: tuple[ScriptStep, ...]
    orders: tuple[tuple[float, Act], ...]
    answers: tuple[str, ...]


class Wild:
    """Follows a script, orders other things in between, and answers proposals as it likes."""

    hazard: ClassVar[Hazard]

    def __init__(self, chart: Chart, *, rng: Generator) -> None:  # noqa: ARG002 - as all are made
        self._script = ScriptedOperator(self.hazard.script, chart)
        self._orders = [(to_ns(t_s), order) for t_s, order in self.hazard.orders]

    @property
    def progress(self) -> OperatorEntry:
        return self._script.progress

    def act(self, situation: Situation) -> Sequence[Act]:
        now_ns = situation.now_ns
        given: list[Act] = []
        for order in self._script.act(situation):
            given += self._answer(order.proposal, now_ns) if isinstance(order, Approve) else [order]
        while self._orders and self._orders[0][0] <= now_ns:
            given.append(self._orders.pop(0)[1])
        return given

    def _answer(self, number: int, now_ns: int) -> list[Order]:
        match self.hazard.answers[number % len(self.hazard.answers)]:
            case "override":
                return [Override(number, "NESW"[number % 4])]
            case "veto":
                return [Veto(number)]
            case "twice":
                return [Approve(number), Approve(number)]
            case "late":
                self._orders.append((now_ns + to_ns(15), Approve(number)))
                self._orders.sort(key=lambda one: one[0])
                return []
            case _:
                return [Approve(number)]


def _places(rows: Sequence[str]) -> list[str]:
    chart = Chart(tuple(rows), 1.0)
    start = next(iter(chart.places.values()))
    reachable = chart.reachable(start)
    return [name for name, cell in chart.places.items() if cell in reachable]


TIMES = st.floats(1, DURATION_S - 20).map(lambda t_s: round(t_s, 2))
ACTIONS = st.sampled_from("NESW")


def orders(places: Sequence[str]) -> st.SearchStrategy[Order]:
    """Any order, sensible or not."""
    signs = st.sampled_from([("at:" + place,) for place in places])
    wild = st.sampled_from([(), ("at:Z",), ("on_charge",), ("link:up",), ("battery:low",)])
    priority = st.sampled_from([0.5, 1.0, 2.0, -1.0, float("nan"), float("inf")])
    number = st.integers(0, 30)
    return st.one_of(
        st.builds(Drive, ACTIONS, st.booleans()),
        st.builds(Drive, ACTIONS),
        st.builds(SetMode, st.sampled_from(Mode)),
        st.builds(SetMode, st.sampled_from(Mode)),
        st.builds(SetGoal, signs, st.sampled_from([1.0, 2.0])),
        st.builds(SetGoal, signs, st.sampled_from([1.0, 2.0])),
        st.builds(SetGoal, st.one_of(signs, wild), priority),
        st.builds(WithdrawGoal, st.one_of(signs, wild)),
        st.builds(TakeBack, number),
        st.builds(Approve, number),
        st.builds(Override, number, ACTIONS),
        st.builds(Veto, number),
        st.builds(SetOnLoss, st.sampled_from(OnLoss)),
        st.builds(Drive, st.sampled_from(["", "UP", "N"])),
    )


def scripts(places: Sequence[str]) -> st.SearchStrategy[tuple[ScriptStep, ...]]:
    """A tour that teaches, then modes and goals."""
    place = st.sampled_from(places)
    # There and back, so that ways to what was seen are known both ways.
    tour = st.lists(place, min_size=2, max_size=3).map(lambda way: Tour(places=(*way, *way[::-1])))
    later = st.one_of(
        st.builds(Pursue, place=place),
        st.builds(SwitchMode, mode=st.sampled_from(Mode)),
        st.builds(Pursue, place=place, priority=st.sampled_from([0.5, 2.0])),
    )
    mode = st.sampled_from([Mode.SHARED, Mode.SHARED, Mode.AUTONOMOUS, Mode.GUIDED])
    return st.tuples(
        tour,
        st.builds(SwitchMode, mode=mode),
        st.builds(Pursue, place=place),
        st.lists(later, max_size=3),
    ).map(lambda parts: (*parts[:3], *parts[3]))


@st.composite
def hazards(draw: st.DrawFn) -> Hazard:
    """A mission of four minutes over a bad link, with an operator who orders anything."""
    rows = YARDS[draw(st.sampled_from(sorted(YARDS)))]
    places = _places(rows)
    script = draw(scripts(places))
    burst_s = draw(TIMES)
    burst: list[tuple[float, Act]] = [
        (burst_s, Drive(action)) for action in draw(st.lists(ACTIONS, max_size=6))
    ]
    wild: list[tuple[float, Act]] = [*draw(st.lists(st.tuples(TIMES, orders(places)), max_size=8))]
    starts = sorted(draw(st.lists(TIMES, max_size=5)))
    lengths = draw(st.lists(st.floats(1, 90), min_size=5, max_size=5))
    ways = draw(st.lists(st.sampled_from(["both", "up", "down"]), min_size=5, max_size=5))
    delay_s = draw(st.sampled_from([0.0, 0.05, 1.28, 4.0]))
    passes = {"first_s": 0.0, "period_s": 120.0, "length_s": 40.0}
    goals = draw(st.lists(st.sampled_from(places), max_size=3, unique=True))
    fault = {"what": draw(st.sampled_from(["tilt", "position-sensor"])), "start_s": 80.0}
    values = {
        "seed": draw(st.integers(0, 1000)),
        "duration_s": DURATION_S,
        "world.map": "\n".join(rows),
        "rover.start": draw(st.sampled_from(places)),
        "rover.goals": [
            {"place": place, "priority": float(n + 1)} for n, place in enumerate(goals)
        ],
        "rover.failsafe.on_loss": draw(st.sampled_from(["autonomy", "autonomy", "hold"])),
        "rover.failsafe.return_to": draw(st.sampled_from(["track", "signal", "none"])),
        "rover.failsafe.return_priority": draw(st.sampled_from([0.5, 5.0])),
        "rover.consent.by": draw(st.sampled_from(["approval", "veto"])),
        "rover.faults": draw(st.sampled_from([[], [], [{**fault, "end_s": 150.0}]])),
        "rover.battery.capacity_j": draw(st.sampled_from([250_000.0, 14_000.0, 5_000.0])),
        "rover.dem.exploration": draw(st.sampled_from(["none", "none", "random", "curious"])),
        "ground.command_lifetime_s": draw(st.sampled_from([2.0, 20.0, 60.0])),
        "ground.script": [],
        "link.up.delay_s": delay_s,
        "link.down.delay_s": delay_s,
        "link.up.loss": draw(st.sampled_from([0.0, 0.0, 0.05, 0.3])),
        "link.down.loss": draw(st.sampled_from([0.0, 0.0, 0.05, 0.3])),
        "link.blackouts": [
            {"start_s": start_s, "end_s": round(start_s + length_s, 2), "direction": way}
            for start_s, length_s, way in zip(starts, lengths, ways, strict=False)
        ],
        "expect": [],
    }
    if draw(st.sampled_from([False, False, False, True])):
        values["link.passes"] = passes
    answers = draw(st.lists(st.sampled_from(ANSWERS), min_size=1, max_size=5))
    by_time = tuple(sorted(burst + wild, key=lambda one: one[0]))
    return Hazard(values, script, by_time, tuple(answers))


def fly(
    hazard: Hazard, folder: Path | None = None, operator: type[Wild] | None = None
) -> FinishedRun:
    """Run it in this process, with that kind of operator; the log is in `folder`.

    Whatever it does, no node ends before the run.
    """
    out = folder or Path(tempfile.gettempdir()) / "farside-hazards"
    rehearsal = Rehearsal("blackout", out, hazard.values)
    run = rehearsal.operator(type("Hazardous", (operator or Wild,), {"hazard": hazard})).run()
    assert not run.lost_processes, run.lost_processes[0].last_words
    return run
