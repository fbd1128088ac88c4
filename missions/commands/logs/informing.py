"""`farside info`."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from farside.escaping import printable
from farside.missions.commands.display.patience import patience
from farside.missions.commands.logs.opening import At, run_of
from farside.missions.commands.values import As

if TYPE_CHECKING:
    from farside.logs import RunView
    from farside.logs.information.ground import GroundInformation
    from farside.logs.information.run import Information


def show_information(
    context: typer.Context,
    log: Annotated[
        Path | None,
        typer.Argument(metavar="LOG", help="Log of a run; the newest where none is named."),
    ] = None,
    as_: As = None,
    at: At = None,
    json: Annotated[bool, typer.Option("--json", help="Print it as one JSON object.")] = False,
) -> None:
    """Show how a run went: outcome, modes, goals, link.

    With --as ground: what the ground knew, at the end or at another time, and nothing else.

    It shows what the log holds, too. A finished log is not read for it, whatever its size, so that
    damage inside is not found; any other is read through.

    \b
    farside info
    farside info logs/runs/blackout-seed1-1.mcap --json
    farside info logs/runs/blackout-seed1-1.mcap --as ground --at 700
    """
    import msgspec

    with patience("reading the log"):
        view = run_of(context, log, as_, at)
        known = _known(view)
    if json:
        print(msgspec.json.encode(known).decode())  # noqa: T201
    else:
        for line in _shown(known):
            print(line)  # noqa: T201


def _known(view: "RunView") -> "Information | GroundInformation":
    """What is shown. Only what it needs is imported: of a large log, too, it is there at once."""
    if view.is_as_ground:
        from farside.logs.information.ground import ground_information

        return ground_information(view)
    from farside.logs.information.run import information

    return information(view)


def _shown(known: "Information | GroundInformation") -> Iterator[str]:
    from farside.logs.information.run import Information

    return _run(known) if isinstance(known, Information) else _ground(known)


def _run(known: "Information") -> Iterator[str]:
    from farside.missions.commands.display.rows import rows_of, tables

    name, seed = _origin(known)
    end = "no result yet" if known.outcome is None else known.outcome
    yield f"{name}: {end}   {seed}, {known.sim_seconds:.1f} s simulated"
    topics = [
        (topic, f"{size.messages:,}", f"{size.bytes:,}") for topic, size in known.topics.items()
    ]
    for table in (*tables(known), rows_of(("topic", "messages", "bytes"), topics, (1, 2))):
        yield ""
        yield from table.lines()
    state = "finished" if known.complete else "not finished; farside recover makes it whole"
    yield ""
    yield f"log      {printable(known.log)}, {known.bytes:,} bytes, {state}"
    yield f"digest   {printable(known.digest or 'none')}"
    yield _versions(known)


def _ground(known: "GroundInformation") -> Iterator[str]:
    from farside.missions.commands.display.rows import rows_of

    name, seed = _origin(known)
    yield f"{name}, as the ground had it at {known.at_s:.1f} s   {seed}"
    heard = "nothing heard of the rover yet"
    if known.heard_s is not None:
        age_s = known.at_s - known.heard_s
        heard = f"last heard: as it was at {known.heard_s:.1f} s, {age_s:.1f} s ago"
    yield f"{heard}, counts as silent" if known.silent else heard
    believed = [
        (
            item.replace("_", " "),
            f"{one.value} (stale)" if one.stale else one.value,
            f"{one.so_s:.1f} s",
            f"{one.learned_s:.1f} s",
        )
        for item, one in known.believed.items()
    ]
    commands = [
        (str(one.number), one.order, f"{one.sent_s:.1f} s", one.known) for one in known.commands
    ]
    events = [(f"{one.t_s:.1f} s", one.text) for one in known.events]
    for table in (
        rows_of(("believed", "", "so", "learned"), believed, (2, 3)),
        rows_of(("command", "order", "sent", "known"), commands, (0, 2)),
        rows_of(("at", "event"), events, (0,)),
    ):
        if table.rows:
            yield ""
            yield from table.lines()
    yield ""
    yield f"log      {printable(known.log)}"
    yield _versions(known)


def _origin(known: "Information | GroundInformation") -> tuple[str, str]:
    name = "a run of an unknown mission" if known.mission is None else printable(known.mission)
    return name, "seed unknown" if known.seed is None else f"seed {known.seed}"


def _versions(known: "Information | GroundInformation") -> str:
    versions = ", ".join(f"{name} {version}" for name, version in known.versions.items())
    return f"made by  {printable(versions or 'unknown')}"
