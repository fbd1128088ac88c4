"""The pytest plugin: what a failing test shows of the runs that it made."""

import re
from typing import Any

import numpy as np  # noqa: F401 - once per process, and `pytester` forgets what it imported
import pytest

import farside.missions.testing.rehearsal
import farside.missions.testing.telling  # noqa: F401 - likewise

TINY = """
name = "tiny"
seed = 4
duration_s = 12

[world]
map = '''
######
#A..B#
######
'''

[rover]
start = "A"
[rover.failsafe]
hold_after_s = 2
lost_after_s = 4

[link.up]
delay_s = 0.5

[link.down]
delay_s = 0.5

[ground]
operator = "scripted"

[[expect]]
what = "reached"
place = "B"
"""


@pytest.fixture
def suite(pytester: pytest.Pytester) -> pytest.Pytester:
    """A folder with a mission beside the tests."""
    pytester.mkdir("tests")
    (pytester.path / "tests/tiny.toml").write_text(TINY)
    return pytester


def flown(suite: pytest.Pytester, test: str, *options: str) -> Any:
    """The outcome of a test file, run from the folder above its own."""
    (suite.path / "tests/test_flight.py").write_text(test)
    return suite.inline_run(*options, "tests")


def failing(suite: pytest.Pytester, test: str, *options: str) -> Any:
    """The report of the one test, which failed."""
    _, _, (report,) = flown(suite, test, *options).listoutcomes()
    return report


FAILS = """
def test_flight(mission):
    run = mission("tiny.toml").with_seed(7).blackout(start_s=3, duration_s=6).run()
    assert run.failsafe_at(8) == "nominal"
"""


def test_a_failing_test_shows_its_run(suite: pytest.Pytester) -> None:
    report = failing(suite, FAILS)

    [(title, text)] = [section for section in report.sections if "farside" in section[0]]
    log = re.search(r"^log: +(.+\.mcap)$", text, re.MULTILINE).group(1)
    assert title == "farside run"
    assert text.startswith("tiny, seed 7: failure after 12.0 s\n")
    assert "  NOT MET  goal at:B reached: never reached as a goal\n" in text
    assert '  with link.blackouts = [{"start_s": 3, "end_s": 9, "direction": "both"}]\n' in text
    assert re.search(r"^mode      g+$", text, re.MULTILINE)
    assert re.search(r"^failsafe  ·+h+·+$", text, re.MULTILINE)
    assert re.search(r"^uplink    ─+x+─+$", text, re.MULTILINE)
    assert "the last events up to 8.0 s, which was asked about last\n" in text
    assert re.search(r"3\.0 s  link    uplink: blackout begins\n", text)
    assert "blackout ends" not in text, "that came after what was asked about"
    assert f"replay: farside replay {log} --start 0" in text
    assert (suite.path / log).is_file()


def test_what_a_test_shows_comes_over_from_a_worker(suite: pytest.Pytester) -> None:
    """As pytest-xdist sends reports."""
    report = failing(suite, FAILS)

    sent = type(report)._from_json(report._to_json())

    assert sent.sections == report.sections
    assert dict(sent.sections)["farside run"]


def test_each_run_of_a_test_is_shown(suite: pytest.Pytester) -> None:
    report = failing(
        suite,
        """
def test_flight(mission):
    for seed in 1, 2:
        mission("tiny.toml").set("expect", []).with_seed(seed).run()
    assert False
""",
    )

    told = [text.splitlines()[0] for title, text in report.sections if title.startswith("farside")]
    assert told == [
        "tiny, seed 1: success after 12.0 s",
        "tiny, seed 2: success after 12.0 s",
    ]


def test_a_passing_test_shows_nothing(suite: pytest.Pytester) -> None:
    ((passed,), _, _) = flown(suite, FAILS.replace("nominal", "hold")).listoutcomes()

    assert passed.sections == []


def test_a_log_that_is_gone_does_not_hide_the_failure(suite: pytest.Pytester) -> None:
    gone = FAILS.replace("    assert", "    run.log.unlink()\n    assert 0 and")
    report = failing(suite, gone)

    text = dict(report.sections)["farside run"]
    assert "tiny, seed 7: failure" in text
    assert "no more can be told: the log " in text


def test_logs_are_kept_where_they_are_wanted_by_test(suite: pytest.Pytester) -> None:
    outcome = flown(suite, FAILS.replace("nominal", "hold"), "--farside-logs", "kept/here")

    outcome.assertoutcome(passed=1)
    logs = [str(log.relative_to(suite.path)) for log in suite.path.rglob("*.mcap")]
    assert logs == ["kept/here/tests-test_flight.py-test_flight/tiny-seed7-1.mcap"]


def test_every_case_of_a_test_has_a_folder_however_it_is_named(suite: pytest.Pytester) -> None:
    cases = ["a b", "a-b", "a/b", "é" * 90, "é" * 91]
    test = f"""
import pytest

@pytest.mark.parametrize("two", [pytest.param(0, id="x" * 99)])
@pytest.mark.parametrize("one", [pytest.param(case, id=case) for case in {cases}])
def test_flight(mission, one, two):
    mission("tiny.toml").set("duration_s", 1.0).run()
"""
    flown(suite, test, "--farside-logs", "kept").assertoutcome(passed=len(cases))

    assert len(list((suite.path / "kept").iterdir())) == len(cases)


def test_what_is_damaged_is_told_of(suite: pytest.Pytester) -> None:
    cut = "    run.log.write_bytes(run.log.read_bytes()[:9000])\n    assert 0 and"
    report = failing(suite, FAILS.replace("    assert", cut))

    assert "not what was written; messages from 0.0 s to" in dict(report.sections)["farside run"]


def test_without_a_run_there_is_no_folder_for_logs(suite: pytest.Pytester) -> None:
    flown(suite, "def test_flight(mission): pass", "--farside-logs", "kept")

    assert not (suite.path / "kept").exists()


@pytest.mark.parametrize(
    ("name", "why"),
    [
        (
            "tiny",
            r"tiny: expected a mission file.*, found neither .*/tests/tiny nor one of",
        ),
        ("tests/tiny.toml", r"neither .*/tests/tests/tiny\.toml nor"),
        ("blackuot", r"among blackout, .*; did you mean blackout\?"),
    ],
)
def test_a_mission_that_is_not_there_was_looked_for_beside_the_test(
    suite: pytest.Pytester, name: str, why: str
) -> None:
    report = failing(suite, f"def test_flight(mission): mission({name!r})")

    assert re.search(why, str(report.longrepr))
    assert report.sections == []


def test_a_shipped_mission_has_its_name_and_a_path_may_be_absolute(suite: pytest.Pytester) -> None:
    outcome = flown(
        suite,
        f"""
def test_flight(mission):
    assert mission("blackout")
    assert mission({str(suite.path / "tests/tiny.toml")!r}).set("duration_s", 1.0).run().log
""",
    )

    outcome.assertoutcome(passed=1)
