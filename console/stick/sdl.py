"""The joystick or gamepad of this host, through SDL2. It needs no window and no display.

Only the one thread that makes a `Sticks` may use it: SDL says what happened to whoever pumps it.
"""

import ctypes
import warnings
from enum import StrEnum
from types import ModuleType
from typing import Any

import msgspec

from farside.console.stick.sinks import ForceSink, RumbleSink, Sink
from farside.escaping import printable

_FULL = 32767
_OLDEST = (2, 0, 18)  # the first that says whether a device can rumble
_AT_ONCE = 64
_PLAIN_BUTTONS = (0, 1, 7)  # A, B, Start of a stick that SDL has no mapping for, as most count


class StickError(Exception):
    """Sticks cannot be used on this host; it says why and what to do."""


class Key(StrEnum):
    """The buttons that mean something."""

    A = "A"
    B = "B"
    START = "Start"


class Polled(msgspec.Struct, frozen=True):
    """What was polled: x to the east, y to the north, each -1 to 1, and the buttons pressed."""

    x: float
    y: float
    pressed: tuple[Key, ...] = ()


def load() -> ModuleType:
    """SDL2.

    Raises:
        StickError: if it is not installed, or too old.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # it warns of which library it has found
            import sdl2  # noqa: PLC0415 - asked for by few
    except ImportError as error:
        raise StickError(
            "a stick needs PySDL2, which is not installed: pip install 'farside[console]'"
        ) from error
    found = sdl2.SDL_version()
    sdl2.SDL_GetVersion(ctypes.byref(found))
    version = (int(found.major), int(found.minor), int(found.patch))
    if version < _OLDEST:
        told, oldest = (".".join(map(str, numbers)) for numbers in (version, _OLDEST))
        raise StickError(
            f"a stick needs SDL {oldest} or newer, found {told}: pip install 'farside[console]'"
        )
    return sdl2  # type: ignore[no-any-return]


class Sticks:
    """The first joystick or gamepad that is plugged in; when it is unplugged, the next.

    Attributes:
        name: what it calls itself; empty while there is none.
        sinks: what it can be felt by.
        opened: how often one was opened, so that a new one is told from the same.

    Raises:
        StickError: if SDL does not start.
    """

    def __init__(self, sdl: ModuleType) -> None:
        self.name = ""
        self.sinks: tuple[Sink, ...] = ()
        self.opened = 0
        self._sdl = sdl
        self._events = (sdl.SDL_Event * _AT_ONCE)()
        self._open: _Opened | None = None
        # SDL would take SIGTERM for itself; and without a window everything is background.
        sdl.SDL_SetHint(sdl.SDL_HINT_NO_SIGNAL_HANDLERS, b"1")
        sdl.SDL_SetHint(sdl.SDL_HINT_JOYSTICK_ALLOW_BACKGROUND_EVENTS, b"1")
        if sdl.SDL_InitSubSystem(sdl.SDL_INIT_GAMECONTROLLER) != 0:
            raise StickError(f"sticks cannot be read on this host: {_error(sdl)}")
        # Where it has no force feedback the sticks still work.
        self._has_haptics = sdl.SDL_InitSubSystem(sdl.SDL_INIT_HAPTIC) == 0
        self._settle()

    def poll(self, wait_ms: int) -> Polled | None:
        """What happened since it was last polled; `None` while no stick is plugged in.

        SDL looks every millisecond and this returns as soon as something happens, within `wait_ms`
        at the latest. It waits without the interpreter's lock, which a busy thread would not give
        back at once.
        """
        sdl = self._sdl
        pressed: list[Key] = []
        sdl.SDL_WaitEventTimeout(None, wait_ms)
        count = _AT_ONCE
        while count == _AT_ONCE:
            count = sdl.SDL_PeepEvents(
                self._events, _AT_ONCE, sdl.SDL_GETEVENT, sdl.SDL_FIRSTEVENT, sdl.SDL_LASTEVENT
            )
            for event in self._events[: max(count, 0)]:
                if event.type in {sdl.SDL_JOYDEVICEADDED, sdl.SDL_JOYDEVICEREMOVED}:
                    self._settle()
                elif self._open is not None:
                    pressed += self._open.take(event)
        opened = self._open
        return None if opened is None else Polled(opened.x, -opened.down, tuple(pressed))

    def close(self) -> None:
        """Let go of the stick, and of SDL."""
        self._let_go()
        if self._has_haptics:
            self._sdl.SDL_QuitSubSystem(self._sdl.SDL_INIT_HAPTIC)
        self._sdl.SDL_QuitSubSystem(self._sdl.SDL_INIT_GAMECONTROLLER)

    def _settle(self) -> None:
        """A device came or went: see that one is open, if there is any."""
        sdl = self._sdl
        if self._open is not None and not sdl.SDL_JoystickGetAttached(self._open.joystick):
            self._let_go()
        for index in range(sdl.SDL_NumJoysticks()):
            if self._open is None:
                self._open = _opened(sdl, index)
                if self._open is not None:
                    self._meet(self._open)

    def _meet(self, opened: "_Opened") -> None:
        sdl, joystick = self._sdl, opened.joystick
        self.opened += 1
        self.name = printable(
            (sdl.SDL_JoystickName(joystick) or b"a stick").decode("utf-8", "replace")
        )
        opened.haptic = Haptic.of(sdl, joystick) if self._has_haptics else None
        if opened.haptic is not None:
            self.sinks = (ForceSink(opened.haptic),)
        elif sdl.SDL_JoystickHasRumble(joystick):
            self.sinks = (RumbleSink(_Rumble(sdl, joystick)),)

    def _let_go(self) -> None:
        if self._open is not None:
            self._open.close()
        self._open, self.name, self.sinks = None, "", ()


class _Opened:
    """A device that is open, as a gamepad where SDL knows its layout, else as a joystick."""

    def __init__(self, sdl: ModuleType, joystick: object, gamepad: object) -> None:
        self.joystick = joystick
        self.haptic: Haptic | None = None
        self._sdl, self._gamepad = sdl, gamepad
        self._id = sdl.SDL_JoystickInstanceID(joystick)
        axis = sdl.SDL_GameControllerGetAxis if gamepad else sdl.SDL_JoystickGetAxis
        self.x, self.down = (_share(axis(gamepad or joystick, index)) for index in (0, 1))
        a, b, start = (
            (
                sdl.SDL_CONTROLLER_BUTTON_A,
                sdl.SDL_CONTROLLER_BUTTON_B,
                sdl.SDL_CONTROLLER_BUTTON_START,
            )
            if gamepad
            else _PLAIN_BUTTONS
        )
        self._keys = {a: Key.A, b: Key.B, start: Key.START}

    def take(self, event: Any) -> list[Key]:
        """Take an event of SDL's; the buttons that it says were pressed."""
        sdl = self._sdl
        if self._gamepad:
            moves, presses = sdl.SDL_CONTROLLERAXISMOTION, sdl.SDL_CONTROLLERBUTTONDOWN
            axis, button = event.caxis, event.cbutton
        else:
            moves, presses = sdl.SDL_JOYAXISMOTION, sdl.SDL_JOYBUTTONDOWN
            axis, button = event.jaxis, event.jbutton
        if event.type == moves and axis.which == self._id:
            if axis.axis == 0:
                self.x = _share(axis.value)
            elif axis.axis == 1:
                self.down = _share(axis.value)
        elif event.type == presses and button.which == self._id and button.button in self._keys:
            return [self._keys[button.button]]
        return []

    def close(self) -> None:
        """Let go of it."""
        if self.haptic is not None:
            self.haptic.close()
        if self._gamepad:
            self._sdl.SDL_GameControllerClose(self._gamepad)
        else:
            self._sdl.SDL_JoystickClose(self.joystick)


def _opened(sdl: ModuleType, index: int) -> _Opened | None:
    """The device at this index, opened; `None` where it cannot be, or has no stick."""
    if sdl.SDL_IsGameController(index):
        gamepad = sdl.SDL_GameControllerOpen(index)
        return (
            _Opened(sdl, sdl.SDL_GameControllerGetJoystick(gamepad), gamepad) if gamepad else None
        )
    joystick = sdl.SDL_JoystickOpen(index)
    if not joystick:
        return None
    if sdl.SDL_JoystickNumAxes(joystick) < 2:
        sdl.SDL_JoystickClose(joystick)
        return None
    return _Opened(sdl, joystick, None)


class _Rumble:
    """The motors of a pad; see `Rumbling`."""

    def __init__(self, sdl: ModuleType, joystick: object) -> None:
        self._sdl, self._joystick = sdl, joystick

    def rumble(self, strength: float, for_ms: int) -> None:
        """See `Rumbling`."""
        level = round(strength * 0xFFFF)
        self._sdl.SDL_JoystickRumble(self._joystick, level, level, for_ms)


class Haptic:
    """The motors of a stick with force feedback; see `Forcing`."""

    def __init__(self, sdl: ModuleType, haptic: object) -> None:
        self._sdl, self._haptic = sdl, haptic
        self._running: dict[int, int] = {}

    @classmethod
    def of(cls, sdl: ModuleType, joystick: object) -> "Haptic | None":
        """Those of a stick; `None` where it has not both a spring and a constant force."""
        haptic = sdl.SDL_HapticOpenFromJoystick(joystick)
        if not haptic:
            return None
        motors = cls(sdl, haptic)
        motors.spring(0.0, 0.0, 0.0)
        motors.constant(0.0, 0.0, 0.0)
        if len(motors._running) == 2:
            return motors
        motors.close()
        return None

    def spring(self, level: float, x: float, y: float) -> None:
        """See `Forcing`."""
        effect = self._sdl.SDL_HapticEffect(type=self._sdl.SDL_HAPTIC_SPRING)
        condition = effect.condition
        condition.length = self._sdl.SDL_HAPTIC_INFINITY
        for axis, centre in enumerate((x, -y)):
            condition.right_sat[axis] = condition.left_sat[axis] = round(level * 0xFFFF)
            condition.right_coeff[axis] = condition.left_coeff[axis] = round(level * _FULL)
            condition.center[axis] = round(centre * _FULL)
        self._play(effect)

    def constant(self, level: float, x: float, y: float) -> None:
        """See `Forcing`."""
        effect = self._sdl.SDL_HapticEffect(type=self._sdl.SDL_HAPTIC_CONSTANT)
        constant = effect.constant
        constant.length = self._sdl.SDL_HAPTIC_INFINITY
        constant.direction.type = self._sdl.SDL_HAPTIC_CARTESIAN
        # SDL asks where a force comes from.
        constant.direction.dir[0], constant.direction.dir[1] = round(-x), round(y)
        constant.level = round(level * _FULL)
        self._play(effect)

    def close(self) -> None:
        """Let go of them."""
        self._sdl.SDL_HapticClose(self._haptic)

    def _play(self, effect: Any) -> None:
        sdl, kind = self._sdl, int(effect.type)
        if kind in self._running:
            sdl.SDL_HapticUpdateEffect(self._haptic, self._running[kind], ctypes.byref(effect))
            return
        number = sdl.SDL_HapticNewEffect(self._haptic, ctypes.byref(effect))
        if number >= 0:
            self._running[kind] = number
            sdl.SDL_HapticRunEffect(self._haptic, number, 1)


def _share(value: int) -> float:
    """An axis, -1 to 1."""
    return max(-1.0, value / _FULL)


def _error(sdl: ModuleType) -> str:
    return str(sdl.SDL_GetError().decode("utf-8", "replace"))
