"""Real Zenoh on loopback: who may say what to whom."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import msgspec
import pytest
import zenoh
from zenoh.handlers import Callback

from farside.missions.crew import network
from farside.missions.crew.network import (
    Exchange,
    Router,
    advance_key,
    join,
    open_router,
    report_key,
)
from farside.node import Role

pytestmark = pytest.mark.processes

PATIENCE_S = 30.0

# Written out here, so that the module under test cannot grant itself more.
HEARS = {
    Role.ROVER: {"farside/rover/advance", "farside/rover/in"},
    Role.LINK: {"farside/link/advance", "farside/rover/out", "farside/ground/out"},
    Role.GROUND: {"farside/ground/advance", "farside/ground/in"},
}
SAYS = {
    Role.ROVER: {"farside/rover/report", "farside/rover/out"},
    Role.LINK: {"farside/link/report", "farside/rover/in", "farside/ground/in"},
    Role.GROUND: {"farside/ground/report", "farside/ground/out"},
}
ALL_KEYS = set().union(*HEARS.values(), *SAYS.values())


class Network:
    """The launcher's router and a session of each role."""

    def __init__(self, router: Router, roles: dict[Role, Exchange]) -> None:
        self.router, self.roles = router, roles

    def others(self, intruder: Role) -> list[Role]:
        return [role for role in Role if role is not intruder]

    def settle(self, speaker: Role) -> None:
        """Wait until all that `speaker` said has come wherever it is let through to."""
        self.roles[speaker].say(report_key(speaker), b"settle")
        wait_for(self.router, (report_key(speaker), b"settle"))
        for role, exchange in self.roles.items():
            self.router.say(advance_key(role), b"settle")
            wait_for(exchange, (advance_key(role), b"settle"))


def wait_for(exchange: Exchange, message: tuple[str, bytes]) -> None:
    while exchange.inbox.get(timeout=PATIENCE_S) != message:
        pass


def overhear(who: Exchange, keys: set[str]) -> list[tuple[str, bytes]]:
    """Whatever comes to `who` on `keys` from now on."""
    heard: list[tuple[str, bytes]] = []

    def note(sample: zenoh.Sample) -> None:
        heard.append((str(sample.key_expr), sample.payload.to_bytes()))

    for key in sorted(keys):
        # Called before the session takes its next message, so that `settle` covers it.
        who._session.declare_subscriber(key, Callback(note, indirect=False))
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
    """The keys on which what `intruder` says reaches anybody, however eager to hear it."""
    with open_network() as network:
        hearers = [network.router, *(network.roles[role] for role in network.others(intruder))]
        ears = [overhear(hearer, ALL_KEYS) for hearer in hearers]
        for role in Role:
            network.settle(role)
        for key in sorted(ALL_KEYS):
            network.roles[intruder].say(key, b"forged")
        network.settle(intruder)
        return {key for heard in ears for key, payload in heard if payload == b"forged"}


def keys_overheard_by(intruder: Role) -> set[str]:
    """The keys of which `intruder` hears anything, with all others saying all they can."""
    with open_network() as network:
        heard = overhear(network.roles[intruder], {*ALL_KEYS, "farside/**", "**"})
        network.settle(intruder)
        for role in network.others(intruder):
            for key in sorted(ALL_KEYS):
                network.roles[role].say(key, b"private")
            network.settle(role)
        for role in Role:
            network.router.say(advance_key(role), b"private")
        network.settle(intruder)
        return {key for key, payload in heard if payload == b"private"}


@pytest.mark.parametrize("intruder", Role)
def test_a_role_is_heard_on_its_own_keys_only(intruder: Role) -> None:
    assert keys_that_take_a_forgery_of(intruder) == SAYS[intruder]


@pytest.mark.parametrize("intruder", Role)
def test_a_role_hears_its_own_keys_only(intruder: Role) -> None:
    assert keys_overheard_by(intruder) == HEARS[intruder]


@pytest.mark.usefixtures("without_access_control")
def test_without_access_control_the_ground_would_be_heard_and_hear_everywhere() -> None:
    assert keys_that_take_a_forgery_of(Role.GROUND) == ALL_KEYS
    assert keys_overheard_by(Role.GROUND) == ALL_KEYS


def test_no_key_of_the_ground_is_one_of_the_rovers() -> None:
    rover, ground = HEARS[Role.ROVER] | SAYS[Role.ROVER], HEARS[Role.GROUND] | SAYS[Role.GROUND]
    assert not rover & ground


def test_the_router_answers_no_questions_about_itself() -> None:
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


def test_passwords_are_in_a_file_for_the_owner_alone_and_only_while_the_router_opens(
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


def test_any_bytes_cross_unchanged_and_in_order() -> None:
    messages = [bytes([number]) * 10**number for number in range(7)]
    with open_network() as network:
        network.settle(Role.ROVER)
        for message in messages:
            network.roles[Role.ROVER].say("farside/rover/out", message)
        inbox = network.roles[Role.LINK].inbox
        for message in messages:
            assert inbox.get(timeout=PATIENCE_S) == ("farside/rover/out", message)
