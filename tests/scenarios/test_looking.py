"""Whoever looks at a run while it goes on changes nothing of it, however often and at whatever."""

from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from numpy.random import Generator

from farside.ground.view.view import Focus, GroundView, OptionKind
from farside.missions import load_mission, run_mission
from farside.missions.build import build_node
from farside.missions.conductor import Watcher
from farside.missions.crew.crew import InProcessCrew
from farside.missions.loading import LoadedMission
from farside.missions.reliving.crew import RelivedCrew
from farside.node import Record, Role, to_ns

TAUGHT_S, BRIEF_S = 490.0, 30.0
WINDOWS_NS = (None,) * 12 + (to_ns(5.0),) * 5 + (0, to_ns(0.33), to_ns(0.9))
FOCI = (Focus(), Focus(heat=True), Focus(goal=("at:B",), heat=True), Focus(goal=("at:nowhere",)))


class Onlooker(Watcher):
    """Looks after every window, at anything, and has the windows be of any length."""

    def __init__(self, chance: Generator) -> None:
        self._chance = chance
        self.views: list[GroundView] = []
        self.reached_ns: list[int] = []
        self._look: Callable[[Focus], GroundView | None] = lambda _: None

    def seeing(self, look: Callable[[Focus], GroundView | None]) -> None:
        self._look = look

    def window_ns(self, now_ns: int) -> int | None:  # noqa: ARG002
        return WINDOWS_NS[self._chance.integers(len(WINDOWS_NS))]

    def watch(self, now_s: float, records: Sequence[Record]) -> None:  # noqa: ARG002
        self.reached_ns.append(to_ns(now_s))
        for choice in self._chance.integers(len(FOCI), size=self._chance.integers(3)):
            view = self._look(FOCI[choice])
            assert view is not None
            assert view.now_ns == self.reached_ns[-1]
            self.views.append(view)

    def wait(self, roles: Sequence[Role], waited_s: float) -> None: ...


@cache
def unwatched(name: str, duration_s: float, out: Path) -> str:
    return run_mission(shortened(name, duration_s), in_process=True, out=out).digest


def shortened(name: str, duration_s: float) -> LoadedMission:
    return load_mission(name, {"duration_s": duration_s, "expect": []})


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("looked-at")


def looked_at(name: str, duration_s: float, seed: int, out: Path) -> Onlooker:
    """The run has the digest of one that nobody looks at."""
    onlooker = Onlooker(np.random.default_rng(seed))
    run = run_mission(shortened(name, duration_s), in_process=True, out=out, watcher=onlooker)
    assert run.digest == unwatched(name, duration_s, out)
    return onlooker


def test_a_run_that_is_looked_at_is_the_run_that_nobody_looks_at(out: Path) -> None:
    """Over a tour that teaches, proposals and their answers."""
    onlooker = looked_at("blackout", TAUGHT_S, 1, out)
    windows_ns = {after - before for before, after in pairwise(onlooker.reached_ns)}
    assert {to_ns(0.04), to_ns(0.32), to_ns(0.88), to_ns(1.28)} <= windows_ns, "in whole ticks"
    proposed = [view for view in onlooker.views if view.review is not None]
    assert proposed
    assert any(view.heat for view in onlooker.views)
    kinds = {option.kind for view in onlooker.views for option in view.options}
    assert kinds == set(OptionKind) - {OptionKind.PROPOSED}, "it is answered at once"


@settings(max_examples=3, deadline=None, phases=[Phase.generate])
@given(seed=st.integers(0, 99), name=st.sampled_from(["teach", "shadow"]))
def test_windows_of_any_length_and_looks_at_any_time_leave_the_log_as_it_is(
    seed: int, name: str, out: Path
) -> None:
    assert looked_at(name, BRIEF_S, seed, out).views


def test_a_run_that_is_lived_again_can_be_looked_at_as_it_was_then() -> None:
    mission = shortened("blackout", BRIEF_S).mission
    live = InProcessCrew(*(build_node(role, mission) for role in Role))
    for until_s in range(1, 21):
        live.advance(to_ns(until_s))
    again = RelivedCrew(mission)
    again.advance(to_ns(20.0))
    assert again.look(Focus()) == live.look(Focus())
    assert again.look(Focus()) is not None
