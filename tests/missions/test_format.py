"""The format of mission files: its schema for editors, and the reference in docs/mission.md."""

import json
import re
import runpy
import tomllib
from pathlib import Path

import jsonschema
import msgspec
import pytest

from farside.missions import MissionFile
from farside.missions.format import key_texts, mission_schema
from farside.missions.loading import MissionError, load_mission, shipped_missions

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs/mission.md"
ROW = re.compile(r"^\| `(\w+)` \| .+ \|  ?[^|]*\| ([^|]+) \| (.+) \|$", re.MULTILINE)


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft7Validator:
    return jsonschema.Draft7Validator(mission_schema())


def tables(kind: type[msgspec.Struct] = MissionFile) -> dict[type[msgspec.Struct], None]:
    """Every table that a mission file may have."""
    found: dict[type[msgspec.Struct], None] = {kind: None}
    for field in msgspec.structs.fields(kind):
        pending = [field.type]
        while pending:
            inner = pending.pop()
            if isinstance(inner, type) and issubclass(inner, msgspec.Struct):
                found |= tables(inner)
            pending += getattr(inner, "__args__", ())
    return found


def sections() -> list[dict[str, tuple[str, str]]]:
    """The keys, with their defaults and meanings, of each section of the reference."""
    reference = PAGE.read_text().partition("## Every table and key")[2]
    return [
        {key: (default, meaning) for key, default, meaning in ROW.findall(section)}
        for section in re.split(r"^### ", reference, flags=re.MULTILINE)[1:]
    ]


def test_the_schema_is_one(validator: jsonschema.Draft7Validator) -> None:
    validator.check_schema(validator.schema)


@pytest.mark.parametrize("name", shipped_missions())
def test_missions_that_ship_are_good_by_the_schema(
    validator: jsonschema.Draft7Validator, name: str
) -> None:
    validator.validate(tomllib.loads(shipped_missions()[name].read_text()))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("world.cell_m", 0),
        ("rover.dem.alpha", 1.5),
        ("rover.stat", "D"),
        ("link.up.drop", "some"),
        ("link.up.loss", {"model": "gilbert-elliott", "p": 2, "r": 0.1}),
        ("ground.script", [{"do": "dance"}]),
        ("expect", [{"what": "reached"}]),
        ("rover.controller_options", {"deep": {"er": 1}}),
        ("ground.operator_options", {"two words": 1}),
        ("name", "My Mission"),
        ("seed", -1),
    ],
)
def test_what_the_loader_refuses_the_schema_marks(
    validator: jsonschema.Draft7Validator, key: str, value: object
) -> None:
    with pytest.raises(MissionError):
        load_mission("blackout", {key: value})
    mission = tomllib.loads(shipped_missions()["blackout"].read_text())
    *way, last = key.split(".")
    table = mission
    for part in way:
        table = table.setdefault(part, {})
    table[last] = value
    assert not validator.is_valid(mission)


@pytest.mark.parametrize("table", tables(), ids=lambda table: table.__name__)
def test_every_key_says_what_it_means(table: type[msgspec.Struct]) -> None:
    assert key_texts(table).keys() == set(table.__struct_fields__)


@pytest.mark.parametrize("table", tables(), ids=lambda table: table.__name__)
def test_every_key_is_in_the_reference_with_the_default_of_the_code(
    table: type[msgspec.Struct],
) -> None:
    fields = {field.encode_name: field for field in msgspec.structs.fields(table)}
    if fields:
        meanings = key_texts(table)
        # An operator that is a single step has a table of the same keys.
        same = [
            section
            for section in sections()
            if {key: meaning for key, (_, meaning) in section.items()} == meanings
        ]
        assert same
        for section in same:
            for key, (told, _) in section.items():
                assert told == quoted(fields[key]), key


def quoted(field: msgspec.structs.FieldInfo) -> str:
    """A default in the words of the reference."""
    match field.default:
        case msgspec.NODEFAULT if field.default_factory is dict:
            return "empty"
        case msgspec.NODEFAULT:
            return "required"
        case None:
            return "none"
        case ():
            return "empty"
        case msgspec.Struct():
            return "its defaults"
        case default:
            return f"`{json.dumps(default)}`"


def test_the_reference_is_up_to_date(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise: `make reference`."""
    monkeypatch.setattr("sys.argv", ["mission.py", str(tmp_path / "mission.md")])
    runpy.run_path(str(ROOT / "docs/mission.py"), run_name="__main__")
    assert (tmp_path / "mission.md").read_text() == PAGE.read_text()
