"""Goals and rules: what a supervisor sends, approves, vetoes and takes back."""

from msgspec.structs import replace
from operator_stand import Ground

from farside.control import CommandStage, Mode
from farside.ground.config import (
    CostRule,
    GroundConfig,
    Pursue,
    Supervision,
    SupervisorConfig,
    WantedPlace,
)
from farside.messages import (
    Approve,
    SetGoal,
    SetMode,
    Veto,
    WithdrawGoal,
)
from farside.topics import OperatorEntry
from tests.ground.conftest import proposal

SHARED, ALONE = SetMode(Mode.SHARED), SetMode(Mode.AUTONOMOUS)
CHEAP = (CostRule(below=10.0),)


def supervisor(mode: str = "shared", *places: str, patience_s: float = 60.0) -> Ground:
    goals = tuple(WantedPlace(place=place) for place in places or ("A", "B"))
    config = SupervisorConfig(goals=goals, mode=Supervision(mode), patience_s=patience_s)
    return Ground(GroundConfig(operator="supervisor", supervisor=config, rules=CHEAP))


def settle(ground: Ground, mode: Mode, place: str = "2,1") -> None:
    ground.end(CommandStage.DONE)
    ground.learn(place, mode=mode)


def test_in_shared_mode_it_approves_what_meets_the_rules_goal_by_goal() -> None:
    ground = supervisor()
    assert ground.act() == [SHARED]
    settle(ground, Mode.SHARED)
    assert ground.act() == [SetGoal(("at:A",), 2.0)]
    ground.belief.consider(replace(proposal(1), goal=("at:A",)))
    assert ground.act() == [Approve(1)]
    assert ground.act() == [], "each is answered once"
    ground.reach("A")
    assert ground.act() == [SetGoal(("at:B",), 2.0)]
    ground.reach("B")
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(1, 1, None)


def test_what_breaks_a_rule_is_vetoed_and_its_goal_tried_once_more_in_the_end() -> None:
    ground = supervisor()
    ground.reviews.costs[("at:A",)] = 12.0
    ground.act()
    settle(ground, Mode.SHARED)
    ground.act()
    for number in (1, 2):
        ground.belief.consider(replace(proposal(number), goal=("at:A",)))
        assert ground.act() == [Veto(number)]
        assert ground.act() == [WithdrawGoal(("at:A",))]
        settle(ground, Mode.SHARED)
        if number == 1:
            assert ground.act() == [SetGoal(("at:B",), 2.0)]
            ground.reach("B")
            assert ground.act() == [SetGoal(("at:A",), 2.0)]
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(
        1, 1, None, left=("goal A: vetoed proposal 2, its cost 12.0 is not below 10",)
    )


def test_where_nothing_is_proposed_for_long_it_goes_on_but_not_while_the_rover_is_silent() -> None:
    ground = supervisor("shared", "A", patience_s=5.0)
    ground.act()
    settle(ground, Mode.SHARED)
    ground.act()
    settle(ground, Mode.SHARED)
    assert ground.act(10.0) == []
    assert ground.act(14.9) == []
    assert ground.act(20.0, silent=True) == [], "it would not be heard"
    assert ground.act(21.0) == []
    assert ground.act(26.0) == [WithdrawGoal(("at:A",))]


def test_in_autonomous_mode_a_goal_is_sent_if_the_way_to_it_meets_the_rules() -> None:
    ground = supervisor("autonomous", "A", "B")
    ground.reviews.costs = {("at:A",): 12.0, ("at:B",): 8.0}
    assert ground.act() == [ALONE]
    settle(ground, Mode.AUTONOMOUS)
    assert ground.act() == [SetGoal(("at:B",), 2.0)]
    assert ground.operator.progress.left == ("goal A: its cost 12.0 is not below 10",)
    settle(ground, Mode.AUTONOMOUS)
    ground.reviews.costs[("at:A",)] = 9.0
    ground.reach("B")
    assert ground.act() == [SetGoal(("at:A",), 2.0)], "it was put aside, and is tried again"
    assert not ground.operator.progress.left
    settle(ground, Mode.AUTONOMOUS)
    ground.reach("A")
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(1, 1, None)


def test_alone_the_rover_has_three_times_the_cost_of_the_way_and_the_patience_on_top() -> None:
    ground = supervisor("autonomous", "A", patience_s=5.0)
    ground.reviews.costs[("at:A",)] = 4.0
    ground.act()
    settle(ground, Mode.AUTONOMOUS)
    ground.act()
    settle(ground, Mode.AUTONOMOUS)
    assert ground.act(100.0) == []
    assert ground.act(110.0) == []
    assert ground.act(115.0, silent=True) == []
    assert ground.act(116.0, silent=True) == []
    assert ground.act(122.9) == [], "six seconds of silence do not count"
    assert ground.act(123.1) == [WithdrawGoal(("at:A",))]


def test_where_no_way_is_known_no_goal_is_sent() -> None:
    ground = supervisor("autonomous", "A")
    ground.act()
    settle(ground, Mode.AUTONOMOUS)
    assert ground.act() == []
    assert ground.operator.progress.left == ("goal A: no way there is known",)


def test_a_rover_that_took_over_meanwhile_is_told_the_mode_again() -> None:
    ground = supervisor("shared")
    ground.act()
    settle(ground, Mode.SHARED)
    ground.act()
    ground.end(CommandStage.DONE)
    ground.learn("A", mode=Mode.AUTONOMOUS)
    ground.reach("A")
    assert ground.act() == [SHARED]


def test_the_script_answers_by_the_rules_too() -> None:
    ground = Ground(GroundConfig(script=(Pursue(place="B"),), rules=CHEAP))
    ground.reviews.costs[("at:B",)] = 99.0
    assert ground.act() == [SetGoal(("at:B",), 2.0)]
    ground.belief.consider(proposal(1))
    assert ground.act() == [Veto(1)]
    assert ground.act() == [WithdrawGoal(("at:B",))]
    settle(ground, Mode.SHARED)
    ground.act()
    assert ground.operator.progress.left == (
        "goal B: vetoed proposal 1, its cost 99.0 is not below 10",
    )
