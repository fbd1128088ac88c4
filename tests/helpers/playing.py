"""`blackout`, live, with a person at the console's page, who plays it by keys."""

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Self

from console_page import Visitor
from sitting import BlackoutPerson, Press

from farside.console.exercise import Exercise
from farside.console.page.hand import JUST_CHANGED
from farside.console.screen.screen import Screen
from farside.console.session import Session
from farside.console.station import Station
from farside.ground.view.view import OptionKind
from farside.missions import load_mission, run_mission
from farside.missions.commands.console.running import AtStation
from farside.missions.interrupts import Interrupts
from farside.missions.run import FinishedRun
from farside.node import to_ns

_PATIENCE_S = 20.0
_LOOKS, _LOOK_MS = 400, 50.0
_NOTE_S = 2.0  # a note that something was refused stands for longer
_KEYS = {"N": "ArrowUp", "E": "ArrowRight", "S": "ArrowDown", "W": "ArrowLeft"}
_MOMENT_NS = to_ns(600)


class HeardStation(Station):
    """A station that keeps what it answered, and that one can wait at.

    Attributes:
        said: its answers to orders, in order.
    """

    def __init__(self, session: Session, *, end: Callable[[], None]) -> None:
        super().__init__(session, end=end)
        self.said: list[str] = []

    def do(self, what: Callable[[Session], str]) -> str:
        """See `Station.do`."""
        with self._moved:
            said = super().do(what)
            if said:
                self.said.append(said)
            return said

    def comes(self, is_so: Callable[[Session], bool], within_s: float) -> bool:
        """Whether this becomes so of the session within some wall time."""
        with self._moved:
            return self._moved.wait_for(lambda: is_so(self._session), timeout=within_s)

    def until(self, what: str, is_so: Callable[[Session], bool]) -> None:
        """Wait until this is so of the session; `what` is it in words."""
        came = self.comes(is_so, _PATIENCE_S)
        assert came, f"waited in vain until {what}; {self.screen().if_nothing}"


def _is_back(session: Session) -> bool:
    """Whether a warp is over, and what is shown is as new as can be."""
    view = session._view
    return not session.pacing.until and view is not None and view.now_ns == session._now_ns


def _can(action: str, session: Session) -> bool:
    """Whether an action is known to lead somewhere from where the rover stands."""
    options = session.screen().options
    return any(one.action == action and one.kind is not OptionKind.INVALID for one in options)


class LiveRun:
    """`blackout` in a thread, for as long as the context lasts, at the pace of who is at its page.

    Args:
        out: folder for the log.

    Attributes:
        station: where the person sits.
    """

    def __init__(self, out: Path) -> None:
        loaded = load_mission("blackout", ('ground.operator="queued"',))
        self._interrupts = Interrupts()
        exercise = Exercise(lost_after_s=loaded.mission.rover.failsafe.lost_after_s)
        session = Session("blackout", to_ns(loaded.mission.duration_s), exercise=exercise)
        self.station = HeardStation(session, end=self._interrupts.request)
        self._run = partial(
            run_mission,
            loaded,
            in_process=True,
            out=out,
            watcher=AtStation(self.station, self._interrupts),
            interrupts=self._interrupts,
        )
        self._finished: FinishedRun | None = None
        self._thread = threading.Thread(target=self._go, name="live run")

    def _go(self) -> None:
        self._finished = self._run()
        self.station.finish(f"The run is over: {self._finished.result.outcome}.")

    def finish(self) -> FinishedRun:
        """Wait until the run is over."""
        self._thread.join()
        assert self._finished is not None, "the run failed"
        return self._finished

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._interrupts.request()
        self.station.leave()
        self._thread.join()


class Player:
    """Somebody who plays `blackout` at a page, and warps time from one arrival to the next.

    Args:
        station: what the page shows.
        visitor: the page in a browser.

    Attributes:
        visitor: the page; another one goes on where command was handed over to it.
        person: who says what to do.
    """

    def __init__(self, station: HeardStation, visitor: Visitor) -> None:
        self.station, self.visitor = station, visitor
        self.person = BlackoutPerson()

    @property
    def screen(self) -> Screen:
        """What is on the page, or will be in a moment."""
        return self.station.screen()

    def play(self, until: Callable[[Screen], bool]) -> None:
        """Play until this is so of the screen, and look at it: time stands then."""
        while not until(screen := self.screen):
            chart = self.station.chart
            press = self.person.next(screen, chart) if chart is not None else None
            if press is not None:
                self._do(press)
            else:
                self._let_pass(screen)
        self._stop()

    def order(self, *keys: str, settled: bool = False) -> str:
        """Press keys that order one thing; the answer."""
        if settled:
            self._settle()
        return self._answered(lambda: self.visitor.press(*keys), str(keys))

    def _settle(self) -> None:
        """Wait until the page's keys mean what is so, and have meant it for long enough."""
        for _ in range(_LOOKS):
            card, paused = self.screen.proposal, self.screen.paused
            number = card.number if card is not None and card.can_answer else 0
            if self.visitor.shows(number, paused=paused):
                break
            self.visitor.page.wait_for_timeout(_LOOK_MS)
        self.visitor.settle()

    def click(self, name: str) -> str:
        """Click a button that orders something; the answer."""
        button = self.visitor.page.get_by_role("button", name=name, exact=True)
        return self._answered(button.click, name)

    def _answered(self, act: Callable[[], object], name: str) -> str:
        count = len(self.station.said)
        act()
        answered = self.station.comes(lambda _: len(self.station.said) > count, _NOTE_S)
        if not answered and self.visitor.page.get_by_text(JUST_CHANGED).count():
            self._settle()  # on a busy machine it may have changed since it was looked at
            act()
        self.station.until(f"{name} is answered", lambda _: len(self.station.said) > count)
        return self.station.said[count]

    def _do(self, press: Press) -> None:
        card = self.screen.proposal
        if card is not None:
            self.visitor.sees(card.title)
        match press.what:
            case "choose":
                self.station.until(f"{press.which} can be chosen", partial(_can, press.which))
                said = self.order(
                    _KEYS[press.which], settled=card is not None or not self.station.said
                )
            case "approve":
                said = self.order("Enter", settled=True)
            case "goal":
                self._stop()
                self.visitor.press("g")
                self.visitor.page.locator("input:focus").wait_for()
                said = self.order(*press.which, "Enter")
                self.visitor.sees_no_dialog()
            case _:
                self.visitor.press("m")
                self.visitor.sees("the model on board proposes")
                said = self.order(press.which[0])
                self.visitor.sees_no_dialog()
        assert not said.startswith("not "), f"{press}: {said}"

    def _stop(self) -> None:
        if not self.screen.paused and not self.screen.over:
            self.visitor.sees("▮▮ pause")
            self.order(" ", settled=True)

    def _let_pass(self, screen: Screen) -> None:
        """Until something arrives; where nothing will, for a moment."""
        if self.person.stage == "wait":
            self.click("10x")
            self._until_then(_MOMENT_NS)
        elif screen.on_the_way or screen.waiting or screen.mode.text == "SHARED":
            self.order("n")
            self.station.until("something arrives", _is_back)
        else:
            if screen.paused:
                self.visitor.sees("▶ go on")
                self.order(" ", settled=True)
            self._until_then(screen.now_ns + 1)

    def _until_then(self, now_ns: int) -> None:
        self.station.until(
            "time has passed",
            lambda session: session._now_ns >= now_ns or bool(session.pacing.slowed),
        )
