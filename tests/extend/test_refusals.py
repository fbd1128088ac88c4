"""Code of one's own that a run cannot use is a mistake of input, told before the run, in words."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from textwrap import dedent

import pytest

from farside.missions import MissionError, load_mission

HEAD = """\
from farside.dem import Choice
from farside.rover import PlainController
"""
WALKER = (
    HEAD
    + """
class Walker(PlainController):
    def choose(self, *, explore=True):
        return None
"""
)
CALLER = """\
from farside.topics import OperatorEntry

class Caller:
    progress = OperatorEntry(0, 0, None)

    def __init__(self, chart, *, rng):
        pass

    def act(self, situation):
        return ()
"""


@pytest.fixture(autouse=True)
def _modules(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """An empty folder of one's own, and no module left of the tests before."""
    monkeypatch.chdir(tmp_path)
    before = set(sys.modules)
    yield
    for name in set(sys.modules) - before:
        if str(tmp_path) in str(getattr(sys.modules[name], "__file__", None)):
            del sys.modules[name]


def refusal(key: str, name: str, text: str = "", **options: object) -> str:
    """The one line that refuses `name` of the module `mine`, which holds `text`."""
    Path("mine.py").write_text(text)
    sys.modules.pop("mine", None)
    with pytest.raises(MissionError) as refused:
        load_mission("blackout", {key: name, f"{key}_options": options})
    return str(refused.value).replace(str(Path.cwd()), "HERE")


def test_a_name_that_nobody_has() -> None:
    assert refusal("rover.controller", "den") == (
        'blackout: rover.controller: expected "dem", "queued", or module:Class from your own code, '
        'found "den"; did you mean dem? (with rover.controller set from Python)'
    )
    assert refusal("ground.operator", "script").startswith(
        'blackout: ground.operator: expected "scripted", "guide", "supervisor", "recorded", '
        '"queued", "absent", or module:Class from your own code, found "script"; did you mean '
        "scripted?"
    )


def cases() -> dict[str, tuple[str, str, str]]:
    """What a mission names, the text of the module `mine`, and what is said of it, by title."""
    found = {}
    told = Path(__file__).with_name("refusals.txt").read_text()
    for case in told.split("\n# ")[1:]:
        title, name, *text, words = case.rstrip("\n").split("\n")
        found[title] = name, dedent("\n".join(text)), words
    return found


@pytest.mark.parametrize(("name", "text", "told"), cases().values(), ids=cases())
def test_a_controller_is_refused_in_these_words(name: str, text: str, told: str) -> None:
    assert refusal("rover.controller", name, text) == (
        f"blackout: rover.controller: {told} (with rover.controller set from Python)"
    )


def test_an_operator_that_does_not_act() -> None:
    text = "class Idle:\n    def __init__(self, chart, *, rng): ..."
    assert refusal("ground.operator", "mine:Idle", text) == (
        "blackout: ground.operator: expected a class with progress, act, found mine:Idle without "
        "act: define what is missing (with ground.operator set from Python)"
    )


def test_options_that_a_class_does_not_take() -> None:
    text = WALKER + "    def __init__(self, costs, *, rng, gain=1.0): ..."
    assert refusal("rover.controller", "mine:Walker", text, gian=2) == (
        "blackout: rover.controller_options.gian: expected one of the options gain of mine:Walker, "
        "found gian; did you mean gain? (with rover.controller_options set from Python)"
    )
    assert refusal("ground.operator", "mine:Caller", CALLER, speed=1) == (
        "blackout: ground.operator_options.speed: expected no options of mine:Caller, found speed "
        "(with ground.operator_options set from Python)"
    )


def test_options_for_what_is_built_in() -> None:
    assert refusal("rover.controller", "dem", alpha=0.5) == (
        'blackout: rover.controller_options: expected none with controller = "dem", which '
        "[rover.dem] sets, found alpha (with rover.controller_options set from Python)"
    )
    assert "which [[ground.script]] sets, found a" in refusal("ground.operator", "scripted", a=1)


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ({"deep": {"er": 1}}, ".deep: expected true or false or a whole number or a number or "),
        ({"mixed": [1, [2]]}, ".mixed.1: expected true or false or a whole number or a number or "),
        ({"far": float("inf")}, ".far: expected true or false or a whole number"),
        ({"two words": 1}, '."two words": expected a name of letters, digits and _, found "two'),
        (3, ": expected a table, found 3"),
    ],
)
def test_options_that_are_no_plain_values(value: object, told: str) -> None:
    Path("mine.py").write_text(WALKER)
    with pytest.raises(MissionError) as refused:
        load_mission(
            "blackout", {"rover.controller": "mine:Walker", "rover.controller_options": value}
        )
    assert str(refused.value).startswith(f"blackout: rover.controller_options{told}")


def test_two_missions_whose_modules_have_one_name() -> None:
    """The module that was loaded first would silently stand in for the other."""
    blackout = (Path(__file__).parents[2] / "missions/blackout.toml").read_text()
    for folder in ("one", "two"):
        Path(folder).mkdir()
        Path(folder, "mine.py").write_text(WALKER)
        Path(folder, "far.toml").write_text(blackout)
    load_mission("one/far.toml", {"rover.controller": "mine:Walker"})
    with pytest.raises(MissionError) as refused:
        load_mission("two/far.toml", {"rover.controller": "mine:Walker"})
    assert str(refused.value).replace(str(Path.cwd()), "HERE") == (
        "two/far.toml: rover.controller: expected module mine to be HERE/two/mine.py, found "
        "HERE/one/mine.py in use by that name: give one of them another (with rover.controller set "
        "from Python)"
    )


@pytest.mark.processes
@pytest.mark.parametrize("command", [["check"], ["run"], ["run", "--in-process"]])
def test_commands_end_with_bad_input_and_no_traceback(command: list[str]) -> None:
    Path("mine.py").write_text("1 / 0")
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-m", "farside", *command, "blackout", "--set", "rover.controller=mine:A"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("farside: blackout: rover.controller: expected a module that can")
    assert done.stderr.count("\n") == 1
