"""What every operator must keep to, as tests that a test class inherits."""

import random
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar, NamedTuple

import msgspec
import numpy as np
import pytest

from farside.acts import Act, Discard, Planned
from farside.ground.operators.operator import Operator, Situation
from farside.messages import Drive, Override, SetGoal
from farside.missions.build import build_ground, build_node, build_operator
from farside.missions.crew.crew import InProcessCrew
from farside.missions.loading import LoadedMission, load_mission
from farside.node import Role, to_ns
from farside.places import ACTIONS
from farside.settings import Plain
from farside.topics import OperatorEntry


class _Asked(NamedTuple):
    """One time that an operator was asked, and what it said."""

    now_ns: int
    acts: tuple[Act, ...]
    progress: OperatorEntry


class _Listener:
    """An operator that hands everything on to another, and keeps what it said."""

    def __init__(self, operator: Operator) -> None:
        self._operator = operator
        self.asked: list[_Asked] = []

    @property
    def progress(self) -> OperatorEntry:
        return self._operator.progress

    def act(self, situation: Situation) -> Sequence[Act]:
        acts = tuple(self._operator.act(situation))
        self.asked.append(_Asked(situation.now_ns, acts, self._operator.progress))
        return acts


class OperatorContract:
    """Tests of an operator. A class that inherits them sets the first attribute.

    It decides at the ground of a mission, while telemetry comes, does not, or knows no place.

    Attributes:
        operator: the class, or the name of one as a mission has it.
        options: what it is made with beside the chart and `rng`.
        given: values of the mission, by dotted key, for an operator that is built in.
        mission: path or name of the mission.
        duration_s: for how long it is asked each time, in simulated time.
    """

    operator: ClassVar[type[Operator] | str]
    options: ClassVar[Mapping[str, Plain | Sequence[Plain]]] = {}
    given: ClassVar[Mapping[str, object]] = {}
    mission: ClassVar[str | Path] = "blackout"
    duration_s: ClassVar[float] = 120.0

    def test_it_can_say_how_far_it_has_come_before_it_is_asked(self) -> None:
        loaded = self._loaded({})
        _check_progress(build_operator(loaded.mission, loaded.extensions).progress)

    def test_it_gives_orders_that_can_be_given(self) -> None:
        for asked in self._life(_GOOD):
            for act in asked.acts:
                assert isinstance(act, Act)
                if isinstance(act, Discard):
                    continue
                order = act.order if isinstance(act, Planned) else act
                assert not isinstance(order, Drive | Override) or order.action in ACTIONS
                assert not isinstance(order, SetGoal) or order.tokens

    def test_its_progress_is_valid_at_all_times(self) -> None:
        for changes in (_GOOD, _BAD):
            for asked in self._life(changes):
                _check_progress(asked.progress)

    def test_it_copes_without_any_telemetry(self) -> None:
        self._life({"link.blackouts": [{"start_s": 0.0, "end_s": 1e6, "direction": "down"}]})

    def test_it_copes_with_telemetry_that_knows_no_place(self) -> None:
        self._life({**_GOOD, "rover.faults": [{"what": "position-sensor", "start_s": 0.0}]})

    def test_it_copes_when_the_place_is_not_known_for_a_while(self) -> None:
        fault = {"what": "position-sensor", "start_s": 20.0, "end_s": 60.0}
        self._life({**_GOOD, "rover.faults": [fault]})

    def test_it_copes_with_silence(self) -> None:
        self._life({"link.blackouts": [{"start_s": 20.0, "end_s": 80.0}]})

    def test_it_copes_when_only_the_rover_hears(self) -> None:
        self._life({"link.blackouts": [{"start_s": 20.0, "end_s": 80.0, "direction": "down"}]})

    def test_the_same_situations_get_the_same_orders(self) -> None:
        random.seed(1)
        np.random.seed(1)  # noqa: NPY002 - this is what it must not use
        first = self._life(_BAD)
        random.seed(2)
        np.random.seed(2)  # noqa: NPY002
        assert self._life(_BAD) == first

    def test_it_draws_nothing_from_global_randomness(self) -> None:
        states = random.getstate(), repr(np.random.get_state())  # noqa: NPY002
        self._life(_GOOD)
        assert (random.getstate(), repr(np.random.get_state())) == states  # noqa: NPY002

    def _loaded(self, changes: Mapping[str, object]) -> LoadedMission:
        given = {
            "duration_s": self.duration_s,
            "ground.operator_options": self.options,
            **self.given,
            **changes,
        }
        if isinstance(self.operator, str):
            return load_mission(self.mission, given | {"ground.operator": self.operator})
        return load_mission(self.mission, given, operator=self.operator)

    def _life(self, changes: Mapping[str, object]) -> list[_Asked]:
        """Everything that the operator says in the mission with these values changed."""
        loaded = self._loaded(changes)
        mission = loaded.mission
        listener = _Listener(build_operator(mission, loaded.extensions))
        crew = InProcessCrew(
            build_node(Role.ROVER, mission, loaded.extensions),
            build_node(Role.LINK, mission),
            build_ground(mission, listener),
        )
        end_ns = to_ns(mission.duration_s)
        for until_ns in range(mission.window_ns, end_ns, mission.window_ns):
            crew.advance(until_ns)
            for lost in crew.lost_processes:
                pytest.fail(lost.last_words)
        return listener.asked


_GOOD: Mapping[str, object] = {"link.blackouts": []}
_BAD: Mapping[str, object] = {
    "link.blackouts": [{"start_s": 40.0, "end_s": 70.0}],
    "link.down.loss": 0.1,
    "rover.faults": [{"what": "position-sensor", "start_s": 80.0, "end_s": 100.0}],
}


def _check_progress(progress: OperatorEntry) -> None:
    assert 0 <= progress.step <= progress.of
    assert progress.waiting_for is None or progress.waiting_for.strip()
    msgspec.json.encode(progress)
