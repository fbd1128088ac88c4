"""Access control on real Zenoh: which role may publish and subscribe to what."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import msgspec
import pytest
import zenoh
from zenoh.handlers import Callback

from farside.missions.crew import network
from farside.missions.crew.barrier import Sample
from farside.missions.crew.network import (
    Connection,
    Router,
    advance_key,
    join,
    open_router,
    report_key,
)
from farside.node import Role

pytestmark = pytest.mark.processes

PATIENCE_S = 30.0

# Written out here, so that a mistake in the module under test shows.
SUBSCRIBES = {
    Role.ROVER: {"farside/rover/advance", "farside/rover/in"},
    Role.LINK: {"farside/link/advance", "farside/rover/out", "farside/ground/out"},
    Role.GROUND: {"farside/ground/advance", "farside/ground/in"},
}
PUBLISHES = {
    Role.ROVER: {"farside/rover/report", "farside/rover/out"},
    Role.LINK: {"farside/link/report", "farside/rover/in", "farside/ground/in"},
    Role.GROUND: {"farside/ground/report", "farside/ground/out"},
}
ALL_KEYS = set().union(*SUBSCRIBES.values(), *PUBLISHES.values())


class Network:
    """The launcher's router and a connection for each role."""

    def __init__(self, router: Router, roles: dict[Role, Connection]) -> None:
        self.router, self.roles = router, roles

    def others(self, intruder: Role) -> list[Role]:
        return [role for role in Role if role is not intruder]

    def settle(self, publisher: Role) -> None:
        """Wait until everything that `publisher` sent has arrived wherever it may."""
        self.roles[publisher].publish(report_key(publisher), b"settle")
        wait_for(self.router, (report_key(publisher), b"settle"))
        for role, connection in self.roles.items():
            self.router.publish(advance_key(role), b"settle")
            wait_for(connection, (advance_key(role), b"settle"))


def wait_for(connection: Connection, sample: Sample) -> None:
    while connection.inbox.get(timeout=PATIENCE_S) != sample:
        pass


def overhear(connection: Connection, keys: set[str]) -> list[tuple[str, bytes]]:
    """Everything that `connection` receives on `keys` from now on."""
    heard: list[tuple[str, bytes]] = []

    def note(sample: zenoh.Sample) -> None:
        heard.append((str(sample.key_expr), sample.payload.to_bytes()))

    for key in sorted(keys):
        # Called before the session takes its next message, so that `settle` covers it.
        connection._session.declare_subscriber(key, Callback(note, indirect=False))
    return heard


@contextmanager
def open_network() -> Iterator[Network]:
    with ExitStack() as stack:
        router = stack.enter_context(open_router())
        tickets = router.tickets.items()
        roles = {role: stack.enter_context(join(ticket)) for role, ticket in tickets}
        yield Network(router, roles)


@pytest.fixture
def without_access_control(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(network, "_access_control", lambda: {"enabled": False})


def keys_that_take_a_forgery_of(intruder: Role) -> set[str]:
    """The keys on which a sample of `intruder` reaches any subscriber, allowed or not."""
    with open_network() as network:
        listeners = [network.router, *(network.roles[role] for role in network.others(intruder))]
        overheard = [overhear(listener, ALL_KEYS) for listener in listeners]
        for role in Role:
            network.settle(role)
        for key in sorted(ALL_KEYS):
            network.roles[intruder].publish(key, b"forged")
        network.settle(intruder)
        return {key for heard in overheard for key, payload in heard if payload == b"forged"}


def keys_overheard_by(intruder: Role) -> set[str]:
    """The keys on which `intruder` receives anything while all others publish on every key."""
    with open_network() as network:
        heard = overhear(network.roles[intruder], {*ALL_KEYS, "farside/**", "**"})
        network.settle(intruder)
        for role in network.others(intruder):
            for key in sorted(ALL_KEYS):
                network.roles[role].publish(key, b"private")
            network.settle(role)
        for role in Role:
            network.router.publish(advance_key(role), b"private")
        network.settle(intruder)
        return {key for key, payload in heard if payload == b"private"}


@pytest.mark.parametrize("intruder", Role)
def test_a_role_can_publish_on_its_own_keys_only(intruder: Role) -> None:
    assert keys_that_take_a_forgery_of(intruder) == PUBLISHES[intruder]


@pytest.mark.parametrize("intruder", Role)
def test_a_role_receives_on_its_own_keys_only(intruder: Role) -> None:
    assert keys_overheard_by(intruder) == SUBSCRIBES[intruder]


@pytest.mark.usefixtures("without_access_control")
def test_without_access_control_the_ground_can_publish_and_receive_on_every_key() -> None:
    assert keys_that_take_a_forgery_of(Role.GROUND) == ALL_KEYS
    assert keys_overheard_by(Role.GROUND) == ALL_KEYS


def test_rover_and_ground_have_no_key_in_common() -> None:
    rover, ground = (
        SUBSCRIBES[Role.ROVER] | PUBLISHES[Role.ROVER],
        SUBSCRIBES[Role.GROUND] | PUBLISHES[Role.GROUND],
    )
    assert not rover & ground


def test_a_role_cannot_query_the_routers_admin_space() -> None:
    with open_router() as router, join(router.tickets[Role.GROUND]) as ground:
        about_itself = f"@/{router._session.info.zid()}/router"
        assert len(list(router._session.get(about_itself))) == 1
        assert list(ground._session.get(about_itself)) == []


@pytest.mark.parametrize("password", ["", "wrong"])
def test_a_wrong_password_gets_no_session(password: str) -> None:
    with open_router() as router:
        ticket = msgspec.structs.replace(router.tickets[Role.GROUND], password=password)
        with pytest.raises(ConnectionRefusedError, match="the ground got no session"), join(ticket):
            pass


def test_the_password_of_another_role_gets_no_session() -> None:
    with open_router() as router:
        ticket = msgspec.structs.replace(router.tickets[Role.GROUND], role=Role.ROVER)
        with pytest.raises(ConnectionRefusedError), join(ticket):
            pass


def test_every_router_draws_new_passwords() -> None:
    with open_router() as one, open_router() as other:
        passwords = [ticket.password for ticket in (*one.tickets.values(), *other.tickets.values())]
    assert len(set(passwords)) == 6


def test_the_password_file_is_private_and_exists_only_while_the_router_opens(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    seen: list[tuple[int, str]] = []
    really_open = network._open

    def look_and_open(settings: dict[str, object]) -> object:
        seen.extend((path.stat().st_mode & 0o777, path.read_text()) for path in tmp_path.iterdir())
        return really_open(settings)

    monkeypatch.setattr(network, "_open", look_and_open)
    with open_router() as router:
        assert list(tmp_path.iterdir()) == []
        [(mode, text)] = seen
        assert mode == 0o600
        assert router.tickets[Role.LINK].password in text


def test_payloads_arrive_unchanged_and_in_order() -> None:
    messages = [bytes([number]) * 10**number for number in range(7)]
    with open_network() as network:
        network.settle(Role.ROVER)
        for message in messages:
            network.roles[Role.ROVER].publish("farside/rover/out", message)
        inbox = network.roles[Role.LINK].inbox
        for message in messages:
            assert inbox.get(timeout=PATIENCE_S) == ("farside/rover/out", message)
