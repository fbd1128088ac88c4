"""Serving the page: a thin shell of uvicorn, in a thread, around NiceGUI and the guard."""

import errno
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from ipaddress import ip_address
from secrets import token_urlsafe
from typing import NamedTuple

import nicegui
import uvicorn
from fastapi import FastAPI
from nicegui import Client, ui

from farside.console.page.guard import Guard
from farside.console.page.page import Page
from farside.console.page.shown import Shown, Visits
from farside.console.page.static import script, style
from farside.console.seats import Seats

LOOPBACK = "127.0.0.1"
"""Where only this machine reaches the page."""


class PageError(Exception):
    """The page cannot be served; the message says why."""


class _Served:
    """What the one page of this process shows: NiceGUI has one app a process."""

    visits: Visits | None = None


class _Server(uvicorn.Server):
    """Says when it listens, or has failed to."""

    def __init__(self, config: uvicorn.Config) -> None:
        super().__init__(config)
        self.is_ready = threading.Event()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        self.is_ready.set()

    def serve_until_told(self, sock: socket.socket) -> None:
        """Run in this thread."""
        try:
            self.run(sockets=[sock])
        finally:
            self.is_ready.set()


class Serving(NamedTuple):
    """A page that is served.

    Attributes:
        address: what to open, with the token in it.
        lines: what to tell the person.
        seats: who commands; a stick of this host takes part like a page.
    """

    address: str
    lines: tuple[str, ...]
    seats: Seats


@contextmanager
def serving(
    station: Shown, *, host: str = LOOPBACK, port: int = 0, token: str | None = None
) -> Iterator[Serving]:
    """Serve the page of a station for as long as the context lasts.

    Args:
        station: what it shows.
        host: where to listen, such as `127.0.0.1`.
        port: at which port; 0 for any that is free.
        token: what every request has to bring; by default a new one.

    Yields:
        Where it is served.

    Raises:
        PageError: if it cannot listen there.
    """
    with _listening(host, port) as sock:
        real = sock.getsockname()[1]
        app, served = _app()
        token = token or token_urlsafe(18)
        visits = served.visits = Visits(station)
        config = uvicorn.Config(
            Guard(app, token, real),
            log_config=None,
            log_level="error",
            access_log=False,
            ws="websockets-sansio",
            timeout_graceful_shutdown=1,
        )
        server = _Server(config)
        thread = threading.Thread(target=server.serve_until_told, args=(sock,), name="console page")
        thread.start()
        try:
            server.is_ready.wait()
            if not server.started:
                raise PageError("the server of the page did not start")
            yield _serving(sock, host, token, visits.seats)
        finally:
            server.should_exit = True
            thread.join()


def _serving(sock: socket.socket, host: str, token: str, seats: Seats) -> Serving:
    number, port = sock.getsockname()[:2]
    where = ip_address(number)
    named = socket.gethostname() if where.is_unspecified else host
    address = f"http://{f'[{named}]' if ':' in named else named}:{port}/?token={token}"
    lines = [f"The page is at {address}"]
    if not where.is_loopback:
        lines.append(
            f"It listens on {host}, not on this machine alone: whoever reaches it there and has "
            "that address sees the run, and may ask for command. Nothing is encrypted."
        )
    return Serving(address, tuple(lines), seats)


@contextmanager
def _listening(host: str, port: int) -> Iterator[socket.socket]:
    try:
        family, kind, proto, _, address = socket.getaddrinfo(
            host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE
        )[0]
    except socket.gaierror as error:
        raise PageError(f"cannot listen at {host}: this machine has no such address") from error
    with socket.socket(family, kind, proto) as sock:
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            sock.bind(address)
        except OSError as error:
            raise PageError(_why(error, host, port)) from error
        yield sock


def _why(error: OSError, host: str, port: int) -> str:
    match error.errno:
        case errno.EADDRINUSE:
            return f"port {port} of {host} is taken"
        case errno.EACCES:
            return f"port {port} is only for an administrator"
        case _:
            return f"cannot listen at {host}, port {port}: {error.strerror}"


@cache
def _app() -> tuple[FastAPI, _Served]:
    """The app of this process; what it serves may change."""
    app, served = FastAPI(docs_url=None, redoc_url=None, openapi_url=None), _Served()
    app.get("/farside/page.css")(style)
    app.get("/farside/page.js")(script)

    def forget() -> None:
        """No visitor outlives the server: who comes back to another one is given a new page."""
        for client in list(Client.instances.values()):
            client.delete()

    nicegui.app.on_shutdown(forget)

    @ui.page("/")
    def page() -> None:
        if served.visits is not None:
            Page(served.visits)

    ui.run_with(
        app,
        title="Farside console",
        dark=None,
        tailwind=False,
        binding_refresh_interval=None,
        reconnect_timeout=5.0,
        gzip_middleware_factory=None,
        show_welcome_message=False,
    )
    return app, served
