"""The page of a run, opened in a browser: it shows, it moves, and it asks nobody for anything."""

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from browsing import CHROMIUM, Opened, chromium
from playwright.sync_api import Browser

from farside.logs import LogFile, Recorder
from farside.logs.report import report_page
from farside.messages import SetGoal, Tokens
from farside.node import to_ns
from farside.topics import CommandSent, OperatorEntry
from tests.logs.conftest import Handmade

pytestmark = [
    pytest.mark.processes,
    pytest.mark.skipif(
        CHROMIUM is None and "CI" not in os.environ,
        reason="there is no chromium: apt-get install chromium",
    ),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Closed with the last test that needs it: its loop would be in the way of others' own."""
    with chromium() as opened:
        yield opened


@pytest.fixture(scope="module")
def page(flown: LogFile, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("page") / "run.html"
    path.write_text(report_page(flown), encoding="utf-8")
    return path


@pytest.fixture
def opened(browser: Browser, page: Path) -> Iterator[Opened]:
    opened = Opened(browser, page)
    yield opened
    opened.close()
    assert opened.said == []
    assert opened.requests == []


def test_the_page_shows_a_run(opened: Opened) -> None:
    assert opened.text("h1") == "blackout"
    assert "✓ success" in opened.text("header")
    assert "goal at:B reached during a blackout" in opened.text("header")
    assert opened.path("#map .t-autonomous").count("L") > 20
    assert all(opened.path(f"#timeline .f-{mode}") for mode in ("guided", "shared", "autonomous"))
    assert opened.path("#strip .w-command")
    assert opened.path("#strip .w-cross")
    titles = opened.page.locator("#curves h3").all_inner_texts()
    assert titles[:2] == ["Battery", "Surprises so far"]
    assert {"Delay, uplink", "Delay, downlink", "Corroboration C_m"} < set(titles)
    drawn = opened.page.eval_on_selector_all(
        "#curves .plot", "(plots) => plots.map((plot) => plot.querySelectorAll('.c').length)"
    )
    assert all(drawn), dict(zip(titles, drawn, strict=True))
    assert opened.page.locator("#columns g").count() == 17 * 10
    assert "command 85" not in opened.text("#refused")


def test_the_slider_moves_all_views(opened: Opened) -> None:
    opened.slide(690)
    told, cursors, rover = views(opened)
    opened.slide(750)
    later, moved, elsewhere = views(opened)

    assert "autonomous: link lost, since 650.0 s" in told
    assert "towards at:B" in told
    assert "At the ground\nHeard\nwhat was so" in told
    assert "towards at:C" in later
    assert opened.text("#time").startswith("750.0 s")
    assert opened.text("#latest li:last-child").endswith("goal at:B reached")
    assert rover != elsewhere
    assert len(cursors) == len(moved) > 10
    assert not set(cursors) & set(moved)
    assert opened.page.locator("#policy-moment").input_value() == "2"


def views(opened: Opened) -> tuple[str, list[Any], Any]:
    """What is told, where the cursors stand, and where the rover is drawn."""
    cursors = opened.page.eval_on_selector_all(
        ".cursor", "(all) => all.map((cursor) => cursor.getAttribute('d'))"
    )
    rover = opened.page.eval_on_selector(
        "#map .rover", "(rover) => [rover.getAttribute('cx'), rover.getAttribute('cy')]"
    )
    return opened.text("main .now"), cursors, rover


def test_dragging_zooms_all_plots_and_a_double_click_shows_the_whole_run(opened: Opened) -> None:
    whole = axes(opened)
    strip = opened.page.locator("#strip svg")
    strip.evaluate("(strip) => strip.scrollIntoView({ block: 'center' })")
    box = strip.bounding_box()
    assert box is not None
    opened.page.mouse.move(box["x"] + 700, box["y"] + 60)
    opened.page.mouse.down()
    opened.page.mouse.move(box["x"] + 760, box["y"] + 60, steps=4)
    opened.page.mouse.up()
    opened.settle()
    near = axes(opened)
    strip.dblclick(position={"x": 700, "y": 60})
    opened.settle()

    assert whole[0] == "0:00:00"
    assert len(set(map(str, near))) > 1
    assert not set(near) & {"0:00:00", "0:18:00"}
    assert axes(opened) == whole


def axes(opened: Opened) -> list[str]:
    """The times along the space-time diagram and the timeline."""
    texts = opened.page.locator("#strip text, #timeline text").all_text_contents()
    return [text for text in texts if re.fullmatch(r"\d+:\d\d:\d\d(\.\d+)?", text)]


def test_close_up_the_slope_of_a_word_is_the_light_time(opened: Opened) -> None:
    opened.slide(512)
    opened.page.click("#light")
    opened.settle()

    assert "command 85" in opened.page.locator("#strip text").all_text_contents()
    sent_again = opened.path("#strip .w-again")
    drawn = re.findall(r"M([\d.]+) (\d+)L([\d.]+) (\d+)", opened.path("#strip .w-command"))
    ticks = opened.page.eval_on_selector_all(
        "#strip .gridline", "(lines) => lines.map((line) => line.getAttribute('d'))"
    )
    per_s = step_px(ticks) / 2  # a tick every two seconds
    assert sent_again
    took_s = [(float(right) - float(left)) / per_s for left, _, right, _ in drawn]
    assert any(1.28 < took < 2.2 for took in took_s)
    assert all(top == took_top for _, top, _, _ in drawn for took_top in [drawn[0][1]])


def step_px(ticks: list[str]) -> float:
    """How far the lines of the time axis are apart."""
    at = sorted({float(found[1]) for tick in ticks if (found := re.match(r"M([\d.]+) 0v", tick))})
    return at[1] - at[0]


def test_the_switch_shows_only_what_the_ground_knew(opened: Opened) -> None:
    opened.slide(700)
    opened.as_ground()

    shown = opened.text("body")
    assert "nothing heard, since 629.2 s" in shown
    assert "what was so 80.2 s ago, at 619.8 s" in shown
    assert "command 93 overdue" in shown
    assert "success" not in shown
    assert "autonomous: link lost" not in shown
    assert "goal at:B reached" not in shown
    assert "1199" not in shown
    assert opened.path("#map .t-autonomous") == ""
    assert opened.page.locator("#map .rover").count() == 0
    times = [float(found) for found in re.findall(r"^([\d.]+) s$", shown, re.MULTILINE)]
    assert times
    assert max(times) <= 700

    opened.slide(1000)
    assert "goal at:B reached" in opened.text("#events")
    assert opened.path("#map .t-autonomous")


@pytest.mark.parametrize("as_ground", [False, True])
def test_on_a_phone_nothing_is_wider_than_the_screen(
    browser: Browser, page: Path, as_ground: bool
) -> None:
    opened = Opened(browser, page, hash_="#t=690" + "&as=ground" * as_ground, width=390)
    assert opened.page.evaluate("document.documentElement.scrollWidth") == 390
    assert "690.0 s" in opened.text("#time")
    opened.close()
    assert opened.said == []


def test_the_page_is_light_or_dark_as_the_system_is_and_light_on_paper(
    browser: Browser, page: Path
) -> None:
    opened = Opened(browser, page, scheme="dark")
    dark = opened.colour("body", "backgroundColor"), opened.colour("#map .wall", "fill")
    opened.page.emulate_media(media="print")
    paper = opened.colour("body", "backgroundColor"), opened.colour("#map .wall", "fill")
    opened.close()

    assert dark[0] == "rgb(18, 22, 29)"
    assert paper[0] == "rgb(255, 255, 255)"
    assert dark[1] != paper[1]


EVIL = "</script><script>window.owned = 1</script><img src=x onerror='window.owned = 1'>"


def test_nothing_in_a_log_becomes_part_of_the_page(
    browser: Browser, run: Handmade, path: Path, tmp_path: Path
) -> None:
    goal: Tokens = (EVIL,)
    run.start().goal(1, *goal).hear(3, "at:D", since_s=2)
    run.note(2, CommandSent(1, SetGoal(goal, 1.0), to_ns(9), None))
    run.note(2, OperatorEntry(1, 1, None, (EVIL,)))
    with Recorder(path) as recorder:
        recorder.metadata("farside.run", {"mission": EVIL, "seed": EVIL, "farside": EVIL})
        recorder.attach("result.json", "application/json", b'{"outcome": "' + EVIL.encode() + b'"}')
        recorder.write(run.records)
    page = tmp_path / "run.html"
    page.write_text(report_page(LogFile(path)), encoding="utf-8")

    opened = Opened(browser, page, hash_="#t=2.5")
    assert opened.text("h1") == EVIL
    assert opened.text("#now").count(EVIL) >= 1
    assert opened.text("#latest").count(EVIL) >= 2
    opened.page.select_option("#events-wanted", "all")
    opened.as_ground()
    assert opened.text("#events").count(EVIL) >= 1
    assert opened.page.evaluate("window.owned") is None
    assert opened.page.locator("img").count() == 0
    opened.close()
    assert opened.said == []
    assert opened.requests == []


def test_a_page_of_a_log_without_a_run_is_a_page(
    browser: Browser, path: Path, tmp_path: Path
) -> None:
    with Recorder(path):
        pass
    page = tmp_path / "run.html"
    page.write_text(report_page(LogFile(path)), encoding="utf-8")

    opened = Opened(browser, page)
    opened.as_ground()
    assert "nothing yet" in opened.text("#now")
    opened.close()
    assert opened.said == []
