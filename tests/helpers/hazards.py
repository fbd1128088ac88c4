"""Missions, links, outages and operators at random, for what must hold in all of them."""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from hypothesis import strategies as st

from farside.control import Mode, OnLoss
from farside.ground import Situation
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
from farside.topics import OperatorEntry

YARDS = {
    "corridor": ("##########", "#D......B#", "##########"),
    "rooms": ("#########", "#A..#..B#", "#...#...#", "#.......#", "##.###.##", "#.D.#.C.#", "#########"),
    "rocks": ("########", "#A.o..B#", "#..o...#", "#D....C#", "########"),
    "no dock": ("#######", "#A...B#", "#.###.#", "#.....#", "#######"),
    "shadow": ("##########", "#D.~~~..B#", "#..~~~...#", "#A......C#", "##########"),
}
DURATION_S = 240.0
ANSWERS = ("approve", "override", "veto", "none", "twice", "late")


class Hazard(NamedTuple):
    """A mission to run, and what its operator does.

    Attributes:
        values: the mission's, by dotted key.
        orders: what the operator orders, and when.
        answers: how the operator answers one proposal after the other, over and over.
    """

    values: dict[str, Any]
    orders: tuple[tuple[float, Order], ...]
    answers: tuple[str, ...]


class Wild:
    """Orders by the clock, and answers proposals as it likes."""

    def __init__(self, hazard: Hazard) -> None:
        self._orders = [(to_ns(t_s), order) for t_s, order in hazard.orders]
        self._answers = hazard.answers
        self._seen = 0
        self._late: list[tuple[int, Order]] = []
        self.progress = OperatorEntry(0, 1, None)

    def act(self, situation: Situation) -> Sequence[Order]:
        now_ns, proposal = situation.now_ns, situation.belief.proposal
        due: list[Order] = []
        while self._orders and self._orders[0][0] <= now_ns:
            due.append(self._orders.pop(0)[1])
        due += [order for t_ns, order in self._late if t_ns <= now_ns]
        self._late = [(t_ns, order) for t_ns, order in self._late if t_ns > now_ns]
        if proposal is not None and proposal.number > self._seen:
            self._seen = number = proposal.number
            match self._answers[number % len(self._answers)]:
                case "approve":
                    due.append(Approve(number))
                case "override":
                    due.append(Override(number, "NESW"[number % 4]))
                case "veto":
                    due.append(Veto(number))
                case "twice":
                    due += [Approve(number), Approve(number)]
                case "late":
                    self._late.append((now_ns + to_ns(15), Approve(number)))
        return due


def _places(rows: Sequence[str]) -> list[str]:
    from farside.places import Chart  # noqa: PLC0415 - beside what it reads

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


@st.composite
def hazards(draw: st.DrawFn) -> Hazard:
    """A mission of four minutes over a bad link, with an operator who orders anything."""
    rows = YARDS[draw(st.sampled_from(sorted(YARDS)))]
    places = _places(rows)
    drives = draw(st.lists(ACTIONS, min_size=4, max_size=24))
    begin_s = draw(st.floats(1, 10))
    pace_s = draw(st.sampled_from([0.0, 3.0, 7.0, 9.0]))
    tour: list[tuple[float, Order]] = [
        (round(begin_s + pace_s * n, 2), Drive(action)) for n, action in enumerate(drives)
    ]
    wild = draw(st.lists(st.tuples(TIMES, orders(places)), max_size=25))
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
        "ground.command_lifetime_s": draw(st.sampled_from([2.0, 10.0, 60.0])),
        "ground.script": [],
        "link.up.delay_s": delay_s,
        "link.down.delay_s": delay_s,
        "link.up.loss": draw(st.sampled_from([0.0, 0.05, 0.3])),
        "link.down.loss": draw(st.sampled_from([0.0, 0.05, 0.3])),
        "link.blackouts": [
            {"start_s": start_s, "end_s": round(start_s + length_s, 2), "direction": way}
            for start_s, length_s, way in zip(starts, lengths, ways, strict=False)
        ],
        "expect": [],
    }
    if draw(st.sampled_from([False, False, False, True])):
        values["link.passes"] = passes
    answers = draw(st.lists(st.sampled_from(ANSWERS), min_size=1, max_size=5))
    by_time = tuple(sorted(tour + wild, key=lambda one: one[0]))
    return Hazard(values, by_time, tuple(answers))


def fly(hazard: Hazard, folder: Path | None = None) -> FinishedRun:
    """Run it in this process; the log is in `folder`."""
    out = folder or Path(tempfile.gettempdir()) / "farside-hazards"
    rehearsal = Rehearsal("blackout", out, hazard.values)
    return rehearsal.operator(lambda *_, **__: Wild(hazard)).run()
