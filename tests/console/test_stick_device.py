"""A stick of this host, as SDL2 sees one: SDL's own virtual joystick."""

import sys
import threading
from collections.abc import Callable
from queue import SimpleQueue

import pytest
from virtual_stick import StationStub, VirtualStick, options, screen_of

from farside.console.screen.screen import Screen
from farside.console.seats import Seats
from farside.console.stick.device import HostStick

SOON_S = 10
A, B, START = 0, 1, 6


class Stand:
    """A stick at a station: what is said to the person, and a clock that the test moves."""

    def __init__(self, station: StationStub, seats: Seats | None = None) -> None:
        self.station = station
        self.said: SimpleQueue[str] = SimpleQueue()
        self.now_ns = 0
        self.stick = HostStick(station, seats, say=self.said.put, now_ns=lambda: self.now_ns)

    def hears(self) -> str:
        return self.said.get(timeout=SOON_S)

    def ordered(self) -> str:
        return self.station.ordered.get(timeout=SOON_S)

    def wait_half_a_second(self) -> None:
        self.now_ns += 500_000_000


def test_a_pad_is_felt_and_obeyed() -> None:
    stand = Stand(StationStub(screen_of(options(E="problematic"))))
    with VirtualStick() as pad, stand.stick:
        assert stand.hears() == (
            "stick: a virtual pad: the left stick chooses, A approves, B vetoes, "
            "Start takes command or hands it over; its cues are felt as rumble"
        )
        pad.push(0.5, 0)
        near, _ = pad.wait(lambda level: level > 0)
        pad.push(0.7, 0)
        nearer, _ = pad.wait(lambda level: level > near)
        assert nearer > 1.4 * near
        pad.push(0, 0)
        pad.wait(lambda level: level == 0)
        stand.wait_half_a_second()
        pad.push(1, 0)
        assert stand.ordered() == "choose E"
        assert stand.hears() == "ordered: choose E"


@pytest.mark.parametrize(("button", "order"), [(A, "approve 14"), (B, "veto 14")])
def test_the_buttons_answer_the_proposal(button: int, order: str) -> None:
    stand = Stand(StationStub(screen_of(options(E="proposed"), 14)))
    with VirtualStick() as pad, stand.stick:
        stand.hears()
        pad.wait(lambda level: level > 0)  # the long pulse with which a proposal comes
        stand.wait_half_a_second()
        pad.press(button, down=True)
        assert stand.ordered() == order


def test_a_joystick_that_sdl_does_not_know_is_a_stick_too() -> None:
    stand = Stand(StationStub(screen_of(options(N="invalid"))))
    with VirtualStick(is_pad=False) as stick, stand.stick:
        assert "a virtual pad" in stand.hears()
        stick.push(0, 0.5)
        assert stick.wait(lambda level: level > 0)[0] == 1.0


def test_no_stick_is_no_error_and_one_that_is_plugged_in_later_goes_on() -> None:
    stand = Stand(StationStub(screen_of(options(N="invalid"))))
    with stand.stick:
        assert stand.hears() == (
            "stick: none found on this host; plug one in at any time, or use the keys"
        )
        with VirtualStick() as pad:
            assert "rumble" in stand.hears()
            pad.unplug()
            assert stand.hears() == "stick: unplugged; plug one in at any time, or use the keys"
            pad.plug_in()
            assert "rumble" in stand.hears()
            pad.push(0, 0.5)
            pad.wait(lambda level: level > 0)


def test_without_pysdl2_it_says_which_extra_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sdl2", None)
    stand = Stand(StationStub(screen_of(options())))
    with stand.stick:
        assert stand.hears() == (
            "stick: a stick needs PySDL2, which is not installed: pip install 'farside[console]'"
        )


class StandingStation(StationStub):
    """At 20 minutes of light time: after the first look nothing is to be had until it is let go."""

    def __init__(self, shown: Screen) -> None:
        super().__init__(shown)
        self.goes_on = threading.Event()

    def screen(self) -> Screen:
        if self.looks:
            self.goes_on.wait(SOON_S)
        return super().screen()


def test_the_cue_waits_neither_for_light_nor_for_a_look_or_a_window() -> None:
    station = StandingStation(screen_of(options(E="problematic", W="invalid")))
    stand = Stand(station)
    with VirtualStick() as pad, stand.stick:
        stand.hears()
        for x in (0.5, -0.5):
            pad.push(x, 0)
            pad.wait(lambda level: level > 0)
            pad.push(0, 0)
            pad.wait(lambda level: level == 0)
        assert station.looks == 1
        station.goes_on.set()


class ChangingStation(StationStub):
    """What is proposed changes at the very moment when an order is handed in."""

    def do(self, what: Callable[..., str]) -> str:
        self.shown = screen_of(options(E="proposed"), 15)
        return super().do(what)


def test_an_order_for_options_that_have_gone_is_not_given() -> None:
    station = ChangingStation(screen_of(options(E="proposed"), 14))
    stand = Stand(station)
    with VirtualStick() as pad, stand.stick:
        stand.hears()
        pad.wait(lambda level: level > 0)
        stand.wait_half_a_second()
        pad.press(A, down=True)
        assert stand.hears() == (
            "not ordered: the options changed meanwhile; look, and choose again"
        )
    assert station.ordered.empty()


def test_a_stick_orders_nothing_while_a_page_commands() -> None:
    seats = Seats()
    seats.open("page", 0.0)
    stand = Stand(StationStub(screen_of(options(E="proposed"), 14)), seats)
    with VirtualStick() as pad, stand.stick:
        stand.hears()
        pad.wait(lambda level: level > 0)
        stand.wait_half_a_second()
        pad.press(A, down=True)
        assert stand.hears() == "not ordered: a page commands now; Start asks it to hand over"
        assert stand.station.ordered.empty()
        pad.press(START, down=True)
        assert stand.hears() == "asked the page that commands to hand over"
        assert seats.hand_over("page")
        assert stand.hears() == "this stick commands now"
        pad.press(B, down=True)
        assert stand.ordered() == "veto 14"
