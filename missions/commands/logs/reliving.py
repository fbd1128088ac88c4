"""`farside verify` and `farside rerun`."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farside.missions.commands.display.patience import patience
from farside.missions.commands.failures import print_error, status_of
from farside.missions.commands.logs.finding import damage_told, log_named
from farside.missions.commands.values import Json, Set
from farside.node import to_s

if TYPE_CHECKING:
    from rich.console import Console

    from farside.missions.reliving.verifying import Verdict

_EQUAL, _DIFFERS = 0, 1
VERIFY_STATUS = (
    "Exit status: 0 every record came out again; 1 one differs; 2 the run cannot be lived again."
)
"""What `verify` ends with."""

Log = Annotated[
    Path | None,
    typer.Argument(metavar="LOG", help="Log of a run; the newest by default.", show_default=False),
]


def verify_log(context: typer.Context, log: Log = None, json: Json = False) -> None:
    """Run a log again, and prove that it comes out the same.

    Whoever gave the orders, and whatever the pace: they are in the log. Of a log that nobody
    finished, what it holds is compared. Nothing is written.

    \b
    farside verify logs/runs/blackout-seed1-1.mcap
    farside verify logs/runs/blackout-seed1-1.mcap --json
    """
    import msgspec
    from rich.console import Console

    from farside.logs import LogFile
    from farside.missions.commands.display.steps import going_through
    from farside.missions.reliving.past import read_past
    from farside.missions.reliving.verifying import verify

    with patience("reading the log"):
        file = damage_told(context, LogFile(log_named(log)))
        end_s = to_s(read_past(file).end_ns)
    with going_through("living it again", end_s, Console(stderr=True)) as come_to:
        verdict = verify(file, come_to)
    for one in verdict.other_versions:
        print_error(f"{file.path}: recorded with {one.name} {one.then}, lived again with {one.now}")
    if json:
        print(msgspec.json.encode(verdict).decode())  # noqa: T201
    else:
        _show_verdict(verdict, Console())
    raise typer.Exit(_EQUAL if verdict.equal else _DIFFERS)


def _show_verdict(verdict: "Verdict", console: "Console") -> None:
    from farside.missions.commands.display.partings import plain, show_parting

    def tell(text: str) -> None:
        console.print(plain(text), soft_wrap=True)

    ended = "" if verdict.whole else ", of which the log ends before the run does"
    if verdict.equal:
        tell(f"{verdict.log}: equal")
        tell(f"{verdict.records} messages came out again, {verdict.sim_seconds:g} s{ended}")
        tell(f"digest  {verdict.digest}")
        return
    tell(f"{verdict.log}: differs")
    tell(f"{verdict.records} messages came out again{ended}")
    if verdict.parting is not None:
        show_parting(verdict.parting, ("in the log", "lived again"), console)
    else:
        tell(f"but the log states another digest than its own records have: {verdict.recorded}")
        tell(f"digest  {verdict.digest}")


def rerun_log(
    context: typer.Context,
    log: Log = None,
    set_: Set = None,
    seed: Annotated[
        int | None, typer.Option(min=0, metavar="N", help="Seed, in place of the run's.")
    ] = None,
    from_s: Annotated[
        float | None,
        typer.Option(
            "--from",
            min=0,
            metavar="S",
            help="Leave all before this simulated time as it was: what is set acts from then on.",
        ),
    ] = None,
    out: Annotated[
        Path, typer.Option(metavar="DIR", help="Folder for the new log.", show_default=True)
    ] = Path("logs/runs"),
    json: Json = False,
) -> None:
    """Run a log again, otherwise: from the start, or from a moment on.

    It writes a new log. Orders that a person gave are given again at their times. With --from the
    run up to then is the recorded one, record by record. The new log can be verified and run again
    like any other; 'farside diff' says where the two part, and what came of it.

    \b
    farside rerun --seed 2                                 the newest run
    farside rerun blackout-seed1-1.mcap --set link.blackouts=[]
    farside rerun blackout-seed1-1.mcap --set link.blackouts=[] --from 700
    """
    import msgspec
    from rich.console import Console

    from farside.logs import LogFile
    from farside.missions.commands.display.progress import ProgressDisplay
    from farside.missions.commands.display.steps import going_through
    from farside.missions.commands.display.summary import show_summary
    from farside.missions.interrupts import Interrupts
    from farside.missions.reliving.rerunning import load_again, run_again

    with patience("reading the log"):
        file = damage_told(context, LogFile(log_named(log)))
        if from_s is None:
            loaded, past = load_again(file, set_ or (), seed)
    if from_s is not None:
        with going_through(f"up to {from_s:g} s", from_s, Console(stderr=True)) as come_to:
            loaded, past = load_again(file, set_ or (), seed, from_s=from_s, progress=come_to)
    with Interrupts() as interrupts:
        with ProgressDisplay(loaded.last, Console(stderr=True)) as display:
            run = run_again(loaded, past, out=out, watcher=display, interrupts=interrupts)
        if json:
            print(msgspec.json.encode(run.result).decode())  # noqa: T201
        else:
            show_summary(run.result, Console())
        for lost in run.lost_processes:
            print_error(f"{lost}; the log is {run.log}")
    raise typer.Exit(status_of(run))
