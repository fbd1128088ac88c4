"""What docs/extend.md says is so: its code is that of these files, and its commands work."""

import re
import shlex
import sys
from pathlib import Path

import pytest

from farside.missions import Rehearsal
from farside.missions.commands import main as cli

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs/extend.md").read_text()
FILES = {
    path.name: path.read_text()
    for path in (
        ROOT / "tests/helpers/pathfinder.py",
        ROOT / "tests/helpers/caller.py",
        ROOT / "tests/extend/relay.toml",
        ROOT / "tests/extend/test_own.py",
    )
}


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


def test_the_code_on_the_page_is_that_of_the_files() -> None:
    """Each under the name that the page gives it."""
    assert [*blocks("python")[:2], *blocks("toml"), *blocks("python")[2:]] == [*FILES.values()]
    assert re.findall(r"`([\w.]+)`:\n\n```(?:python|toml)", PAGE) == [*FILES]


def test_the_commands_on_the_page_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a folder that holds what the page does."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.path", [entry for entry in sys.path if "helpers" not in entry])
    for name in ("pathfinder", "caller"):
        monkeypatch.delitem(sys.modules, name, raising=False)
    for name, text in FILES.items():
        Path(name).write_text(text)
    commands = [line for block in blocks("sh") for line in block.replace("\\\n", "").splitlines()]
    assert len(commands) == 3
    for command in commands:
        monkeypatch.setattr("sys.argv", shlex.split(command))
        with pytest.raises(SystemExit) as end:
            cli.main()
        assert end.value.code == 0, command
    for name in ("pathfinder", "caller"):
        del sys.modules[name]  # those of this folder


def test_the_line_for_a_test_on_the_page_is_one(tmp_path: Path) -> None:
    (line,) = re.findall(r"^`(mission\(.*\.run\(\))`\.$", PAGE, re.MULTILINE)
    from caller import Caller  # noqa: PLC0415
    from pathfinder import Pathfinder  # noqa: PLC0415

    def mission(name: str) -> Rehearsal:
        return Rehearsal(name, tmp_path).set("duration_s", 20.0)

    names = {"mission": mission, "Caller": Caller, "Pathfinder": Pathfinder}
    assert eval(line, names).lost_processes == ()  # noqa: S307 - our own page


def test_every_name_on_the_page_is_there() -> None:
    for package, name in re.findall(r"`farside\.(rover|ground)\.(\w+)`", PAGE):
        module = __import__(f"farside.{package}", fromlist=[name])
        assert getattr(module, name)
