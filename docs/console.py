"""Makes docs/console/*: what a person at the console sees in the main moments of `blackout`.

The person plays by the screen alone, and looks at every window. So the moments are the same on
every machine, and what stands on the screen is stored beside each picture, to tell when the
picture has to be made anew.
"""

import tempfile
import threading
from collections.abc import Callable
from functools import partial
from io import BytesIO
from pathlib import Path
from typing import Literal, NamedTuple

from browsing import chromium
from console_page import Visitor, visiting
from PIL import Image
from playwright.sync_api import Browser
from seats import Seat, seated
from sitting import BlackoutPerson, Sitting, sat

from farside.console.page.serving import serving
from farside.console.screen.screen import Screen
from farside.console.station import Station
from farside.console.text.app import ConsoleApp
from farside.console.wording import clock_text
from farside.node import to_ns

FOLDER = Path(__file__).with_name("console")

_LAPTOP, _TABLET, _TERMINAL = (1280, 800), (820, 1180), (110, 36)
_COLOURS = 96


class Moment(NamedTuple):
    """A moment to make a picture of.

    Attributes:
        name: of the picture.
        is_now: whether this is it, on the first screen of which it is true.
        view: how the map is shown.
        size: of the window; in columns and rows, of the terminal.
        scheme: light or dark; `text` is the terminal.
    """

    name: str
    is_now: Callable[[Screen], bool]
    view: Literal["map", "heat", "columns", "meanwhile"] = "map"
    size: tuple[int, int] = _LAPTOP
    scheme: Literal["light", "dark", "text"] = "light"


def _proposes(number: int, screen: Screen) -> bool:
    card = screen.proposal
    return card is not None and card.number == number and card.can_answer


def _at(seconds: float, screen: Screen) -> bool:
    return screen.now_ns >= to_ns(seconds)


def _drives(seconds: float, screen: Screen) -> bool:
    return _at(seconds, screen) and screen.on_the_way > 0


MOMENTS = (
    Moment("driving", partial(_drives, 60)),
    Moment("terminal", partial(_drives, 90), size=_TERMINAL, scheme="text"),
    Moment("proposal", partial(_proposes, 2)),
    Moment("columns", partial(_proposes, 3), view="columns"),
    Moment("night", partial(_proposes, 5), view="heat", scheme="dark"),
    Moment("silence", partial(_at, 635)),
    Moment("tablet", partial(_at, 700), size=_TABLET),
    Moment("told", lambda screen: "meanwhile" in str(screen.events)),
    Moment("meanwhile", partial(_at, 990), view="meanwhile"),
)


def picture(moment: Moment) -> str:
    """The name of the file with the picture of a moment."""
    return f"{moment.name}.{'svg' if moment.scheme == 'text' else 'png'}"


def texts(screen: Screen) -> str:
    """What stands on a screen, line by line."""
    card = screen.proposal
    lines = [
        f"here {clock_text(screen.now_ns)}, rover {clock_text(screen.rover_ns)}",
        f"{screen.mode.text}, {screen.on_the_way} on the way",
        *(f"{said.name} {said.text}" for said in screen.status),
        screen.if_nothing,
        card.title if card else "no proposal",
        *(f"{said.name} {said.text}" for said in (card.facts if card else ())),
        *(f"{row.number} {row.text}: {', '.join(row.words)}" for row in screen.commands),
        *(row.text for row in screen.goals),
        *(
            f"{said.name} {said.text}"
            for said in (*screen.rover, *screen.model, *screen.failsafe, *screen.link)
        ),
        *(f"{clock_text(row.learned_ns)} {row.text}" for row in screen.alarms),
        *(f"{clock_text(row.learned_ns)} {row.text}" for row in screen.events[:8]),
        f"{sum(step.done for step in screen.exercise)} steps done",
    ]
    return "\n".join(lines) + "\n"


class Looking(Sitting):
    """A person who shows somebody else the screen in the moments that are worth a picture."""

    def __init__(
        self,
        station: Station,
        person: BlackoutPerson,
        *,
        show: Callable[[Moment, Station, Screen], None],
    ) -> None:
        super().__init__(station, person)
        self._left = list(MOMENTS)
        self._show = show

    def look(self, screen: Screen) -> None:
        """See `Sitting.look`."""
        super().look(screen)
        while self._left and self._left[0].is_now(screen):
            self._show(self._left.pop(0), self._station, screen)


class _Photographer:
    """Makes the pictures."""

    def __init__(self, browser: Browser) -> None:
        self._browser = browser

    def __call__(self, moment: Moment, station: Station, screen: Screen) -> None:
        (FOLDER / f"{moment.name}.txt").write_text(texts(screen))
        if moment.scheme == "text":
            # Textual wants a thread without a browser's event loop.
            thread = threading.Thread(target=_terminal, args=(moment, station))
            thread.start()
            thread.join()
        else:
            self._page(moment, station, screen)

    def _page(self, moment: Moment, station: Station, screen: Screen) -> None:
        width, height = moment.size
        scheme: Literal["light", "dark"] = "dark" if moment.scheme == "dark" else "light"
        with (
            serving(station) as page,
            visiting(
                self._browser, page.address, width=width, height=height, scheme=scheme
            ) as visitor,
        ):
            visitor.sees(clock_text(screen.now_ns))
            _turn(moment, station, visitor, screen)
            visitor.page.mouse.move(5, 5)
            visitor.look()
            shot = Image.open(BytesIO(visitor.page.screenshot()))
        few = shot.convert("RGB").quantize(_COLOURS, dither=Image.Dither.NONE)
        few.save(FOLDER / picture(moment), optimize=True)


def _turn(moment: Moment, station: Station, visitor: Visitor, screen: Screen) -> None:
    """Show the map or the list that the moment is about."""
    if moment.view == "meanwhile":
        visitor.page.get_by_label("what it did meanwhile").click()
    elif moment.view != "map":
        visitor.page.get_by_role("button", name=moment.view, exact=True).click()
        station.watch(screen.now_ns, (), ending=lambda: True)  # the ground looks again


def _terminal(moment: Moment, station: Station) -> None:
    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.wait(1)
        (FOLDER / picture(moment)).write_text(
            seat.app.export_screenshot(title="farside console --text")
        )

    seated(lambda now: ConsoleApp(station, now=now), does, moment.size)


def main() -> None:
    """Play the mission, and make a picture of every moment."""
    FOLDER.mkdir(exist_ok=True)
    with tempfile.TemporaryDirectory() as out, chromium() as browser:
        sat(Path(out), sitting=partial(Looking, show=_Photographer(browser)))


if __name__ == "__main__":
    main()
