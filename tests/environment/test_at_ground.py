"""An agent at the ground: it drives over the link, and knows what has come down by then."""

from typing import Any

import pytest

WAIT = 4
CLEAR = {"link.blackouts": [], "duration_s": 300.0}


def told_of(env: Any, *actions: int) -> list[dict[str, Any]]:
    return [env.step(action)[4] for action in actions]


def test_a_move_is_a_command_and_word_of_it_comes_a_round_trip_later(make: Any) -> None:
    """A second way, 2.56 s for both; the move takes some three, and the agent sees it under way."""
    env = make("teach", seat="ground", overrides=CLEAR, period_s=1.0)
    seen, told = env.reset()
    assert (env.unwrapped.places[seen["place"]], seen["link"]) == ("D", 1)
    assert 1.28 <= seen["age_s"][0] <= 2.0
    given_s = told["time_s"]
    waiting = []
    seen, *_, told = env.step(0)
    while not told["ended"]:
        waiting.append(seen["outstanding"].tolist())
        assert told["outstanding"] == ("N",)
        seen, *_, told = env.step(WAIT)
    assert waiting == [[1, 0, 0, 0, 0, 0, 0, 0]] * len(waiting)
    assert told["ended"] == (("N", "done", ""),)
    assert 2.56 + 2.0 < told["time_s"] - given_s < 2.56 + 6.0
    assert env.unwrapped.places[env.step(WAIT)[0]["place"]] == "5,4"


def test_who_knows_the_way_reaches_the_goal_when_word_of_it_comes(make: Any) -> None:
    """Seven moves in a row: the episode is over, and the goal paid, when the ground hears it."""
    env = make("teach", seat="ground", goals=["B"], overrides=CLEAR, period_s=2.0)
    chart = env.unwrapped.chart
    moves = chart.way(chart.places["D"], chart.places["B"])
    env.reset()
    for move in moves:
        _, reward, terminated, _, told = env.step(env.unwrapped.action_names.index(move))
        assert (reward, terminated) == (-2.0, False)
    while not terminated:
        seen, reward, terminated, truncated, told = env.step(WAIT)
        assert not truncated
    assert (reward, told["reached"], seen["goals"].tolist()) == (98.0, ("B",), [0])


def test_after_a_bump_what_was_to_follow_is_refused_with_the_reason(make: Any) -> None:
    env = make("teach", seat="ground", overrides=CLEAR, period_s=1.0)
    env.reset()
    told = told_of(env, 3, 0, *[WAIT] * 9)
    ended = [end for one in told for end in one["ended"]]
    assert ended == [
        ("W", "failed", "its move was blocked, or given up"),
        ("N", "refused", "it was meant to follow on command 4, which was not done"),
    ]


def test_no_more_is_sent_than_can_be_followed(make: Any) -> None:
    """The ninth move stays at the ground, and says so; a blackout keeps word of the others away."""
    env = make("teach", seat="ground", overrides={"link.blackouts": [{"start_s": 3, "end_s": 90}]})
    env.reset()
    told = told_of(env, *[0] * 9)
    assert [one["refused"] for one in told] == [""] * 8 + [
        "8 moves are on their way, and none is known to be over"
    ]
    assert told[-1]["outstanding"] == ("N",) * 8


def test_in_a_blackout_what_is_known_grows_old_and_commands_come_to_nothing(make: Any) -> None:
    """What was ordered in the silence came too late, and that is told when the link is back."""
    blackout = {"link.blackouts": [{"start_s": 6.0, "end_s": 70.0}], "duration_s": 200.0}
    env = make("teach", seat="ground", overrides=blackout, period_s=10.0)
    env.reset()
    env.step(WAIT)
    env.step(0)
    ages, links = [], []
    for _ in range(4):
        seen, *_, told = env.step(WAIT)
        ages.append(float(seen["age_s"][0]))
        links.append(int(seen["link"]))
    assert ages == sorted(ages)
    assert ages[-1] > 40
    assert links[-1] == 0
    while not told["ended"]:
        seen, *_, told = env.step(WAIT)
    assert told["ended"] == (("N", "expired", "it came too late"),)
    assert seen["link"] == 1


def test_a_flat_battery_is_known_when_it_is_heard(make: Any) -> None:
    empty = {"capacity_j": 300.0, "charge_w": 0.0, "low": 0.0, "charged": 0.0}
    env = make("teach", seat="ground", overrides={**CLEAR, "rover.battery": empty}, period_s=5.0)
    env.reset()
    terminated, paid, steps = False, 0.0, 0
    while not terminated:
        seen, reward, terminated, *_ = env.step(0 if steps == 0 else WAIT)
        paid, steps = paid + reward, steps + 1
    assert seen["battery"][0] == 0
    assert paid == pytest.approx(-300.0, abs=10.0)
