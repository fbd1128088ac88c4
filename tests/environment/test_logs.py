"""Logs of episodes are logs of runs: the same seed and actions, the same digest, proved again."""

from itertools import cycle
from pathlib import Path
from typing import Any

import pytest

import farside
from farside.logs import open as open_log
from farside.logs.views.run import RunView
from farside.missions.reliving.rerunning import rerun
from farside.missions.reliving.verifying import verify
from farside.topics import ROVER_ACTION_STARTED


def flown(make: Any, folder: Path, seat: str) -> Path:
    """An episode to the end of a short mission, with moves, bumps and a silence."""
    short = {"duration_s": 40.0, "link.blackouts": [{"start_s": 12.0, "end_s": 30.0}]}
    env = make("shadow", seat=seat, logs=folder, overrides=short)
    env.reset(seed=7)
    truncated = False
    for action in cycle((0, 0, 1, 3, 4, 0, 2, 1, 1, 1, 4, 3, 3)):
        truncated = env.step(action)[3]
        if truncated:
            return Path(env.unwrapped.log)
    raise AssertionError


@pytest.mark.parametrize("seat", ["rover", "ground"])
def test_the_log_of_an_episode_is_proved_as_that_of_any_run(
    make: Any, tmp_path: Path, seat: str
) -> None:
    """What the agent chose is in it, whether as orders of the ground or as moves on board."""
    paths = [flown(make, tmp_path, seat) for _ in range(2)]
    runs = [open_log(path) for path in paths]
    assert [path.name for path in paths] == ["shadow-seed7-1.mcap", "shadow-seed7-2.mcap"]
    assert runs[0].digest == runs[1].digest
    assert runs[0].result.outcome == "failure"
    assert [one.met for one in runs[0].result.expectations] == [False, False, True, True, True]
    verdict = verify(paths[0])
    assert (verdict.equal, verdict.whole, verdict.digest) == (True, True, runs[0].digest)
    assert verdict.records > 300


def test_the_moves_of_an_agent_on_board_are_lived_and_run_again(make: Any, tmp_path: Path) -> None:
    """On the ticks on which they began then; on other ground the same moves are another run."""
    path = flown(make, tmp_path, "rover")
    run = open_log(path)
    then = run.pose_at(20.0)
    lived = farside.relive(path, 20.0).rover.world.pose
    assert (lived.x_m, lived.y_m) == pytest.approx((then.x_m, then.y_m), abs=0.2)

    again = rerun(path, out=tmp_path)
    other = rerun(path, {"rover.body.slip_mean": 0.1}, out=tmp_path)

    assert again.digest == run.digest != other.digest
    assert {action for _, action in moves(run)} == {"N", "E", "S", "W"}
    assert [action for _, action in moves(other)[:2]] == [action for _, action in moves(run)[:2]]


def moves(run: RunView) -> list[tuple[float, str]]:
    return [(t_s, began.action) for t_s, began in run.each(ROVER_ACTION_STARTED)]
