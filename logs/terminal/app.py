"""The replay's screen, with its keys."""

import math
import time
from collections.abc import Callable
from typing import ClassVar

from rich.console import Group, RenderableType
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.geometry import Size
from textual.widgets import Input, Static

from farside.escaping import printable
from farside.logs.events import EventLine, time_text
from farside.logs.file.parts import LogError
from farside.logs.file.reading import LogEntry, LogFile
from farside.logs.moments import Moments
from farside.logs.picture import PICTURE_TOPICS
from farside.logs.playing import Player
from farside.logs.terminal.screen import LEAST_HEIGHT, LEAST_WIDTH, screen
from farside.logs.terminal.strip import STRIP_HEIGHT, LightStrip
from farside.logs.terminal.taking import WholeTerminal
from farside.logs.terminal.transport import (
    FAR_S,
    SEEK_S,
    STEP_S,
    Key,
    keys_of,
    keys_text,
    transport,
)
from farside.node import to_ns, to_s

SPEEDS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
"""Simulated seconds per wall second that `+` and `-` step through."""

_AS_GROUND = " as the ground knew it: nothing else is shown "
_STRIP_FROM = 29  # rows, without those of the keys
_KEYS_ROOM = 4  # rows above the least height from which the keys have theirs


class ReplayApp(WholeTerminal):
    """A log on the whole terminal, played by keys; in the terminal's own colours.

    Args:
        log: the log.
        speed: simulated seconds per wall second; `math.inf` goes straight to the end.
        start_ns: where to start.
        refresh: called before each update; brings a log up to date that is still being written,
            and says how that stands in a few words, if at all.
        now: wall time in seconds, from any origin.

    Attributes:
        player: what plays the log.
    """

    CSS = """
    Screen { layout: vertical; overflow: hidden; }
    Static { width: 100%; height: auto; }
    #board { height: 1fr; }
    #banner { height: 1; text-style: reverse; }
    #transport { height: 1; }
    #go { display: none; height: 1; border: none; padding: 0 1; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        ("space", "pause_or_play"),
        ("left", f"step({-STEP_S})"),
        ("right", f"step({STEP_S})"),
        ("shift+left", f"skip({-SEEK_S})"),
        ("shift+right", f"skip({SEEK_S})"),
        ("pageup", f"skip({-FAR_S})"),
        ("pagedown", f"skip({FAR_S})"),
        ("home", "edge(False)"),
        ("end", "edge(True)"),
        ("[", "previous_event"),
        ("]", "next_event"),
        ("+", "faster"),
        ("=", "faster"),
        ("-", "slower"),
        ("r", "reverse"),
        ("l", "loop"),
        ("g", "go"),
        ("escape", "close"),
        ("q", "quit"),
        ("ctrl+c", "quit"),
    ]

    def __init__(
        self,
        log: LogFile,
        *,
        speed: float = 1.0,
        start_ns: int = 0,
        refresh: Callable[[], str] = str,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        super().__init__()
        self.player = Player(log, PICTURE_TOPICS, speed=speed, start_ns=start_ns)
        self._source = log
        self._moments = Moments(log)
        self._strip = LightStrip(log)
        self._picture = self._moments.at(self.player.now_ns)
        self._refresh_log, self._wall_s = refresh, now
        self._seen_s = now()
        self._standing = ""
        self._drawn = Size()
        self._board, self._transport = Static(id="board"), Static(id="transport")
        self._keys, self._keys_shown = Static(id="keys"), list[Text]()
        self._go = Input(id="go", compact=True, select_on_focus=False)
        self._note = ""
        self._loop_from_ns: int | None = None

    def compose(self) -> ComposeResult:
        """See `textual.app.App`."""
        if self._source.is_as_ground:
            yield Static(Text(_AS_GROUND, no_wrap=True), id="banner")
        yield from (self._board, self._transport, self._keys, self._go)

    def on_resize(self) -> None:
        """Draw it in its new size."""
        self._draw()

    def tick(self) -> None:
        """Let the wall time since the last tick pass, and draw what is so then."""
        now_s = self._wall_s()
        passed_s, self._seen_s = now_s - self._seen_s, now_s
        before = self.player.now_ns, self._standing, self._drawn
        try:
            self._standing = self._refresh_log()
            played = self.player.advance(passed_s)
            if played.jumped:
                self._picture = self._moments.at(self.player.now_ns)
            else:
                for record in played.records:
                    self._picture.apply(LogEntry.of(record))
                self._picture.settle(self.player.now_ns)
        except LogError as error:
            self.fail(error)
            return
        if played.jumped or before != (self.player.now_ns, self._standing, self.size):
            self._draw()

    # --- drawing -------------------------------------------------------------------------------

    @property
    def keys(self) -> list[Key]:
        """The keys and what they do now."""
        return keys_of(self.player, loop_from_ns=self._loop_from_ns)

    def _draw(self) -> None:
        self._drawn = self.size
        width, height = self.size
        keys = keys_text(self.keys, width)
        if height - len(keys) < LEAST_HEIGHT + _KEYS_ROOM or self._go.display:
            keys = []
        foot = transport(
            self.player,
            width,
            loop_from_ns=self._loop_from_ns,
            at_end="end" if self._source.complete else "so far",
            note=self._note or self._standing,
        )
        rows = height - len(keys) - 1 - self._source.is_as_ground - self._go.display
        self._board.update(self._board_of(width, rows), layout=False)
        self._transport.update(foot, layout=False)
        if keys != self._keys_shown:
            self._keys_shown = keys
            self._keys.update(Group(*keys))
            self._keys.display = bool(keys)

    def _board_of(self, width: int, height: int) -> RenderableType:
        now_ns = self.player.now_ns
        strip = STRIP_HEIGHT if height >= _STRIP_FROM else 0
        if width < LEAST_WIDTH or height < LEAST_HEIGHT:
            state = f"{time_text(now_ns)} {self._picture.mode or ''} {self._picture.failsafe or ''}"
            return Text(f"{state}\n{LEAST_WIDTH} columns by {LEAST_HEIGHT + 1} rows show more")
        board = screen(
            self._picture,
            now_ns,
            width=width,
            height=height - strip,
            title=self._source.path.name,
            end_ns=self._source.end_ns,
        )
        if not strip:
            return board
        return Group(board, self._strip.draw(self._picture, now_ns, width))

    # --- keys ----------------------------------------------------------------------------------

    def action_pause_or_play(self) -> None:
        """Pause, or play on; from the end, from the beginning."""
        player = self.player
        if player.playing and not player.at_end:
            player.pause()
        else:
            if player.at_end and self._source.complete:
                player.seek(self._source.end_ns if player.backwards else 0)
            player.play()
        self.moved()

    def action_step(self, seconds: int) -> None:
        """Pause, and go some seconds on, or back."""
        self.player.pause()
        self.action_skip(seconds)

    def action_skip(self, seconds: int) -> None:
        """Go some seconds on, or back."""
        self.player.seek(self.player.now_ns + to_ns(seconds))
        self.moved()

    def action_edge(self, at_end: bool) -> None:  # noqa: FBT001 - textual passes it by position
        """Go to the beginning, or to the end."""
        self.player.seek(self._source.end_ns if at_end else 0)
        self.moved()

    def action_next_event(self) -> None:
        """Pause at the next event."""
        self._to_event(self._moments.next_event, "no event after this")

    def action_previous_event(self) -> None:
        """Pause at the event before."""
        self._to_event(self._moments.previous_event, "no event before this")

    def _to_event(self, find: Callable[[int], EventLine | None], without: str) -> None:
        try:
            line = find(self.player.now_ns)
        except LogError as error:
            self.fail(error)
            return
        self.player.pause()
        if line is not None:
            self.player.seek(line.t_ns)
        self.moved("" if line is not None else without)

    def action_faster(self) -> None:
        """Play at the next higher speed."""
        self._set_speed(min((s for s in SPEEDS if s > self.player.speed), default=None))

    def action_slower(self) -> None:
        """Play at the next lower speed."""
        self._set_speed(max((s for s in SPEEDS if s < self.player.speed), default=None))

    def _set_speed(self, speed: float | None) -> None:
        if speed is not None:
            self.player.set_speed(speed)
        self.moved()

    def action_reverse(self) -> None:
        """Play the other way."""
        self.player.reverse()
        self.player.play()
        self.moved()

    def action_loop(self) -> None:
        """Mark where a loop begins; then where it ends; then play on without it."""
        player, begin_ns = self.player, self._loop_from_ns
        note = ""
        if player.loop_ns is not None:
            player.unloop()
        elif begin_ns is None:
            self._loop_from_ns = player.now_ns
        elif begin_ns == player.now_ns:
            note = "the loop needs another end"
        else:
            player.loop(*sorted((begin_ns, player.now_ns)))
            self._loop_from_ns = None
        self.moved(note)

    def action_go(self) -> None:
        """Ask for a time."""
        self._go.value = ""
        self._go.placeholder = f"go to which second, 0 to {to_s(self._source.end_ns):g}? Esc: stay"
        self._go.display = True
        self._go.focus()
        self._draw()

    def action_close(self) -> None:
        """Stay where it is."""
        self._go.display = False
        self.set_focus(None)
        self._draw()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Go to the time that was entered."""
        try:
            seconds = float(event.value.strip().removesuffix("s"))
        except ValueError:
            seconds = math.nan
        self.action_close()
        if 0 <= seconds <= to_s(self._source.end_ns):
            self.player.seek(to_ns(seconds))
            self.moved()
        else:
            within = f"expected 0 to {to_s(self._source.end_ns):g} s"
            self.moved(f"{within}, found {printable(event.value)!r}")

    def moved(self, note: str = "") -> None:
        """Draw what a key brought about, and a note on it if it brought nothing."""
        self._note = note
        self.tick()
        self._draw()
