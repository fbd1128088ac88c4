"""A person at the terminal, before a screen that fills it."""

import asyncio
from collections.abc import Awaitable, Callable
from typing import Generic, TypeVar

from textual.pilot import Pilot

from farside.logs.terminal.app import ReplayApp
from farside.logs.terminal.taking import WholeTerminal
from farside.node import to_s

A = TypeVar("A", bound=WholeTerminal)


class Seat(Generic[A]):
    """A person at the terminal: presses keys, lets time pass, and looks."""

    def __init__(self, app: A, pilot: Pilot[None], clock: list[float]) -> None:
        self.app, self._pilot, self._clock = app, pilot, clock

    async def press(self, *keys: str) -> None:
        """Press keys one after the other."""
        await self._pilot.press(*keys)

    async def wait(self, seconds: float) -> None:
        """Let wall time pass."""
        self._clock[0] += seconds
        self.app.tick()
        await self._pilot.pause()

    async def resize(self, width: int, height: int) -> None:
        """Make the terminal larger or smaller."""
        await self._pilot.resize_terminal(width, height)

    @property
    def now_s(self) -> float:
        """Simulated time of what is on the screen of a replay."""
        assert isinstance(self.app, ReplayApp)
        return to_s(self.app.player.now_ns)

    @property
    def colours(self) -> set[str]:
        """The names of all colours on the screen, as the terminal is told them."""
        strips = self.app.screen._compositor.render_strips()
        styles = [segment.style for strip in strips for segment in strip if segment.style]
        return {
            colour.name for style in styles for colour in (style.color, style.bgcolor) if colour
        }

    @property
    def lines(self) -> list[str]:
        """The screen's rows, as text."""
        width, height = self.app.size
        strips = self.app.screen._compositor.render_strips()
        assert len(strips) == height
        return ["".join(segment.text for segment in strip)[:width] for strip in strips]

    @property
    def text(self) -> str:
        """The whole screen, as text."""
        return "\n".join(self.lines)


def seated(
    app: Callable[[Callable[[], float]], A],
    does: Callable[[Seat[A]], Awaitable[None]],
    size: tuple[int, int] = (80, 24),
) -> None:
    """Run an app, made with a clock, as long as a person does something with it."""
    clock = [1000.0]

    async def run() -> None:
        made = app(lambda: clock[0])
        async with made.run_test(size=size) as pilot:
            await does(Seat(made, pilot, clock))

    asyncio.run(run())
