"""The status strip: two clocks with their names, the pace of time, the mode, what is on the way."""

from collections.abc import Callable

from nicegui import ui

from farside.console.page.hand import Press, What
from farside.console.page.parts import Facts, Words, toned
from farside.console.screen.screen import Screen, Tone
from farside.console.wording import clock_text

PACES = (1.0, 10.0, 60.0)


class Top:
    """The status strip.

    Args:
        press: orders something.
        ask: asks for command, or hands it over.
        asks_mode: opens the choice of the mode.
        asks_help: opens the help.
    """

    def __init__(
        self,
        press: Callable[[Press], None],
        *,
        ask: Callable[[], None],
        asks_mode: Callable[[], object],
        asks_help: Callable[[], object],
    ) -> None:
        self._press = press
        with ui.element("header"):
            with ui.element("div").classes("clocks"):
                self._mission = ui.label().classes("mission")
                self._here = _clock("here")
                self._rover = _clock("rover, as far as light goes")
                ui.element("span").classes("grow")
                self._paces()
                self._seat = ui.button(color=None, on_click=ask).props("no-caps")
                help_ = ui.button("?", color=None, on_click=asks_help).props("no-caps")
                help_.props('aria-label="help: all keys"')
            with ui.element("div").classes("status"):
                self._mode = ui.button(color=None, on_click=asks_mode).classes("mode")
                self._mode.props("no-caps")
                self._facts = Facts()
                self._way = Words("way")
                ui.element("span").classes("grow")
                self._pace = Words("pace")

    def _paces(self) -> None:
        with ui.element("div").classes("paces").props('role=group aria-label="pace of time"'):
            self._pause = ui.button(color=None).props("no-caps").classes("pause")
            self._pause.on("click", js_handler="() => farside.pause()")
            self._speeds: dict[float, ui.button] = {}
            for speed in PACES:
                button = self._button(f"{speed:g}x", Press(What.SPEED, amount=speed))
                self._speeds[speed] = button
            self._arrival = self._button("next arrival", Press(What.ARRIVAL))
            self._contact = self._button("next contact", Press(What.CONTACT))

    def _button(self, text: str, press: Press) -> ui.button:
        button = ui.button(text, color=None, on_click=lambda: self._press(press))
        return button.props("no-caps")

    def show(self, screen: Screen) -> None:
        """Show what is so now."""
        self._mission.set_text(screen.mission)
        self._here.set_text(clock_text(screen.now_ns))
        self._rover.set_text(clock_text(max(0, screen.rover_ns)))
        self._pace.say(screen.over or screen.standing or _pace(screen))
        tone = Tone.WORD if screen.over else Tone.CAUTION if screen.standing else Tone.PLAIN
        toned(self._pace.label, tone)
        self._pause.set_text("▶ go on" if screen.paused else "▮▮ pause")
        plain = not screen.paused and not screen.warp
        for speed, button in self._speeds.items():
            _pressed(button, pressed=plain and speed == screen.speed)
        self._mode.set_text(screen.mode.text)
        toned(self._mode, screen.mode.tone, stale=screen.mode.stale)
        self._facts.show(screen.status)
        self._way.say(f"{screen.on_the_way} ON THE WAY" if screen.on_the_way else "")

    def seat(self, text: str, *, asked: bool) -> None:
        """Say who commands; `asked`: whether another page asks for it."""
        self._seat.set_text(text)
        toned(self._seat, Tone.WORD if asked else Tone.PLAIN)


def _pace(screen: Screen) -> str:
    pace = "time stands" if screen.paused else screen.warp or f"at {screen.speed:g}x"
    return " · ".join(filter(None, [pace, screen.slowed]))


def _clock(name: str) -> ui.label:
    with ui.element("span").classes("clock"):
        ui.label(name).classes("name")
        return ui.label().classes("time")


def _pressed(button: ui.button, *, pressed: bool) -> None:
    word = "true" if pressed else "false"
    if button.props.get("aria-pressed") != word:
        button.props(f"aria-pressed={word}")
