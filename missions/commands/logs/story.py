"""`farside story`: one thing of a run, from birth to effect."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farside.missions.commands.display.patience import patience
from farside.missions.commands.logs.finding import damage_told, log_named
from farside.missions.commands.values import As, Json, completing

if TYPE_CHECKING:
    from rich.console import Console

    from farside.logs.story import Story

_KINDS = {
    "command:": "one numbered order, as command:12",
    "proposal:": "what the rover proposed, as proposal:3",
    "event:": "what the rover told, as event:5",
    "goal:": "a Sign that somebody wants, as goal:B or goal:at:D+on_charge",
    "frame:up:": "a frame to the rover, as frame:up:17",
    "frame:down:": "a frame to the ground, as frame:down:17",
}


def tell_story(
    context: typer.Context,
    log_or_subject: Annotated[
        str,
        typer.Argument(
            metavar="LOG",
            help="Log of a run; the newest in logs/runs by default.",
            autocompletion=completing(_KINDS),
            show_default=False,
        ),
    ],
    subject: Annotated[
        str | None,
        typer.Argument(
            metavar="SUBJECT",
            help="What to tell of: command:N, proposal:N, event:N, goal:PLACE, frame:up|down:N.",
            autocompletion=completing(_KINDS),
            show_default=False,
        ),
    ] = None,
    as_: As = None,
    json: Json = False,
) -> None:
    """Tell the story of one thing, from birth to effect.

    Across both sides of the link: each line says when it was so, how long after the line before,
    and where. Told are waits, losses, what was sent again, refusals, and the light time of each
    leg.

    \b
    SUBJECT is one of
      command:12      an order: given, sent, taken, begun, done, known to be done
      proposal:3      what the rover proposed, on what grounds, what came of it
      event:5         what the rover told the ground, and when that knew
      goal:B          who set it, what was done for it, how it ended: a place by
                      its name, any other Sign by its Tokens: goal:at:D+on_charge
      frame:down:17   a frame, and the others with the same in them; up is to
                      the rover

    \b
    farside story logs/runs/blackout-seed1-1.mcap command:93
    farside story logs/runs/blackout-seed1-1.mcap goal:B --as ground
    farside story proposal:3 --json
    """
    import msgspec
    from rich.console import Console

    from farside.logs import LogFile
    from farside.logs.story import SubjectError, story, subject_of

    path = None if subject is None else Path(log_or_subject)
    try:
        wanted = subject_of(log_or_subject if subject is None else subject)
        with patience("reading the log"):
            log = LogFile(log_named(path))
            told = story(damage_told(context, log if as_ is None else log.as_ground()), wanted)
    except SubjectError as error:
        raise typer.BadParameter(str(error), param_hint="SUBJECT") from error
    if json:
        print(msgspec.json.encode(told.as_json).decode())  # noqa: T201
    else:
        _show(told, Console())


def _show(told: "Story", console: "Console") -> None:
    from rich.table import Table
    from rich.text import Text

    from farside.logs.story import story_lines

    if not console.is_terminal:
        print(told.title)  # noqa: T201
        for when, since, side, text in story_lines(told):
            print(f"{when:>11}  {since:>8}  {side:<6}  {text}".rstrip())  # noqa: T201
        return
    console.print(Text(told.title, style="bold"), soft_wrap=True)
    table = Table(box=None, padding=(0, 2, 0, 0), show_header=False)
    table.add_column(justify="right", no_wrap=True)
    table.add_column(justify="right", no_wrap=True, style="bright_black")
    table.add_column(no_wrap=True)
    table.add_column(overflow="fold")
    for when, since, side, text in story_lines(told):
        table.add_row(when, since, Text(side, style=_SIDES[side]), Text(text))
    console.print(table)


_SIDES = {"rover": "green", "link": "yellow", "ground": "magenta"}
