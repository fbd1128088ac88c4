"""The lists: commands on the way, goals, events and alarms."""

from collections.abc import Callable

import msgspec
from nicegui import ui

from farside.console.page.hand import Press, What
from farside.console.page.parts import Facts, Rows, Words, toned
from farside.console.screen.screen import AlarmRow, CommandRow, EventRow, GoalRow, Screen
from farside.console.wording import clock_text, times_text
from farside.places import is_place_token, place_name

Presses = Callable[[Press], None]


def _small(text: str, told: str, press: Callable[[], None] | None = None) -> ui.button:
    button = ui.button(text, color=None, on_click=press).props("no-caps dense").classes("small")
    button.props["aria-label"] = told
    return button


class _Command:
    """A command on its way, or what is held."""

    def __init__(self, press: Presses, row: CommandRow) -> None:
        if row.held is not None:
            order, button = Press(What.DISCARD, number=row.held), "discard ✕"
        else:
            order, button = Press(What.TAKE_BACK, number=row.number), "take back ✕"
        self._shown: CommandRow | None = None
        with ui.element("div").classes("command") as self.root:
            ui.label(str(row.number or "–")).classes("number")
            with ui.element("div").classes("what"):
                self._text = ui.label().classes("text")
                self._words = Words("soft")
            self._back = _small(
                button, f"{button[:-2]}: {row.number or ''} {row.text}", lambda: press(order)
            )

    def show(self, item: CommandRow) -> None:
        self._words.say(" · ".join(item.words))
        if self._shown == (rest := msgspec.structs.replace(item, words=())):
            return  # mostly the ages in the words are all that changes
        self._shown = rest
        self._text.set_text(item.text)
        self._back.set_visibility(item.can_take_back or item.held is not None)
        toned(self.root, item.tone)
        self.root.classes(add="over" if item.is_over else "", remove="" if item.is_over else "over")


class _Goal:
    """A goal that can be withdrawn."""

    def __init__(self, press: Presses, row: GoalRow) -> None:
        place = next(map(place_name, filter(is_place_token, row.tokens)), "")
        with ui.element("span").classes("goal-row") as self.root:
            self._text = ui.label().classes("text")
            _small(
                "✕",
                f"withdraw the goal {row.text}",
                lambda: press(Press(What.WITHDRAW, tokens=row.tokens)),
            )
        self.root.on("mouseenter", lambda: press(Press(What.LOOK, place)), args=[])
        self.root.on("mouseleave", lambda: press(Press(What.LOOK)), args=[])

    def show(self, item: GoalRow) -> None:
        self._text.set_text(item.text)
        toned(self.root, item.tone)


class _Event:
    """Something that happened."""

    def __init__(self, row: EventRow) -> None:
        with ui.element("div").classes("event") as self.root:
            ui.label(f"{clock_text(row.so_ns)} so").classes("soft")
            ui.label(f"{clock_text(row.learned_ns)} learned").classes("soft")
            ui.label(row.text).classes("what")
        toned(self.root, row.tone)

    def show(self, item: EventRow) -> None:
        """An event stays as it is."""


class _Alarm:
    """An alarm that stays until it is acknowledged."""

    def __init__(self, press: Presses, row: AlarmRow) -> None:
        with ui.element("div").classes("alarm") as self.root:
            self._text = ui.label().classes("text")
            self._times = ui.label().classes("soft")
            self._button = _small(
                "ack.",
                f"acknowledge: {row.text}",
                lambda: press(Press(What.ACKNOWLEDGE, alarms=(row.number,))),
            )

    def show(self, item: AlarmRow) -> None:
        self._text.set_text(item.text + (f" ({item.count} times)" if item.count > 1 else ""))
        self._times.set_text(times_text(item.so_ns, item.learned_ns))
        self._button.set_visibility(not item.acknowledged)
        toned(self.root, item.tone)


class Way:
    """ON THE WAY: every command, and whether it can still be taken back."""

    def __init__(self, press: Presses) -> None:
        with ui.element("section").classes("way-block").props('aria-label="on the way"'):
            ui.label("ON THE WAY").classes("head")
            self._rows = Rows[CommandRow](
                lambda row: (row.number, row.held, row.text if row.held else None),
                lambda row: _Command(press, row),
                label="commands",
                empty="nothing is on the way",
            )

    def show(self, screen: Screen) -> None:
        """Show what is so now."""
        self._rows.show(screen.commands)


class Blocks:
    """GOALS, ROVER, MODEL, FAILSAFE and LINK."""

    def __init__(self, press: Presses, asks_goal: Callable[[], None]) -> None:
        with ui.element("section").classes("blocks").props('aria-label="rover and link"'):
            with ui.element("div").classes("head"):
                ui.label("GOALS").style("display: inline")
                _small("+", "set a goal at a place", asks_goal)
            with ui.element("div").classes("goals"):
                self._goals = Rows[GoalRow](
                    lambda row: row.tokens,
                    lambda row: _Goal(press, row),
                    label="goals",
                    empty="none",
                )
            self._facts = {}
            for name in ("rover", "model", "failsafe", "link"):
                ui.label(name.upper()).classes("head")
                self._facts[name] = Facts()

    def show(self, screen: Screen) -> None:
        """Show what is so now."""
        self._goals.show(screen.goals)
        self._facts["rover"].show(screen.rover)
        self._facts["model"].show(screen.model)
        self._facts["failsafe"].show(screen.failsafe)
        self._facts["link"].show(screen.link)


class Foot:
    """Events, newest first, and alarms."""

    def __init__(self, press: Presses, asks_meanwhile: Callable[[], None]) -> None:
        self._all = False
        self._newest: tuple[EventRow, ...] = ()
        with ui.element("footer"):
            with ui.element("section").classes("events").props('aria-label="events"'):
                self._events = Rows[EventRow](
                    lambda row: row.number,
                    _Event,
                    label="events, newest first",
                    empty="nothing has happened",
                )
            with ui.element("section").classes("alarms").props('aria-label="alarms"'):
                with ui.element("div").classes("head"):
                    self._count = ui.label()
                    every = _small("ack. all (X)", "acknowledge all alarms")
                    every.on("click", js_handler="() => farside.acknowledge()")
                    ui.switch(
                        "all events", on_change=lambda event: self._show_all(all_=event.value)
                    ).props("dense")
                    self.meanwhile = _small("meanwhile", "what it did meanwhile", asks_meanwhile)
                self._alarms = Rows[AlarmRow](
                    lambda row: row.number,
                    lambda row: _Alarm(press, row),
                    label="alarms",
                    empty="none",
                )

    def _show_all(self, *, all_: bool) -> None:
        self._all = all_
        self._show_events()

    def show(self, screen: Screen) -> None:
        """Show what is so now."""
        self._newest = screen.events
        self._show_events()
        self._alarms.show(screen.alarms)
        count = sum(not row.acknowledged for row in screen.alarms)
        self._count.set_text(f"ALARMS {count}")

    def _show_events(self) -> None:
        self._events.show([row for row in self._newest if self._all or not row.routine])
