"""The run's Zenoh network: a router on loopback, three clients, and their access control.

The launcher opens the router with a random password for each role. Each role may publish and
subscribe to its own keys only, so rover and ground can reach each other through the link alone:

    key                   publisher    subscriber
    farside/ROLE/advance  launcher     ROLE
    farside/ROLE/report   ROLE         launcher
    farside/END/out       END          link       (END: rover, ground)
    farside/END/in        link         END

The network carries frames and the messages of the barrier. A frame's fate is decided in the
channel, so the network itself must lose nothing: it blocks rather than drops, and never times out.
"""

import json
import mmap
import os
import secrets
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from queue import SimpleQueue

import msgspec
import zenoh

from farside.missions.crew.crew import InfrastructureError
from farside.node import Role

_ENDS = (Role.ROVER, Role.GROUND)

# A process that dies closes its connection. Silence only means that a role is computing, or that
# the machine is suspended.
_LEASE_MS = 24 * 3600 * 1000

_ADDRESS = "tcp/127.0.0.1:0"
_MOST_PENDING = 10_000

# What has to be free for a run: it opens 25 files, and the heaps of Zenoh's threads take 64 MiB of
# addresses each, though little memory.
_FREE_FILES = 32
_FREE_BYTE = 1 << 30

_QUIET: dict[str, object] = {
    "scouting/multicast/enabled": False,
    "scouting/gossip/enabled": False,
    "scouting/delay": 0,
    "timestamping/enabled": False,
    # Shared memory outlives a killed process, and frames are small.
    "transport/shared_memory/enabled": False,
    "transport/link/tx/lease": _LEASE_MS,
}


class Ticket(msgspec.Struct, frozen=True):
    """A role's credentials for the run's network. Secret: passed through a pipe only.

    Attributes:
        role: the role, and its user name at the router.
        locator: address of the router, such as `tcp/127.0.0.1:40123`.
        password: valid for this role at this router.
    """

    role: Role
    locator: str
    password: str


def advance_key(role: Role) -> str:
    """Key of the `Advance` messages from the launcher to `role`."""
    return f"farside/{role}/advance"


def report_key(role: Role) -> str:
    """Key of the `WindowReport` messages from `role` to the launcher."""
    return f"farside/{role}/report"


def out_key(end: Role) -> str:
    """Key of the frames that an end of the link sends."""
    return f"farside/{end}/out"


def in_key(end: Role) -> str:
    """Key of the frames that arrive at an end of the link."""
    return f"farside/{end}/in"


def frame_sources(role: Role) -> dict[str, Role]:
    """The keys on which `role` receives frames, each with its publisher, in the order of taking."""
    if role is Role.LINK:
        return {out_key(end): end for end in _ENDS}
    return {in_key(role): Role.LINK}


def subscriptions(role: Role) -> list[str]:
    """All keys to which `role` may subscribe."""
    return [advance_key(role), *frame_sources(role)]


def publications(role: Role) -> list[str]:
    """All keys on which `role` may publish."""
    frames = [
        key for other in Role for key, sender in frame_sources(other).items() if sender is role
    ]
    return [report_key(role), *frames]


class Connection:
    """A Zenoh session with one inbox for all its subscriptions.

    Args:
        session: an open session; the caller closes it.
        keys: the keys to subscribe to.

    Attributes:
        inbox: samples received, as (key, payload), in order of arrival. It is unbounded, but the
            barrier keeps it to the messages of one window.
    """

    def __init__(self, session: zenoh.Session, keys: list[str]) -> None:
        self.inbox: SimpleQueue[tuple[str, bytes]] = SimpleQueue()
        self._session = session
        for key in keys:
            self._subscribe(key)

    def _subscribe(self, key: str) -> None:
        def put(sample: zenoh.Sample) -> None:
            self.inbox.put((key, sample.payload.to_bytes()))

        self._session.declare_subscriber(key, put)

    def publish(self, key: str, payload: bytes) -> None:
        """Send `payload` to the subscribers of `key` at once; blocks while the network is full."""
        self._session.put(
            key, payload, congestion_control=zenoh.CongestionControl.BLOCK, express=True
        )


class Router(Connection):
    """The router, and the launcher's connection to it, subscribed to all reports.

    Args:
        session: an open session in router mode.
        passwords: of the roles.

    Attributes:
        tickets: the credentials of each role.
    """

    def __init__(self, session: zenoh.Session, passwords: Mapping[Role, str]) -> None:
        super().__init__(session, [report_key(role) for role in Role])
        locator = _locator(session)
        self.tickets = {role: Ticket(role, locator, passwords[role]) for role in Role}


@contextmanager
def open_router() -> Iterator[Router]:
    """A router with new passwords, on a free loopback port; closed on exit.

    Raises:
        InfrastructureError: if it cannot listen, or may not open enough files.
    """
    _check_room()
    passwords = {role: secrets.token_urlsafe() for role in Role}
    settings: dict[str, object] = {
        "mode": "router",
        "listen/endpoints": [_ADDRESS],
        # Whoever connects and says nothing takes no role's place.
        "transport/unicast/accept_pending": _MOST_PENDING,
        "adminspace/enabled": True,  # to learn the port; access control keeps the roles out
        "access_control": _access_control(),
    }
    with ExitStack() as stack:
        try:
            path = stack.enter_context(_dictionary(passwords))
            session = _open(settings | {"transport/auth/usrpwd": {"dictionary_file": path}})
        except (zenoh.ZError, OSError) as error:
            raise InfrastructureError(
                f"the run's network cannot start: {_reason(error)}"
            ) from error
    with session:
        yield Router(session, passwords)


@contextmanager
def join(ticket: Ticket) -> Iterator[Connection]:
    """A client's connection with all subscriptions of its role; closed on exit.

    Raises:
        ConnectionRefusedError: if the router is gone or rejects the password.
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
            "either the run is over, or the password belongs to another run"
        ) from error
    with session:
        yield Connection(session, subscriptions(ticket.role))


def _open(settings: dict[str, object]) -> zenoh.Session:
    config = zenoh.Config()
    for key, value in (_QUIET | settings).items():
        config.insert_json5(key, json.dumps(value))
    try:
        return zenoh.open(config)
    except Exception:
        raise
    except BaseException as error:
        # A panic of Zenoh's, as where no thread can be started, is no `Exception`.
        if isinstance(error, KeyboardInterrupt | SystemExit):
            raise
        raise InfrastructureError(f"Zenoh cannot start: {error}") from error


def _reason(error: Exception) -> str:
    """The words of an error, without the place in Zenoh's source."""
    if isinstance(error, OSError):
        return error.strerror or str(error)
    return str(error).partition(" at /")[0]


def _check_room() -> None:
    """Find out before Zenoh does, which aborts the process where it cannot start a thread."""
    advice = "raise the limit with `ulimit {}`, or run with --in-process"
    with ExitStack() as stack:
        try:
            for _ in range(_FREE_FILES):
                stack.callback(os.close, os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC))
        except OSError as error:
            raise InfrastructureError(
                f"a run in processes needs {_FREE_FILES} more open files: {error.strerror}; "
                + advice.format("-n")
            ) from error
    try:
        # Neither read nor written, so that only the limit on addresses counts.
        mmap.mmap(-1, _FREE_BYTE, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS, prot=0).close()
    except OSError as error:
        raise InfrastructureError(
            f"a run in processes needs {_FREE_BYTE >> 20} MiB more address space: "
            f"{error.strerror}; " + advice.format("-v")
        ) from error


def _locator(session: zenoh.Session) -> str:
    for reply in session.get(f"@/{session.info.zid()}/router"):
        if reply.ok is not None:
            locator: str = json.loads(reply.ok.payload.to_bytes())["locators"][0]
            return locator
    raise RuntimeError("expected the Zenoh router to report its locator, found no reply")


@contextmanager
def _dictionary(passwords: Mapping[Role, str]) -> Iterator[str]:
    # Zenoh takes passwords from a file only, and reads it once, on opening. A temporary file is
    # readable by its owner alone.
    with tempfile.NamedTemporaryFile("w", prefix="farside-") as file:
        file.writelines(f"{role}:{password}\n" for role, password in passwords.items())
        file.flush()
        yield file.name


def _access_control() -> dict[str, object]:
    """Deny everything but what the table at the top of this module grants to each role."""
    rules: list[dict[str, object]] = []
    for role in Role:
        rules += [
            _rule(f"{role} subscribes", subscriptions(role), "ingress", "declare_subscriber"),
            _rule(f"{role} receives", subscriptions(role), "egress", "put"),
            _rule(f"{role} publishes", publications(role), "ingress", "put"),
        ]
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": [{"id": role, "usernames": [role]} for role in Role],
        "policies": [
            {
                "subjects": [role],
                "rules": [f"{role} subscribes", f"{role} receives", f"{role} publishes"],
            }
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
