"""The command line: `farside run`, `check`, `replay` and more.

What a command needs is imported when it is called: `farside check` starts without physics, Zenoh
or the log's libraries.
"""

import math
import signal
import sys
from contextlib import ExitStack
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup

from farside.escaping import printable
from farside.missions.commands import failures
from farside.missions.commands.console.console import open_console
from farside.missions.commands.display.patience import patience
from farside.missions.commands.formats import list_missions, show_schema
from farside.missions.commands.live.address import Listen, Live, Port, address_of, live_speed
from farside.missions.commands.live.layout import write_layouts
from farside.missions.commands.logs.comparing import DIFF_STATUS, diff_logs
from farside.missions.commands.logs.exporting import export_log
from farside.missions.commands.logs.informing import show_information
from farside.missions.commands.logs.looking import recover_log, replay_log
from farside.missions.commands.logs.reliving import VERIFY_STATUS, rerun_log, verify_log
from farside.missions.commands.logs.report import report_log
from farside.missions.commands.logs.story import tell_story
from farside.missions.commands.logs.why import tell_why
from farside.missions.commands.values import Json, Set, pace_of
from farside.node import to_ns
from farside.validation import dotted

if TYPE_CHECKING:
    from farside.missions.crew.crew import LostProcess

_DONE, _BAD_INPUT = 0, 2

_WATCH_SPEED = 20.0  # as of a replay

_STATUS = (
    "Exit status: 0 done and all expectations met; 1 an expectation was not met; 2 bad input; "
    "3 a process, the network or the disk failed, or Farside itself; 130 interrupted by Ctrl-C."
)

_HELP = """Simulate rover missions over delayed, lossy links.

\b
farside missions                 what ships
farside run blackout             run one, and leave a log
farside console blackout         run it with you at the ground station
farside info LOG                 how it went
farside replay LOG               watch it again
"""

_GROUPS = {
    "link": "A link that stands between any Zenoh programs.",
    "dem": "The learning controller by itself.",
}
"""Commands with commands of their own, and what the list of commands says of them."""


class _Commands(TyperGroup):
    """The commands, with the groups that are imported when they are called."""

    def __init__(self, **settings: Any) -> None:
        super().__init__(**settings)
        for name, help_text in _GROUPS.items():
            self.add_command(TyperGroup(name=name, help=help_text))

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[str | None, Any, list[str]]:
        name, command, rest = super().resolve_command(ctx, args)
        if name in _GROUPS:
            module = import_module(f"farside.missions.commands.{name}")
            command = typer.main.get_command(module.app)
        return name, command, rest


app = typer.Typer(
    cls=_Commands,
    help=_HELP,
    no_args_is_help=True,
    rich_markup_mode=None,  # plain help: flags as flags, sentences and examples whole
    context_settings={"help_option_names": ["-h", "--help"]},
    pretty_exceptions_enable=False,
)

Mission = Annotated[
    str,
    typer.Argument(
        metavar="MISSION",
        help="A mission file, or the name of a shipped mission such as 'blackout'.",
    ),
]


def _give_up_after(text: str) -> float:
    if text == "never":
        return math.inf
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not seconds > 0:
        raise typer.BadParameter(
            f"expected a number of seconds above 0, or 'never', found {text!r}"
        )
    return seconds


def _show_version(wanted: bool) -> None:  # noqa: FBT001 - typer passes it by position
    if wanted:
        from importlib.metadata import version

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
    seed: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="Seed, in place of the mission's.")
    ] = None,
    in_process: Annotated[
        bool, typer.Option("--in-process", help="Run everything in this process, without Zenoh.")
    ] = False,
    pace: Annotated[
        float | None,
        typer.Option(
            parser=pace_of,
            metavar="X|max",
            help="At most X simulated seconds per wall second.",
            show_default="max; with --live 1, with --watch 20",
        ),
    ] = None,
    set_: Set = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for the log.", show_default=True)
    ] = Path("logs/runs"),
    json: Json = False,
    give_up_after: Annotated[
        float,
        typer.Option(
            parser=_give_up_after,
            metavar="S|never",
            help="End the run if a process does not answer for so many wall-clock seconds. "
            "Without it the run waits, and says for whom every ten seconds.",
        ),
    ] = "never",  # type: ignore[assignment]  # typer parses the default as it parses an argument
    watch: Annotated[
        bool, typer.Option("--watch", help="Watch it on the screen of `farside replay`.")
    ] = False,
    live: Live = False,
    port: Port = None,
    listen: Listen = None,
) -> None:
    """Run a mission and write its log.

    It takes a process each for rover, link and ground, unless --in-process. With --live it is seen
    in Foxglove as it goes on, and Foxglove's play bar sets its pace: a pause holds the run, a seek
    back shows again what was while the run waits, and a seek ahead makes it hurry there. When the
    run is over its log stays in Foxglove until Ctrl-C. None of this changes what is recorded.

    With --watch it is on the screen of `farside replay` as it goes on, and the same keys play it:
    a pause holds the run, and so does a look back. Leaving the screen does not end the run, which
    then goes on as fast as it can; Ctrl-C does. None of this changes what is recorded, either.

    \b
    farside run blackout
    farside run missions/blackout.toml --seed 7 --set link.up.loss=0.2
    farside run blackout --in-process --pace 10
    farside run blackout --watch --pace 5
    farside run blackout --live --pace 20
    """
    import msgspec
    from rich.console import Console

    from farside.logs.terminal.replay import has_screen
    from farside.missions.commands.display.progress import ProgressDisplay
    from farside.missions.commands.display.summary import show_summary
    from farside.missions.crew.crew import Patience
    from farside.missions.interrupts import Interrupts
    from farside.missions.loading import load_mission
    from farside.missions.run import run_mission

    if watch and (live or not has_screen(Console())):
        found = "found --live, too" if live else "found none"
        raise typer.BadParameter(f"expected a terminal alone, {found}", param_hint="--watch")
    with patience("reading the mission"):
        loaded = load_mission(mission, set_ or (), seed=seed)
    address = address_of(live=live, listen=listen, port=port)
    # Until the last line is out: an impatient Ctrl-C must not cost the name of the log.
    with Interrupts() as interrupts, ExitStack() as stack:
        display, shown = ProgressDisplay(loaded.mission, Console(stderr=True)), None
        run_it = partial(
            run_mission,
            loaded,
            in_process=in_process,
            out=out,
            patience=Patience(give_up_s=give_up_after),
            interrupts=interrupts,
        )
        if watch:
            from farside.missions.commands.display.watching import LONGEST_WINDOW_NS, watched

            finished = watched(
                lambda gate: run_it(watcher=gate, window_ns=LONGEST_WINDOW_NS),
                display,
                interrupts,
                speed=_WATCH_SPEED if pace is None else pace,
            )
        else:
            with display:
                if address is not None:
                    from farside.missions.commands.live.serving import LiveRun

                    shown = stack.enter_context(
                        LiveRun(
                            display,
                            interrupts,
                            address,
                            name=loaded.mission.name,
                            end_ns=to_ns(loaded.mission.duration_s),
                            speed=live_speed(pace or 1.0),
                        )
                    )
                finished = run_it(
                    watcher=shown or display,
                    pace=math.inf if shown or pace is None else pace,
                )
        if json:
            print(msgspec.json.encode(finished.result).decode())  # noqa: T201
        else:
            show_summary(finished.result, Console())
        for lost in finished.lost_processes:
            failures.print_error(f"{lost}; the log is {finished.result.log}")
            _print_last_words(lost)
        if shown is not None and not finished.interrupted:
            shown.serve()
    raise typer.Exit(failures.status_of(finished))


@app.command()
def check(mission: Mission, set_: Set = None) -> None:
    """Check a mission file; warn of what can never come about in it.

    \b
    farside check missions/blackout.toml
    farside check blackout --set rover.start="A"
    """
    from farside.missions.advice import warnings
    from farside.missions.loading import load_mission

    with patience("reading the mission"):
        loaded = load_mission(mission, set_ or ())
    for key, text in warnings(loaded.mission):
        failures.print_error(f"warning: {loaded.source}: {dotted(key)}: {text}")
    mission_, source = loaded.mission, printable(loaded.source)
    print(  # noqa: T201
        f"{source}: good. {mission_.name}: {mission_.duration_s:g} s, "
        f"{len(mission_.world.chart().cells)} places, {len(mission_.expect)} expectations"
    )


app.command("console", epilog=_STATUS)(open_console)
app.command("replay")(replay_log)
app.command("info")(show_information)
app.command("recover")(recover_log)
app.command("export")(export_log)
app.command("verify", epilog=VERIFY_STATUS)(verify_log)
app.command("rerun", epilog=_STATUS)(rerun_log)
app.command("diff", epilog=DIFF_STATUS)(diff_logs)
app.command("story")(tell_story)
app.command("why")(tell_why)
app.command("report")(report_log)
app.command("layout")(write_layouts)
app.command("missions")(list_missions)
app.command("schema")(show_schema)


def _print_last_words(lost: "LostProcess | None") -> None:
    if lost is not None and failures.traceback_wanted():
        for line in lost.last_words.split("\n"):
            print(printable(line), file=sys.stderr)  # noqa: T201


def main() -> NoReturn:
    """The `farside` command."""
    try:
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.default_int_handler)
        app(prog_name="farside")
    except (SystemExit, MemoryError):  # which leaves none to find out what else it could be
        raise
    except KeyboardInterrupt:
        sys.exit(failures.INTERRUPTED)
    except _bad_input() as error:
        failures.print_error(str(error))
        sys.exit(failures.INFRASTRUCTURE if failures.of_machine(error.__cause__) else _BAD_INPUT)
    except _broken_infrastructure() as error:
        failures.print_error(str(error))
        _print_last_words(getattr(error, "lost", None))
        sys.exit(failures.INFRASTRUCTURE)
    except OSError as error:
        failures.print_error(failures.in_words(error))
        sys.exit(failures.INFRASTRUCTURE)
    sys.exit(_DONE)


def _bad_input() -> tuple[type[Exception], ...]:
    """What bad input raises. The classes are imported once there is something to catch."""
    from farside.link.profile.sky.positions import EphemerisError
    from farside.logs import LogError
    from farside.missions.commands.dem_stream import StreamError
    from farside.missions.loading import MissionError
    from farside.missions.reliving.past import RelivingError

    return MissionError, RelivingError, LogError, StreamError, EphemerisError


def _broken_infrastructure() -> type[Exception]:
    from farside.missions.crew.crew import InfrastructureError

    return InfrastructureError


if __name__ == "__main__":
    main()
