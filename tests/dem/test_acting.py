"""Acting in the whole model: goals, policy map and path, and exploration."""

import pytest

from farside.dem import DynamicExpectancyModel, Goal, Hypothesis
from tests.dem.conftest import Grid, MakeModel, RunCycle, Tour

A, B, C = ("at:A",), ("at:B",), ("at:C",)


def run_to(model: DynamicExpectancyModel, world: Grid, goal: tuple[int, int], patience: int) -> int:
    """Set the goal, leave the model alone, and count its steps."""
    model.set_goal([world.token(goal)], priority=1.0)
    for steps in range(patience):
        if model.sense(world.tokens()).reached:
            model.perform(None)
            return steps
        model.perform(world.do(model.choose().action))
    raise AssertionError(f"{goal} not reached from {world.at} in {patience} steps")


def value_of(model: DynamicExpectancyModel, sign: tuple[str, ...]) -> float:
    return {row.sign: row.value for row in model.policy_map()}[sign]


def test_one_trial_is_enough(make_model: MakeModel, cycle: RunCycle) -> None:
    model = make_model()
    cycle(model, A, "E")
    cycle(model, B, "W")
    model.set_goal(B, priority=1.0)
    model.sense(A)
    choice = model.choose()
    assert (choice.action, choice.goal, choice.sign, choice.cost_to_go) == ("E", B, A, 5.32)


def test_a_corridor_driven_once_is_travelled_in_the_fewest_steps(
    make_model: MakeModel, corridor: Grid, cycle: RunCycle
) -> None:
    model = make_model()
    for action in "EEEEEWWWWW":
        cycle(model, corridor.tokens(), corridor.do(action))
    assert run_to(model, corridor, (5, 0), patience=20) == 5
    assert run_to(model, corridor, (2, 0), patience=20) == 3


def test_after_a_tour_valence_depths_are_the_fewest_steps_to_any_goal(
    make_model: MakeModel, grid: Grid, tour: Tour
) -> None:
    model = make_model()
    tour(model, grid, 1500)
    for goal in sorted(grid.places):
        model.set_goal([grid.token(goal)], priority=1.0)
        depths = {row.sign: row.depth for row in model.policy_map()}
        steps = grid.steps_to(goal)
        assert depths == {(grid.token(place),): steps[place] for place in grid.places}
        model.withdraw_goal([grid.token(goal)])


def test_left_alone_it_takes_the_shortest_path_to_each_goal(
    make_model: MakeModel, grid: Grid, tour: Tour
) -> None:
    model = make_model()
    tour(model, grid, 1500)
    for goal in [(4, 3), (0, 0), (4, 0), (2, 1)]:
        fewest = grid.steps_to(goal)[grid.at]
        assert run_to(model, grid, goal, patience=30) == fewest


def test_the_policy_path_adds_up_and_begins_with_the_choice(
    make_model: MakeModel, grid: Grid, tour: Tour
) -> None:
    model = make_model()
    tour(model, grid, 1500)
    grid.at = (0, 0)
    model.sense(grid.tokens())
    model.set_goal(["at:4,0"], priority=1.0)
    path, choice = model.policy_path(), model.choose()
    assert (path[0].sign, path[0].action) == (choice.sign, choice.action)
    assert path[0].cost_to_go == choice.cost_to_go
    walked = [grid.at]
    for step in path:
        assert step.sign == (grid.token(walked[-1]),)
        walked.append(grid.beside(walked[-1], step.action))
    assert walked[-1] == (4, 0)
    for number, step in enumerate(path):
        rest = sum(2.66 / later.cm for later in path[number:])
        assert step.cost_to_go == pytest.approx(rest)


def test_the_policy_map_begins_at_the_goal_and_leaves_out_what_cannot_reach_it(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model()
    for tokens, action in [(A, "E"), (B, "N"), (C, None)]:
        cycle(model, tokens, action)
    model.set_goal(B, priority=1.0)
    rows = [(row.sign, row.value, row.action, row.depth) for row in model.policy_map()]
    assert rows == [(B, 0.0, None, 0), (A, 5.32, "E", 1)]


def test_choosing_and_reading_the_map_change_nothing_that_was_learned(
    make_model: MakeModel, grid: Grid, tour: Tour
) -> None:
    model = make_model()
    tour(model, grid, 200)
    model.set_goal(["at:4,3"], priority=1.0)
    model.sense(grid.tokens())
    before = model.hypotheses
    assert model.choose() == model.choose()
    assert model.policy_map() == model.policy_map()
    assert model.hypotheses == before


def test_a_failure_raises_the_cost_in_the_same_cycle(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model()
    cycle(model, A, "E")
    cycle(model, B, "N")
    model.set_goal(B, priority=1.0)
    cycle(model, A, "E")
    assert value_of(model, A) == 2.66 / 0.5
    model.sense(C)
    assert value_of(model, A) == 2.66 / 0.25


def test_a_blocked_path_is_left_for_a_known_detour(
    make_model: MakeModel, grid: Grid, tour: Tour
) -> None:
    """From (0, 0) to (2, 0) the path is E, E; then (1, 0) is blocked."""
    model = make_model()
    tour(model, grid, 1500)
    grid.at = (0, 0)
    assert run_to(model, grid, (2, 0), patience=10) == 2
    grid.places.remove((1, 0))
    grid.at = (0, 0)
    detour = grid.steps_to((2, 0))[0, 0]
    assert detour > 2
    assert detour < run_to(model, grid, (2, 0), patience=40) < 40


def test_a_new_hypothesis_is_on_the_map_in_the_same_cycle(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model()
    cycle(model, A, "E")
    cycle(model, B, "N")
    model.set_goal(B, priority=1.0)
    cycle(model, C, "W")
    assert [row.sign for row in model.policy_map()] == [B, A]
    model.sense(A)
    assert [row.sign for row in model.policy_map()] == [B, A, C]


@pytest.fixture
def between(make_model: MakeModel, corridor: Grid, cycle: RunCycle) -> DynamicExpectancyModel:
    """A model that knows a corridor both ways and stands at 2,0, with a cycle begun."""
    model = make_model()
    for action in "EEEEEWWWWWEE":
        cycle(model, corridor.tokens(), corridor.do(action))
    model.sense(corridor.tokens())
    return model


def test_a_goal_of_higher_priority_takes_over_until_it_is_withdrawn(
    between: DynamicExpectancyModel,
) -> None:
    between.set_goal(["at:5,0"], priority=1.0)
    assert between.choose().action == "E"
    between.set_goal(["at:1,0"], priority=2.0)
    assert between.choose().action == "W"
    assert between.withdraw_goal(["at:1,0"])
    assert between.choose().action == "E"


def test_a_priority_that_rises_above_another_changes_the_goal(
    between: DynamicExpectancyModel,
) -> None:
    between.set_goal(["at:5,0"], priority=1.0)
    between.set_goal(["at:0,0"], priority=0.5)
    assert between.choose().goal == ("at:5,0",)
    between.set_goal(["at:0,0"], priority=1.5)
    assert between.choose().goal == ("at:0,0",)


def test_a_goal_that_becomes_active_is_reached_even_if_it_is_not_the_top_goal(
    between: DynamicExpectancyModel,
) -> None:
    between.set_goal(["at:5,0"], priority=2.0)
    between.set_goal(["at:3,0"], priority=1.0)
    between.perform("E")
    assert between.sense(["at:3,0"]).reached == (Goal(("at:3,0",), {"operator": 1.0}),)
    assert between.goals == (Goal(("at:5,0",), {"operator": 2.0}),)


def test_a_goal_that_is_active_when_it_is_set_is_satisfied_at_once(
    between: DynamicExpectancyModel,
) -> None:
    """It is returned, and told once more to those who wait for `reached`, wherever they are."""
    here = Goal(("at:2,0",), {"operator": 1.0})
    assert between.set_goal(["at:2,0"]) == here
    assert between.goals == ()
    assert between.policy_path() == ()
    assert not between.withdraw_goal(["at:2,0"])
    between.perform("E")
    assert between.sense(["at:3,0"]).reached == (here,)
    between.perform("W")
    assert between.sense(["at:2,0"]).reached == ()


def test_for_a_goal_that_is_active_nothing_else_is_left_undone_and_nothing_is_done(
    between: DynamicExpectancyModel,
) -> None:
    between.set_goal(["at:5,0"], priority=1.0)
    before = between.choose()
    between.set_goal(["at:2,0"], priority=9.0)
    assert between.choose() == before
    between.withdraw_goal(["at:5,0"])
    assert between.choose(explore=False) is None


def test_a_goal_of_several_tokens_is_active_when_all_of_them_are_sensed(
    between: DynamicExpectancyModel,
) -> None:
    between.perform(None)
    between.sense(["at:2,0", "drill:out", "dust"])
    both = Goal(("at:2,0", "drill:out"), {"mission": 2.0})
    assert between.set_goal(["drill:out", "at:2,0"], 2.0, "mission") == both
    assert between.set_goal(["dust", "at:3,0"]) is None
    assert between.goals[0].tokens == ("at:3,0", "dust")


def test_of_several_that_set_an_active_goal_each_is_told_and_the_goal_once(
    between: DynamicExpectancyModel,
) -> None:
    """Together with those reached in the next cycle, the highest first; set again, it is new."""
    here = ("at:2,0",)
    between.set_goal(["at:3,0"], 2.0)
    assert between.set_goal(here, 1.0, "mission") == Goal(here, {"mission": 1.0})
    assert between.set_goal(here, 5.0, "operator") == Goal(here, {"operator": 5.0})
    between.perform("E")
    assert between.sense(["at:3,0"]).reached == (
        Goal(here, {"mission": 1.0, "operator": 5.0}),
        Goal(("at:3,0",), {"operator": 2.0}),
    )
    assert between.set_goal(here) is None
    assert between.choose().action == "W"


def test_between_two_cycles_nothing_is_active_and_the_next_sense_decides(
    between: DynamicExpectancyModel,
) -> None:
    """The robot is on its way: it may have left the place where it was last sensed."""
    between.perform("E")
    assert between.set_goal(["at:2,0"]) is None
    assert between.sense(["at:3,0"]).reached == ()
    assert between.choose().action == "W"


def test_what_was_satisfied_at_once_is_still_told_by_a_model_that_is_loaded(
    between: DynamicExpectancyModel,
) -> None:
    between.set_goal(["at:2,0"])
    loaded = DynamicExpectancyModel.load(between.save())
    loaded.perform(None)
    assert loaded.sense([]).reached == (Goal(("at:2,0",), {"operator": 1.0}),)


def test_an_unknown_goal_stays_on_the_list(between: DynamicExpectancyModel) -> None:
    between.set_goal(["at:nowhere"], priority=1.0)
    assert ("at:nowhere",) not in between.signs
    assert between.policy_map() == ()
    assert between.policy_path() == ()
    assert between.choose().goal is None
    assert between.goals[0].tokens == ("at:nowhere",)


def test_a_goal_of_several_tokens_becomes_a_sign(between: DynamicExpectancyModel) -> None:
    """Being at the place is not enough; the drill must be out too."""
    both = ("at:3,0", "drill:out")
    between.set_goal(["drill:out", "at:3,0"], priority=1.0)
    assert both in between.signs
    between.perform("E")
    assert between.sense(["at:3,0"]).reached == ()
    between.perform("N")
    sensed = between.sense(both)
    assert sensed.reached == (Goal(both, {"operator": 1.0}),)
    assert both in sensed.novel
    between.perform(None)
    between.sense(["at:3,0"])
    between.set_goal(both, priority=1.0)
    assert between.choose().action == "N"


def test_withdrawing_a_goal_that_is_not_on_the_list_returns_false(
    between: DynamicExpectancyModel,
) -> None:
    assert not between.withdraw_goal(["at:5,0"])


def test_without_a_goal_every_action_is_tried(make_model: MakeModel) -> None:
    model = make_model()
    model.sense(A)
    choices = [model.choose() for _ in range(400)]
    assert {(choice.goal, choice.sign, choice.cost_to_go) for choice in choices} == {
        (None, None, None)
    }
    counts = [sum(choice.action == name for choice in choices) for name in "NESW"]
    assert min(counts) > 60


def test_without_an_active_sign_on_the_map_it_explores(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    model = make_model()
    cycle(model, A, "E")
    cycle(model, B, None)
    model.set_goal(B, priority=1.0)
    model.sense(C)
    assert model.choose().goal is None
    assert model.policy_path() == ()
    assert model.policy_map() != ()


def test_the_same_seed_explores_the_same_way(make_model: MakeModel, grid: Grid) -> None:
    def explore(model: DynamicExpectancyModel) -> tuple[Hypothesis, ...]:
        grid.at = (0, 0)
        for _ in range(100):
            model.sense(grid.tokens())
            model.perform(grid.do(model.choose().action))
        return model.hypotheses

    assert explore(make_model(3)) == explore(make_model(3))
    assert explore(make_model(3)) != explore(make_model(4))


def test_of_several_active_signs_the_one_nearest_to_the_goal_decides(
    make_model: MakeModel, cycle: RunCycle
) -> None:
    """`dust` was there once when E led to B; `at:A` has led there twice."""
    model = make_model()
    cycle(model, (*A, "dust"), "E")
    cycle(model, B, "W")
    cycle(model, A, "E")
    cycle(model, B, None)
    model.set_goal(B, priority=1.0)
    model.sense((*A, "dust"))
    choice = model.choose()
    assert choice.sign == A
    assert choice.cost_to_go == pytest.approx(2.66 / 0.75)
