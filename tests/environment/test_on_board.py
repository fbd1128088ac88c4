"""An agent on board: it moves, is refused where the rover may not begin, and reaches its goals."""

from collections.abc import Iterator
from itertools import groupby, pairwise
from typing import Any

import gymnasium
import pytest

from farside.missions.environment.environment import MissionEnv
from farside.missions.environment.happening import Happened

WAIT = 4


def unwrapped(env: gymnasium.Env[Any, Any]) -> MissionEnv:
    assert isinstance(env.unwrapped, MissionEnv)
    return env.unwrapped


def way(env: gymnasium.Env[Any, Any], *places: str) -> Iterator[int]:
    """The moves of a shortest way by these places."""
    mission = unwrapped(env)
    chart = mission.chart
    for start, goal in pairwise(places):
        for move in chart.way(chart.places[start], chart.places[goal]):
            yield mission.action_names.index(move)


def test_who_knows_the_way_reaches_all_goals(make: Any) -> None:
    """Each pays when it is reached, in any order, and with the last one the episode is over."""
    env = make("teach")
    seen, told = env.reset(seed=4)
    assert told["tokens"] == ("at:D", "on_charge")
    began_s, paid, reached = told["time_s"], 0.0, []
    for action in way(env, "D", "A", "C", "B"):
        seen, reward, terminated, truncated, told = env.step(action)
        assert (told["action"], told["blocked"]) == (env.unwrapped.action_names[action], False)
        paid += reward
        reached += told["reached"]
    assert reached == ["A", "C", "B"]
    assert (terminated, truncated, seen["goals"].tolist()) == (True, False, [0, 0, 0])
    assert env.unwrapped.places[seen["place"]] == "B"
    assert paid == pytest.approx(300 - (told["time_s"] - began_s))
    with pytest.raises(RuntimeError, match="expected an episode under way, found none"):
        env.unwrapped.step(0)


def test_a_move_into_a_wall_takes_its_time(make: Any) -> None:
    env = make("teach", reward=lambda happened: -happened.seconds * happened.blocked)
    before, _ = env.reset()
    seen, reward, _, _, told = env.step(3)
    assert (told["action"], told["blocked"], told["refused"]) == ("W", True, "")
    assert (seen["place"] == before["place"], reward < -0.5) == (True, True)


def test_in_silence_the_rover_holds_and_then_goes_on_alone(make: Any) -> None:
    """What it may not begin is refused with the failsafe's reason, and not begun later either."""
    blackout = {"link.blackouts": [{"start_s": 8.0, "end_s": 500.0}]}
    env = make("teach", overrides={**blackout, "rover.failsafe.lost_after_s": 20.0})
    env.reset()
    told = [env.step(0)[4] for _ in range(2)]
    while told[-1]["failsafe"] != "alone":
        told.append(env.step(1)[4])
    told += [env.step(action)[4] for action in (1, 2)]

    states = [(one["failsafe"], one["refused"], one["action"]) for one in told]
    assert [key for key, _ in groupby(states)] == [
        ("nominal", "", "N"),
        ("nominal", "", "E"),
        ("hold", "", "E"),  # it ends the move under way
        ("hold", "nothing is heard", ""),
        ("alone", "", "E"),
        ("alone", "", "S"),
    ]


def test_a_refused_move_takes_a_second_and_is_taken_back(make: Any) -> None:
    """While the rover does not know where it is."""
    fault = {"what": "position-sensor", "start_s": 5.0, "end_s": 12.0}
    env = make("teach", overrides={"rover.faults": [fault]})
    env.reset()
    seen, _, _, _, told = env.step(0)
    while not told["refused"]:
        seen, _, _, _, told = env.step(WAIT)
        seen, reward, _, _, told = env.step(0)
    assert told["refused"] == "the rover does not know where it is"
    assert (seen["place"], told["action"], told["tokens"]) == (38, "", ())
    assert reward == pytest.approx(-1.2)
    while seen["place"] == 38:
        seen, _, _, _, told = env.step(WAIT)
        assert told["action"] == ""
    assert env.step(2)[4]["refused"] == ""


def test_at_the_dock_it_stands_until_it_is_charged(make: Any) -> None:
    low = {"capacity_j": 20_000.0, "initial": 0.31, "low": 0.3, "charged": 0.35, "charge_w": 100.0}
    env = make("teach", overrides={"rover.battery": low})
    env.reset()
    *_, told = env.step(0)
    while not {"on_charge", "battery:low"} <= set(told["tokens"]):
        *_, told = env.step(2 if "on_charge" not in told["tokens"] else 0)
    assert env.step(0)[4]["refused"] == "the rover stands at the dock until it is charged"
    while "battery:low" in told["tokens"]:
        *_, told = env.step(WAIT)
    assert env.step(0)[4]["action"] == "N"


def test_a_flat_battery_ends_the_episode_and_costs_all_the_time_left(make: Any) -> None:
    happened: list[Happened] = []

    def reward(one: Happened) -> float:
        happened.append(one)
        return one.energy_j

    empty = {"rover.battery": {"capacity_j": 600.0, "initial": 1.0, "charge_w": 0.0, "low": 0.0}}
    for settings in ({}, {"reward": reward}):
        env = make("teach", overrides={**empty, "rover.battery.charged": 0.0}, **settings)
        seen, told = env.reset()
        began_s, charge, paid, terminated = told["time_s"], float(seen["battery"][0]), 0.0, False
        while not terminated:
            seen, worth, terminated, _, told = env.step(0)
            paid += worth
        assert (seen["battery"][0], told["refused"]) == (0.0, "")
        assert paid == pytest.approx(600 * charge if settings else began_s - 600.0, abs=0.01)
    assert [one.lost for one in happened] == [False] * (len(happened) - 1) + [True]


def test_the_end_of_the_mission_truncates(make: Any) -> None:
    env = make("teach", overrides={"duration_s": 20.0, "link.blackouts": []}, period_s=7.0)
    env.reset()
    ends = [env.step(WAIT)[2:5] for _ in range(3)]
    assert [(truncated, told["time_s"] == 20.0) for _, truncated, told in ends] == [
        (False, False),
        (False, False),
        (True, True),
    ]
    assert not any(terminated for terminated, _, _ in ends)


@pytest.mark.parametrize("deep", [1, 3])
def test_a_way_of_the_rovers_own_comes_first(make: Any, deep: int) -> None:
    """Out of sight of Earth with the link lost, it goes back by its track, whatever the agent says.

    Its moves are told as they are; the agent's are refused, and not begun afterwards.
    """
    hidden = {
        "world.map": "########\n#D.~~~G#\n########",
        "expect": [{"what": "reached", "place": "G"}],
        "rover.goals": [],
        "rover.failsafe": {
            "hold_after_s": 5.0,
            "lost_after_s": 8.0,
            "return_to": "track",
            "return_priority": 50.0,
        },
    }
    env = make("shadow", overrides=hidden)
    env.reset()
    for _ in range(1 + deep):
        *_, told = env.step(1)
    assert told["tokens"] == (f"at:{2 + deep},1",)
    moves = []
    while "link:up" not in told["tokens"]:
        *_, told = env.step(1 if told["failsafe"] != "nominal" else WAIT)
        if told["action"]:
            moves.append((told["action"], told["refused"]))
    assert moves == [("W", "the rover is on a way of its own")] * deep
    assert env.step(WAIT)[4]["action"] == ""
