"""Missions made to do harm, or by mistake: refused in words, in little time and memory."""

import os
from pathlib import Path
from typing import Any

import pytest

from farside.files import MAX_FILE_BYTE
from farside.missions.loading import MissionError, load_mission
from farside.validation import MAX_PROBLEMS

HEAD = 'name = "big"\nduration_s = 60\nrover.start = "1,1"\nground.heartbeat_s = 2\n'
LINK = "link.up.delay_s = 1\nlink.down.delay_s = 1\n"


def yard(size: int) -> str:
    """A mission in an empty yard of `size` by `size` cells."""
    rows = ["#" * size, *["#" + "." * (size - 2) + "#"] * (size - 2), "#" * size]
    return HEAD + LINK + "world.map = '''\n" + "\n".join(rows) + "\n'''\n"


def refusal(path: Path, overrides: Any = ()) -> str:
    """Why the mission at `path` is refused, without the path."""
    with pytest.raises(MissionError) as refused:
        load_mission(path, overrides)
    return str(refused.value).replace(f"{path}: ", "")


def test_a_large_map_with_thousands_of_named_places_is_read(tmp_path: Path) -> None:
    places = [f"{east},{north}" for east in range(1, 95) for north in range(1, 95)]
    path = tmp_path / "big.toml"
    path.write_text(f'{yard(300)}[[ground.script]]\ndo = "tour"\nplaces = {places}\n')

    assert len(load_mission(path).mission.world.chart().cells) == 298 * 298


def test_thousands_of_mistakes_are_told_up_to_a_limit(tmp_path: Path) -> None:
    path = tmp_path / "big.toml"
    path.write_text(f'{yard(300)}[[ground.script]]\ndo = "tour"\nplaces = {["888,0"] * 9000}\n')

    lines = refusal(path).splitlines()
    assert len(lines) == MAX_PROBLEMS + 1
    assert lines[0].endswith('found "888,0"; did you mean 298,1?')
    assert lines[-1] == f"no more than the first {MAX_PROBLEMS} problems are told"


@pytest.mark.parametrize(
    ("key", "value", "problem"),
    [
        ("world.map", ("#" * 1000 + "\n") * 251, "at most 250000 cells, found 251000"),
        ("link.blackouts", [{"start_s": 0, "end_s": 1}] * 10_001, "at most 10000 entries, found"),
        ("duration_s", 1e9, "expected at most 4e+07 s in ticks of 0.04 s, found 1e+09"),
        ("duration_s", 1e308, "expected a number > 0 and <= 1e+09, found 1e+308"),
        ("duration_s", float("nan"), "expected a number > 0 and <= 1e+09, found nan"),
        ("duration_s", 10**4000, "expected a number > 0 and <= 1e+09, found a whole number of"),
        ("name", "a" * 300, "{0,63}"),
        ("name", "a\x1b[2Jb", r'found "a\u001b[2Jb"'),
        ("world.map", "####\n#\x1b.#\n####", r'map row 2 has "\u001b"'),
        ("world.cell_m", 1e-9, "expected a number >= 0.01 and <= 1000, found 1e-09"),
        ("rover.body.radius_m", 1e-300, "expected a number >= 0.01 and <= 1000, found 1e-300"),
        ("rover.body.mass_kg", 1e300, "expected a number >= 0.001 and <= 1e+06, found 1e+300"),
        ("rover.dem.reach", 10**9, "expected a whole number >= 1 and <= 1000"),
        (".".join("a" * 50_000), 1, "expected a key of at most 32 parts, found 50000"),
    ],
)
def test_what_is_beyond_a_limit_is_refused(
    tmp_path: Path, key: str, value: object, problem: str
) -> None:
    path = tmp_path / "big.toml"
    path.write_text(yard(5))
    assert problem in refusal(path, {key: value})


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a." * 50_000 + "a = 1", "expected TOML, found: a key of more than 32 parts (at line 1)"),
        ("\n[" + '"a".' * 50 + "a]", "a key of more than 32 parts (at line 2)"),
        ("a = {" + "'x' . " * 50_000 + "b=1}", "a key of more than 32 parts (at line 1)"),
        ("x = " + "[" * 100_000, "expected TOML, found: values nested too deeply"),
        ("x = " + "9" * 100_000, "expected TOML, found: Exceeds the limit"),
        ("#" * MAX_FILE_BYTE + "#", "expected a file of at most 4194304 bytes, found a longer one"),
    ],
)
def test_a_file_that_would_take_long_to_read_is_refused(
    tmp_path: Path, text: str, problem: str
) -> None:
    path = tmp_path / "bomb.toml"
    path.write_text(text)
    assert problem in refusal(path)


def test_a_row_of_rocks_and_places_is_not_taken_for_a_long_key(tmp_path: Path) -> None:
    path = tmp_path / "rocks.toml"
    path.write_text(yard(203).replace("#" + "." * 201 + "#", "#." + "o." * 100 + "#", 1))
    assert load_mission(path).mission.world.chart().rocks


def test_values_nested_too_deeply_in_python_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "deep.toml"
    path.write_text(yard(5))
    deep: list[Any] = []
    for _ in range(5000):
        deep = [deep]
    assert "link set from Python: expected values that are not nested" in refusal(
        path, {"link": deep}
    )


def test_only_a_regular_file_is_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    assert refusal(tmp_path / "pipe") == "expected a regular file, found a pipe"
    assert refusal(tmp_path) == "expected a regular file, found a folder"
    assert refusal(Path("/dev/zero")) == "expected a regular file, found a device"
    assert "File name too long" in refusal(tmp_path / ("n" * 300))
