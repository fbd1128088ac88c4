"""`farside link` and the sides that it joins: credentials, and waiting for who is not there yet."""

import json
import socket
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import pytest
import zenoh
from certificates import Authority
from linking import LinkProcess, unused_port
from relaying import until
from typer.testing import CliRunner

from farside.link.emulator import sides
from farside.link.emulator.domains import Domain, domain_at, domain_of
from farside.link.emulator.sides import open_sides
from farside.missions.commands.main import app

pytestmark = pytest.mark.processes

USERS = {"auth": {"usrpwd": {"dictionary_file": "users"}}}


@contextmanager
def router(
    locator: str, transport: Mapping[str, object] | None = None, *, connect: Sequence[str] = ()
) -> Iterator[zenoh.Session]:
    """A Zenoh router at an address, which connects to others."""
    config = zenoh.Config()
    config.insert_json5("mode", '"router"')
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints", json.dumps([locator]))
    config.insert_json5("connect/endpoints", json.dumps(connect))
    for key, value in (transport or {}).items():
        config.insert_json5(f"transport/{key}", json.dumps(value))
    with zenoh.open(config) as session:
        yield session


def side(locator: str, transport: object, mode: str = "client") -> Domain:
    """The rover's side, with settings from a file."""
    path = Path("rover.json5")
    settings = {"mode": mode, "transport": transport, "connect": {"endpoints": [locator]}}
    path.write_text(json.dumps(settings | {"listen": {"endpoints": []}}))
    return domain_of(path, None, "rover side")


def joined(domain: Domain) -> list[str]:
    """Join a side that has to be there, and say whom one finds."""
    told: list[str] = []
    with open_sides([domain], told.append) as [session]:
        found = [str(one) for one in session.info.routers_zid()]
    assert told == []
    return found


def refusal(domain: Domain) -> str:
    """What is said of a side that cannot be joined."""
    with pytest.raises(ConnectionError) as caught, open_sides([domain], print):
        pass
    return str(caught.value)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where settings, certificates and passwords of a test are; paths in settings begin here."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_side_that_shows_a_trusted_certificate_is_joined_and_any_other_refused(
    folder: Path,
) -> None:
    ours, theirs = Authority(folder, "ours"), Authority(folder, "theirs")
    certificate, key = ours.pair("router")
    at = f"tls/127.0.0.1:{unused_port()}"
    shown = {"link": {"tls": {"listen_certificate": certificate, "listen_private_key": key}}}
    with router(at, shown) as there:
        trusting = {"link": {"tls": {"root_ca_certificate": ours.certificate}}}
        assert joined(side(at, trusting)) == [str(there.info.zid())]
        doubting = {"link": {"tls": {"root_ca_certificate": theirs.certificate}}}
        for mode in ("client", "peer"):
            assert refusal(side(at, doubting, mode)) == (
                f"expected a Zenoh router or peer of the rover side at {at}, found one whose "
                "certificate is not trusted: invalid peer certificate: UnknownIssuer"
            )


def test_a_side_that_asks_for_a_certificate_is_joined_with_a_trusted_one_only(
    folder: Path,
) -> None:
    ours, theirs = Authority(folder, "ours"), Authority(folder, "theirs")
    certificate, key = ours.pair("router")
    at = f"tls/127.0.0.1:{unused_port()}"
    trust = {"root_ca_certificate": ours.certificate, "enable_mtls": True}
    shown = {"listen_certificate": certificate, "listen_private_key": key}
    words = "found one that does not trust the certificate of this side, or misses it: received"
    with router(at, {"link": {"tls": trust | shown}}) as there:
        for authority, found in ((ours, "joined"), (theirs, "UnknownCA"), (None, "Required")):
            tls: dict[str, object] = {"root_ca_certificate": ours.certificate}
            if authority is not None:
                own = authority.pair("farside")
                tls |= {"connect_certificate": own.certificate, "connect_private_key": own.key}
                tls["enable_mtls"] = True
            domain = side(at, {"link": {"tls": tls}})
            if found == "joined":
                assert joined(domain) == [str(there.info.zid())]
            else:
                said = refusal(domain)
                assert words in said
                assert found in said


@pytest.mark.parametrize("mode", ["client", "peer"])
def test_a_side_that_asks_for_a_password_is_joined_with_the_right_one_only(
    folder: Path, mode: str
) -> None:
    (folder / "users").write_text("rover:secret\n")
    at = f"tcp/127.0.0.1:{unused_port()}"
    with router(at, USERS) as there:
        right = {"auth": {"usrpwd": {"user": "rover", "password": "secret"}}}
        assert joined(side(at, right, mode)) == [str(there.info.zid())]
        wrong = {"auth": {"usrpwd": {"user": "rover", "password": "guess"}}}
        for transport in (wrong, {}):
            said = refusal(side(at, transport, mode))
            assert "found one that refuses the session, as it does a wrong user or pass" in said
            assert "guess" not in said


def test_one_of_several_addresses_is_enough(folder: Path) -> None:
    at = f"tcp/127.0.0.1:{unused_port()}"
    with router(at) as there:
        path = folder / "both.json5"
        path.write_text(json.dumps({"connect": {"endpoints": ["tcp/127.0.0.1:1", at]}}))
        for mode in ("client", "peer"):
            domain = domain_of(path, None, "rover side")._replace(mode=mode)
            assert joined(domain) == [str(there.info.zid())]


def test_an_address_that_is_not_free_or_no_address_is_told() -> None:
    port = unused_port()
    with router(f"tcp/127.0.0.1:{port}"):
        taken = refusal(domain_at(f"listen/tcp/127.0.0.1:{port}", "rover side"))
    assert "to listen for the rover side on tcp/127.0.0.1" in taken
    assert "Address already in use" in taken
    assert ".rs" not in taken
    assert "no such port" in refusal(domain_at("tcp/127.0.0.1:99999", "rover side"))
    assert "no host with a port" in refusal(domain_at("tcp/127.0.0.1", "rover side"))
    assert "no such protocol" in refusal(domain_at("pigeon/127.0.0.1:1", "rover side"))


def test_a_side_without_an_answer_is_waited_for_too(monkeypatch: pytest.MonkeyPatch) -> None:
    """Somebody listens there who never says anything, as where a firewall swallows all."""
    monkeypatch.setattr(sides, "_PATIENCE_S", 0.1)
    told: list[str] = []

    def tell(words: str) -> None:
        told.append(words)
        raise KeyboardInterrupt

    with socket.create_server(("127.0.0.1", 0)) as mute:
        at = f"tcp/127.0.0.1:{mute.getsockname()[1]}"
        with pytest.raises(KeyboardInterrupt), open_sides([domain_at(at, "rover side")], tell):
            pass
    assert told == [f"rover side: waiting for it at {at}: no answer"]


UP = "--up=cmd/**"


def test_a_side_that_is_not_there_yet_is_waited_for() -> None:
    """It says so once, says when the side is there, and counts the duration from then on.

    The other side is open to anybody, and that is warned of.
    """
    at = f"tcp/127.0.0.1:{unused_port()}"
    with LinkProcess(
        UP, f"--rover-side={at}", "--ground-side=listen/tcp/0.0.0.0:0", "--duration=0.01"
    ) as between:
        assert between.says() == (
            "warning: ground side: anybody who reaches tcp/0.0.0.0:0 may send over the link and "
            "change it; --ground-config can ask for a certificate or a password"
        )
        assert between.says() == f"rover side: waiting for it at {at}: Connection refused"
        with router(at):
            assert between.says() == "rover side: connected"
            assert between.says().startswith("passing messages: ")
            status, output, _ = between.end()
    assert status == 0
    assert json.loads(output)["rover_side"]["unheard"] == 0


def test_waiting_ends_with_an_interrupt() -> None:
    with LinkProcess(
        UP, "--rover-side=tcp/127.0.0.1:1", "--ground-side=tcp/127.0.0.1:2"
    ) as between:
        waiting = {between.says(), between.says()}
        assert waiting == {
            f"{role} side: waiting for it at tcp/127.0.0.1:{port}: Connection refused"
            for role, port in (("rover", 1), ("ground", 2))
        }
        assert between.interrupt() == (130, "", "")


def test_a_side_that_goes_and_comes_back_is_told_and_served_again() -> None:
    at = f"tcp/127.0.0.1:{unused_port()}"
    with router(at):
        between = LinkProcess(UP, f"--ground-side={at}", "--rover-side=listen/tcp/127.0.0.1:0")
        assert between.says().startswith("passing messages: ")
    with between:
        assert between.says() == "ground side: nobody is connected any more"
        with router(at) as again:
            assert between.says() == "ground side: connected"
            replies: list[bytes] = []

            def answered() -> bool:
                told = [one.ok for one in again.get("farside/link/counters")]
                replies.extend(one.payload.to_bytes() for one in told if one is not None)
                return bool(replies)

            # That somebody answers there takes a moment to get about.
            until(answered)
            assert json.loads(replies[0])["ground_side"]["connected"] == 1


def test_two_sides_whose_routers_know_each_other_are_refused() -> None:
    """What the one is given the other would give back, for ever."""
    rover, ground = (f"tcp/127.0.0.1:{unused_port()}" for _ in range(2))
    with router(rover), router(ground, connect=[rover]):
        options = ["--down=cmd/**", f"--rover-side={rover}", f"--ground-side={ground}"]
        with LinkProcess(UP, *options) as between:
            status, _, errors = between.end()
    assert status == 3
    assert "found a way from one side to the other beside this link" in errors


def test_a_wrong_certificate_ends_the_command_in_words(folder: Path) -> None:
    ours, theirs = Authority(folder, "ours"), Authority(folder, "theirs")
    certificate, key = ours.pair("router")
    at = f"tls/127.0.0.1:{unused_port()}"
    shown = {"link": {"tls": {"listen_certificate": certificate, "listen_private_key": key}}}
    trust = {"transport": {"link": {"tls": {"root_ca_certificate": theirs.certificate}}}}
    Path("rover.json5").write_text(json.dumps(trust))
    ground = "--ground-side=listen/tcp/127.0.0.1:0"
    with (
        router(at, shown),
        LinkProcess(UP, "--rover-config=rover.json5", f"--rover-side={at}", ground) as between,
    ):
        status, _, errors = between.end()
    assert status == 3
    assert "whose certificate is not trusted" in errors
    assert errors.count("\n") == 1


def test_access_control_of_the_file_keeps_others_from_changing_the_link(folder: Path) -> None:
    at = f"tcp/127.0.0.1:{unused_port()}"
    denied = {
        "id": "hands off",
        "permission": "deny",
        "flows": ["ingress"],
        "messages": ["query"],
        "key_exprs": ["farside/link/control"],
    }
    control = {
        "enabled": True,
        "default_permission": "allow",
        "rules": [denied],
        "subjects": [{"id": "anybody"}],
        "policies": [{"rules": ["hands off"], "subjects": ["anybody"]}],
    }
    settings = {"listen": {"endpoints": [at]}, "access_control": control}
    Path("ground.json5").write_text(json.dumps(settings))
    rover = "--rover-side=listen/tcp/127.0.0.1:0"
    with LinkProcess(UP, rover, "--ground-config=ground.json5") as between:
        between.passes()
        config = zenoh.Config.from_json5(json.dumps({"mode": "client"}))
        config.insert_json5("connect/endpoints", json.dumps([at]))
        config.insert_json5("scouting/multicast/enabled", "false")
        with zenoh.open(config) as anybody:
            while not list(anybody.get("farside/link/counters")):
                pass
            assert (
                list(anybody.get("farside/link/control", payload='{"both": {"out": true}}')) == []
            )
        assert between.state()["up"]["outage"] is None


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([], "expected --rover-side or --rover-config, found neither"),
        (["--rover-side=tcp/127.0.0.1:1"], "expected --ground-side or --ground-config"),
        (
            ["--rover-side=tcp/127.0.0.1:1", "--ground-config=ground.json5"],
            "--ground-config: ground.json5: line 1, column 2: unknown field `conect`",
        ),
    ],
)
def test_what_is_missing_or_wrong_is_status_2(folder: Path, options: list[str], words: str) -> None:
    Path("ground.json5").write_text("{conect: {}}")
    result = CliRunner().invoke(app, ["link", UP, *options], env={"COLUMNS": "1000"})
    assert result.exit_code == 2
    assert words in result.output
