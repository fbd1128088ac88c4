"""`farside replay` and `farside recover`."""

from pathlib import Path
from typing import Annotated

import typer

from farside.escaping import printable
from farside.missions.commands.display.patience import patience
from farside.missions.commands.live.address import Listen, Live, Port, address_of, live_speed
from farside.missions.commands.logs.finding import tell_damage
from farside.missions.commands.values import As, pace_of
from farside.node import to_ns


def replay_log(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Log of a run.")],
    speed: Annotated[
        float,
        typer.Option(parser=pace_of, metavar="X|max", help="Simulated seconds per wall second."),
    ] = "20",  # type: ignore[assignment]
    start: Annotated[
        float, typer.Option(min=0, metavar="S", help="Start at this simulated time, in seconds.")
    ] = 0.0,
    as_: As = None,
    live: Live = False,
    port: Port = None,
    listen: Listen = None,
) -> None:
    """Replay a log: the map, the modes, the link.

    Ctrl-C ends it. Into a pipe it prints a line per event. With --live it plays in Foxglove, from
    when a viewer has subscribed, and Foxglove's play bar pauses, seeks and sets the speed.

    \b
    farside replay logs/runs/blackout-seed1-1.mcap
    farside replay logs/runs/blackout-seed1-1.mcap --start 600 --speed 10
    farside replay logs/runs/blackout-seed1-1.mcap | grep mode
    farside replay logs/runs/blackout-seed1-1.mcap --live --as ground
    """
    from rich.console import Console

    from farside.logs import LogFile, replay

    with patience("reading the log"):
        file = LogFile(log)
    if as_ is not None:
        file = file.as_ground()
    address = address_of(live=live, listen=listen, port=port)
    try:
        if address is not None:
            from farside.missions.commands.live.serving import serve_log

            serve_log(file, address, speed=live_speed(speed), start_ns=to_ns(start))
            return
        replay(file, Console(), speed=speed, start_s=start, waiting=patience)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--start") from error
    finally:
        tell_damage(file)


def recover_log(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log that nobody finished.")],
) -> None:
    """Make a whole log of one that is unfinished or damaged.

    Such is a log whose writer was killed. The new one lies beside it, and the old one stays.

    \b
    farside recover logs/runs/blackout-seed1-1.mcap
    """
    from farside.logs import LogFile, recover

    with patience("making a whole log"):
        file = LogFile(log)
        recovered = recover(file)
    print(f"{printable(str(recovered.path))}: {recovered.messages} messages")  # noqa: T201
    tell_damage(file)
