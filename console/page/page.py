"""The page as one visitor has it: five places, kept as the station is."""

import time
from collections.abc import Callable

import msgspec
from nicegui import events, ui

from farside.console.page.dialogs import (
    GoalDialog,
    Listing,
    event_words,
    help_dialog,
    mode_dialog,
    step_words,
    told_late,
)
from farside.console.page.hand import JUST_CHANGED, SETTLED_MS, Hand, Press, What
from farside.console.page.lists import Blocks, Foot, Way
from farside.console.page.next import Next
from farside.console.page.parts import Words, toned
from farside.console.page.shown import Picture, Visits, as_json
from farside.console.page.top import Top
from farside.console.screen.screen import Chart, EventRow, MapView, Screen, Spot, Tone
from farside.console.session import Session
from farside.console.stick.cues import TABLE
from farside.places import Chart as Places

_TICK_S = 0.09  # a tick comes late by what a busy machine takes: ten frames a second come of it
_HURRIED_S = 0.5  # drawing less often while nobody reads along leaves the processor to the run
_HEAD = (
    '<link rel="stylesheet" href="/farside/page.css"><script defer src="/farside/page.js"></script>'
)


class Page:
    """See the module. Made while NiceGUI builds the page of a client.

    Args:
        visits: what it has in common with the other pages of the station.
    """

    def __init__(self, visits: Visits) -> None:
        self._visits = visits
        self._hand = Hand(visits.station, visits.seats)
        self._client = ui.context.client
        self._version: int | None = None
        self._chart: Chart | None = None
        self._heat: tuple[Spot, ...] | None = None
        self._screen: Screen | None = None
        self._drawn_s = 0.0
        self._seat: tuple[bool, bool] | None = None
        self._seat_s = -SETTLED_MS
        self._announced: tuple[int, frozenset[int]] = (0, frozenset())
        self._read_until = 0
        self._wants_heat = False
        ui.add_head_html(_HEAD)
        self._build()
        self._client.on_connect(self._connected)
        self._client.on_disconnect(self._disconnected)
        ui.timer(_TICK_S, self._tick)

    # --- building ---

    def _build(self) -> None:
        goal = self._goal = GoalDialog(self._press, self._named)
        help_, mode = help_dialog(), mode_dialog(self._press)
        self._meanwhile, self._steps = Listing("What it did meanwhile"), Listing("Exercise")
        self._opens: dict[str, Callable[[], object]] = {
            "help": help_.open,
            "mode": mode.open,
            "goal": goal.open,
        }
        with ui.element("div").classes("console"):
            self._top = Top(
                self._press,
                ask=self._ask,
                asks_mode=self._opens["mode"],
                asks_help=self._opens["help"],
            )
            with ui.element("main"):
                with ui.element("div").classes("left"):
                    self._exercise = ui.button(color=None, on_click=self._open_steps)
                    self._exercise.classes("exercise").props("no-caps align=left")
                    self._map()
                    ui.element("div").classes("farside-strip").props(
                        'role=img aria-label="light strip"'
                    )
                with ui.element("div").classes("right"):
                    self._next = Next()
                    self._way = Way(self._press)
                    self._blocks = Blocks(self._press, goal.open)
            self._foot = Foot(self._press, self._open_meanwhile)
        self._live = ui.label().classes("unseen").props("role=status aria-live=polite")
        self._hands = ui.element("div").classes("farside-hands")
        self._hands.on("press", self._pressed, args=["detail"])
        self._hands.on("opens", self._opened, args=["detail"])

    def _map(self) -> None:
        with ui.element("div").classes("map"):
            ui.element("div").classes("farside-map").props('role=img aria-label="map"')
            with ui.element("div").classes("views"):
                views = ui.toggle({"map": "map", "heat": "heat", "columns": "columns"}, value="map")
                views.props("no-caps unelevated dense").classes("farside-views")
                views.on_value_change(self._viewed)
                self._views = views
            self._legend = Words("legend")

    # --- what the person does ---

    def _press(self, press: Press) -> None:
        self._tell(self._hand.order(press))

    def _pressed(self, event: events.GenericEventArguments) -> None:
        try:
            press = msgspec.convert(event.args["detail"], Press)
        except msgspec.ValidationError as error:
            self._tell(f"not done: {error}")
            return
        self._press(press)

    def _opened(self, event: events.GenericEventArguments) -> None:
        match event.args["detail"]:
            case "seat":
                self._ask()
            case "view":
                order = list(self._views.options)
                place = order.index(self._views.value)
                self._views.set_value(order[(place + 1) % len(order)])
            case str(name) if name in self._opens:
                self._opens[name]()

    def _viewed(self, event: events.ValueChangeEventArguments[str]) -> None:
        view = str(event.value)
        wants = view != "map"
        has = self._wants_heat if self._hand.has_stick else bool(self._heat)
        if (wants and not has) or (has and not wants and self._hand.has_stick):
            self._wants_heat = wants and self._hand.has_stick
            self._press(Press(What.HEAT, "shown" if wants else ""))
        self._run(f"farside.view({as_json(view)})")

    def _ask(self) -> None:
        if time.monotonic() - self._seat_s < SETTLED_MS / 1000:
            self._tell(JUST_CHANGED)
        elif self._hand.has_stick:
            self._tell(self._hand.hand_over())
        else:
            self._tell(self._hand.ask())

    def _open_steps(self) -> None:
        if self._screen:
            self._steps.open(step_words(self._screen.exercise))

    def _open_meanwhile(self) -> None:
        late = self._late()
        self._meanwhile.open(event_words(late) or [("nothing was learned late", "")])
        self._read_until = max([self._read_until, *(row.number for row in late)])
        self._press(Press(What.READ))

    def _tell(self, said: str) -> None:
        if said:
            refused = said.startswith("not ")
            with self._client:
                ui.notify(
                    f"▲ {said}" if refused else said,
                    position="bottom-left",
                    timeout=5000,
                    classes="said refused" if refused else "said",
                    group="said",
                    badgeStyle="display: none",
                )

    # --- what the person sees ---

    def _connected(self) -> None:
        self._hand.page = self._client.tab_id
        if self._hand.page:
            self._visits.seats.open(self._hand.page, time.monotonic())
        self._visits.station.do(Session.greet)
        self._version = self._chart = self._heat = None

    def _disconnected(self) -> None:
        if self._hand.page:
            self._visits.seats.close(self._hand.page, time.monotonic())

    def _tick(self) -> None:
        """Show what has changed, to a page that can hear it."""
        if not self._client.has_socket_connection:
            return
        self._show_seat()
        now_s = time.monotonic()
        if self._visits.station.is_hurried and now_s - self._drawn_s < _HURRIED_S:
            return
        picture = self._visits.pictures.newest()
        if picture.version != self._version:
            self._version, self._screen, self._drawn_s = picture.version, picture.screen, now_s
            self._draw(picture)
            self._show(picture.screen)

    def _draw(self, picture: Picture) -> None:
        chart = self._visits.station.chart
        if chart is not None and chart != self._chart:
            self._chart = chart
            self._run(f"farside.cues({as_json(TABLE)})")
            self._run(f"farside.chart({as_json(chart)})")
        if picture.heat != self._heat:
            self._heat = picture.heat
            self._run(f"farside.heat({as_json(picture.heat)})")
        self._run(f"farside.draw({picture.drawing})")

    def _show(self, screen: Screen) -> None:
        self._top.show(screen)
        self._next.show(screen)
        self._way.show(screen)
        self._blocks.show(screen)
        self._foot.show(screen)
        self._legend.say(_legend(screen.map))
        new = [row for row in self._late() if row.number > self._read_until]
        toned(self._foot.meanwhile, Tone.WORD if new else Tone.PLAIN)
        done = sum(step.done for step in screen.exercise)
        step = next((step for step in screen.exercise if not (step.done or step.missed)), None)
        self._exercise.set_visibility(bool(screen.exercise))
        marks = "".join(step.mark for step in screen.exercise)
        text = f"{step.text}: {step.how}" if step else "nothing more to do; press for all steps"
        self._exercise.set_text(f"Exercise {done}/{len(screen.exercise)} {marks}  {text}")
        self._announce(screen)

    def _announce(self, screen: Screen) -> None:
        """Say new proposals and alarms to a screen reader, and nothing else."""
        proposal = screen.proposal.number if screen.proposal else 0
        alarms = frozenset(row.number for row in screen.alarms if not row.acknowledged)
        before, self._announced = self._announced, (proposal, alarms)
        said = [f"alarm: {row.text}" for row in screen.alarms if row.number in alarms - before[1]]
        if screen.proposal and proposal != before[0]:
            said.append(screen.proposal.title)
        if said:
            self._live.set_text(". ".join(said))

    def _show_seat(self) -> None:
        seats = self._visits.seats
        if seats.asks is not None and seats.asks == self._hand.page:
            seats.ask(seats.asks, time.monotonic())  # whoever has it may be gone by now
        seat = (self._hand.has_stick, seats.asks is not None)
        if seat == self._seat:
            return
        if self._seat is not None:
            self._seat_s = time.monotonic()
        self._seat = seat
        has, asked = seat
        if has:
            self._top.seat("hand over command" if asked else "you command", asked=asked)
        else:
            self._top.seat("asked for command" if asked else "ask for command", asked=False)

    # --- small things ---

    def _late(self) -> list[EventRow]:
        screen = self._screen
        return told_late(screen.events, screen.now_ns - screen.rover_ns) if screen else []

    def _named(self) -> list[str]:
        chart = self._visits.station.chart
        return Places(chart.rows, chart.cell_m).named if chart else []

    def _run(self, code: str) -> None:
        self._client.run_javascript(code)


def _legend(shown: MapView) -> str:
    """What stands on the map, each with the mark that it has there."""
    marks = (
        ("●", shown.heard_label),
        ("◌", shown.now.label if shown.now else ""),
        ("──", shown.policy_label),
    )
    return "    ".join(f"{mark} {label}" for mark, label in marks if label)
