"""The command line: `farside run`, `check`, `replay`, `link` and `dem`."""

import math
import signal
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, NoReturn

import msgspec
import typer
from rich.console import Console

from farside.link.profile.light import EphemerisError
from farside.logs import LogError, LogFile, play
from farside.missions.advice import warnings
from farside.missions.commands.dem import dem_app
from farside.missions.commands.dem_stream import StreamError
from farside.missions.commands.link import link_app
from farside.missions.commands.progress import ProgressDisplay
from farside.missions.commands.summary import show_summary
from farside.missions.crew.crew import CrewError
from farside.missions.loading import MissionError, load_mission
from farside.missions.result import Outcome
from farside.missions.run import RUNS, FinishedRun, run_mission
from farside.validation import dotted, printable

_DONE, _UNMET, _BAD_INPUT, _INFRASTRUCTURE, _INTERRUPTED = 0, 1, 2, 3, 130

_STATUS = (
    "Exit status: 0 done and all expectations met; 1 an expectation was not met; 2 bad input; "
    "3 a process failed; 130 stopped by Ctrl-C."
)

app = typer.Typer(
    help="Simulate rover missions over delayed, lossy links.",
    no_args_is_help=True,
    rich_markup_mode="rich",
    add_completion=False,
    pretty_exceptions_enable=False,
)

app.add_typer(link_app, name="link")
app.add_typer(dem_app, name="dem")

Mission = Annotated[
    str,
    typer.Argument(
        metavar="MISSION", help="A mission file, or the name of a shipped one such as 'blackout'."
    ),
]
Set = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Replace a value of the mission file."),
]


def _pace(text: str) -> float:
    if text == "max":
        return math.inf
    try:
        pace = float(text)
    except ValueError:
        pace = math.nan
    if not pace > 0 or math.isinf(pace):
        raise typer.BadParameter(f"expected a number above 0, or 'max', found {text!r}")
    return pace


def _show_version(wanted: bool) -> None:  # noqa: FBT001 - typer calls it so
    if wanted:
        print(f"farside {version('farside')}")  # noqa: T201
        raise typer.Exit


@app.callback()
def _farside(
    _version: Annotated[
        bool,
        typer.Option("--version", callback=_show_version, is_eager=True, help="Show the version."),
    ] = False,
) -> None:
    pass


@app.command(epilog=_STATUS)
def run(
    mission: Mission,
    seed: Annotated[int | None, typer.Option(min=0, help="In place of the mission's.")] = None,
    in_process: Annotated[
        bool, typer.Option("--in-process", help="Run all in this process, without Zenoh.")
    ] = False,
    pace: Annotated[
        float,
        typer.Option(
            parser=_pace, metavar="X|max", help="Simulated seconds per wall second at most."
        ),
    ] = "max",  # type: ignore[assignment]  # typer parses the default as it parses an argument
    set_: Set = None,
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for the log.")] = RUNS,
    json: Annotated[
        bool, typer.Option("--json", help="Print the result as one JSON object.")
    ] = False,
) -> None:
    """Run a mission: a process each for rover, link and ground, one log.

    \b
    farside run blackout
    farside run missions/blackout.toml --seed 7 --set link.up.loss=0.2
    farside run blackout --in-process --pace 10
    """
    loaded = load_mission(mission, set_ or (), seed=seed)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    errors = Console(stderr=True)
    with ProgressDisplay(loaded.mission, errors) as display:
        finished = run_mission(loaded, in_process=in_process, pace=pace, out=out, watcher=display)
    if json:
        print(msgspec.json.encode(finished.result).decode())  # noqa: T201
    else:
        show_summary(finished.result, Console())
    for loss in finished.losses:
        _say(f"{loss}; the log is {finished.result.log}")
    raise typer.Exit(_status(finished))


@app.command()
def check(mission: Mission, set_: Set = None) -> None:
    """Check a mission file without running it, and warn of what can never come about in it.

    \b
    farside check missions/blackout.toml
    farside check blackout --set rover.start="A"
    """
    loaded = load_mission(mission, set_ or ())
    for key, text in warnings(loaded.mission):
        _say(f"warning: {loaded.source}: {dotted(key)}: {text}")
    mission_, source = loaded.mission, printable(loaded.source)
    print(  # noqa: T201
        f"{source}: good. {mission_.name}: {mission_.duration_s:g} s, "
        f"{len(mission_.world.chart().cells)} places, {len(mission_.expect)} expectations"
    )


@app.command()
def replay(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="A log that a run left.")],
    speed: Annotated[
        float,
        typer.Option(parser=_pace, metavar="X|max", help="Simulated seconds per wall second."),
    ] = "20",  # type: ignore[assignment]
    start: Annotated[
        float, typer.Option(min=0, metavar="S", help="Begin at this simulated time.")
    ] = 0.0,
) -> None:
    """Play a log back: the map, the modes, the link. Ctrl-C ends it.

    \b
    farside replay logs/runs/blackout-seed1-1.mcap
    farside replay logs/runs/blackout-seed1-1.mcap --start 600 --speed 10
    farside replay logs/runs/blackout-seed1-1.mcap | less    (a line an event)
    """
    try:
        play(LogFile(log), Console(), speed=speed, start_s=start)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--start") from error


def _status(finished: FinishedRun) -> int:
    if finished.interrupted:
        return _INTERRUPTED
    match finished.result.outcome:
        case Outcome.SUCCESS:
            return _DONE
        case Outcome.FAILURE:
            return _UNMET
        case Outcome.ABORTED:
            return _INFRASTRUCTURE


def _say(message: str) -> None:
    for line in f"farside: {message}".split("\n"):
        print(printable(line), file=sys.stderr)  # noqa: T201


def main() -> NoReturn:
    """The `farside` command."""
    try:
        app()
    except (MissionError, LogError, StreamError, EphemerisError) as error:
        _say(str(error))
        sys.exit(_BAD_INPUT)
    except BrokenPipeError:
        # Whoever read our output has seen enough, as with `| head`.
        sys.stderr.close()
        sys.exit(_DONE)
    except (CrewError, OSError) as error:
        _say(str(error))
        sys.exit(_INFRASTRUCTURE)
    except KeyboardInterrupt:
        sys.exit(_INTERRUPTED)
    sys.exit(_DONE)


if __name__ == "__main__":
    main()
