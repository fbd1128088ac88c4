"""Every command that reads a log tells on standard error what is missing from it."""

from collections.abc import Callable
from pathlib import Path

import pytest
from mcap.reader import make_reader

from farside.logs import LogFile
from farside.missions import load_mission, run_mission
from farside.missions.commands.main import app

Farside = Callable[..., tuple[int, str, str]]

_ASKED = {
    "diff": ("whole.mcap",),
    "export": ("--out", "tables"),
    "info": (),
    "recover": (),
    "replay": (),
    "report": ("--out", "page.html"),
    "rerun": (),
    "story": ("command:1",),
    "verify": (),
    "why": ("--at", "4"),
}
"""Each command that reads a log, and what it is asked besides."""

_READ_ALL = ("diff", "export", "recover", "replay", "report", "verify")
"""Those that come upon whatever is damaged inside."""

_COMMANDS = "farside.missions.commands.logs."


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of the first 12 s of `blackout`, in several chunks."""
    folder = tmp_path_factory.mktemp("runs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("farside.logs.file.packing._CHUNK_BYTE", 30_000)
        loaded = load_mission("blackout", {"duration_s": 12.0})
        return run_mission(loaded, in_process=True, out=folder).log


def test_all_commands_that_read_a_log_are_asked_here() -> None:
    ours = {
        one.name
        for one in app.registered_commands
        if one.callback is not None and one.callback.__module__.startswith(_COMMANDS)
    }
    assert ours == set(_ASKED)


@pytest.mark.parametrize("command", _ASKED)
def test_what_was_cut_off_is_told_once(
    farside: Farside, whole: Path, tmp_path: Path, command: str
) -> None:
    content = whole.read_bytes()
    (tmp_path / "whole.mcap").write_bytes(content)
    (tmp_path / "run.mcap").write_bytes(content[: _last_chunk(whole) + 100])

    status, _, err = farside(command, "run.mcap", *_ASKED[command])

    assert status in {0, 1}
    [sentence] = LogFile(tmp_path / "run.mcap").damage
    assert err.count(f"farside: run.mcap: {sentence}\n") == 1


@pytest.mark.parametrize("command", _READ_ALL)
def test_what_is_damaged_inside_is_told_by_whatever_comes_upon_it(
    farside: Farside, whole: Path, tmp_path: Path, command: str
) -> None:
    content = bytearray(whole.read_bytes())
    (tmp_path / "whole.mcap").write_bytes(content)
    content[_last_chunk(whole) + 100] ^= 1
    (tmp_path / "run.mcap").write_bytes(content)
    log = LogFile(tmp_path / "run.mcap")
    assert not log.damage, "it is found where it is read"
    assert list(log.records())

    status, _, err = farside(command, "run.mcap", *_ASKED[command])

    assert status in {0, 1}
    [sentence] = log.damage
    assert err.count(f"farside: run.mcap: {sentence}\n") == 1


def test_it_is_told_too_where_the_command_fails(
    farside: Farside, whole: Path, tmp_path: Path
) -> None:
    """The reason may lie in what is missing."""
    (tmp_path / "run.mcap").write_bytes(whole.read_bytes()[: _last_chunk(whole) + 100])

    status, out, err = farside("story", "run.mcap", "command:999")

    assert (status, out) == (2, "")
    assert "farside: run.mcap: bytes" in err
    assert "there is no command 999" in err


@pytest.mark.parametrize("command", ["export", "info", "report", "why"])
def test_as_ground_nothing_is_told_of_what_lay_ahead(
    farside: Farside, whole: Path, tmp_path: Path, command: str
) -> None:
    (tmp_path / "run.mcap").write_bytes(whole.read_bytes()[: _last_chunk(whole) + 100])

    _, _, err = farside(command, "run.mcap", "--as", "ground", "--at", "4")

    assert "bytes" not in err


def _last_chunk(path: Path) -> int:
    with path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert len(summary.chunk_indexes) > 1
    return summary.chunk_indexes[-1].chunk_start_offset
