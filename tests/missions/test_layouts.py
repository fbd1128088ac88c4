"""What shows a run in Foxglove, Lichtblick and Rerun names nothing that a log does not hold."""

import json
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import rerun.blueprint as rrb
from rerun.chunk import McapReader

from farside.logs import LogFile
from farside.logs.layouts.foxglove import foxglove_layout
from farside.logs.layouts.rerun import TIMELINE, blueprint, write_blueprint
from farside.missions import load_mission, run_mission

_DRAWN = {"foxglove.Grid", "foxglove.SceneUpdate"}


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> LogFile:
    """A log of a run of a minute. Its topics are those of every log, whatever comes about."""
    short = load_mission("blackout", ["duration_s=60", "expect=[]"])
    return LogFile(run_mission(short, in_process=True, out=tmp_path_factory.mktemp("run")).log)


def _panels(layout: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    for name, config in layout["configById"].items():
        yield name.partition("!")[0], config


def _placed(tree: Any, layout: dict[str, Any]) -> Iterator[str]:
    """The panels that stand somewhere, those in tabs included."""
    if isinstance(tree, str):
        yield tree
        for tab in layout["configById"][tree].get("tabs", ()):
            yield from _placed(tab["layout"], layout)
    else:
        for half in ("first", "second"):
            yield from _placed(tree[half], layout)


def _schemas(log: LogFile) -> dict[str, Any]:
    """The schema of each topic in the log."""
    return {
        channel.topic: log.index.schemas[channel.schema_id]
        for channel in log.index.channels.values()
    }


def _seen(log: LogFile) -> dict[str, set[str]]:
    """What Rerun makes of each topic with messages: its components, and the fields of a message."""
    seen: dict[str, set[str]] = {}
    for chunk in McapReader(log.path).stream():
        names = seen.setdefault(chunk.entity_path, set())
        for column in chunk.to_record_batch().schema:
            names.add(column.name)
            if column.name.endswith(":message"):
                names |= {f".{field.name}" for field in column.type.value_type}
    return seen


@pytest.fixture(scope="module")
def seen(log: LogFile) -> dict[str, set[str]]:
    return _seen(log)


@pytest.mark.parametrize("as_ground", [False, True])
def test_foxglove_finds_every_field_and_topic_of_its_layout_in_a_log(
    log: LogFile, seen: dict[str, set[str]], as_ground: bool
) -> None:
    schemas, kinds = _schemas(log), set()
    for kind, config in _panels(json.loads(foxglove_layout(as_ground=as_ground))):
        kinds.add(kind)
        match kind:
            case "3D":
                drawn = config["topics"]
                assert {schemas[topic].name for topic in drawn} <= _DRAWN
                assert all(settings["visible"] for settings in drawn.values())
                topics = set(drawn)
            case "Plot" | "StateTransitions":
                paths = [path["value"].partition(".") for path in config["paths"]]
                assert all(f".{field}" in seen[topic] for topic, _, field in paths)
                topics = {topic for topic, _, _ in paths}
            case "RosOut":
                topics = {config["topicToRender"]}
                assert {schemas[topic].name for topic in topics} == {"foxglove.Log"}
            case "RawMessages":
                topics = {config["topicPath"]}
            case _:
                topics = set()
        assert topics <= schemas.keys()
        assert not as_ground or all(topic.startswith("/ground/") for topic in topics)
    assert kinds == {"3D", "StateTransitions", "Plot", "RosOut", "RawMessages", "Tab"}


@pytest.mark.parametrize("as_ground", [False, True])
def test_every_panel_of_the_layout_has_a_place(as_ground: bool) -> None:
    layout = json.loads(foxglove_layout(as_ground=as_ground))
    placed = list(_placed(layout["layout"], layout))
    assert sorted(placed) == sorted(layout["configById"])


def test_rerun_finds_everything_of_its_blueprint_in_a_log(
    tmp_path: Path, log: LogFile, seen: dict[str, set[str]]
) -> None:
    schemas = _schemas(log)
    path = tmp_path / "run.rbl"
    write_blueprint(path)
    verified = subprocess.run(  # noqa: S603
        [sys.executable, "-m", "rerun", "rrd", "verify", str(path)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "1 file verified without error." in verified.stdout + verified.stderr

    views = list(_views(blueprint().root_container))
    assert {str(view.name) for view in views} == {
        "Yard", "Modes", "Battery, 0 to 1", "Link, s", "Learning, 0 to 1", "Counts", "Events",
    }  # fmt: skip
    for view in views:
        assert schemas.keys() >= set(view.contents)
        for entity, visualizers in view.visualizer_overrides.items():
            assert TIMELINE in seen[entity]
            for mapping in (each for one in visualizers for each in one.mappings or ()):
                assert {mapping.source_component, mapping.selector} <= seen[entity]
    events = next(view for view in views if str(view.name) == "Events")
    assert {schemas[topic].name for topic in events.contents} == {"foxglove.Log"}


def _views(container: Any) -> Iterator[Any]:
    for each in container.contents:
        yield from (_views(each) if isinstance(each, rrb.Container) else [each])


def test_without_reruns_library_the_other_layout_is_written_and_it_says_what_to_do(
    farside: Callable[..., tuple[int, str, str]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delitem(sys.modules, "farside.logs.layouts.rerun")
    monkeypatch.setitem(sys.modules, "rerun", None)

    status, said, errors = farside("layout")

    assert (status, "farside-foxglove.json" in said, "rerun" in said) == (0, True, False)
    assert "pip install --upgrade rerun-sdk" in errors
    assert [path.name for path in tmp_path.iterdir()] == ["farside-foxglove.json"]


def test_layout_writes_both_and_never_over_a_file(
    farside: Callable[..., tuple[int, str, str]], tmp_path: Path
) -> None:
    folder = tmp_path / "viewers"
    status, said, _ = farside("layout", "--out", str(folder))
    assert status == 0
    for name in ("farside-foxglove.json", "farside-rerun.rbl"):
        assert name in said
        (folder / name).unlink(missing_ok=False)
        (folder / name).write_text("mine")

    status, _, errors = farside("layout", "--out", str(folder))
    assert (status, "already exists, and is not overwritten" in errors) == (2, True)
    assert (folder / "farside-foxglove.json").read_text() == "mine"
    status, said, _ = farside("layout", "--out", str(folder), "--as", "ground")
    assert (status, "as-ground" in said, "Rerun" in said) == (0, True, False)
