"""What the page needs of a station, and the drawing that all pages are sent."""

from collections.abc import Callable
from typing import Protocol

import msgspec

from farside.console.screen.screen import Chart, MapView, OptionRow, Screen, Spot, Strip
from farside.console.seats import Seats
from farside.console.session import Session


class Shown(Protocol):
    """A station, as the page sees it."""

    version: int
    """Grows with every change."""

    @property
    def chart(self) -> Chart | None:
        """The map; `None` until it is known."""

    @property
    def is_hurried(self) -> bool:
        """Whether time passes so fast that nobody reads along."""

    def screen(self) -> Screen:
        """All that is shown now."""

    def do(self, what: Callable[[Session], str], /) -> str:
        """Ask something of the session; what to tell the person."""


class Newest(msgspec.Struct, frozen=True):
    """What Esc takes back: a command by its number, or what is held under its number of holding."""

    number: int
    held: int | None
    text: str


class Drawing(msgspec.Struct, frozen=True):
    """What the script of the page draws, and what its keys mean.

    Attributes:
        now_ns: the ground's clock.
        paused: whether time stands.
        map: the map, without its heat, which is sent when it changes.
        strip: the light strip.
        options: the actions with their cues.
        proposal: the number of the proposal that can be answered; 0 without one.
        proposed: its action.
        alarms: the numbers of those not acknowledged.
        newest: what can be taken back, the newest of it; `None` without one.
    """

    now_ns: int
    paused: bool
    map: MapView
    strip: Strip
    options: tuple[OptionRow, ...]
    proposal: int
    proposed: str
    alarms: tuple[int, ...]
    newest: Newest | None


class Picture(msgspec.Struct, frozen=True):
    """A screen, and its drawing as JSON: made once however many pages look."""

    version: int
    screen: Screen
    drawing: str
    heat: tuple[Spot, ...]


class Pictures:
    """The newest picture of a station."""

    def __init__(self, station: Shown) -> None:
        self._station = station
        self._newest: Picture | None = None

    def newest(self) -> Picture:
        """The picture of the station as it is."""
        version = self._station.version
        if self._newest is None or self._newest.version != version:
            self._newest = _picture(version, self._station.screen())
        return self._newest


class Visits:
    """What all pages of a station have in common.

    Attributes:
        station: the station.
        pictures: what it shows.
        seats: who commands.
    """

    def __init__(self, station: Shown) -> None:
        self.station = station
        self.pictures = Pictures(station)
        self.seats = Seats()


def _picture(version: int, screen: Screen) -> Picture:
    proposal = screen.proposal
    answerable = proposal is not None and proposal.can_answer
    drawing = Drawing(
        screen.now_ns,
        screen.paused,
        msgspec.structs.replace(screen.map, heat=()),
        screen.strip,
        screen.options,
        proposal.number if proposal and answerable else 0,
        proposal.action if proposal and answerable else "",
        tuple(row.number for row in screen.alarms if not row.acknowledged),
        next(
            (
                Newest(row.number, row.held, row.text)
                for row in screen.commands
                if row.can_take_back
            ),
            None,
        ),
    )
    return Picture(version, screen, as_json(drawing), screen.map.heat)


def as_json(shape: msgspec.Struct | tuple[Spot, ...] | str) -> str:
    """As JSON, for the script."""
    return msgspec.json.encode(shape).decode()
