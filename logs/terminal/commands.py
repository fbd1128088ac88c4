"""The panel of commands: what is on its way, how far it is, and whether it can be taken back."""

from rich.text import Text

from farside.control import CommandStage
from farside.escaping import printable
from farside.logs.events import order_text
from farside.logs.known import KnownCommand, KnownCommands, command_text

_DIM, _FAIR, _BAD = "bright_black", "yellow", "bold red"

Row = tuple[Text, Text, Text]
"""A number, an order, and what is known of it."""


def commands_title(commands: KnownCommands) -> str:
    """The title of the panel, such as `commands, 2 on the way, 1 overdue`."""
    parts = ["commands"]
    if commands.held:
        parts.append(f"{len(commands.held)} held")
    parts.append(f"{commands.on_the_way or 'none'} on the way")
    if commands.overdue:
        parts.append(f"{commands.overdue} overdue")
    return ", ".join(parts)


def command_rows(commands: KnownCommands, now_ns: int, most: int) -> list[Row]:
    """A row for each command, newest first, `most` at most; above them what is held."""
    held = [_held(commands, number) for number in reversed(commands.held)][:most]
    shown = commands.foremost(most - len(held))
    return [*held, *(_row(command, now_ns) for command in shown)]


def _held(commands: KnownCommands, number: int) -> Row:
    orders = ", then ".join(map(order_text, commands.held[number]))
    return Text("held"), Text(printable(orders)), Text("held until the link is up")


def _row(command: KnownCommand, now_ns: int) -> Row:
    words = printable(" · ".join(command.words(now_ns)))
    style = _style(command)
    # Only what is known is said of the past, so what is over needs no eye any more.
    quiet = _DIM if command.is_over else ""
    return (
        Text(str(command.number), style=quiet),
        Text(printable(command_text(command)), style=quiet),
        Text(words, style=style),
    )


def _style(command: KnownCommand) -> str:
    """Grey is normal; each of the others has a word of its own, too."""
    if command.is_overdue:
        return _BAD
    if command.end not in {None, CommandStage.DONE} or command.is_late:
        return _FAIR
    return _DIM if command.is_over else ""
