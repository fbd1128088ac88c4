"""NEXT: what happens if nobody does anything, the proposal, and the actions with their cues."""

from nicegui import ui

from farside.console.page.parts import Facts, Words, toned
from farside.console.screen.screen import OptionRow, ProposalCard, Screen, Tone
from farside.console.stick.cues import Edge, cue_of, edge_of

_PLACES = {"N": "2 / 3", "W": "3 / 2", "E": "3 / 4", "S": "4 / 3"}
_ARROWS = {"N": "▲", "W": "◀", "E": "▶", "S": "▼"}


class Next:
    """The block. Its parts have their places whether or not a proposal stands."""

    def __init__(self) -> None:
        self._options: dict[str, tuple[ui.button, OptionRow | None]] = {}
        with ui.element("section").classes("next").props('aria-label="next"'):
            ui.label("NEXT").classes("head")
            self._nothing = ui.label().classes("nothing")
            with ui.element("div").classes("card"):
                self._title = Words("title")
                self._facts = Facts()
                self._conflicts = Words("conflicts tone-caution")
                self._runner_up = Words("soft")
                self._answered = Words("answered")
                with ui.element("div").classes("veto") as self._veto:
                    self._bar = ui.linear_progress(show_value=False, color=None).props(
                        "instant-feedback"
                    )
                    self._bar.props('aria-label="veto window"')
                    self._left = ui.label()
            with ui.element("div").classes("answer"):
                self._pad = (
                    ui.element("div").classes("pad").props('role=group aria-label="actions"')
                )
                with ui.element("div").classes("buttons"):
                    with ui.element("div").classes("pair"):
                        self._approve = _button("Approve ⏎", "approve")
                        self._no = _button("Veto ⌫", "veto")
                    ui.element("div").classes("cue farside-cue").props("role=note")

    def show(self, screen: Screen) -> None:
        """Show what is so now."""
        self._nothing.set_text(screen.if_nothing)
        self._card(screen.proposal)
        for option in screen.options:
            self._option(option)

    def _card(self, card: ProposalCard | None) -> None:
        self._title.say(card.title if card else "")
        self._facts.show(card.facts if card else ())
        self._conflicts.say("; ".join(card.conflicts) if card else "")
        self._runner_up.say(card.runner_up if card else "")
        self._answered.say(card.answered if card else "")
        left = card.veto_left_s if card else None
        self._veto.set_visibility(left is not None)
        if card and left is not None:
            self._bar.set_value(round(left / (card.veto_window_s or left or 1.0), 3))
            self._left.set_text(f"{max(0.0, left):.1f} s to veto")
        can = bool(card and card.can_answer)
        for button in (self._approve, self._no):
            button.set_enabled(can)
        toned(self._approve, Tone.WORD if can else Tone.PLAIN)

    def _option(self, option: OptionRow) -> None:
        action = option.action
        if action not in self._options:
            with self._pad:
                button = ui.button(color=None).props(f'no-caps data-option="{action}"')
                if action in _PLACES:
                    button.style(f"grid-area: {_PLACES[action]}")
                button.on(
                    "click", js_handler=f"(event) => farside.choose('{action}', event.shiftKey)"
                )
                self._options[action] = button, None
        button, shown = self._options[action]
        if option == shown:
            return
        self._options[action] = button, option
        button.set_text(f"{_ARROWS.get(action, '')} {action}".strip())
        edge = edge_of(cue_of(option))
        others = " ".join(f"edge-{other}" for other in Edge if other is not edge)
        button.classes(add=f"edge-{edge}", remove=others)
        told = ": ".join(filter(None, [action, option.does, option.why]))
        if button.props.get("aria-label") != told:
            button.props["aria-label"] = told


def _button(text: str, what: str) -> ui.button:
    button = ui.button(text, color=None).props(f'no-caps data-shows="{what}"')
    return button.on("click", js_handler=f"() => farside.answer('{what}')")
