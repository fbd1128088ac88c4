"""The options of commands that show a run in Foxglove: where the server listens, and the speed."""

import math
from typing import Annotated, NamedTuple

import typer

Live = Annotated[
    bool, typer.Option("--live", help="Show it in Foxglove, whose play bar then plays it.")
]
Port = Annotated[
    int | None,
    typer.Option(
        min=0,
        max=65535,
        metavar="N",
        help="With --live: the port to listen on, 8765 by default; 0 for any that is free.",
    ),
]
Listen = Annotated[
    str | None,
    typer.Option(
        metavar="HOST",
        help="With --live: the address to listen on; by default only this machine reaches it.",
    ),
]
"""The options of what is served to Foxglove; see `address_of`."""


class Address(NamedTuple):
    """Where a server listens: by default where Foxglove looks for one.

    Attributes:
        host: name or address of an interface of this machine.
        port: 0 for any that is free.
    """

    host: str = "127.0.0.1"
    port: int = 8765


def address_of(*, live: bool, listen: str | None, port: int | None) -> Address | None:
    """Where to listen; `None` if nothing is to be served.

    Raises:
        typer.BadParameter: if an address is given, and nothing is to be served.
    """
    if live:
        usual = Address()
        return Address(
            usual.host if listen is None else listen, usual.port if port is None else port
        )
    for option, value in (("--listen", listen), ("--port", port)):
        if value is not None:
            raise typer.BadParameter("expected it with --live", param_hint=option)
    return None


def live_speed(speed: float) -> float:
    """`speed`, if a viewer can play at it.

    Raises:
        typer.BadParameter: if it is infinite.
    """
    if math.isinf(speed):
        raise typer.BadParameter("expected a number with --live, found 'max'")
    return speed
