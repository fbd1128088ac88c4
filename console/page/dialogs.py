"""Dialogs: help, mode, a goal by its place's name, what the rover did meanwhile, the exercise."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from nicegui import ui

from farside.console.page.hand import Press, What
from farside.console.screen.screen import EventRow, ExerciseStep
from farside.console.wording import times_text
from farside.control import Mode

KEYS = (
    ("arrows or W A S D", "choose an action"),
    ("Shift with one of them", "insist, although much speaks against it"),
    ("Enter", "approve the proposal"),
    ("Backspace", "veto the proposal"),
    ("Esc", "take back the newest command that can be taken back"),
    ("G, or a click", "set a goal at the pointer; G elsewhere: by its name"),
    ("M", "mode: guided, shared or autonomous"),
    ("space", "pause, go on"),
    (", and .", "slower, faster"),
    ("N", "until something arrives"),
    ("C", "until the next contact"),
    ("H", "map: plain, heat, columns"),
    ("X", "acknowledge all alarms"),
    ("?", "this help"),
    ("gamepad", "left stick: choose, hold it to insist; A approves, B vetoes; Start: command"),
)

MODES = {
    Mode.GUIDED: "the rover does what you command, and nothing of its own while the link is up",
    Mode.SHARED: "the model on board proposes, and acts only with your consent",
    Mode.AUTONOMOUS: "the rover pursues its goals by itself, until you take over",
}


def help_dialog() -> ui.dialog:
    """All keys."""
    with _dialog("Keys") as dialog:
        with ui.element("dl").classes("keys"):
            for key, does in KEYS:
                with ui.element("dt"):
                    ui.label(key)
                with ui.element("dd"):
                    ui.label(does)
        _close(dialog)
    return dialog


def mode_dialog(press: Callable[[Press], None]) -> ui.dialog:
    """The modes, each with what it will do."""

    def order(mode: Mode) -> Callable[[], None]:
        def ordered() -> None:
            dialog.close()
            press(Press(What.MODE, mode))

        return ordered

    with _dialog("Mode") as dialog:
        for mode, does in MODES.items():
            button = ui.button(color=None, on_click=order(mode)).props(
                f'no-caps align=left data-key="{mode[0]}"'
            )
            with button.classes("choice"):
                ui.label(f"{mode} ({mode[0].upper()})").classes("title")
                ui.label(does)
        _close(dialog)
    return dialog


class GoalDialog:
    """A goal by its place's name."""

    def __init__(self, press: Callable[[Press], None], places: Callable[[], list[str]]) -> None:
        self._press, self._places = press, places
        with _dialog("Goal") as self._dialog:
            self._place = ui.input("place, such as B or 7,4", autocomplete=[]).props("autofocus")
            self._place.on("keydown.enter", self._order, args=[])
            self._priority = ui.number("priority (may stay empty)", min=0)
            with ui.element("div").classes("pair"):
                ui.button("Set the goal", color=None, on_click=self._order).props("no-caps")
                _close(self._dialog)

    def open(self) -> None:
        """Open it."""
        self._place.set_autocomplete(self._places())
        self._place.set_value("")
        self._dialog.open()

    def _order(self) -> None:
        place = str(self._place.value or "").strip()
        if place:
            self._dialog.close()
            priority = self._priority.value
            self._press(
                Press(What.GOAL, place, amount=None if priority is None else float(priority))
            )


class Listing:
    """A dialog that lists something as it is when it opens."""

    def __init__(self, title: str) -> None:
        with _dialog(title) as self._dialog:
            self._list = ui.element("div").classes("listing").props("role=list")
            _close(self._dialog)

    def open(self, rows: Sequence[tuple[str, str]]) -> None:
        """List what was, and when or how."""
        self._list.clear()
        with self._list:
            for first, second in rows:
                with ui.element("div").classes("event").props("role=listitem"):
                    ui.label(first)
                    ui.label(second).classes("soft")
        self._dialog.open()


def told_late(events: Sequence[EventRow], light_ns: int) -> list[EventRow]:
    """The events learned more than 5 s later than light allows, the first first."""
    late_ns = light_ns + 5_000_000_000
    late = [row for row in events if row.learned_ns - row.so_ns > late_ns]
    return sorted(late, key=lambda row: row.so_ns)


def event_words(events: Sequence[EventRow]) -> list[tuple[str, str]]:
    """Events as rows of a listing."""
    return [(row.text, times_text(row.so_ns, row.learned_ns)) for row in events]


def step_words(steps: Sequence[ExerciseStep]) -> list[tuple[str, str]]:
    """Steps of the exercise as rows of a listing."""
    return [(f"{'✓' if step.done else '○'} {step.text}", step.how) for step in steps]


@contextmanager
def _dialog(title: str) -> Iterator[ui.dialog]:
    dialog = ui.dialog()
    dialog.props["aria-label"] = title
    with dialog, ui.card().classes("sheet"):
        ui.label(title).classes("title")
        yield dialog


def _close(dialog: ui.dialog) -> None:
    ui.button("Close", color=None, on_click=dialog.close).props("no-caps")
