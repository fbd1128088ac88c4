"""What gymnasium asks of an environment, by its own checkers, and what it offers for one."""

import threading
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st

from farside.gymnasium import MISSIONS
from farside.missions.loading import shipped_missions

SEATS = ("rover", "ground")


@pytest.mark.parametrize("seat", SEATS)
@pytest.mark.parametrize("name", ["blackout", "shadow", "teach", "tether"])
def test_gymnasium_finds_nothing_to_say_against_them(make: Any, name: str, seat: str) -> None:
    """A warning would be an error here."""
    check_env(make(name, seat=seat, render_mode="rgb_array").unwrapped)


def test_every_shipped_mission_is_one_and_so_is_any_file(tmp_path: Path) -> None:
    assert sorted(MISSIONS) == sorted(shipped_missions())
    for name in MISSIONS:
        assert gymnasium.spec(f"farside/{name}-v0").kwargs == {"mission": name}
    mine = tmp_path / "mine.toml"
    mine.write_text(shipped_missions()["teach"].read_text(encoding="utf-8"))

    env: Any = gymnasium.make("farside.gymnasium:farside/mission-v0", mission=mine)

    assert env.spec.id == "farside/mission-v0"
    assert env.unwrapped.goals == ("B", "C", "A")
    assert env.unwrapped.action_names == ("N", "E", "S", "W", "wait")
    assert len(env.unwrapped.places) == 38


@pytest.mark.parametrize("seat", SEATS)
def test_several_fly_side_by_side(seat: str) -> None:
    """Each is the run that it would be alone; one that is over begins anew."""
    settings: dict[str, Any] = {
        "seat": seat,
        "overrides": {"tick_s": 0.2, "duration_s": 12.0, "link.blackouts": []},
    }
    many: Any = gymnasium.make_vec(
        "farside/teach-v0", num_envs=2, vectorization_mode="sync", **settings
    )
    alone = gymnasium.make("farside/teach-v0", **settings)
    seen, _ = many.reset(seed=[3, 4])
    first, _ = alone.reset(seed=4)
    assert {key: value[1].tolist() for key, value in seen.items()} == {
        key: np.asarray(value).tolist() for key, value in first.items()
    }
    ends = 0
    for _ in range(8):
        seen, _, _, truncated, _ = many.step(np.array([4, 0]))
        ends += int(truncated.sum())
    assert ends
    many.close()


@pytest.mark.parametrize("seat", SEATS)
@settings(max_examples=5)
@given(st.integers(0, 2**40), st.lists(st.integers(0, 4), min_size=1, max_size=5))
def test_the_same_seed_and_actions_give_the_same_episode(
    seat: str, seed: int, actions: list[int]
) -> None:
    """All that is seen, told and paid, whatever was done with the environment before."""
    env = gymnasium.make("farside/shadow-v0", seat=seat, overrides={"tick_s": 0.2})

    def episode() -> list[str]:
        told = [repr(env.reset(seed=seed))]
        return told + [repr(env.step(action)) for action in actions]

    assert episode() == episode()


def test_without_a_seed_runs_differ_and_can_be_had_again(make: Any) -> None:
    """The first has the mission's own seed; those after it are drawn from the last one given."""
    env = make("teach")

    def seeds(*given: int | None) -> list[int]:
        return [env.reset(seed=seed)[1]["seed"] for seed in given]

    own, second, third = seeds(None, None, None)
    assert own == 1
    assert seeds(1, None, None) == [1, second, third]
    assert seeds(2, None)[1] not in {second, third}

    def run(seed: int) -> str:
        return repr([env.reset(seed=seed), env.step(0), env.step(0), env.step(1)])

    assert run(second) == run(second) != run(third)


def test_nothing_is_left_behind(make: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No thread, no file, and closing again is harmless."""
    monkeypatch.chdir(tmp_path)
    before = threading.enumerate()
    env = make("teach", seat="ground")
    env.reset()
    env.step(0)
    env.close()
    env.unwrapped.close()
    assert threading.enumerate() == before
    assert list(tmp_path.iterdir()) == []


def test_the_yard_is_drawn_as_text_and_as_a_picture(make: Any) -> None:
    """The rover at the dock, a goal without a letter, and walls."""
    env = make("teach", goals=["1,4", "B"], render_mode="ansi")
    env.reset()
    assert env.render().splitlines() == [
        "###########",
        "#A..#....B#",
        "#.#.#.##..#",
        "#*#...#.#.#",
        "#...#@..#.#",
        "#.#.##.##.#",
        "#C..o.....#",
        "###########",
    ]
    env = make("teach", goals=["B"], render_mode="rgb_array")
    env.reset()
    picture = env.render()
    assert picture.shape == (8 * 16, 11 * 16, 3)
    wall, goal, rover = (
        tuple(picture[north * 16 + 8, east * 16 + 8].tolist())
        for east, north in ((0, 0), (9, 1), (5, 4))
    )
    dock = tuple(picture[4 * 16, 5 * 16].tolist())
    assert len({wall, goal, rover, dock}) == 4
