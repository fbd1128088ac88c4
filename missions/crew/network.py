"""The run's Zenoh network: one router on loopback, three clients, and who may say what.

The launcher opens the router, which draws a password for each role and lets each one say and hear
its own keys only, so that rover and ground can reach each other through the link alone:

    key                   said by      heard by
    farside/ROLE/advance  launcher     ROLE
    farside/ROLE/report   ROLE         launcher
    farside/END/out       END          link       (END: rover, ground)
    farside/END/in        link         END

What crosses here is frames and the run's own book-keeping; a frame's fate is decided in the
channel, so this network must lose nothing: it waits rather than drops, and never times out.
"""

import json
import secrets
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from queue import SimpleQueue

import msgspec
import zenoh

from farside.node import Role

_ENDS = (Role.ROVER, Role.GROUND)

# A process that dies closes its connection, so silence means only that somebody thinks, or that
# the machine sleeps.
_LEASE_MS = 24 * 3600 * 1000

_QUIET: dict[str, object] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "scouting/delay": 0,
    "timestamping/enabled": False,
    # Shared memory would outlive a killed process, and frames are small.
    "transport/shared_memory/enabled": False,
    "transport/link/tx/lease": _LEASE_MS,
}


class Ticket(msgspec.Struct, frozen=True):
    """What a role needs to join the run's network. Secret: it goes by pipe only.

    Attributes:
        role: who joins; the user name towards the router.
        locator: the router's address, such as `tcp/127.0.0.1:40123`.
        password: good for this role and this router.
    """

    role: Role
    locator: str
    password: str


def advance_key(role: Role) -> str:
    """Where the launcher tells `role` how far to live."""
    return f"farside/{role}/advance"


def report_key(role: Role) -> str:
    """Where `role` tells the launcher what it recorded."""
    return f"farside/{role}/report"


def out_key(end: Role) -> str:
    """Where an end of the link hands over the frames that it sends."""
    return f"farside/{end}/out"


def in_key(end: Role) -> str:
    """Where the link hands over the frames that arrive at an end."""
    return f"farside/{end}/in"


def frame_sources(role: Role) -> dict[str, Role]:
    """The keys on which `role` gets frames, with who says them, in the order of taking."""
    if role is Role.LINK:
        return {out_key(end): end for end in _ENDS}
    return {in_key(role): Role.LINK}


def heard_by(role: Role) -> list[str]:
    """All keys that `role` may hear."""
    return [advance_key(role), *frame_sources(role)]


def said_by(role: Role) -> list[str]:
    """All keys on which `role` may say something."""
    frames = [
        key for other in Role for key, sender in frame_sources(other).items() if sender is role
    ]
    return [report_key(role), *frames]


class Exchange:
    """A Zenoh session that hears some keys into one inbox.

    Attributes:
        inbox: what was heard, as (key, payload), in order of arrival. Nothing is ever dropped:
            the barrier between windows bounds it to one window's messages.
    """

    def __init__(self, session: zenoh.Session, keys: list[str]) -> None:
        self.inbox: SimpleQueue[tuple[str, bytes]] = SimpleQueue()
        self._session = session
        for key in keys:
            self._hear(key)

    def _hear(self, key: str) -> None:
        def put(sample: zenoh.Sample) -> None:
            self.inbox.put((key, sample.payload.to_bytes()))

        self._session.declare_subscriber(key, put)

    def say(self, key: str, payload: bytes) -> None:
        """Send `payload` to whoever hears `key`, at once; waits where the network is full."""
        self._session.put(
            key, payload, congestion_control=zenoh.CongestionControl.BLOCK, express=True
        )


class Router(Exchange):
    """The launcher's exchange: hears all reports.

    Attributes:
        tickets: one for each role.
    """

    def __init__(self, session: zenoh.Session, passwords: Mapping[Role, str]) -> None:
        super().__init__(session, [report_key(role) for role in Role])
        locator = _locator(session)
        self.tickets = {role: Ticket(role, locator, passwords[role]) for role in Role}


@contextmanager
def open_router() -> Iterator[Router]:
    """A router on a loopback port chosen by the system, with fresh passwords; closed at the end.

    Raises:
        zenoh.ZError: if it cannot listen.
    """
    passwords = {role: secrets.token_urlsafe() for role in Role}
    settings: dict[str, object] = {
        "mode": "router",
        "listen/endpoints": ["tcp/127.0.0.1:0"],
        "adminspace/enabled": True,  # for the port; the access control keeps the roles out of it
        "access_control": _access_control(),
    }
    with _dictionary(passwords) as path:
        session = _open(settings | {"transport/auth/usrpwd": {"dictionary_file": path}})
    with session:
        yield Router(session, passwords)


@contextmanager
def join(ticket: Ticket) -> Iterator[Exchange]:
    """A client's exchange that hears all keys of the ticket's role; left at the end.

    Raises:
        ConnectionRefusedError: if the router is gone or does not take the password.
    """
    settings: dict[str, object] = {
        "mode": "client",
        "connect/endpoints": [ticket.locator],
        "connect/timeout_ms": 0,
        "connect/exit_on_failure": True,
        "transport/auth/usrpwd": {"user": ticket.role, "password": ticket.password},
    }
    try:
        session = _open(settings)
    except zenoh.ZError as error:
        raise ConnectionRefusedError(
            f"the {ticket.role} got no session with the router at {ticket.locator}: "
            "either the run is over, or the password is not of this run"
        ) from error
    with session:
        yield Exchange(session, heard_by(ticket.role))


def _open(settings: dict[str, object]) -> zenoh.Session:
    config = zenoh.Config()
    for key, value in (_QUIET | settings).items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def _locator(session: zenoh.Session) -> str:
    for reply in session.get(f"@/{session.info.zid()}/router"):
        if reply.ok is not None:
            locator: str = json.loads(reply.ok.payload.to_bytes())["locators"][0]
            return locator
    raise RuntimeError("the Zenoh router does not tell on which port it listens")


@contextmanager
def _dictionary(passwords: Mapping[Role, str]) -> Iterator[str]:
    # Zenoh takes passwords from a file only, and reads it once, while opening. The system makes
    # such a temporary file readable by its owner alone.
    with tempfile.NamedTemporaryFile("w", prefix="farside-") as file:
        file.writelines(f"{role}:{password}\n" for role, password in passwords.items())
        file.flush()
        yield file.name


def _access_control() -> dict[str, object]:
    """Nobody may do anything, except each role what the table at the top of this module says."""
    rules: list[dict[str, object]] = []
    for role in Role:
        rules += [
            _rule(f"{role} hears", heard_by(role), "ingress", "declare_subscriber"),
            _rule(f"{role} is told", heard_by(role), "egress", "put"),
            _rule(f"{role} says", said_by(role), "ingress", "put"),
        ]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": role, "usernames": [role]} for role in Role],
        "policies": [
            {"subjects": [role], "rules": [f"{role} hears", f"{role} is told", f"{role} says"]}
            for role in Role
        ],
    }


def _rule(name: str, keys: list[str], flow: str, message: str) -> dict[str, object]:
    return {
        "id": name,
        "permission": "allow",
        "flows": [flow],
        "messages": [message],
        "key_exprs": keys,
    }
