"""`farside replay` and `farside recover`."""

from pathlib import Path
from typing import Annotated

import typer

from farside.escaping import printable
from farside.missions.commands.display.patience import patience
from farside.missions.commands.live.address import Listen, Live, Port, address_of, live_speed
from farside.missions.commands.logs.finding import damage_told, log_named
from farside.missions.commands.values import As, pace_of

_SPEED = 20.0


def replay_log(
    context: typer.Context,
    log: Annotated[
        Path | None, typer.Argument(metavar="[LOG]", help="Log of a run; by default the newest.")
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            parser=pace_of,
            metavar="X|max",
            help="Simulated seconds per wall second.",
            show_default="20; with --zenoh 1",
        ),
    ] = None,
    start: Annotated[
        float | None,
        typer.Option(
            min=0,
            metavar="S",
            help="Start at this simulated time, in seconds.",
            show_default="0; with --follow what was written last",
        ),
    ] = None,
    as_: As = None,
    follow: Annotated[
        bool, typer.Option("--follow", help="Go on as the log grows, until its run is over.")
    ] = False,
    zenoh: Annotated[
        str | None,
        typer.Option(
            metavar="ENDPOINT",
            help="Publish it to the Zenoh router or peer at tcp/HOST:PORT; listen/tcp/… to be one.",
        ),
    ] = None,
    live: Live = False,
    port: Port = None,
    listen: Listen = None,
) -> None:
    """Replay a log: the map, the modes, the link.

    The keys are on the screen: pause, step, seek, the event before and after, speed, reverse, a
    loop; PgUp and PgDn go a minute, Home and End to the ends. Into a pipe it prints a line per
    event.

    With --zenoh it publishes what was recorded, with the timing that it had, from when anybody
    subscribes: what is on the topic /ground/telemetry of the log goes out on the key
    farside/ground/telemetry, as JSON, and as its attachment {"log_time_ns": …,
    "publish_time_ns": …}, when it became known and when it was so.

    With --live it plays in Foxglove, from when a viewer has subscribed, and Foxglove's play bar
    pauses, seeks and sets the speed.

    \b
    farside replay
    farside replay logs/runs/blackout-seed1-1.mcap --start 600 --speed 10
    farside replay --as ground
    farside replay --follow | grep mode
    farside replay --zenoh tcp/localhost:7447 --speed max
    farside replay logs/runs/blackout-seed1-1.mcap --live --as ground
    """
    from rich.console import Console

    from farside.logs import LogFile, replay
    from farside.logs.file.following import start_of

    if sum((live, zenoh is not None)) + (live and follow) > 1:
        raise typer.BadParameter("expected it without --zenoh and --follow", param_hint="--live")
    with patience("reading the log"):
        file = LogFile(log_named(log))
    file = damage_told(context, file if as_ is None else file.as_ground())
    try:
        start_of(file, start, follow=follow)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--start") from error
    pace = (1.0 if zenoh is not None else _SPEED) if speed is None else speed
    if (address := address_of(live=live, listen=listen, port=port)) is not None:
        from farside.missions.commands.live.serving import serve_log

        serve_log(file, address, speed=live_speed(pace), start_s=start)
    elif zenoh is not None:
        from farside.missions.commands.logs.republishing import republish_log

        republish_log(file, zenoh, speed=pace, start_s=start, follow=follow)
    else:
        replay(file, Console(), speed=pace, start_s=start, follow=follow, waiting=patience)


def recover_log(
    context: typer.Context,
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log that nobody finished.")],
) -> None:
    """Make a whole log of one that is unfinished or damaged.

    Such is a log whose writer was killed. The new one lies beside it, and the old one stays.

    \b
    farside recover logs/runs/blackout-seed1-1.mcap
    """
    from farside.logs import LogFile, recover

    with patience("making a whole log"):
        recovered = recover(damage_told(context, LogFile(log)))
    print(f"{printable(str(recovered.path))}: {recovered.messages} messages")  # noqa: T201
