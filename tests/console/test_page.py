"""The page of the console, in a browser, as a person uses it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal
from urllib.parse import urlsplit

import pytest
from browsing import CHROMIUM
from console_page import Visitor, visiting
from fake_station import FakeStation
from playwright.sync_api import Browser

from farside.console.page.serving import Serving, serving
from farside.console.stick.cues import cue_of, nearness, rumble_of

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs chromium")


@pytest.fixture(scope="module")
def stand() -> FakeStation:
    return FakeStation()


@pytest.fixture(scope="module")
def served(stand: FakeStation) -> Iterator[Serving]:
    with serving(stand) as page:
        yield page


@pytest.fixture(scope="module")
def first(browser: Browser, served: Serving) -> Iterator[Visitor]:
    with visiting(browser, served.address) as visitor:
        yield visitor


@pytest.fixture
def station(stand: FakeStation) -> FakeStation:
    """A station as it was at first; to load the page anew for each test would take long."""
    stand.reset()
    return stand


@pytest.fixture
def visitor(first: Visitor, station: FakeStation) -> Iterator[Visitor]:
    """The first visitor, who commands."""
    first.page.mouse.move(5, 5)
    first.settle()
    yield first
    assert first.said == []


def test_the_page_shows_the_screen_and_loads_nothing_from_elsewhere(
    visitor: Visitor, served: Serving
) -> None:
    for words in (
        "SHARED",
        "4 ON THE WAY",
        "If you do nothing: the rover stands",
        "Proposal 14",
        "runner-up N",
        "B, priority 2, yours",
        "48 Signs",
        "battery below the reserve (2 times)",
        "Exercise 2/4",
        "0:10:10.5",
    ):
        visitor.sees(words)

    hosts = {urlsplit(address).netloc for address in visitor.requests}
    assert hosts == {urlsplit(served.address).netloc}
    assert not Path(".nicegui").exists()


def test_every_key_does_what_the_help_says(visitor: Visitor, station: FakeStation) -> None:
    visitor.settle()
    visitor.press("ArrowUp", "w", "Shift+ArrowDown", "Enter")
    station.wait_for("choose N", "choose N", "choose S insist", "approve 14")
    visitor.press("Escape", "n", "c", ".", ",", "x")
    station.wait_for(
        "discard 3",
        "warp until something arrives",
        "warp until the next contact",
        "faster",
        "slower",
        "acknowledge 1",
        "acknowledge 2",
    )
    visitor.press("h", "h", "h")
    station.wait_for("heat True", "heat False")
    visitor.press("m", "a")
    station.wait_for("mode autonomous")
    visitor.sees_no_dialog()
    visitor.press("?")
    visitor.sees("veto the proposal")
    visitor.press("Escape")
    visitor.sees_no_dialog()
    assert station.session.asked[-1] == "mode autonomous", "Esc closed the help, and nothing else"


def test_a_goal_is_set_at_the_pointer_by_key_and_by_click(
    visitor: Visitor, station: FakeStation
) -> None:
    box = visitor.page.locator(".farside-map").bounding_box()
    assert box is not None
    cell = min(box["width"] / 17, box["height"] / 10)
    x = box["x"] + box["width"] / 2 + (10.5 - 8.5) * cell
    y = box["y"] + box["height"] / 2 + (5.0 - 4.5) * cell
    visitor.page.mouse.move(x, y)
    visitor.page.keyboard.press("g")
    station.wait_for("goal 10,4 None")
    visitor.page.mouse.click(x, y)
    station.wait_for("goal 10,4 None", "goal 10,4 None")


def test_a_goal_is_set_by_its_name_and_what_is_typed_there_orders_nothing(
    visitor: Visitor, station: FakeStation
) -> None:
    visitor.press("g")
    visitor.page.wait_for_function("() => document.activeElement.tagName === 'INPUT'")
    visitor.page.keyboard.type("nowhere ")
    visitor.press("Enter")
    visitor.hears("not ordered: no place is called nowhere")
    visitor.sees_no_dialog()

    assert station.session.asked == ["goal nowhere"]


def test_a_key_held_down_orders_once(visitor: Visitor, station: FakeStation) -> None:
    visitor.settle()
    for _ in range(3):
        visitor.page.keyboard.down("ArrowUp")
    visitor.page.keyboard.up("ArrowUp")
    visitor.press("n")
    station.wait_for("warp until something arrives")
    assert station.session.asked == ["choose N", "warp until something arrives"]


def test_a_late_approve_never_hits_another_proposal(visitor: Visitor, station: FakeStation) -> None:
    """The person means 14; the page has just come to show 15."""
    visitor.settle()
    station.propose(15)
    visitor.sees("Proposal 15")
    visitor.press("Enter", "Backspace")
    visitor.hears("has just changed")
    visitor.press("n")
    station.wait_for("warp until something arrives")
    assert not {"approve 14", "approve 15", "veto 15"} & set(station.session.asked)

    visitor.settle()
    visitor.page.get_by_role("button", name="Approve ⏎").click()
    station.wait_for("approve 15")
    visitor.page.locator("[role=status]", has_text="Proposal 15: ").wait_for(state="attached")


def test_an_action_shows_what_it_will_do_before_it_is_done(
    visitor: Visitor, station: FakeStation
) -> None:
    visitor.page.locator("[data-option=W]").hover()
    visitor.sees("C_m 0.31; blocked here once before")
    visitor.page.wait_for_function("() => document.querySelectorAll('.meant').length === 2")
    visitor.page.locator("[data-option=E]").focus()
    visitor.sees("approves proposal 14")
    assert station.session.asked == []


def test_the_goal_in_focus_is_the_one_under_the_pointer(
    visitor: Visitor, station: FakeStation
) -> None:
    visitor.page.get_by_text("C, priority 1").hover()
    visitor.sees("to C: 24.1 s to go")
    assert station.session.looked_at == "C"


def test_alarms_stay_until_they_are_acknowledged_and_what_was_missed_can_be_read(
    visitor: Visitor, station: FakeStation
) -> None:
    visitor.page.get_by_label("acknowledge: blocked at 3,4").click()
    station.wait_for("acknowledge 2")
    visitor.sees("ALARMS 1")
    visitor.page.get_by_label("what it did meanwhile").click()
    visitor.sees("nothing was learned late")
    station.wait_for("read")
    visitor.press("Escape")
    visitor.sees_no_dialog()


def test_lists_do_not_move_under_the_pointer(visitor: Visitor, station: FakeStation) -> None:
    visitor.page.get_by_label("take back: 92").hover()
    station.advance(4.0)
    visitor.sees("0:10:14.5")
    assert visitor.page.get_by_label("take back: 93").count() == 0
    visitor.page.mouse.move(10, 10)
    visitor.page.get_by_label("take back: 93").wait_for()


FARTHEST = """() => Math.max(...[...document.querySelectorAll('.console *')]
  .filter((node) => !(node instanceof SVGElement))
  .map((node) => node.getBoundingClientRect().right))"""

NAMELESS = """() => [...document.querySelectorAll('button, [role=switch], [role=img]')]
  .filter((node) => !(node.innerText?.trim() || node.getAttribute('aria-label')
    || node.labels?.[0]?.innerText)).map((node) => node.outerHTML)"""

PAD = """
window.pad = {connected: true, axes: [0, 0], buttons: [...Array(17)].map(() => ({pressed: false})),
  vibrationActuator: {playEffect: (kind, effect) => { effects.push(effect.strongMagnitude); }}};
window.effects = [];
navigator.getGamepads = () => [pad];
"""


def test_a_gamepad_chooses_as_the_keys_do_and_is_felt_at_once(
    visitor: Visitor, station: FakeStation
) -> None:
    page = visitor.page
    page.evaluate(PAD)
    page.wait_for_function("() => effects.length", polling=10)
    near = page.evaluate(
        """() => new Promise((tell) => { effects.length = 0; pad.axes = [-0.5, 0];
        requestAnimationFrame(() => requestAnimationFrame(() => tell(
          [effects.at(-1), document.querySelector('[data-near]').dataset.option])));})"""
    )
    west = next(option for option in station.screen().options if option.action == "W")
    felt = rumble_of(cue_of(west), nearness(0.5)).strength
    assert felt > 0.1
    assert near == [round(felt, 2), "W"], "the same as a stick of this host would feel"
    assert station.session.asked == []

    visitor.settle()
    page.evaluate("() => { pad.axes = [0, -1]; }")
    station.wait_for("choose N")
    page.evaluate("() => { pad.axes = [0, 0]; }")
    page.wait_for_function("() => !document.querySelector('[data-near]')")
    page.evaluate("() => { pad.axes = [0, 1]; }")
    visitor.hears("insist with Shift")
    station.wait_for("choose S", "choose S insist")
    page.evaluate("() => { pad.axes = [0, 0]; pad.buttons[1].pressed = true; }")
    station.wait_for("veto 14")
    assert station.session.asked == ["choose N", "choose S", "choose S insist", "veto 14"]
    page.evaluate("() => { pad.connected = false; }")


def test_what_is_no_press_is_refused_in_words_and_the_page_lives_on(
    visitor: Visitor, station: FakeStation
) -> None:
    for sent, said in (
        (None, "Expected `object`, got `null`"),
        ({"what": "explode"}, "Invalid enum value 'explode'"),
        ({"what": "choose", "word": 5}, "Expected `str`, got `int`"),
        ({"what": "choose", "word": "E", "more": 1}, "unknown field `more`"),
        ({"what": "take_back", "number": 1e30}, "Expected `int`, got `float`"),
        ({"what": "mode", "word": "fast"}, "expected guided, shared, autonomous"),
        ({"what": "speed", "amount": 1e300}, "expected a speed from 0.1 to 1000"),
    ):
        visitor.sends("press", sent)
        visitor.hears(said)
    visitor.sends("opens", {"all": 1})
    visitor.press("ArrowUp")
    station.wait_for("choose N")


def test_two_pages_look_one_commands_and_hands_over(
    browser: Browser, served: Serving, visitor: Visitor, station: FakeStation
) -> None:
    with visiting(browser, served.address) as second:
        second.settle()
        second.press("ArrowUp")
        second.hears("another page commands")
        second.page.get_by_role("button", name="ask for command").click()
        visitor.page.reload()
        visitor.here().page.get_by_role("button", name="hand over command").click()
        second.sees("you command")
        second.press("ArrowUp")
        station.wait_for("choose N")
        visitor.sees("ask for command")


@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (820, "dark")])
def test_the_page_is_readable_without_scrolling(
    browser: Browser, served: Serving, width: int, scheme: Literal["light", "dark"]
) -> None:
    height = {1280: 800, 820: 1180}[width]
    with visiting(browser, served.address, width=width, height=height, scheme=scheme) as visitor:
        assert visitor.page.evaluate("document.documentElement.scrollHeight") <= height
        assert visitor.page.evaluate(FARTHEST) <= width
        texts = visitor.texts()
        assert len(texts) > 40
        assert not [text for text, size, _ in texts if size < 14]
        assert not [text for text, _, contrast in texts if contrast < 4.5]
        assert not visitor.page.evaluate(NAMELESS)


def test_on_a_low_window_what_is_next_stands_below_the_map_and_not_on_it(visitor: Visitor) -> None:
    """A browser of 1280 by 800 that is zoomed to 150 %."""
    page = visitor.page
    before = page.viewport_size
    page.set_viewport_size({"width": 853, "height": 533})
    strip, following = (page.locator(part).bounding_box() for part in (".farside-strip", ".next"))
    if before is not None:
        page.set_viewport_size(before)
    assert strip is not None
    assert following is not None
    assert strip["y"] + strip["height"] <= following["y"]
