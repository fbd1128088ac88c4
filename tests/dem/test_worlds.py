"""The model in whole worlds, measured."""

from itertools import pairwise

import pytest
from worlds import aliased_trial, phantom_trial, removal_curve, walk_to

from farside.dem import DynamicExpectancyModel, Exploration, Parameters
from tests.dem.conftest import Grid, MakeModel


@pytest.mark.parametrize("seed", range(2))
def test_place_and_heading_are_joined_where_neither_predicts_alone(seed: int) -> None:
    model, trial = aliased_trial(seed, Parameters())
    assert trial.ratio <= 1.15
    learned = {(h.context, h.action, h.outcome) for h in model.hypotheses if h.cm > 0.9}
    assert (("at:1,1", "heading:N"), "forward", ("at:1,2", "heading:N")) in learned
    assert (("at:1,1", "heading:E"), "forward", ("at:2,1", "heading:E")) in learned


def test_differentiation_alone_joins_them_too() -> None:
    model, trial = aliased_trial(0, Parameters(situations=False))
    assert trial.ratio <= 1.15
    learned = {(h.context, h.action, h.outcome) for h in model.hypotheses if h.cm > 0.9}
    assert (("at:1,1", "heading:N"), "forward", ("at:1,2",)) in learned
    assert (("at:1,1", "heading:E"), "forward", ("at:2,1",)) in learned


def test_without_both_they_stay_apart_and_paths_are_long() -> None:
    model, trial = aliased_trial(0, Parameters(differentiation=False, situations=False))
    assert trial.ratio > 1.15
    assert all(len(sign) == 1 for sign in model.signs)


@pytest.mark.parametrize("seed", range(3))
def test_tokens_sensed_everywhere_do_not_lead_to_phantom_shortcuts(seed: int) -> None:
    _, trial = phantom_trial(seed, Parameters())
    assert trial.ratio <= 1.05


def test_a_path_seen_once_can_be_repeated_among_tokens_that_are_active_everywhere(
    make_model: MakeModel,
) -> None:
    """One trial is enough: no second visit is needed to separate cause from bystanders."""
    everywhere = {"battery:ok", "mode:nominal"}
    model = make_model()
    for place in range(6):
        model.sense({f"at:{place}", *everywhere})
        model.perform("E")
    model.sense({"at:6", *everywhere})
    model.perform(None)
    model.set_goal(["at:6"], priority=1.0)
    for place in range(6):
        model.sense({f"at:{place}", *everywhere})
        choice = model.choose()
        assert (choice.goal, choice.action) == (("at:6",), "E")
        model.perform("E")
    assert model.sense({"at:6", *everywhere}).reached


def test_in_noise_the_lists_level_off_and_goals_are_still_reached() -> None:
    model, world, beside, lengths = removal_curve(Parameters(), cycles=16_000, every=4_000)
    *_, last = (now.hypotheses - then.hypotheses for then, now in pairwise(lengths))
    assert last < lengths[-1].hypotheses / 30
    assert lengths[-1].hypotheses < 2500
    assert lengths[-1].signs < 120
    assert walk_to(model, world, ["at:0,0"], 100, beside) < 60


def test_without_removal_noise_makes_the_lists_longer() -> None:
    *_, kept = removal_curve(Parameters(), cycles=1500, every=1500)
    *_, all_of_them = removal_curve(Parameters(removal=False), cycles=1500, every=1500)
    assert kept[-1].hypotheses < 0.85 * all_of_them[-1].hypotheses
    assert kept[-1].signs < 0.5 * all_of_them[-1].signs


def test_the_last_hypothesis_for_a_goal_is_never_removed(make_model: MakeModel) -> None:
    model = make_model(maturity=2, ineffective=0.3)
    model.sense(["at:A"])
    model.perform("E")
    model.sense(["at:B"])
    model.perform(None)
    model.set_goal(["at:B"], priority=1.0)
    for _ in range(40):
        model.sense(["at:A"])
        model.perform("E")
    kept = [h for h in model.hypotheses if h.outcome == ("at:B",)]
    assert len(kept) == 1
    assert kept[0].cm < 0.3
    model.withdraw_goal(["at:B"])
    model.sense(["at:A"])
    model.perform("E")
    assert not [h for h in model.hypotheses if h.outcome == ("at:B",)]


def test_no_whole_has_a_greater_value_than_its_parts() -> None:
    model, _ = aliased_trial(0, Parameters())
    model.set_goal(["at:2,2"], priority=1.0)
    value = {row.sign: row.value for row in model.policy_map()}
    wholes = [sign for sign in value if len(sign) > 1]
    assert wholes
    for whole in wholes:
        for token in whole:
            assert value[whole] <= value.get((token,), float("inf"))


def test_curiosity_tries_everything_sooner_than_random_exploration(
    make_model: MakeModel, grid: Grid
) -> None:
    def cycles_to_try_all(model: DynamicExpectancyModel) -> int:
        tried, cycles = set[tuple[tuple[int, int], str | None]](), 0
        while len(tried) < 4 * len(grid.places):
            cycles += 1
            model.sense(grid.tokens())
            action = model.choose().action
            tried.add((grid.at, action))
            model.perform(grid.do(action))
        return cycles

    start = grid.at
    curious = cycles_to_try_all(make_model(exploration=Exploration.CURIOUS))
    grid.at = start
    at_random = cycles_to_try_all(make_model())
    assert curious < at_random / 3


def test_curiosity_crosses_known_ground_to_what_was_never_tried(
    make_model: MakeModel, corridor: Grid
) -> None:
    """Everything is known except the far end of a corridor of six places."""
    model = make_model(exploration=Exploration.CURIOUS)
    for action in "EWEEWWEEEWWWEEEEWWWW":
        model.sense(corridor.tokens())
        model.perform(corridor.do(action))
    for _ in range(5):
        for action in "NS":
            model.sense(corridor.tokens())
            model.perform(corridor.do(action))
        model.sense(corridor.tokens())
        model.perform(corridor.do("E"))
    assert corridor.at == (5, 0)
    known = model.hypothesis_count
    for _ in range(4):
        model.sense(corridor.tokens())
        choice = model.choose()
        assert choice.goal is None
        model.perform(corridor.do(choice.action))
    model.sense(corridor.tokens())
    assert model.hypothesis_count > known


def test_curiosity_is_off_by_default() -> None:
    assert Parameters().exploration is Exploration.RANDOM
