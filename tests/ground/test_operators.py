"""The operators that Farside brings beside the script: what each gives, and when."""

import math

import pytest
from msgspec.structs import replace

from farside.acts import Act, Planned
from farside.control import CommandStage, Failsafe, Mode
from farside.ground import Operator, Situation
from farside.ground.config import (
    CostRule,
    GroundConfig,
    GuideConfig,
    Leave,
    Pursue,
    RecordedConfig,
    RecordedLine,
    Supervision,
    SupervisorConfig,
    WantedPlace,
)
from farside.ground.operators.built_in import built_in_operator
from farside.ground.operators.queued import QueuedOperator, as_logged
from farside.ground.operators.recorded import RecordedOperator
from farside.messages import (
    Approve,
    CommandReached,
    Drive,
    Event,
    GoalReached,
    Proposal,
    SetGoal,
    SetMode,
    Tokens,
    Veto,
    WithdrawGoal,
)
from farside.node import to_ns
from farside.places import Chart
from farside.topics import OperatorEntry, PathReview
from tests.ground.conftest import CHART, make_belief, make_desk, proposal, telemetry

ROOM = Chart(("#####", "#A.B#", "#####"), 1.0)
SHARED, ALONE = SetMode(Mode.SHARED), SetMode(Mode.AUTONOMOUS)


class Reviews:
    """Reviews in place of those of an outlook: every way costs the same, by what was said."""

    def __init__(self) -> None:
        self.costs: dict[Tokens, float] = {}

    def review(self, proposal: Proposal, _now_ns: int) -> PathReview:
        cost = self.costs.get(proposal.goal, 1.0)
        return PathReview(proposal.goal, proposal.action, (), 0.0, cost)

    def review_path(self, goal: Tokens, _now_ns: int) -> PathReview | None:
        return PathReview(goal, "E", (), 0.0, self.costs[goal]) if goal in self.costs else None


class Ground:
    """An operator, and what it is shown."""

    def __init__(self, config: GroundConfig, chart: Chart = CHART) -> None:
        self.operator: Operator = built_in_operator(config, chart)
        self.belief, self.desk, self.reviews = make_belief(), make_desk(), Reviews()
        self.events = 0
        self.t_s = 0.0

    def learn(self, place: str = "A", **changes: object) -> None:
        """Telemetry says that the rover stands here, and that all commands are over."""
        self.t_s += 1.0
        said = telemetry(self.t_s, place, **{"commands_done": self.desk.last_given, **changes})
        self.belief.learn(said, said.time_ns)
        self.desk.learn(said)

    def end(self, stage: CommandStage, number: int | None = None) -> None:
        """The rover says how a command ended, by default the last one."""
        number = number or self.desk.last_given
        self.desk.learn_stage(CommandReached(number, stage, "for a reason"))

    def reach(self, place: str) -> None:
        """The rover says that it has reached a goal."""
        self.events += 1
        self.belief.tell(Event(self.events, 0, GoalReached((f"at:{place}",))), 0)

    def act(self, t_s: float | None = None, *, silent: bool = False) -> list[Act]:
        now_ns = to_ns(self.t_s if t_s is None else t_s)
        situation = Situation(now_ns, self.belief, self.desk, silent, self.reviews)  # type: ignore[arg-type]
        acts = list(self.operator.act(situation))
        for act in acts:
            self.desk.give(act, now_ns)
        return acts

    @property
    def waits_for(self) -> str | None:
        return self.operator.progress.waiting_for


# --- absent, queued, recorded ---------------------------------------------------------------------


def test_where_nobody_is_nothing_is_ordered() -> None:
    ground = Ground(GroundConfig(operator="absent"))
    ground.learn()
    ground.belief.consider(proposal(1))
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(0, 0, None)


def test_what_was_put_is_given_once_and_in_order() -> None:
    ground = Ground(GroundConfig(operator="queued"))
    assert isinstance(ground.operator, QueuedOperator)
    ground.operator.put([Drive("N"), Drive("E")])
    ground.operator.put([SHARED])
    assert ground.act() == [Drive("N"), Drive("E"), SHARED]
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(3, 3, None)


def line(t_s: float, json: str) -> RecordedLine:
    return RecordedLine(time_ns=to_ns(t_s), json=json)


def test_what_is_recorded_is_given_at_its_time_with_the_progress_of_then() -> None:
    drive, goal = (
        f'{{"act":{order}}}'
        for order in (
            '{"type":"drive","action":"N"}',
            '{"type":"planned","order":{"type":"veto","proposal":3},"follows":true}',
        )
    )
    recorded = RecordedConfig(
        orders=(line(1, drive), line(2, goal), line(2, drive)),
        progress=(line(1, '{"step":1,"of":2,"waiting_for":"x"}'),),
    )
    ground = Ground(GroundConfig(operator="recorded", recorded=recorded))
    assert ground.act(0.9) == []
    assert ground.operator.progress == OperatorEntry(0, 2, None)
    assert ground.act(1.0) == [Drive("N")]
    assert ground.operator.progress == OperatorEntry(1, 2, "x")
    assert ground.act(5.0) == [Planned(Veto(3), follows=True), Drive("N")]
    assert ground.act(6.0) == []


def test_the_first_recorded_progress_is_a_change_whatever_it_was() -> None:
    """The ground notes changes, and it noted this one."""
    first = RecordedConfig(orders=(), progress=(line(0, '{"step":0,"of":3,"waiting_for":null}'),))
    assert RecordedOperator(first).progress != OperatorEntry(0, 3, None)


def test_an_order_is_given_as_the_log_will_give_it_back() -> None:
    assert as_logged(SetGoal(("at:A",), math.nan)) == SetGoal(("at:A",), None)
    assert as_logged(Planned(Drive("N"), at_ns=5)) == Planned(Drive("N"), at_ns=5)


@pytest.mark.parametrize(
    ("orders", "why"),
    [
        ((line(2, '{"act":{"type":"veto","proposal":1}}'), line(1, "{}")), "not before"),
        ((line(0, '{"act":{"type":"fly"}}'),), "Invalid value 'fly'"),
        ((line(0, "[]"),), "got `array`"),
    ],
)
def test_lines_that_no_log_has_are_refused(orders: tuple[RecordedLine, ...], why: str) -> None:
    with pytest.raises(ValueError, match=why):
        RecordedConfig(orders=orders)


# --- guide ----------------------------------------------------------------------------------------


def guide(ahead: int = 1, chart: Chart = ROOM) -> Ground:
    return Ground(GroundConfig(operator="guide", guide=GuideConfig(ahead=ahead)), chart)


def test_the_guide_moves_and_waits_until_every_move_was_made() -> None:
    ground = guide()
    assert ground.act() == []
    assert ground.waits_for == "the rover to be heard"
    for place, action in (("A", "E"), ("2,1", "E"), ("B", "W"), ("2,1", "W")):
        ground.learn(place)
        assert ground.act() == [Drive(action)]
        assert ground.act() == [], "it waits for word"
        ground.end(CommandStage.DONE)
    ground.learn("A")
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(1, 1, None)


def test_the_guide_sends_several_moves_each_to_follow_on_the_one_before() -> None:
    ground = guide(ahead=3)
    ground.learn("A")
    ahead = [Planned(Drive(action), follows=True) for action in "EW"]
    assert ground.act() == [Drive("E"), *ahead]
    assert ground.waits_for == "every move to be made, as 0 of 4 are"
    for number in (1, 2, 3):
        assert ground.act() == []
        ground.end(CommandStage.DONE, number)
    ground.learn("2,1")
    assert ground.act() == [Drive("W")]
    assert ground.waits_for == "every move to be made, as 3 of 4 are"


def test_word_of_how_a_move_ended_is_waited_for() -> None:
    """Telemetry that says that it is over may be there before."""
    ground = guide()
    ground.learn("A")
    ground.act()
    ground.learn("A")
    assert ground.act() == []
    ground.end(CommandStage.FAILED)
    assert ground.act() == [Drive("E", force=True)], "it was blocked here just now"


def test_what_was_blocked_three_times_is_given_up_and_said() -> None:
    ground = guide()
    ground.learn("A")
    for number in (1, 2, 3):
        assert ground.act() == [Drive("E", force=number > 1)]
        ground.end(CommandStage.FAILED)
        ground.learn("A")
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(
        1, 1, None, left=("4 moves, as they were blocked: first E from A",)
    )


def test_after_a_refusal_it_starts_from_where_the_rover_is() -> None:
    ground = guide(ahead=2)
    ground.learn("A")
    ground.act()
    ground.end(CommandStage.EXPIRED, 1)
    ground.end(CommandStage.REFUSED, 2)
    ground.learn("B")
    assert ground.act() == [Drive("W"), Planned(Drive("E"), follows=True)]


def test_a_low_battery_comes_first_and_the_rover_is_charged_before_it_goes_on() -> None:
    ground = guide(chart=Chart(("######", "#D..A#", "######"), 1.0))
    ground.learn("A", tokens=("at:3,1", "battery:low"))
    assert ground.act() == [Drive("W")]
    assert ground.waits_for == "the rover to be at the dock"
    ground.end(CommandStage.DONE)
    ground.learn("D", tokens=("at:D", "battery:low", "on_charge"), battery=0.3)
    assert ground.act() == []
    assert ground.waits_for == "the rover to be charged"
    ground.learn("D", tokens=("at:D", "on_charge"), battery=0.95)
    assert ground.act() == [Drive("E")]


def test_behind_a_long_delay_it_turns_back_before_the_battery_is_low() -> None:
    """A move took a quarter of the charge: there and back takes more than is left."""
    ground = guide(chart=Chart(("######", "#D..A#", "######"), 1.0))
    ground.learn("D", battery=1.0)
    assert ground.act() == [Drive("E")]
    ground.end(CommandStage.DONE)
    ground.learn("2,1", battery=0.75)
    assert ground.act() == [Drive("W")]
    assert ground.waits_for == "the rover to be at the dock"


def test_into_silence_and_to_a_rover_that_is_not_safe_the_guide_sends_nothing() -> None:
    ground = guide()
    ground.learn("A")
    assert ground.act(silent=True) == []
    ground.learn("A", failsafe=Failsafe.SAFE)
    assert ground.act() == []
    assert ground.waits_for == "the rover to be safe to drive"
    ground.learn("A")
    assert ground.act() == [Drive("E")]


# --- leave ----------------------------------------------------------------------------------------


def test_the_rover_is_left_with_mode_and_goals_at_once_and_nothing_is_said_after() -> None:
    goals = (WantedPlace(place="B"), WantedPlace(place="A", priority=1.0))
    ground = Ground(GroundConfig(script=(Leave(goals=goals),)))
    sent = [ALONE, SetGoal(("at:B",), 2.0), SetGoal(("at:A",), 1.0)]
    assert ground.act() == sent
    ground.end(CommandStage.EXPIRED, 2)
    ground.learn(mode=Mode.AUTONOMOUS)
    assert ground.act() == sent[1:2], "only what was not done is said again"
    ground.learn(mode=Mode.AUTONOMOUS)
    assert ground.act() == []
    ground.belief.consider(proposal(1))
    assert ground.act() == []
    assert ground.operator.progress == OperatorEntry(1, 1, None)


# --- supervisor, and rules ------------------------------------------------------------------------

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
