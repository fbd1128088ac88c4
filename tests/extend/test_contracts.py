"""The contracts find what is wrong: each of these is wrong in one way, and one test says so."""

import random
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import ClassVar

import numpy as np
import pytest
from caller import Caller
from pathfinder import Pathfinder

from farside.dem import Choice, Goal, Sensed, Sign, Why
from farside.ground import Operator, Situation
from farside.messages import Drive, Order
from farside.missions.testing.contracts import ControllerContract, OperatorContract
from farside.rover import Controller, PlainController
from farside.topics import OperatorEntry


class Forgetful(Pathfinder):
    """Takes two cycles for one."""

    def sense(self, tokens: Iterable[str]) -> Sensed:
        self._is_open = False
        return super().sense(tokens)


class Wilful(Pathfinder):
    """Performs nothing but what it would choose itself."""

    def perform(self, action: str | None) -> None:
        if action is not None and self.choose() is None:
            raise TypeError(action)
        super().perform(action)


class Taciturn(Pathfinder):
    """Takes no notice of a goal that it sees satisfied, and does not tell."""

    def set_goal(
        self, tokens: Iterable[str], priority: float, source: str = "operator"
    ) -> Goal | None:
        satisfied = super().set_goal(tokens, priority, source)
        if satisfied is not None:
            self._goals.take_satisfied(self.tokens)
        return satisfied


class Faithful(Pathfinder):
    """Never gives up a goal."""

    def withdraw_goal(self, tokens: Iterable[str], source: str = "operator") -> bool:
        return source in self.goal_priorities(tokens)


class Lordless(Pathfinder):
    """Does not tell who wants what."""

    def set_goal(
        self,
        tokens: Iterable[str],
        priority: float,
        source: str = "operator",  # noqa: ARG002
    ) -> Goal | None:
        return super().set_goal(tokens, priority, "operator")


class Restless(Pathfinder):
    """Goes about without a goal."""

    def choose(self, *, explore: bool = True) -> Choice | None:
        return super().choose(explore=explore) or Choice("N")


class Flighty(Pathfinder):
    """Chooses what no rover can do."""

    def choose(self, *, explore: bool = True) -> Choice | None:
        choice = super().choose(explore=explore)
        return choice and Choice("up", goal=choice.goal)


class Presumptuous(Pathfinder):
    """Serves a goal that nobody set."""

    def choose(self, *, explore: bool = True) -> Choice | None:
        choice = super().choose(explore=explore)
        return choice and Choice(choice.action, goal=("at:elsewhere",))


class Bold(Pathfinder):
    """Explores where it may not."""

    def choose(self, *, explore: bool = True) -> Choice | None:  # noqa: ARG002
        return super().choose(explore=True)


class Lucky(Pathfinder):
    """Draws from the randomness of the whole process."""

    def choose(self, *, explore: bool = True) -> Choice | None:
        if not (self.goals and explore):
            return None
        return Choice(random.choice(self.actions))  # noqa: S311 - that is what is wrong


class Hurried(Pathfinder):
    """Looks at the clock."""

    def choose(self, *, explore: bool = True) -> Choice | None:
        if not (self.goals and explore):
            return None
        return Choice(self.actions[time.perf_counter_ns() // 100 % len(self.actions)])


class Communal(PlainController):
    """Shares what it has seen with all of its kind."""

    seen: ClassVar[set[Sign]] = set()

    def choose(self, *, explore: bool = True) -> Choice | None:
        if not (self.goals and explore):
            return None
        self.seen.add(self.tokens)
        return Choice(self.actions[len(self.seen) % len(self.actions)])


class Mute(Pathfinder):
    """Has reasons that no log can hold."""

    def why(self) -> Why | None:
        odd: Why = object()  # type: ignore[assignment]
        return odd if self.goals else None


class Optimist(Pathfinder):
    """Is everywhere already."""

    def cost_to(self, goal: Iterable[str], start: Iterable[str] | None = None) -> float:  # noqa: ARG002
        return 0.0


CONTROLLERS: Mapping[type[Controller], str] = {
    Forgetful: "test_a_cycle_begins_with_sense_and_ends_with_perform",
    Wilful: "test_it_performs_what_others_chose",
    Taciturn: "test_a_goal_that_is_active_when_it_is_set_is_told_in_the_next_cycle_and_once",
    Faithful: "test_goals_are_listed_by_priority_and_can_be_withdrawn",
    Lordless: "test_a_goal_is_reached_once_for_all_who_want_it",
    Restless: "test_without_a_goal_it_chooses_nothing",
    Flighty: "test_it_chooses_known_actions_for_goals_on_the_list",
    Presumptuous: "test_it_chooses_known_actions_for_goals_on_the_list",
    Bold: "test_it_chooses_known_actions_for_goals_on_the_list",
    Lucky: "test_it_draws_nothing_from_global_randomness",
    Hurried: "test_the_same_seed_and_inputs_give_the_same_choices",
    Communal: "test_two_side_by_side_do_not_disturb_each_other",
    Mute: "test_all_that_it_says_fits_into_a_log",
    Optimist: "test_what_it_expects_and_estimates_can_be_used",
}


def fails(test: Callable[[], None]) -> bool:
    try:
        test()
    except (AssertionError, TypeError, pytest.fail.Exception):
        return True
    return False


@pytest.mark.parametrize(("wrong", "test"), CONTROLLERS.items())
def test_what_is_wrong_with_a_controller_is_found(wrong: type[Controller], test: str) -> None:
    class Contract(ControllerContract):
        controller = wrong

    assert fails(getattr(Contract(), test))


class Sure(Caller):
    """Takes it that the rover was heard."""

    def act(self, situation: Situation) -> Sequence[Order]:
        assert situation.belief.telemetry is not None
        return super().act(situation)


class Placed(Caller):
    """Takes it that the rover knows where it is."""

    def act(self, situation: Situation) -> Sequence[Order]:
        telemetry = situation.belief.telemetry
        if telemetry is not None:
            next(token for token in telemetry.tokens if token.startswith("at:"))
        return super().act(situation)


class Wild(Caller):
    """Orders what no rover can do."""

    def act(self, situation: Situation) -> Sequence[Order]:
        return [Drive("up")] if situation.now_ns == 0 else ()


class Boastful(Caller):
    """Has done more than there is to do."""

    @property
    def progress(self) -> OperatorEntry:
        return OperatorEntry(3, 2, None)


class Moody(Caller):
    """Lets the randomness of the whole process decide."""

    def act(self, situation: Situation) -> Sequence[Order]:
        return super().act(situation) if random.random() < 0.01 else ()  # noqa: S311


OPERATORS: Mapping[type[Operator], str] = {
    Sure: "test_it_copes_without_any_telemetry",
    Placed: "test_it_copes_with_telemetry_that_knows_no_place",
    Wild: "test_it_gives_orders_that_can_be_given",
    Boastful: "test_its_progress_is_valid_at_all_times",
    Moody: "test_the_same_situations_get_the_same_orders",
}


@pytest.mark.parametrize(("wrong", "test"), OPERATORS.items())
def test_what_is_wrong_with_an_operator_is_found(wrong: type[Operator], test: str) -> None:
    class Contract(OperatorContract):
        operator = wrong
        options: ClassVar = {"places": ["A", "B"]}

    assert fails(getattr(Contract(), test))


def test_a_plain_controller_learns_what_others_chose() -> None:
    class Pupil(PlainController):
        def __init__(self) -> None:
            super().__init__({"N": 1.0, "S": 1.0}, rng=np.random.default_rng(1))
            self.lessons: list[tuple[Sign, str, Sign]] = []

        def learn(self, before: Sign, action: str, after: Sign) -> None:
            self.lessons.append((before, action, after))

        def choose(self, *, explore: bool = True) -> Choice | None:
            return Choice("N") if explore else None

    pupil = Pupil()
    pupil.sense(["at:B", "on_charge"])
    pupil.choose()
    pupil.perform("S")
    pupil.sense(["at:A"])
    pupil.perform(None)
    pupil.sense(["at:A"])
    pupil.perform("N")
    pupil.sense([])

    assert pupil.lessons == [(("at:B", "on_charge"), "S", ("at:A",)), (("at:A",), "N", ())]
    assert (pupil.sign_count, pupil.tokens) == (3, ())
