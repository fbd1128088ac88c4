"""What is wrong with an environment is said where it is made: what was expected, what was found."""

from pathlib import Path
from typing import Any

import pytest

from farside.logs import LogError
from farside.missions import MissionError
from farside.missions.environment.environment import MissionEnv

MOVES = "expected an action, 0 N, 1 E, 2 S, 3 W, 4 wait, found"


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (
            {"seat": "grund"},
            'seat: expected rover or ground, found "grund"; did you mean ground?',
        ),
        ({"goals": []}, "goals: expected one place at least"),
        (
            {"goals": ["D"]},
            'goals: expected places that can be reached from the start, D, found "D"',
        ),
        ({"goals": ["5,44"]}, 'from the start, D, found "5,44"; did you mean'),
        ({"period_s": 0.0}, "period_s: expected a time above 0, found 0.0"),
        ({"period_s": float("nan")}, "period_s: expected a time above 0, found nan"),
        (
            {"overrides": {"rover.controller": "dem"}},
            "overrides: expected none of what the seat sets (rover.controller, ",
        ),
        ({"overrides": {"ground.script": []}}, 'ground.script), found "ground.script"'),
    ],
)
def test_what_is_wrong_is_said(make: Any, settings: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError) as refused:  # noqa: PT011 - compared below
        make("teach", **settings)
    assert said in str(refused.value)


def test_a_mission_that_is_none(make: Any) -> None:
    with pytest.raises(
        MissionError, match=r"nowhere\.toml: expected a mission file or the name of"
    ):
        make("mission", mission="nowhere.toml")
    with pytest.raises(MissionError, match="duration_s: expected a number > 0"):
        make("teach", overrides={"duration_s": -1})
    with pytest.raises(TypeError, match="mission"):
        make("mission")


def test_a_way_to_draw_that_there_is_not() -> None:
    with pytest.raises(ValueError, match='expected "ansi" or "rgb_array", found "humans"'):
        MissionEnv("teach", render_mode="humans")


def test_what_cannot_be_done_in_an_episode(make: Any) -> None:
    env = make("teach", render_mode="ansi").unwrapped
    over = "expected an episode under way, found none: call reset"
    with pytest.raises(RuntimeError, match=over):
        env.step(0)
    with pytest.raises(RuntimeError, match="expected an episode, found none: call reset"):
        env.render()
    env.reset()
    for action in (5, -1, "N", 0.5):
        with pytest.raises(ValueError, match=MOVES):
            env.step(action)
    with pytest.raises(ValueError, match="options: expected none, found start"):
        env.reset(options={"start": "A"})
    env.close()
    with pytest.raises(RuntimeError, match=over):
        env.step(0)


@pytest.mark.parametrize("seat", ["rover", "ground"])
def test_a_link_that_never_opens_leaves_nothing_to_decide(make: Any, seat: str) -> None:
    silent = {"duration_s": 20.0, "link.blackouts": [{"start_s": 0.0, "end_s": 20.0}]}
    env = make("teach", seat=seat, overrides=silent)
    with pytest.raises(
        RuntimeError, match="to come to a first decision, found none in all its 20 s"
    ):
        env.reset()


def test_a_log_that_cannot_be_written(make: Any, tmp_path: Path) -> None:
    (tmp_path / "taken").touch()
    with pytest.raises(LogError, match="expected a folder for logs"):
        make("teach", logs=tmp_path / "taken").reset()
