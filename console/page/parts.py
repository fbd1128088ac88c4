"""Parts of the page: values with their tone, and lists that keep their rows in their places."""

import re
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Generic, Protocol, TypeVar

from nicegui import ui

from farside.console.screen.screen import Said, Tone

Item_contra = TypeVar("Item_contra", contravariant=True)
Item = TypeVar("Item")
_TONES = tuple(Tone)
_UNITS = re.compile(r"(?<=\d) (?=(?:s|m|J|kB)\b|%)|(?<=[<>]) (?=\d)")


def unbroken(text: str) -> str:
    """The text with every number and its unit on one line."""
    return _UNITS.sub("\N{NO-BREAK SPACE}", text)


def toned(element: ui.element, tone: Tone, *, stale: bool = False) -> None:
    """Draw an element in a tone: colour, and a mark before it that says the same."""
    # To ask is much cheaper than to change, and mostly nothing changes.
    if f"tone-{tone}" in element.classes and stale == ("stale" in element.classes):
        return
    others = [f"tone-{other}" for other in _TONES if other is not tone]
    element.classes(
        add=f"tone-{tone}{' stale' if stale else ''}",
        remove=" ".join(others if stale else [*others, "stale"]),
    )


class Words:
    """A text on the page that is sent only when it changes."""

    def __init__(self, classes: str = "", text: str = "") -> None:
        self.label = ui.label(text).classes(classes)
        self._is_shown = True
        self._said = text

    def say(self, text: str) -> None:
        """Set the text; without one it takes no room."""
        if text == self._said and self._is_shown == bool(text):
            return
        self._said = text
        self.label.set_text(unbroken(text))
        if bool(text) != self._is_shown:
            self._is_shown = bool(text)
            self.label.set_visibility(self._is_shown)


class Facts:
    """Values in a line, each with its name."""

    def __init__(self, classes: str = "") -> None:
        self._root = ui.element("div").classes(f"facts {classes}")
        self._shown: list[tuple[ui.element, ui.label, ui.label]] = []
        self._said: list[Said | None] = []

    def show(self, said: Sequence[Said]) -> None:
        """Show these values."""
        while len(self._shown) < len(said):
            with self._root, ui.element("span").classes("fact") as fact:
                self._shown.append((fact, ui.label().classes("name"), ui.label().classes("value")))
            self._said.append(None)
        for index, (fact, name, value) in enumerate(self._shown):
            new = said[index] if index < len(said) else None
            if new == self._said[index]:
                continue
            self._said[index] = new
            fact.set_visibility(new is not None)
            if new is not None:
                name.set_text(new.name)
                name.set_visibility(bool(new.name))
                value.set_text(unbroken(new.text))
                toned(fact, new.tone, stale=new.stale)


class Row(Protocol[Item_contra]):
    """A row of a list."""

    root: ui.element

    def show(self, item: Item_contra) -> None:
        """Show what is so of its item now."""


class Rows(Generic[Item]):
    """A list that grows away from the pointer: while the pointer is in it, no row comes or goes.

    Args:
        key: what an item is told apart by.
        make: makes the row of an item.
        empty: what stands there without any.
        label: what the list is, for a screen reader.
    """

    def __init__(
        self,
        key: Callable[[Item], Hashable],
        make: Callable[[Item], Row[Item]],
        *,
        label: str,
        empty: str = "",
    ) -> None:
        self._key, self._make = key, make
        self._rows: dict[Hashable, Row[Item]] = {}
        self._shown: dict[Hashable, Item] = {}
        self._is_held = False
        self._last: list[Item] = []
        self.root = ui.element("div").classes("rows").props(f'role=list aria-label="{label}"')
        self.root.on("mouseenter", lambda: self._hold(held=True), args=[])
        self.root.on("mouseleave", lambda: self._hold(held=False), args=[])
        with self.root:
            self._empty = ui.label(empty).classes("soft")

    def _hold(self, *, held: bool) -> None:
        self._is_held = held
        self.show(self._last)

    def show(self, items: Iterable[Item]) -> None:
        """Show these, the first above."""
        self._last = list(items)
        new = {self._key(item): item for item in self._last}
        if not self._is_held and list(new) != list(self._rows):
            self._arrange(new)
        for key, row in self._rows.items():
            if key in new and new[key] != self._shown.get(key):
                row.show(new[key])
        self._shown = {key: item for key, item in new.items() if key in self._rows}

    def _arrange(self, new: dict[Hashable, Item]) -> None:
        for key in [key for key in self._rows if key not in new]:
            self._rows.pop(key).root.delete()
        for index, (key, item) in enumerate(new.items()):
            if key not in self._rows:
                with self.root:
                    self._rows[key] = self._make(item)
                self._rows[key].root.props("role=listitem").move(self.root, target_index=index + 1)
        if list(self._rows) != list(new):
            self._rows = {key: self._rows[key] for key in new}
            for index, row in enumerate(self._rows.values()):
                if self.root.default_slot.children.index(row.root) != index + 1:
                    row.root.move(self.root, target_index=index + 1)
        self._empty.set_visibility(not new)
