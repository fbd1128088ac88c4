"""Where a domain is: an address, a file of Zenoh's settings, or both."""

import json
import re
from pathlib import Path

import pytest

from farside.link.emulator.domains import Domain, domain_at, domain_of

ADDRESS = "tcp/192.0.2.1:7447"
PAGE = Path(__file__).parents[2] / "docs" / "link.md"


def domain(folder: Path, text: str, locator: str | None = None) -> Domain:
    path = folder / "zenoh.json5"
    path.write_text(text)
    return domain_of(path, locator, "rover side")


def setting(one: Domain, key: str) -> object:
    return json.loads(one.config().get_json(key))


@pytest.mark.parametrize(
    ("text", "mode", "where"),
    [
        ('{connect: {endpoints: ["tcp/a:1", "tcp/b:2"]}}', "client", "tcp/a:1, tcp/b:2"),
        ('{listen: {endpoints: ["tcp/[::1]:1"]}}', "router", "listen/tcp/[::1]:1"),
        (
            '{connect: {endpoints: ["tcp/a:1"]}, listen: {endpoints: ["tcp/b:2"]}}',
            "router",
            "tcp/a:1, listen/tcp/b:2",
        ),
        (
            '{mode: "peer", connect: {endpoints: {peer: ["tcp/a:1"], client: ["tcp/b:2"]}}}',
            "peer",
            "tcp/a:1, listen/tcp/[::]:0",  # where every peer of Zenoh's listens
        ),
        (
            '{connect: {endpoints: [{strategy: "oneOf", locators: ["tcp/a:1", "tcp/b:2"]}]}}',
            "client",
            "tcp/a:1, tcp/b:2",
        ),
        ('{mode: "router", listen: {endpoints: ["tcp/a:1"]}}', "router", "listen/tcp/a:1"),
    ],
)
def test_a_file_says_where_the_domain_is_and_what_to_be_there(
    tmp_path: Path, text: str, mode: str, where: str
) -> None:
    found = domain(tmp_path, text)
    assert (found.mode, found.where) == (mode, where)
    assert setting(found, "mode") == mode


def test_the_address_may_come_from_the_command_line_and_the_rest_from_the_file(
    tmp_path: Path,
) -> None:
    text = '{mode: "client", transport: {auth: {usrpwd: {user: "rover", password: "secret"}}}}'
    found = domain(tmp_path, text, ADDRESS)
    assert found.where == ADDRESS
    assert setting(found, "connect/endpoints") == [ADDRESS]
    assert setting(found, "transport/auth/usrpwd/user") == "rover"


def test_what_the_file_leaves_out_is_as_without_one(tmp_path: Path) -> None:
    without = domain_at(ADDRESS, "rover side")
    assert str(domain(tmp_path, "{}", ADDRESS).config()) == str(without.config())
    assert setting(without, "scouting/multicast/enabled") is False
    scouting = "{scouting: {multicast: {enabled: true}}}"
    assert setting(domain(tmp_path, scouting, ADDRESS), "scouting/multicast/enabled") is True


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{\n  conect: {}}", "line 2, column 3: unknown field `conect`, expected one of `id`"),
        ("{\n  mode: 'clint'}", "line 2, column 9: unknown variant `clint`"),
        ("{connect: {endpoints: 3}}", "line 1, column 23: invalid type: integer `3`"),
        ("{\n\n listen: {endpoints: ['x' }}", "line 3, column 23: no valid JSON5: expected"),
        ("{connect: {endpoints: ['nonsense']}}", "line 1, column 24: Endpoints must be"),
        ("[]", "line 1: expected Zenoh's settings as a JSON5 object, found none"),
        ("", "line 1: expected Zenoh's settings as a JSON5 object, found none"),
        ("// only words\n", "line 1: expected Zenoh's settings as a JSON5 object, found none"),
        ("{" + "a" * 100_000 + ": 1}", "line 1, column 2: unknown field `aaaa"),
        ("{mode: 'router'}", "expected connect/endpoints or listen/endpoints, or an address"),
        (
            "{transport: {link: {tls: {root_ca_certificate: '/nowhere/ca.pem'}}}}",
            "transport/link/tls/root_ca_certificate: expected a file, found none at /nowhere/",
        ),
    ],
)
def test_a_file_that_is_not_valid_says_where(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(ValueError, match=r"zenoh\.json5: ") as refusal:
        domain(tmp_path, text)
    assert f"zenoh.json5: {words}" in str(refusal.value)
    assert ".rs" not in str(refusal.value)
    assert len(str(refusal.value)) < 600 + len(str(tmp_path))


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"none\.json5: No such file"):
        domain_of(tmp_path / "none.json5", None, "rover side")
    with pytest.raises(ValueError, match="expected a regular file, found a folder"):
        domain_of(tmp_path, None, "rover side")
    (tmp_path / "bytes.json5").write_bytes(b"\xff")
    with pytest.raises(ValueError, match="expected text in UTF-8, found byte 0xff in line 1"):
        domain_of(tmp_path / "bytes.json5", None, "rover side")


@pytest.mark.parametrize(
    ("text", "locator", "words"),
    [
        (
            '{connect: {endpoints: ["tcp/a:1"]}}',
            ADDRESS,
            f"expected the address there or on the command line, found both: tcp/a:1 and {ADDRESS}",
        ),
        ('{listen: {endpoints: ["tcp/a:1"]}}', ADDRESS, "found both: listen/tcp/a:1 and "),
        (
            '{mode: "peer"}',
            ADDRESS,
            f'mode: expected "client", which {ADDRESS} on the command line stands for',
        ),
        ('{mode: "client"}', f"listen/{ADDRESS}", 'mode: expected "router"'),
    ],
)
def test_file_and_command_line_may_not_contradict_each_other(
    tmp_path: Path, text: str, locator: str, words: str
) -> None:
    with pytest.raises(ValueError, match=r"zenoh\.json5: ") as refusal:
        domain(tmp_path, text, locator)
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    "locator",
    [
        "tcp/0.0.0.0:7447",
        "tcp/[::]:7447",
        "udp/192.0.2.1:7447#iface=eth0",
        "tls/rover.example:7447",
        "quic/10.0.0.1:7447",
        "ws/[fe80::1%eth0]:7447?rel=1",
    ],
)
def test_an_address_on_which_anybody_may_connect_is_unguarded(locator: str) -> None:
    assert domain_at(f"listen/{locator}", "rover side").unguarded() == locator


@pytest.mark.parametrize(
    "locator",
    [
        "tcp/192.0.2.1:7447",  # connects, and does not listen
        "listen/tcp/127.0.0.1:7447",
        "listen/tcp/127.1.2.3:0",
        "listen/tls/[::1]:7447",
        "listen/tcp/localhost:7447#iface=lo",
        "listen/unixsock-stream//tmp/zenoh.sock",
    ],
)
def test_on_loopback_nobody_comes_from_outside(locator: str) -> None:
    assert domain_at(locator, "rover side").unguarded() is None


@pytest.mark.parametrize(
    ("settings", "guarded"),
    [
        ('transport: {auth: {usrpwd: {dictionary_file: "users"}}}', ["tcp", "tls"]),
        ('transport: {auth: {usrpwd: {user: "u", password: "p"}}}', []),  # ours, asked of nobody
        ("transport: {link: {tls: {enable_mtls: true}}}", ["tls"]),
        ("transport: {link: {tls: {enable_mtls: false}}}", []),
        ('access_control: {enabled: true, default_permission: "deny"}', ["tcp", "tls"]),
        ("access_control: {enabled: false}", []),
    ],
)
def test_credentials_guard_an_address(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, settings: str, guarded: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "users").write_text("rover:secret\n")
    for protocol in ("tcp", "tls"):
        address = f"{protocol}/0.0.0.0:7447"
        found = domain(tmp_path, f'{{{settings}, listen: {{endpoints: ["{address}"]}}}}')
        assert found.unguarded() == (None if protocol in guarded else address)


def test_the_default_of_a_peer_is_no_loopback(tmp_path: Path) -> None:
    peer = domain(tmp_path, '{mode: "peer", connect: {endpoints: ["tcp/a:1"]}}')
    assert peer.unguarded() == "tcp/[::]:0"


def test_the_settings_on_the_page_are_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ca.pem").touch()
    [text] = re.findall("```json5\n(.*?)```", PAGE.read_text(), re.DOTALL)
    found = domain(tmp_path, text)
    assert (found.mode, found.where) == ("client", "tls/ground.example:7447")
    assert setting(found, "transport/auth/usrpwd/user") == "farside"
