"""Loading missions, and the errors that say what to correct."""

import json
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.dem import Exploration
from farside.link.profile.config import Affected, Blackout
from farside.missions.loading import LoadedMission, MissionError, load_mission
from farside.missions.schema import MissionFile
from farside.rover.config import DemConfig

# Two ways lead to A, east of the dock D; B is walled off in the north-east.
GOOD = '''\
# A small yard.
name = "yard"
duration_s = 600
seed = 7

[world]
map = """
#######
#D..#B#
#.o.###
#..A..#
#######
"""

[rover]
start = "D"
goals = [{ place = "A" }]

[link.up]
delay_s = 1.28
rate_bit_s = 2_000
loss = 0.01

[link.down]
delay_s = 1.28

[[link.blackouts]]
start_s = 100
end_s = 200

[[ground.script]]
do = "tour"
places = ["3,3", "5,1"]

[[ground.script]]
do = "mode"
mode = "shared"

[[ground.script]]
do = "goal"
place = "A"
overrides = [{ proposal = 2, action = "S" }]

[[expect]]
what = "reached"
place = "A"
'''


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def load(text: str, *assignments: str, seed: int | None = None) -> MissionFile:
    """The mission in `text`, from a file called yard.toml."""
    Path("yard.toml").write_text(text, encoding="utf-8")
    return load_mission("yard.toml", assignments, seed).mission


def refusal(text: str, *assignments: str, seed: int | None = None) -> list[str]:
    """The lines of the message that refuses `text`."""
    with pytest.raises(MissionError) as refused:
        load(text, *assignments, seed=seed)
    return str(refused.value).splitlines()


# --- the source of a mission ------------------------------------------------------------------


def test_a_mission_comes_with_the_exact_text_of_its_file() -> None:
    text = GOOD.replace("\n", "\r\n")
    Path("yard.toml").write_bytes(text.encode())

    loaded = load_mission(Path("yard.toml"), seed=9)

    assert loaded == LoadedMission(loaded.mission, text, "yard.toml", overrides=(("seed", 9),))
    assert (loaded.mission.name, loaded.mission.seed) == ("yard", 9)


def test_a_shipped_mission_is_loaded_by_name_from_any_folder() -> None:
    assert load_mission("blackout").mission.name == "blackout"


def test_a_file_takes_precedence_over_the_shipped_mission_of_that_name() -> None:
    Path("blackout").write_text(GOOD)
    assert load_mission("blackout").mission.name == "yard"


def test_a_folder_does_not_hide_the_shipped_mission_of_that_name() -> None:
    Path("blackout").mkdir()
    assert load_mission("blackout").mission.name == "blackout"


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        (
            "missions/blakout.toml",
            (
                "missions/blakout.toml: expected a mission file or the name of a shipped mission "
                "(SHIPPED), found neither; did you mean blackout?"
            ),
        ),
        (
            "zzz",
            (
                "zzz: expected a mission file or the name of a shipped mission (SHIPPED), "
                "found neither"
            ),
        ),
        (".", ".: expected a regular file, found a folder"),
        ("x" * 300, "x" * 300 + ": expected a mission file, found: File name too long"),
    ],
)
def test_a_source_that_is_not_a_file_is_refused(source: str, expected: str) -> None:
    names = (file.name for file in resources.files("farside.missions").iterdir())
    shipped = ", ".join(sorted(n.removesuffix(".toml") for n in names if n.endswith(".toml")))

    with pytest.raises(MissionError) as refused:
        load_mission(source)

    assert str(refused.value) == expected.replace("SHIPPED", shipped)


def test_bytes_that_are_not_utf_8_are_refused_with_their_line() -> None:
    Path("yard.toml").write_bytes(b'name = "yard"\nabout = "\xff"\n')

    with pytest.raises(MissionError) as refused:
        load_mission("yard.toml")

    assert str(refused.value) == "yard.toml: expected text in UTF-8, found byte 0xff in line 2"


def test_toml_nested_too_deeply_is_refused() -> None:
    [line] = refusal("name = " + "[" * 10_000)
    assert line.startswith("yard.toml: expected TOML, found: ")


# --- invalid missions ---------------------------------------------------------------------------


GALLERY = dict(
    case.split("\n", 1)
    for case in (Path(__file__).parent / "refusals.txt").read_text().split("\n\n# ")[1:]
)


@pytest.mark.parametrize("case", GALLERY.values(), ids=list(GALLERY))
def test_an_invalid_mission_is_refused_in_these_words(case: str) -> None:
    lines = case.splitlines()

    def after(start: str) -> list[str]:
        return [line.removeprefix(start) for line in lines if line.startswith(start)]

    removed, added, assignments = "\n".join(after("- ")), "\n".join(after("+ ")), after("--set ")
    message = lines[len(after("- ") + after("+ ") + assignments) :]
    assert removed in GOOD
    assert refusal(GOOD.replace(removed, added, 1), *assignments) == message


# --- assignments ----------------------------------------------------------------------------------


def test_an_assignment_replaces_a_value_of_the_file() -> None:
    mission = load(
        GOOD,
        "link.up.loss=0.2",
        "link.blackouts=[{start_s=10, end_s=20, direction='up'}, {start_s=30, end_s=40}]",
        "link.blackouts.1.end_s = 50",
        "rover.start=3,3",
        "rover.body.mass_kg=50",
        'ground.script.0.places=["A"]',
        "name=other",
        "about=",
    )

    assert mission.link.up.loss == 0.2
    assert mission.link.blackouts == (
        Blackout(start_s=10, end_s=20, direction=Affected.UP),
        Blackout(start_s=30, end_s=50),
    )
    assert (mission.rover.start, mission.rover.body.mass_kg) == ("3,3", 50)
    assert mission.ground.script[0] == msgspec.structs.replace(
        load(GOOD).ground.script[0], places=("A",)
    )
    assert (mission.name, mission.about) == ("other", "")


def test_the_model_on_board_takes_all_its_parameters_from_the_mission() -> None:
    mission = load(
        GOOD, "rover.dem.own_credit=false", "rover.dem.maturity=8", "rover.dem.exploration=curious"
    )

    curious = DemConfig(own_credit=False, maturity=8, exploration=Exploration.CURIOUS)
    assert mission.rover.dem == curious
    assert load(GOOD).rover.dem == DemConfig()
    assert DemConfig() == DemConfig(exploration=Exploration.NONE), "unlike the library"


def test_the_last_assignment_to_a_key_wins() -> None:
    assert load(GOOD, "seed=1", "seed=2").seed == 2
    assert load(GOOD, "seed=1", seed=3).seed == 3


def test_assignments_from_python_do_the_same_as_those_from_text() -> None:
    Path("yard.toml").write_text(GOOD)
    blackouts = ({"start_s": 10, "end_s": 20, "direction": Affected.UP},)
    changes = {"link.up.loss": 0.2, "link.up.rate_bit_s": None, "link.blackouts": blackouts}
    changes["link.blackouts.0.start_s"] = 15

    mission = load_mission("yard.toml", changes).mission

    assert (mission.link.up.loss, mission.link.up.rate_bit_s) == (0.2, None)
    assert mission.link.blackouts == (Blackout(start_s=15, end_s=20, direction=Affected.UP),)
    assert blackouts[0]["start_s"] == 10


def test_an_error_names_the_assignment_from_python() -> None:
    Path("yard.toml").write_text(GOOD)

    with pytest.raises(MissionError) as refused:
        load_mission("yard.toml", {"link.up.loss": 2})

    assert str(refused.value) == (
        "yard.toml: link.up.loss: expected a number >= 0 and <= 1, found 2 "
        "(with link.up.loss set from Python)"
    )


def test_an_error_names_the_seed_option() -> None:
    assert refusal(GOOD, seed=-1) == [
        "yard.toml: seed: expected a whole number >= 0, found -1 (with --seed -1)"
    ]


def test_an_override_cannot_smuggle_in_a_second_key() -> None:
    assert load(GOOD, 'about="a"\nb = 1').about == '"a"\nb = 1'


# --- whatever comes -------------------------------------------------------------------------------


def as_toml(value: object) -> str:
    """`value` written in TOML, on one line."""
    match value:
        case dict():
            pairs = (f"{as_toml(key)} = {as_toml(entry)}" for key, entry in value.items())
            return "{" + ", ".join(pairs) + "}"
        case list():
            return "[" + ", ".join(map(as_toml, value)) + "]"
        case str():
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case _:
            return str(value).lower()


def slots(data: object) -> list[tuple[Any, Any]]:
    """Every value in `data`, as its container and its key or index there."""
    if isinstance(data, dict):
        pairs = list(data.items())
    elif isinstance(data, list):
        pairs = list(enumerate(data))
    else:
        return []
    return [slot for key, entry in pairs for slot in [(data, key), *slots(entry)]]


def outcome(text: str, *assignments: str) -> MissionFile | list[str]:
    """The mission in `text`, or the lines that refuse it."""
    try:
        return load(text, *assignments)
    except MissionError as refused:
        return str(refused).splitlines()


def sound(outcome: MissionFile | list[str]) -> bool:
    """Whether a mission satisfies the schema, or every line of a refusal names the file."""
    if isinstance(outcome, list):
        return all(line.startswith("yard.toml: ") for line in outcome)
    return msgspec.convert(msgspec.to_builtins(outcome), MissionFile) == outcome


WORDS = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
VALUES = st.recursive(
    st.booleans() | st.integers() | st.floats() | WORDS | st.sampled_from(["A", "B", "5,1"]),
    lambda inner: st.lists(inner, max_size=2) | st.dictionaries(WORDS, inner, max_size=2),
    max_leaves=4,
)


@given(st.data())
def test_a_mutated_mission_is_loaded_or_refused_key_by_key(data: st.DataObject) -> None:
    mutated = tomllib.loads(GOOD)
    for _ in range(data.draw(st.integers(1, 3))):
        container, key = data.draw(st.sampled_from(slots(mutated)))
        match data.draw(st.sampled_from(["delete", "retype", "rename"])):
            case "delete":
                del container[key]
            case "rename" if isinstance(container, dict):
                container[data.draw(WORDS)] = container.pop(key)
            case _:
                container[key] = data.draw(VALUES)
    text = "".join(f"{as_toml(key)} = {as_toml(entry)}\n" for key, entry in mutated.items())

    assert sound(outcome(text))


KEYS = ["seed", "rover.start", "link.blackouts.0.end_s", "ground.script.2.place", "world.map"]


@given(st.sampled_from(KEYS) | st.text(), WORDS | VALUES.map(as_toml))
def test_any_assignment_is_applied_or_refused_key_by_key(key: str, value: str) -> None:
    assert sound(outcome(GOOD, f"{key}={value}"))
