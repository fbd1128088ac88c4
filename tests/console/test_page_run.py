"""`blackout`, played whole by a person at the page, whatever happens to pages meanwhile."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from browsing import CHROMIUM
from console_page import Visitor, visiting
from playing import LiveRun, Player
from playwright.sync_api import Browser

from farside.console.page.serving import Serving, serving
from farside.console.screen.screen import Screen
from farside.console.wording import clock_text
from farside.missions.reliving.verifying import verify
from farside.node import to_ns

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs chromium")


@contextmanager
def played(browser: Browser, out: Path) -> Iterator[tuple[LiveRun, Serving, Player]]:
    """A run that has begun, and somebody before its page."""
    live = LiveRun(out)
    with (
        serving(live.station) as served,
        live,
        visiting(browser, served.address) as visitor,
    ):
        yield live, served, Player(live.station, visitor)


def assert_shows(visitor: Visitor, screen: Screen) -> None:
    """While time stands: the page says what the station does."""

    def says(where: str, text: str) -> None:
        visitor.page.locator(f"{where}:visible").filter(has_text=text).first.wait_for()

    assert screen.paused or screen.over
    says(".clocks", clock_text(screen.now_ns))
    says(".clocks", clock_text(screen.rover_ns))
    says("button.mode", screen.mode.text)
    says(".nothing", screen.if_nothing)
    if screen.on_the_way:
        says(".way", f"{screen.on_the_way} ON THE WAY")
    if screen.proposal is not None:
        says(".card .title", screen.proposal.title)
    for said in (*screen.status, *screen.rover, *screen.failsafe, *screen.link):
        says(".fact", said.text)
    for command in screen.commands[:1]:
        says(".command", command.text)
    done = sum(step.done for step in screen.exercise)
    says(".exercise", f"{done}/{len(screen.exercise)}")


def finishes(live: LiveRun, player: Player) -> None:
    """The person reads what the rover did meanwhile, and lets the rest of the time pass."""
    player.play(lambda _: player.person.is_done)
    player.order("x")
    player.visitor.page.get_by_label("what it did meanwhile").click()
    player.visitor.page.locator(".q-dialog").get_by_text("goal at:B reached").wait_for()
    player.visitor.press("Escape")
    player.visitor.sees_no_dialog()
    live.station.until(
        "all is ticked", lambda session: all(s.done for s in session.screen().exercise)
    )
    player.click("60x")
    player.order(*"...")


def test_a_person_plays_the_whole_of_blackout_by_keys(browser: Browser, tmp_path: Path) -> None:
    """Drives, teaches, consents, overrides, lets go, loses the link, and is told everything."""
    with played(browser, tmp_path) as (live, served, player):
        visitor = player.visitor

        player.play(lambda screen: screen.on_the_way > 0)
        assert player.screen.mode.text == "GUIDED"
        assert_shows(visitor, player.screen)

        player.play(lambda screen: screen.proposal is not None and screen.proposal.can_answer)
        assert player.screen.mode.text == "SHARED"
        assert_shows(visitor, player.screen)

        player.play(lambda screen: "unexpected" in str(screen.status))
        in_silence = player.screen
        assert not any("goal at:B reached" in event.text for event in in_silence.events)
        assert_shows(visitor, in_silence)

        finishes(live, player)
        run = live.finish()
        assert_shows(visitor, player.screen)

    assert run.result.outcome == "success", run.result.expectations
    assert verify(run.log).equal
    assert all(step.done for step in player.screen.exercise)
    assert visitor.said == []
    assert {urlsplit(address).netloc for address in visitor.requests} == {
        urlsplit(served.address).netloc
    }


def test_what_happens_to_pages_does_nothing_to_the_run(browser: Browser, tmp_path: Path) -> None:
    """A reload, a page opened late, command handed over, a page closed, a connection lost."""
    with played(browser, tmp_path) as (live, served, player):
        first = player.visitor
        player.play(lambda screen: screen.now_ns > to_ns(100))
        first.page.reload()
        first.here().settle()

        player.play(lambda screen: screen.proposal is not None and screen.proposal.can_answer)
        with visiting(browser, served.address) as second:
            assert_shows(second, player.screen)
            second.press("Enter")
            second.hears("another page commands")
            second.page.get_by_role("button", name="ask for command").click()
            first.sees("hand over command")
            first.look()
            first.page.get_by_role("button", name="hand over command").click()
            second.sees("you command")
            first.sees("ask for command")
            first.page.close()

            player.visitor = second
            player.play(lambda screen: "unexpected" in str(screen.status))
            player.order("n")
            second.page.context.set_offline(offline=True)
            second.sees("Connection lost")
            live.station.until("the rover is heard", lambda session: not session.pacing.until)
            second.page.context.set_offline(offline=False)
            second.sees("the link is back")

            finishes(live, player)
            run = live.finish()

    assert run.result.outcome == "success", run.result.expectations
    assert verify(run.log).equal
    assert first.said == []
