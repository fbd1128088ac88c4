"""What a run shows when it is over."""

from rich.console import Console
from rich.table import Table
from rich.text import Text

from farside.logs.view import LinkCounters
from farside.missions.result import Outcome, RunResult

_STYLE = {Outcome.SUCCESS: "bold green", Outcome.FAILURE: "bold red", Outcome.ABORTED: "bold red"}


def show_summary(result: RunResult, console: Console) -> None:
    """Print the result as tables."""
    console.print(_head(result))
    for table in (_modes(result), _goals(result), _link(result), _expectations(result)):
        if table.row_count:
            console.print(table)
            console.print()
    console.print(f"log     {result.log}", soft_wrap=True, highlight=False)
    console.print(f"digest  {result.digest}", soft_wrap=True, highlight=False)


def _head(result: RunResult) -> Text:
    return Text.assemble(
        (f"{result.mission}: {result.outcome}", _STYLE[result.outcome]),
        f"   seed {result.seed}, {result.sim_seconds:.0f} s simulated in "
        f"{result.wall_seconds:.1f} s, {result.speedup:.0f}x real time\n",
        f"DEM: {result.dem.signs} Signs, {result.dem.hypotheses} hypotheses, "
        f"mean C_m {result.dem.mean_cm:.2f}\n",
    )


def _modes(result: RunResult) -> Table:
    table = _table("from", "mode", "why")
    for mode in result.modes:
        table.add_row(f"{mode.t_s:.1f} s", mode.mode, mode.why)
    return table


def _goals(result: RunResult) -> Table:
    table = _table("goal", "of", "set", "reached")
    for goal in result.goals:
        reached = "never" if goal.reached_s is None else f"{goal.reached_s:.1f} s"
        table.add_row(" ".join(goal.tokens), goal.source, f"{goal.set_s:.1f} s", reached)
    return table


def _link(result: RunResult) -> Table:
    table = _table("link", "frames", "delivered", "lost", "in outage", "queue full", "mean delay")
    for name, counters in (("up", result.link.uplink), ("down", result.link.downlink)):
        table.add_row(name, *_counts(counters))
    return table


def _counts(counters: LinkCounters) -> list[str]:
    delay = "" if counters.delay_s is None else f"{counters.delay_s:.2f} s"
    numbers = (
        counters.sent,
        counters.delivered,
        counters.lost,
        counters.outage,
        counters.queue_full,
    )
    return [*(str(number) for number in numbers), delay]


def _expectations(result: RunResult) -> Table:
    table = _table("expected", "met", "found")
    for judgement in result.expectations:
        met = Text("yes", "green") if judgement.met else Text("NO", "bold red")
        table.add_row(judgement.name, met, judgement.detail)
    return table


def _table(*columns: str) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim", title_justify="left")
    for column in columns:
        table.add_column(column)
    return table
