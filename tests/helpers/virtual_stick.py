"""A stick that SDL2 takes for real, at a station that has no run behind it."""

import ctypes
import time
from collections.abc import Callable
from queue import SimpleQueue
from types import TracebackType
from typing import Self

from farside.console.screen.screen import MapView, OptionRow, ProposalCard, Said, Screen, Strip
from farside.console.stick.device import InSession
from farside.console.stick.sdl import load
from farside.ground.view.view import OptionKind
from farside.node import to_ns

LIGHT_NS = to_ns(20 * 60.0)
_AXES, _BUTTONS = 6, 15
_FULL = 32767
_PATIENCE_S = 10


def options(**kinds: str) -> tuple[OptionRow, ...]:
    """The four actions, free but for those named."""
    return tuple(
        OptionRow(action, OptionKind(kinds.get(action, "free")), 0.5, f"drives {action}", "a wall")
        for action in "NESW"
    )


def screen_of(rows: tuple[OptionRow, ...], proposal: int | None = None) -> Screen:
    """What the ground shows, a light time of 20 minutes away from the rover."""
    card = None if proposal is None else ProposalCard(proposal, "E", "E", (), can_answer=True)
    now_ns = 3 * LIGHT_NS
    return Screen(
        "far", now_ns, now_ns - LIGHT_NS, 9 * LIGHT_NS, 1.0, False, Said("mode", "SHARED"),
        "The rover waits.", MapView(), Strip(0, 0, 0), proposal=card, options=rows,
    )  # fmt: skip


class StationStub:
    """Shows a screen, and notes what is ordered."""

    def __init__(self, shown: Screen) -> None:
        self.shown = shown
        self.looks = 0
        self.ordered: SimpleQueue[str] = SimpleQueue()

    def screen(self) -> Screen:
        self.looks += 1
        return self.shown

    def do(self, what: Callable[[InSession], str]) -> str:
        return what(self)

    def choose(self, action: str, *, insist: bool = False) -> str:
        return self._note(f"choose {action}{', insisting' if insist else ''}")

    def approve(self, proposal: int) -> str:
        return self._note(f"approve {proposal}")

    def veto(self, proposal: int) -> str:
        return self._note(f"veto {proposal}")

    def _note(self, order: str) -> str:
        self.ordered.put(order)
        return f"ordered: {order}"


class VirtualStick:
    """A pad plugged into SDL2, or a plain joystick; unplugged at the end.

    Attributes:
        rumbles: how strongly it was told to rumble, 0 to 1, and when (ns of `perf_counter_ns`).
    """

    def __init__(self, *, is_pad: bool = True) -> None:
        self._sdl = sdl = load()
        self.rumbles: SimpleQueue[tuple[float, int]] = SimpleQueue()
        sdl.SDL_SetHint(sdl.SDL_HINT_NO_SIGNAL_HANDLERS, b"1")
        sdl.SDL_InitSubSystem(sdl.SDL_INIT_GAMECONTROLLER)
        self._felt = sdl.joystick.CFUNC_Rumble(self._feel)
        self._described = sdl.SDL_VirtualJoystickDesc(
            version=1, naxes=_AXES, nbuttons=_BUTTONS, name=b"a virtual pad", Rumble=self._felt
        )
        if is_pad:
            self._described.type = sdl.SDL_JOYSTICK_TYPE_GAMECONTROLLER
            self._described.axis_mask = (1 << _AXES) - 1
            self._described.button_mask = (1 << _BUTTONS) - 1
        self.plug_in()

    def plug_in(self) -> None:
        self._index = self._sdl.SDL_JoystickAttachVirtualEx(ctypes.byref(self._described))
        assert self._index >= 0, self._sdl.SDL_GetError()
        self._joystick = self._sdl.SDL_JoystickOpen(self._index)

    def unplug(self) -> None:
        self._sdl.SDL_JoystickClose(self._joystick)
        self._sdl.SDL_JoystickDetachVirtual(self._index)

    def push(self, x: float, y: float) -> None:
        """Push it to x (east) and y (north), each -1 to 1."""
        for axis, share in enumerate((x, -y)):
            self._sdl.SDL_JoystickSetVirtualAxis(self._joystick, axis, round(share * _FULL))

    def press(self, button: int, *, down: bool) -> None:
        self._sdl.SDL_JoystickSetVirtualButton(self._joystick, button, int(down))

    def wait(self, is_it: Callable[[float], bool]) -> tuple[float, int]:
        """The next rumble of this kind: its strength and when it came."""
        until_s = time.monotonic() + _PATIENCE_S
        while True:
            rumble = self.rumbles.get(timeout=max(0.0, until_s - time.monotonic()))
            if is_it(rumble[0]):
                return rumble

    def _feel(self, _: int | None, low: int, high: int) -> int:
        self.rumbles.put((max(low, high) / 0xFFFF, time.perf_counter_ns()))
        return 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.unplug()
        self._sdl.SDL_QuitSubSystem(self._sdl.SDL_INIT_GAMECONTROLLER)
