"""The command line of `farside console`."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farside.missions.commands import failures
from farside.missions.commands.display.patience import patience
from farside.node import to_ns

if TYPE_CHECKING:
    from farside.missions.loading import LoadedMission
    from farside.missions.run import FinishedRun

_LOOPBACK = "127.0.0.1"
_QUEUED = 'ground.operator="queued"'

Speed = Annotated[
    float,
    typer.Option(
        min=0.1, max=1000, metavar="X", help="Simulated seconds per wall second at first."
    ),
]


def open_console(
    mission: Annotated[
        str,
        typer.Argument(
            metavar="MISSION",
            help="A mission file, or the name of a shipped mission such as 'blackout'.",
        ),
    ],
    seed: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="Seed, in place of the mission's.")
    ] = None,
    set_: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="Set a value of the mission file."),
    ] = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for the log.", show_default=True)
    ] = Path("logs/runs"),
    in_process: Annotated[
        bool, typer.Option("--in-process", help="Run everything in this process, without Zenoh.")
    ] = False,
    speed: Speed = 1.0,
    text: Annotated[
        bool, typer.Option("--text", help="In this terminal, in place of a page.")
    ] = False,
    stick: Annotated[
        bool, typer.Option("--stick", help="Take a joystick or gamepad of this host, too.")
    ] = False,
    listen: Annotated[
        str | None,
        typer.Option(
            metavar="HOST",
            help="The address to listen on; by default only this machine reaches the page.",
        ),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, metavar="N", help="The port; by default any free one."),
    ] = None,
) -> None:
    """Run a mission with a person at the ground station.

    You are its operator, in place of the one that the mission names: you drive the rover under
    delay and teach its model by doing so, answer its proposals, set goals and leave it alone, lose
    the link and find out what it did meanwhile. You are shown what the ground knows, and nothing
    else. Time is yours: pause, speed, and warps that end when something needs a decision.

    The page opens in any browser at the address that is printed. More than one may look; one has
    the stick. When the run is over the page stays until Ctrl-C. With --text all of it is in this
    terminal. `farside verify` runs the log again with what you ordered.

    \b
    farside console blackout
    farside console blackout --text
    farside console mars-relay --speed 10 --stick
    farside console blackout --listen 0.0.0.0 --port 8080
    """
    from rich.console import Console

    from farside.console.exercise import Exercise
    from farside.console.session import Session
    from farside.console.station import Station
    from farside.missions.commands.console.running import page_run, text_run
    from farside.missions.commands.display.summary import show_summary
    from farside.missions.interrupts import Interrupts
    from farside.missions.loading import load_mission
    from farside.missions.run import run_mission

    if text and (listen is not None or port is not None):
        raise typer.BadParameter("expected neither with --text", param_hint="--listen, --port")
    if text and not Console().is_terminal:
        raise typer.BadParameter("expected a terminal, found none", param_hint="--text")
    _needs(page=not text, stick=stick)
    with patience("reading the mission"):
        loaded = load_mission(mission, (*(set_ or ()), _QUEUED), seed=seed)
    with Interrupts() as interrupts:
        name, lost_after_s = loaded.mission.name, loaded.mission.rover.failsafe.lost_after_s
        exercise = Exercise(lost_after_s=lost_after_s) if has_exercise(loaded) else None
        end_ns = to_ns(loaded.mission.duration_s)
        session = Session(name, end_ns, speed=speed, exercise=exercise)
        if not text:
            session.pacing.stand_by()  # for the first page
        station = Station(session, end=interrupts.request)
        run_it = partial(run_mission, loaded, in_process=in_process, out=out, interrupts=interrupts)

        def over(finished: "FinishedRun") -> None:
            show_summary(finished.result, Console())
            for lost in finished.lost_processes:
                failures.print_error(f"{lost}; the log is {finished.result.log}")

        if text:
            finished = text_run(run_it, station, interrupts, stick=stick)
            over(finished)
        else:
            finished = page_run(
                run_it,
                station,
                interrupts,
                host=listen or _LOOPBACK,
                port=port or 0,
                stick=stick,
                over=over,
            )
    raise typer.Exit(failures.status_of(finished))


def has_exercise(loaded: "LoadedMission") -> bool:
    """Whether it is the shipped mission of the exercise, with nothing set but its operator."""
    from farside.console.exercise import MISSION
    from farside.missions.loading import shipped_missions

    is_shipped = loaded.text == shipped_missions()[MISSION].read_text(encoding="utf-8")
    return is_shipped and [key for key, _ in loaded.overrides] == ["ground.operator"]


def _needs(*, page: bool, stick: bool) -> None:
    """Refuse at once what lacks the extra that it needs, before a run is begun for it."""
    from farside.console.stick.sdl import StickError, load

    try:
        if page:
            import farside.console.page.serving  # noqa: F401 - an extra
        if stick:
            load()
    except ModuleNotFoundError as error:
        raise typer.BadParameter(
            f"expected nicegui for the page, found no {error.name}: pip install "
            "'farside[console]', or use --text, which needs nothing more",
        ) from error
    except StickError as error:
        raise typer.BadParameter(str(error), param_hint="--stick") from error
