"""The console in a terminal: a person at the ground station, over SSH if need be."""

import re
import time
from collections.abc import Callable
from functools import partial
from operator import methodcaller
from typing import ClassVar, NamedTuple

from rich.console import Group
from rich.text import Text
from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.geometry import Size
from textual.widgets import Input, Static

from farside.console.pacing import Until
from farside.console.screen.screen import Tone
from farside.console.session import Session
from farside.console.text.blocks import newest_open, status_rows
from farside.console.text.board import LEAST_HEIGHT, LEAST_WIDTH, board
from farside.console.text.keys import foot_keys
from farside.console.text.pages import Page, Pages
from farside.console.text.place import StationLike
from farside.console.text.words import filled, line, told
from farside.control import Mode, OnLoss
from farside.logs.terminal.taking import WholeTerminal
from farside.logs.terminal.transport import keys_text
from farside.messages import Tokens
from farside.places import Chart as Places
from farside.places import place_token

QUIET_S = 0.5
"""Wall time for which a proposal that has just come is neither approved nor vetoed."""

_NOTE_S = 15.0  # wall time for which the answer to a key stands
_KEYS_FROM = 16, 30  # rows from which the keys have a row, and as many as they need
_MODES = {"g": Mode.GUIDED, "s": Mode.SHARED, "a": Mode.AUTONOMOUS}
_ON_LOSS = {"o": OnLoss.AUTONOMY, "h": OnLoss.HOLD}


class _Question(NamedTuple):
    """Something asked in the foot that one key answers."""

    text: str
    answers: dict[str, Callable[[], str]]


class ConsoleApp(WholeTerminal):
    """The operator's place on the whole terminal; all that it shows is of the station's screen.

    Args:
        station: the station.
        now: wall time in seconds, from any origin.
    """

    CSS = """
    Screen { layout: vertical; overflow: hidden; }
    Static { width: 100%; height: auto; }
    #board { height: 1fr; }
    #foot { height: 1; }
    #goal { display: none; height: 1; border: none; padding: 0 1; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        *(
            (f"{prefix}{arrow},{letter}", f"choose('{action}', {insists})")
            for action, arrow, small in (
                ("N", "up", "w"),
                ("E", "right", "d"),
                ("S", "down", "s"),
                ("W", "left", "a"),
            )
            for prefix, letter, insists in (("", small, False), ("shift+", small.upper(), True))
        ),
        ("enter", "approve"),
        ("backspace", "veto"),
        ("escape", "take_back"),
        ("g", "goal"),
        ("m", "mode"),
        ("p", "path"),
        ("h", "heat"),
        ("space", "pause"),
        ("comma", "slower"),
        ("full_stop", "faster"),
        ("n", "warp('ARRIVAL')"),
        ("c", "warp('CONTACT')"),
        ("x", "acknowledge"),
        ("e", "in_full"),
        ("question_mark", "help"),
        ("q", "leave"),
        Binding("ctrl+c", "end", priority=True),
        Binding("ctrl+q", "leave", priority=True),
    ]

    def __init__(self, station: StationLike, *, now: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._station, self._wall_s = station, now
        self._shown = station.screen()
        self._drawn: tuple[int, Size] | None = None
        self._places: Places | None = None
        self._proposal: tuple[int | None, float] = (None, 0.0)
        self._question: _Question | None = None
        self._pages = Pages()
        self._looked_at: str | None = None
        self._heat = self._ends = False
        self._note = self._news = ""
        self._noted_s = 0.0
        self._board, self._foot = Static(id="board"), Static(id="foot")
        self._keys, self._keys_shown = Static(id="keys"), list[Text]()
        self._goal = Input(id="goal", compact=True, select_on_focus=False)

    def compose(self) -> ComposeResult:
        """See `textual.app.App`."""
        yield from (self._board, self._foot, self._goal, self._keys)

    def on_resize(self) -> None:
        """Draw it in its new size."""
        self._draw()

    def tick(self) -> None:
        """Draw what is so now, if anything changed."""
        if self._drawn != (self._station.version, self.size):
            self._draw()
        if self._shown.over and self._ends:
            self.exit()

    # --- drawing -------------------------------------------------------------------------------

    def _draw(self) -> None:
        self._drawn = self._station.version, self.size
        self._shown = screen = self._station.screen()
        number = screen.proposal.number if screen.proposal is not None else None
        if number != self._proposal[0]:
            self._proposal = number, self._wall_s()
        news = screen.over or (f"back to 1x: {screen.slowed}" if screen.slowed else "")
        if news != self._news or self._wall_s() - self._noted_s > _NOTE_S:
            self._note, self._news = "", news
        width, height = self.size
        keys = keys_text(foot_keys(screen), width)
        keys = keys[: 0 if height < _KEYS_FROM[0] else 1 if height < _KEYS_FROM[1] else None]
        self._board.update(self._board_of(width, height - len(keys) - 1), layout=False)
        self._foot.update(self._foot_of(width), layout=False)
        if keys != self._keys_shown:
            self._keys_shown = keys
            self._keys.update(Group(*keys))
        self._keys.display = bool(keys)

    @property
    def _is_small(self) -> bool:
        width, height = self.size
        return width < LEAST_WIDTH or height <= LEAST_HEIGHT

    def _board_of(self, width: int, height: int) -> Group:
        screen = self._shown
        if self._is_small:
            few = f"{LEAST_WIDTH} columns by {LEAST_HEIGHT + 1} rows show more"
            rows = [*status_rows(screen, width), told(screen.if_nothing), told(few)]
            return Group(*filled([line(row, width) for row in rows], height))
        if self._pages.shown is not None:
            return Group(*self._pages.rows(screen, width, height))
        chart = self._station.chart
        if self._places is None and chart is not None:
            self._places = Places(chart.rows, chart.cell_m)
        return Group(board(screen, self._places, width, height))

    def _foot_of(self, width: int) -> Text:
        if self._question is not None:
            return line(told(self._question.text, Tone.WORD), width)
        if self._note:
            tone = Tone.CAUTION if self._note.startswith("not ") else Tone.PLAIN
            return line(told(self._note, tone), width)
        return line(told(self._news or "? shows the keys"), width)

    def tell(self, note: str) -> None:
        """Have something told with the next drawing; from any thread."""
        self._note, self._noted_s, self._drawn = note, self._wall_s(), None

    def _say(self, note: str) -> None:
        """Draw what a key brought about, and what there is to say of it."""
        self._note, self._noted_s = note, self._wall_s()
        self._draw()

    def _order(self, what: Callable[[Session], str]) -> None:
        self._say(self._station.do(what))

    # --- keys: orders --------------------------------------------------------------------------

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002
        """While a question waits for its key, or a page covers the board, keys are for these."""
        if action == "end":
            return True
        if self._question is not None:
            return False
        return self._pages.shown is None or action in {"help", "in_full", "take_back", "leave"}

    def on_key(self, event: events.Key) -> None:
        """The answer to a question; any other key is none, and Esc gives it up."""
        question = self._question
        if question is None:
            return
        event.prevent_default()  # no binding is to see it, too
        self._question = None
        answer = question.answers.get((event.character or event.key).lower())
        if answer is not None:
            self._say(answer())
        elif event.key == "escape":
            self._say("")
        else:
            self._question = question

    def action_choose(self, action: str, insist: bool) -> None:  # noqa: FBT001 - by position
        """Choose an action: answers the proposal, or drives."""
        self._order(lambda session: session.choose(action, insist=insist))

    def action_approve(self) -> None:
        """Approve the proposal that is on the screen."""
        self._answer("approved", lambda session, number: session.approve(number))

    def action_veto(self) -> None:
        """Veto the proposal that is on the screen."""
        self._answer("vetoed", lambda session, number: session.veto(number))

    def _answer(self, done: str, answer: Callable[[Session, int], str]) -> None:
        """Answer the proposal that stood here long enough to be read, and no other."""
        number, since_s = self._proposal
        if number is None:
            self._say(f"not {done}: no proposal stands")
        elif self._is_small:
            self._say(f"not {done}: the terminal is too small to show it")
        elif self._wall_s() - since_s < QUIET_S:
            self._say(f"not {done}: proposal {number} has only just come; press again")
        else:
            self._order(lambda session: answer(session, number))

    def action_take_back(self) -> None:
        """Give up what is typed, close what covers the board, or take back the newest command."""
        if self._goal.display:
            self._close_goal()
            return
        if self._pages.shown is not None:
            self._pages.close()
            self._proposal = None, 0.0  # one that has come meanwhile is seen only now
            self._say("")
            return
        newest = newest_open(self._shown)
        held = None if newest is None else newest.held
        if held is not None and held > 0:
            self._order(lambda session: session.discard(held))
        else:  # the session knows best what is newest by now
            self._order(lambda session: session.take_back())

    def action_mode(self) -> None:
        """Ask who is to drive, or what the rover does when the link is lost."""
        do = self._station.do
        answers: dict[str, Callable[[], str]] = {
            key: partial(do, methodcaller("set_mode", mode)) for key, mode in _MODES.items()
        }
        for key, on_loss in _ON_LOSS.items():
            answers[key] = partial(do, methodcaller("set_on_loss", on_loss))
        self._ask("g guided  s shared  a alone; on loss: o on alone  h hold", answers)

    def _ask(self, text: str, answers: dict[str, Callable[[], str]]) -> None:
        self._question = _Question(text, answers)
        self._draw()

    # --- keys: goals ---------------------------------------------------------------------------

    def action_goal(self) -> None:
        """Ask for a place."""
        named = ", ".join(self._places.named) if self._places is not None else ""
        self._goal.value = ""
        self._goal.placeholder = f"goal at {named} or 3,4? -B: none there; Esc: leave"
        self._foot.display, self._goal.display = False, True
        self._goal.focus()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Set the goal that was entered, or withdraw it."""
        entered = re.sub(r"\s*,\s*", ",", event.value.strip())
        self._close_goal()
        if entered.startswith("-"):
            self._withdraw(entered.removeprefix("-").strip())
            return
        place, _, priority = entered.partition(" ")
        try:
            worth = float(priority) if priority else None
        except ValueError:
            self._say(f"not ordered: expected a priority such as 2, found {priority!r}")
            return
        if place:
            self._order(lambda session: session.set_goal(place, worth))

    def _withdraw(self, place: str) -> None:
        tokens = next((t for t in self._goal_tokens() if {place, place_token(place)} & {*t}), None)
        if tokens is None:
            self._say(f"not withdrawn: there is no goal {place}")
        else:
            self._order(lambda session: session.withdraw_goal(tokens))

    def _goal_tokens(self) -> list[Tokens]:
        return [goal.tokens for goal in self._shown.goals]

    def _close_goal(self) -> None:
        self._goal.display, self._foot.display = False, True
        self.set_focus(None)
        self._draw()

    # --- keys: looking -------------------------------------------------------------------------

    def action_path(self) -> None:
        """Look at the path to the next goal."""
        names = [goal.name for goal in self._shown.map.goals]
        if not names:
            self._say("not shown: there is no goal on the map")
            return
        after = names.index(self._looked_at) + 1 if self._looked_at in names else 1
        self._looked_at = place = names[after % len(names)]

        def look(session: Session) -> str:
            session.look_at(place)
            return f"path to {place}"

        self._order(look)

    def action_heat(self) -> None:
        """Show the cost to go from every known place, or not."""
        self._heat = shown = not self._heat

        def show(session: Session) -> str:
            session.show_heat(shown)
            return "heat: 0 is nearest to the goal" if shown else "no heat"

        self._order(show)

    def action_in_full(self) -> None:
        """Show everything in full, or the next page of it."""
        note = self._turn(Page.ALL)

        def read(session: Session) -> str:
            session.read()
            return note

        self._order(read)

    def action_help(self) -> None:
        """Show all keys, or their next page."""
        self._say(self._turn(Page.HELP))

    def _turn(self, page: Page) -> str:
        width, height = self.size
        self._pages.turn(page, self._shown, width, height - len(self._keys_shown) - 1)
        return "the same key: next page  Esc: back" if self._pages.shown is not None else ""

    # --- keys: time, alarms, the end -----------------------------------------------------------

    def action_pause(self) -> None:
        """Let time stand, or pass."""
        self._order(lambda session: session.pause())

    def action_slower(self) -> None:
        """The next lower speed."""
        self._order(lambda session: session.slower())

    def action_faster(self) -> None:
        """The next higher speed."""
        self._order(lambda session: session.faster())

    def action_warp(self, until: str) -> None:
        """Let time pass until something happens."""
        self._order(lambda session: session.warp(Until[until]))

    def action_acknowledge(self) -> None:
        """Acknowledge the alarms."""
        self._order(lambda session: session.acknowledge())

    def action_leave(self) -> None:
        """Ask whether the run goes on; once it is over there is nothing to ask."""
        if self._shown.over:
            self.exit()
            return
        answers = {"e": self._end, "l": self._leave}
        self._ask("e end the run  l leave, it goes on  Esc stay", answers)

    def _leave(self) -> str:
        self.exit()
        return "the run goes on"

    def _end(self) -> str:
        if self._ends or self._shown.over:
            self.exit()
        self._ends = True
        self._station.end()
        return "the run ends"

    def action_end(self) -> None:
        """End the run, then leave; the second time, leave at once."""
        self._say(self._end())
