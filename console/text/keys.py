"""The keys of the console in a terminal: what the foot says of them, and the help."""

from collections.abc import Iterator

from rich.text import Text

from farside.console.screen.screen import Screen
from farside.console.text.words import BOLD, DIM, wrapped
from farside.logs.terminal.transport import Key

_HELP: tuple[Key, ...] = (
    ("arrows, W A S D", "choose an action: answers the proposal, or drives"),
    ("Shift + these", "insist: order what is invalid, or into silence, all the same"),
    ("Enter", "approve the proposal that is on the screen"),
    ("Backspace", "veto it"),
    ("Esc", "take back the newest command that can be; it is marked [Esc]"),
    ("g", "set a goal: B, or 3,4, or B 5 with a priority; -B withdraws it"),
    ("m", "the mode: guided, shared, autonomous; and what to do when the link is lost"),
    ("p", "show the path to the next goal"),
    ("h", "heat: the cost to go from every known place"),
    ("Space", "let time stand, or pass"),
    (", .", "slower, faster"),
    ("n", "let time pass until something arrives"),
    ("c", "let time pass until the next contact"),
    ("x", "acknowledge the alarms"),
    ("e", "everything in full: next, on the way, state, all events"),
    ("?", "this help; again for its next page"),
    ("q", "leave: asks whether the run goes on"),
    ("^C", "end the run; twice: at once"),
    ("◇ ◌ ①", "where the rover was heard; is by now, as predicted; will be after a command"),
    ("░", "somewhere here: no place has 50 %"),
    ("• ━", "the path to the goal; the way of the commands on their way"),
    ("◆ ◈", "a goal; a goal on its way to the rover"),
    ("» « ▒ ▒ ║ ║", "an option: lit is proposed, hatched is risky, barred is invalid"),
    ("[value]", "something newer was due"),
    ("▸ ! !!", "asks for your word; will need attention; is wrong now"),
)
_NAME_WIDTH = 17
_WIDE = 60  # columns from which what a key does stands beside its name in every row


def foot_keys(screen: Screen) -> list[Key]:
    """The keys and what they do now, the most important first."""
    keys: list[Key] = [("?", "help")]
    card = screen.proposal
    if card is not None and card.can_answer:
        keys += [("⏎", f"approve {card.number}"), ("⌫", "veto")]
    keys += [("←↑↓→", "choose"), ("⇧", "insist"), ("Esc", "take back")]
    if any(not alarm.acknowledged for alarm in screen.alarms):
        keys.append(("x", "alarms seen"))
    return [
        *keys,
        ("g", "goal"),
        ("m", "mode"),
        ("space", "play" if screen.paused else "pause"),
        (", .", "speed"),
        ("n", "until news"),
        ("c", "until contact"),
        ("e", "in full"),
        ("h", "heat"),
        ("p", "path"),
        ("q", "leave"),
        ("^C", "end the run"),
    ]


def help_rows(width: int) -> Iterator[Text]:
    """Every key and sign with what it means, in rows of a width."""
    for name, does in _HELP:
        text = Text.assemble((f"{name:<{_NAME_WIDTH}}", BOLD), (does, DIM))
        yield from wrapped(text, width, hang=_NAME_WIDTH if width >= _WIDE else 2)
