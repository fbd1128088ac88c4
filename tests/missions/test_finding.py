"""Which log a command reads that was given none."""

import os
from pathlib import Path

import pytest

from farside.logs import LogError
from farside.missions.commands.logs.finding import log_named, newest_log


def lay(folder: Path, name: str, *, written_s: int) -> Path:
    """Put a file there that was last written to at a time."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / name
    path.touch()
    os.utime(path, (written_s, written_s))
    return path


def test_the_newest_log_is_the_one_written_to_last_whatever_its_name(tmp_path: Path) -> None:
    lay(tmp_path, "blackout-seed1-2.mcap", written_s=10)
    newest = lay(tmp_path, "blackout-seed1-1-recovered.mcap", written_s=30)
    lay(tmp_path, "mars-seed1-1.mcap", written_s=20)

    assert newest_log(tmp_path) == newest


def test_what_is_no_log_does_not_count(tmp_path: Path) -> None:
    log = lay(tmp_path, "blackout-seed1-1.mcap", written_s=10)
    lay(tmp_path, ".blackout-seed1-1.mcap.77.packing", written_s=20)
    lay(tmp_path, "blackout.html", written_s=20)
    (tmp_path / "pictures.mcap").mkdir()

    assert newest_log(tmp_path) == log


@pytest.mark.parametrize("there", [True, False])
def test_without_any_log_one_is_told_what_to_do(tmp_path: Path, there: bool) -> None:
    folder = tmp_path / "runs"
    if there:
        folder.mkdir()

    with pytest.raises(LogError, match=rf"one in {folder}, found none there: name one, or run a"):
        newest_log(folder)


def test_a_log_that_is_named_is_taken_without_a_word(capsys: pytest.CaptureFixture[str]) -> None:
    assert log_named(Path("mine.mcap")) == Path("mine.mcap")
    assert capsys.readouterr() == ("", "")


def test_a_log_that_is_not_named_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    log = lay(Path("logs/runs"), "blackout-seed1-1.mcap", written_s=10)

    assert log_named(None) == log
    assert capsys.readouterr().err == f"farside: no log is named: reading the newest, {log}\n"
