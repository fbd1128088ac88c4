"""What every controller must keep to, as tests that a test class inherits."""

import random
from collections.abc import Iterator, Mapping, Sequence
from typing import ClassVar, NamedTuple

import msgspec
import numpy as np
import pytest

from farside.dem import Choice, Goal, Hypothesis, PolicyStep, Why
from farside.missions.build import build_controller
from farside.missions.loading import load_mission
from farside.places import ACTIONS, BATTERY_LOW, LINK_UP, ON_CHARGE
from farside.rover.controller import Controller
from farside.settings import Plain

_A, _B, _HOME = ("at:A",), ("at:B",), (ON_CHARGE,)
_SIDE = 4


class _Yard:
    """A yard of 4 by 4 places, with the dock in one corner and A and B in others."""

    _NAMES: ClassVar = {(0, 0): "D", (3, 3): "A", (0, 3): "B"}

    def __init__(self) -> None:
        self.east = self.north = 0

    @property
    def tokens(self) -> list[str]:
        here = (self.east, self.north)
        place = self._NAMES.get(here, f"{self.east},{self.north}")
        return [f"at:{place}", *([ON_CHARGE] if here == (0, 0) else [])]

    def do(self, action: str | None) -> None:
        east, north = ACTIONS[action] if action else (0, 0)
        self.east = min(max(self.east + east, 0), _SIDE - 1)
        self.north = min(max(self.north + north, 0), _SIDE - 1)


class _Moment(NamedTuple):
    """All that a controller said in one cycle."""

    choice: Choice | None
    cautious: Choice | None
    why: Why | None
    path: tuple[PolicyStep, ...]
    goals: tuple[Goal, ...]
    expected: Hypothesis | None
    home: float


def _life(controller: Controller, cycles: int = 120) -> Iterator[_Moment]:
    """A life in a yard: led about, then given goals by the operator, the mission and the rover."""
    yard, guide = _Yard(), np.random.default_rng(3)
    names = list(ACTIONS)
    for cycle in range(cycles):
        blind = cycle % 37 == 36  # the position sensor has failed
        controller.sense([] if blind else yard.tokens)
        if cycle == 40:
            controller.set_goal(_A, 2.0, "operator")
            controller.set_goal(_B, 1.0, "mission")
        if cycle == 60:
            controller.set_goal((LINK_UP,), 5.0, "inherent")
        if cycle == 70:
            controller.withdraw_goal((LINK_UP,), "inherent")
            controller.set_goal(_HOME, 9.0, "inherent")
        if cycle % 20 == 0 and cycle > 80:
            controller.set_goal([_A, _B][cycle % 40 == 0], 1.0, "operator")
        cautious = controller.choose(explore=False)
        choice = controller.choose()
        yield _Moment(
            choice,
            cautious,
            controller.why(),
            tuple(controller.policy_path()),
            tuple(controller.goals),
            controller.expected("N"),
            controller.cost_to(_HOME),
        )
        action: str | None
        led = cycle < 40 or cycle % 5 == 0 or choice is None
        action = names[guide.integers(len(names))] if led or choice is None else choice.action
        if cycle % 11 == 10:
            action = None  # nothing was done
        controller.perform(action)
        yard.do(action)


class ControllerContract:
    """Tests of a controller. A class that inherits them sets the first attribute.

    Attributes:
        controller: the class, or the name of one as a mission has it.
        options: what it is made with beside the action costs and `rng`.
    """

    controller: ClassVar[type[Controller] | str]
    options: ClassVar[Mapping[str, Plain | Sequence[Plain]]] = {}

    def made(self, seed: int = 1) -> Controller:
        """A controller made as a run makes it, with a random stream of this seed."""
        given = {"rover.controller_options": self.options}
        if isinstance(self.controller, str):
            loaded = load_mission("blackout", given | {"rover.controller": self.controller})
        else:
            loaded = load_mission("blackout", given, controller=self.controller)
        rng = np.random.default_rng(seed)
        return build_controller(loaded.mission.rover, rng, loaded.extensions)

    # --- the cycle -----------------------------------------------------------------------------

    def test_a_cycle_begins_with_sense_and_ends_with_perform(self) -> None:
        controller = self.made()
        with pytest.raises(RuntimeError):
            controller.perform("N")
        controller.sense(["at:0,0"])
        with pytest.raises(RuntimeError):
            controller.sense(["at:0,1"])
        controller.perform(None)
        controller.sense(["at:0,1"])

    def test_it_performs_what_others_chose(self) -> None:
        controller = self.made()
        for action in ACTIONS:
            controller.sense(["at:0,0"])
            controller.perform(action)
        controller.sense(["at:0,0"])

    def test_it_tells_what_it_sensed_in_order(self) -> None:
        sensed = self.made().sense(["at:B", BATTERY_LOW, "at:B"])
        assert sensed.tokens == ("at:B", BATTERY_LOW)

    def test_its_counts_are_counts(self) -> None:
        controller = self.made()
        for _ in _life(controller):
            assert controller.sign_count >= 0
            assert controller.hypothesis_count >= 0
            assert 0 <= controller.mean_cm <= 1

    # --- goals ---------------------------------------------------------------------------------

    def test_goals_are_listed_by_priority_and_can_be_withdrawn(self) -> None:
        controller = self.made()
        controller.set_goal(_A, 1.0)
        controller.set_goal(_B, 2.0)
        assert [goal.tokens for goal in controller.goals] == [_B, _A]
        controller.set_goal(_A, 3.0)
        assert [(goal.tokens, goal.priority) for goal in controller.goals] == [(_A, 3.0), (_B, 2.0)]
        assert controller.withdraw_goal(_A)
        assert not controller.withdraw_goal(_A)
        assert [goal.tokens for goal in controller.goals] == [_B]

    def test_a_goal_of_several_stays_until_none_of_them_wants_it(self) -> None:
        controller = self.made()
        controller.set_goal(_A, 1.0, "mission")
        controller.set_goal(_A, 4.0, "operator")
        assert dict(controller.goal_priorities(_A)) == {"mission": 1.0, "operator": 4.0}
        assert controller.goals[0].priority == 4.0
        assert not controller.withdraw_goal(_A, "inherent")
        assert controller.withdraw_goal(_A, "operator")
        assert dict(controller.goals[0].priorities) == {"mission": 1.0}
        assert controller.withdraw_goal(_A, "mission")
        assert controller.goals == ()
        assert dict(controller.goal_priorities(_A)) == {}

    def test_a_goal_is_reached_once_for_all_who_want_it(self) -> None:
        controller = self.made()
        controller.set_goal(_A, 1.0, "mission")
        controller.set_goal(_A, 2.0, "operator")
        controller.set_goal(_B, 1.0, "mission")
        (reached,) = controller.sense(["at:A"]).reached
        assert (reached.tokens, dict(reached.priorities)) == (_A, {"mission": 1.0, "operator": 2.0})
        assert [goal.tokens for goal in controller.goals] == [_B]
        controller.perform("N")
        assert controller.sense(["at:A"]).reached == ()

    def test_a_goal_that_is_active_when_it_is_set_is_told_in_the_next_cycle_and_once(self) -> None:
        controller = self.made()
        controller.sense(["at:A"])
        controller.set_goal(_A, 1.0)
        controller.perform(None)
        told = [(goal.tokens, goal.priority) for goal in controller.sense(["at:A"]).reached]
        assert told == [(_A, 1.0)]
        assert controller.goals == ()
        controller.perform(None)
        assert controller.sense(["at:A"]).reached == ()

    def test_a_goal_of_several_tokens_is_reached_when_all_are_sensed(self) -> None:
        controller = self.made()
        controller.set_goal(["at:D", ON_CHARGE], 1.0)
        assert controller.sense(["at:D"]).reached == ()
        controller.perform(None)
        assert len(controller.sense([ON_CHARGE, "at:D"]).reached) == 1

    @pytest.mark.parametrize(
        ("tokens", "priority", "error"),
        [((), 1.0, ValueError), (_A, float("nan"), ValueError), ("at:A", 1.0, TypeError)],
    )
    def test_what_is_no_goal_is_refused(
        self, tokens: str | tuple[str, ...], priority: float, error: type[Exception]
    ) -> None:
        controller = self.made()
        with pytest.raises(error):
            controller.set_goal(tokens, priority)
        assert controller.goals == ()

    # --- the choice ----------------------------------------------------------------------------

    def test_without_a_goal_it_chooses_nothing(self) -> None:
        """Before the first goal, after it was withdrawn, and after it was reached."""
        controller, yard = self.made(), _Yard()
        for action in [*"NESW" * 5, *"NNNEEE"]:
            controller.sense(yard.tokens)
            self._chooses_nothing(controller)
            controller.perform(action)
            yard.do(action)
        controller.set_goal(_B, 1.0)
        controller.withdraw_goal(_B)
        controller.set_goal(_A, 1.0)
        assert len(controller.sense(yard.tokens).reached) == 1
        self._chooses_nothing(controller)

    @staticmethod
    def _chooses_nothing(controller: Controller) -> None:
        assert controller.choose() is None
        assert controller.choose(explore=False) is None
        assert controller.why() is None
        assert tuple(controller.policy_path()) == ()

    def test_it_chooses_known_actions_for_goals_on_the_list(self) -> None:
        for moment in _life(self.made()):
            goals = [goal.tokens for goal in moment.goals]
            for choice in (moment.choice, moment.cautious):
                assert choice is None or choice.action in ACTIONS
                assert choice is None or choice.goal is None or choice.goal in goals
            assert moment.cautious is None or moment.cautious.goal is not None

    def test_what_it_expects_and_estimates_can_be_used(self) -> None:
        controller = self.made()
        for moment in _life(controller):
            assert moment.home >= 0
            assert moment.expected is None or moment.expected.action == "N"
        controller.sense(["at:D", ON_CHARGE])
        assert controller.cost_to(_HOME) == 0
        assert controller.cost_to(("at:nowhere",)) > 0
        assert controller.cost_to(_HOME, _HOME) == 0

    def test_all_that_it_says_fits_into_a_log(self) -> None:
        for moment in _life(self.made()):
            for said in (*moment[:4], moment.expected):
                msgspec.json.encode(said)

    # --- the same run again --------------------------------------------------------------------

    def test_the_same_seed_and_inputs_give_the_same_choices(self) -> None:
        random.seed(1)
        np.random.seed(1)  # noqa: NPY002 - this is what it must not use
        first = list(_life(self.made()))
        random.seed(2)
        np.random.seed(2)  # noqa: NPY002
        assert list(_life(self.made())) == first

    def test_it_draws_nothing_from_global_randomness(self) -> None:
        states = random.getstate(), repr(np.random.get_state())  # noqa: NPY002
        list(_life(self.made()))
        assert (random.getstate(), repr(np.random.get_state())) == states  # noqa: NPY002

    def test_two_side_by_side_do_not_disturb_each_other(self) -> None:
        alone = list(_life(self.made()))
        both = list(zip(_life(self.made()), _life(self.made()), strict=True))
        assert both == list(zip(alone, alone, strict=True))
