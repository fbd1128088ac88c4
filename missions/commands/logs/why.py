"""`farside why`: one moment's reasons."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farside.missions.commands.display.patience import patience
from farside.missions.commands.logs.finding import damage_told, log_named
from farside.missions.commands.values import As, Json, Who, completing

if TYPE_CHECKING:
    from rich.console import Console

    from farside.logs import LogFile
    from farside.logs.story import Aspect, Reasons

_ASPECTS = {
    "action": "what the rover does, or why it stands still; the default",
    "mode": "who drives, and what brought that about",
    "failsafe": "the failsafe's state, and the condition that made it",
    "silence": "why nothing is heard, on either side",
}


def tell_why(
    context: typer.Context,
    log_or_aspect: Annotated[
        str | None,
        typer.Argument(
            metavar="LOG",
            help="Log of a run; the newest in logs/runs by default.",
            autocompletion=completing(_ASPECTS),
            show_default=False,
        ),
    ] = None,
    aspect: Annotated[
        str | None,
        typer.Argument(
            metavar="WHAT",
            help="action, mode, failsafe or silence; the action by default.",
            autocompletion=completing(_ASPECTS),
            show_default=False,
        ),
    ] = None,
    at: Annotated[
        float | None,
        typer.Option(
            "--at",
            min=0,
            metavar="S",
            help="At this simulated time, in seconds; at the end of the run by default.",
        ),
    ] = None,
    as_: As = None,
    json: Json = False,
) -> None:
    """Say why something was so at a moment of a run.

    Of an action: who chose it, the active Signs, the hypothesis behind it with its policy value,
    the runner-up and the margin, the command behind it, what led to it, and what the ground
    thought then. Where the rover did nothing, the run is lived again up to that moment, and the
    model on board is asked.

    \b
    farside why logs/runs/blackout-seed1-1.mcap --at 655
    farside why logs/runs/blackout-seed1-1.mcap mode --at 655
    farside why logs/runs/blackout-seed1-1.mcap silence --at 655 --as ground
    farside why failsafe
    """
    import msgspec
    from rich.console import Console

    from farside.logs import LogFile
    from farside.logs.story import why

    path, asked = _told_apart(log_or_aspect, aspect)
    with patience("reading the log"):
        log = LogFile(log_named(path))
    t_ns = _moment(log, at, as_)
    log = damage_told(context, log if as_ is None else log.as_ground(t_ns))
    with patience("looking for the reasons"):
        reasons = why(log, t_ns, asked, None if as_ is not None else lambda: _mind(log, t_ns))
    if json:
        print(msgspec.json.encode(reasons.as_json).decode())  # noqa: T201
    else:
        _show(reasons, Console())


def _told_apart(first: str | None, second: str | None) -> tuple[Path | None, "Aspect"]:
    """The log, and what is asked of it: where only one is given, a log may be left out."""
    from farside.logs.story import Aspect
    from farside.validation import did_you_mean, shown

    names = [aspect.value for aspect in Aspect]
    if second is None and first in names and not Path(first).is_file():
        return None, Aspect(first)
    if second is not None and second not in names:
        expected = f"expected {', '.join(names)}, found {shown(second)}"
        raise typer.BadParameter(f"{expected}{did_you_mean(second, names)}", param_hint="WHAT")
    return (None if first is None else Path(first)), Aspect(second or Aspect.ACTION)


def _moment(log: "LogFile", at: float | None, as_: Who | None) -> int:
    """The moment that is asked about. The ground does not know when the run ends."""
    from farside.node import to_ns, to_s

    if at is None:
        return log.end_ns
    if as_ is not None and not math.isfinite(at):
        raise typer.BadParameter(f"expected a time, found {at:g} s", param_hint="--at")
    if as_ is None and not at <= to_s(log.end_ns):
        raise typer.BadParameter(
            f"expected a time within the run, 0 to {to_s(log.end_ns):g} s, found {at:g} s",
            param_hint="--at",
        )
    return to_ns(at)


def _mind(log: "LogFile", t_ns: int) -> Iterator[str]:
    """What the model on board held at a moment, from living the run again up to it."""
    from farside.missions.reliving.mind import mind_of
    from farside.missions.reliving.moment import relive
    from farside.missions.reliving.past import RelivingError
    from farside.node import to_s

    try:
        yield from mind_of(relive(log, to_s(t_ns)).rover)
    except RelivingError as error:
        yield f"not known: {error}"


def _show(reasons: "Reasons", console: "Console") -> None:
    from rich.text import Text

    from farside.logs.events import time_text

    console.print(Text(f"at {time_text(reasons.t_ns)}", style="bold"), soft_wrap=True)
    for section in reasons.sections:
        console.print(Text(section.heading, style="bold"), soft_wrap=True)
        for line in section.lines:
            console.print(Text(f"  {line}"), soft_wrap=True)
