"""The summary of a run."""

from collections.abc import Iterator

from rich.console import Console
from rich.table import Table
from rich.text import Text

from farside.escaping import printable
from farside.logs.result import (
    OperatorResult,
    Outcome,
    RoverResult,
    RunResult,
    ShadowResult,
    StoreResult,
)
from farside.missions.commands.display.rows import UNMET, Rows, tables

# Of an expectation: its second column.
_CELL_STYLES = {(1, "yes"): "green", (1, UNMET): "bold red"}
_STYLE = {Outcome.SUCCESS: "bold green", Outcome.FAILURE: "bold red", Outcome.ABORTED: "bold red"}


def show_summary(result: RunResult, console: Console) -> None:
    """Print the result as tables."""
    console.print(_head(result))
    for rows in tables(result):
        console.print(_table(rows))
        console.print()
    if result.shadow is not None:
        console.print(_shadow(result.shadow))
    if result.store.kept:
        console.print(_store(result.store))
    console.print(_text(f"log     {result.log}"), soft_wrap=True)
    console.print(f"digest  {result.digest}", soft_wrap=True, highlight=False)


def _head(result: RunResult) -> Text:
    return Text.assemble(
        (f"{result.mission}: {result.outcome}", _STYLE[result.outcome]),
        f"   seed {result.seed}, {result.sim_seconds:.0f} s simulated in "
        f"{result.wall_seconds:.1f} s, {result.speedup:.0f}x real time\n",
        f"DEM: {result.dem.signs} Signs, {result.dem.hypotheses} hypotheses, "
        f"mean C_m {result.dem.mean_cm:.2f}\n",
        *_rover(result.rover),
        _operator(result.operator),
    )


def _rover(rover: RoverResult) -> Iterator[str | tuple[str, str]]:
    """What the battery came down to; and what keeps the rover from moving at the end."""
    if rover.least_charge is not None:
        yield f"rover: least charge {rover.least_charge:.0%} at {rover.least_charge_s:.1f} s"
    if rover.flat_since_s is not None:
        yield f", battery flat since {rover.flat_since_s:.1f} s", "bold red"
    if rover.stuck_since_s is not None:
        yield f", stuck since {rover.stuck_since_s:.1f} s", "bold red"
    yield "\n"


def _operator(operator: OperatorResult | None) -> str:
    """Where the operator got to, where there was a script."""
    if operator is None:
        return ""
    left = "".join(f"operator: gave up {printable(one)}\n" for one in operator.left)
    if operator.waiting_for is None:
        return f"operator: all {operator.of} steps done at {operator.since_s:.1f} s\n{left}"
    return (
        f"operator: at step {operator.step} of {operator.of}, waiting since "
        f"{operator.since_s:.1f} s for {printable(operator.waiting_for)}\n{left}"
    )


def _shadow(shadow: ShadowResult) -> Text:
    text = (
        f"shadow of the model: {shadow.updates} updates of {shadow.cycles} cycles\n"
        f"took {shadow.downlink_bytes} bytes of the downlink, {shadow.downlink_share:.1%} of all, "
        f"and {shadow.report_bytes} of the uplink"
    )
    if shadow.bits_per_cycle is not None:
        text += f",\n{shadow.bits_per_cycle:.0f} bits a cycle"
    if not shadow.in_step:
        text += "; at the end it was out of step"
    return Text(f"{text}\n")


def _store(store: StoreResult) -> Text:
    text = f"stored telemetry: {store.kept} kept while the link was out, {store.arrived} arrived"
    if store.given_up:
        text += f", {store.given_up} given up since the store was full"
    if store.waiting:
        text += f", {store.waiting} still waiting at the end"
    return Text(f"{text}\n")


def _text(text: str) -> Text:
    """Text that is neither taken for markup nor for escape sequences."""
    return Text(printable(text))


def _table(rows: Rows) -> Table:
    table = Table(box=None, padding=(0, 2, 0, 0), header_style="dim", title_justify="left")
    for column in rows.columns:
        table.add_column(column)
    for row in rows.rows:
        table.add_row(*(Text(cell, _CELL_STYLES.get((n, cell), "")) for n, cell in enumerate(row)))
    return table
