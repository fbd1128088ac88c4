"""What the terminal needs of the place behind it."""

from collections.abc import Callable
from typing import Protocol

from farside.console.screen.screen import Chart, Screen
from farside.console.session import Session


class StationLike(Protocol):
    """What the terminal needs of `farside.console.station.Station`."""

    @property
    def version(self) -> int:
        """Grows with everything that may change the screen."""
        ...

    @property
    def chart(self) -> Chart | None:
        """The map; `None` before the ground has it."""
        ...

    def screen(self) -> Screen:
        """What is shown now."""
        ...

    def do(self, what: Callable[[Session], str], /) -> str:
        """Have something done with the session; what it says of it."""
        ...

    def end(self) -> None:
        """End the run after the window in progress."""
        ...
