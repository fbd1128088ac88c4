"""Where a Zenoh domain is, and how to be part of it: an address, Zenoh's settings, or both.

The settings are a file of Zenoh's own, in JSON5: TLS, user and password, access control, and
whatever else Zenoh knows. Where the file leaves them out, ours apply: no multicast scouting, and a
mode that follows from the endpoints, router where there is one to listen on and client otherwise.
"""

import json
import re
from collections.abc import Iterator, Mapping
from ipaddress import ip_address
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import NamedTuple

import zenoh

from farside.files import read_text
from farside.validation import one_line

LISTEN = "listen/"
"""The prefix of an address on which to be a router that others connect to."""

_MOST_SHOWN = 400
"""The most characters of a message of Zenoh's: its longest lists the keys that it knows."""

_MISTAKE = re.compile(
    r'msg: "(?P<text>.*)", location: Some\(Location '
    r"\{ line: (?P<line>\d+), column: (?P<column>\d+)"
)
_NO_JSON5 = re.compile(r"--> (?P<line>\d+):(?P<column>\d+).*= (?P<text>[^\n]*)", re.DOTALL)
_PLACE = re.compile(r" at (/|[A-Z]:)\S+\.rs:\d+\.?")
_OBJECT = re.compile(r"(\s|//[^\n]*|/\*.*?\*/)*\{", re.DOTALL)

_FILES = (
    "transport/auth/usrpwd/dictionary_file",
    "transport/auth/pubkey/known_keys_file",
    "transport/auth/pubkey/public_key_file",
    "transport/auth/pubkey/private_key_file",
    "transport/link/tls/root_ca_certificate",
    "transport/link/tls/listen_certificate",
    "transport/link/tls/listen_private_key",
    "transport/link/tls/connect_certificate",
    "transport/link/tls/connect_private_key",
)
"""Settings that name a file, relative to where the command runs."""

_NETWORKS = frozenset({"tcp", "udp", "tls", "quic", "ws"})
_CERTIFIED = frozenset({"tls", "quic"})


class Domain(NamedTuple):
    """A domain of Zenoh programs.

    Attributes:
        name: what is there, in the words of a message, such as `rover side`.
        mode: `client`, `peer` or `router`.
        connect: the addresses to connect to, of which one is enough.
        listen: the addresses to listen on.
        is_told: whether the addresses are told here; otherwise `text` has them.
        text: Zenoh's settings, in JSON5.
    """

    name: str
    mode: str
    connect: tuple[str, ...]
    listen: tuple[str, ...]
    is_told: bool
    text: str = "{}"

    @property
    def where(self) -> str:
        """Its addresses, as on the command line."""
        return ", ".join((*self.connect, *(LISTEN + one for one in self.listen)))

    def config(self, others: Mapping[str, object] | None = None) -> zenoh.Config:
        """The settings of a session with it.

        Args:
            others: replace some of them, by key.
        """
        config = zenoh.Config.from_json5(self.text)
        # Waiting is up to `farside.link.emulator.sides`: Zenoh's cannot be interrupted.
        ours: dict[str, object] = {
            "mode": self.mode,
            "connect/timeout_ms": 0 if self.mode == "client" else -1,
            "connect/exit_on_failure": self.mode == "client",
            "listen/timeout_ms": 0,
            "listen/exit_on_failure": True,
        }
        if _value(config, "scouting/multicast/enabled") is None:
            ours["scouting/multicast/enabled"] = False
        if self.is_told:
            ours |= {"connect/endpoints": self.connect, "listen/endpoints": self.listen}
        for key, value in (ours | dict(others or {})).items():
            config.insert_json5(key, json.dumps(value))
        return config

    def unguarded(self) -> str | None:
        """The first address beyond loopback on which anybody may connect; `None` without one.

        Credentials are a certificate, a user and password, or a key that the file asks for; access
        control may grant less to those without.
        """
        config = self.config()
        if _value(config, "access_control/enabled") or any(
            _value(config, key) for key in _FILES[:2]
        ):
            return None
        certified = _CERTIFIED if _value(config, "transport/link/tls/enable_mtls") else frozenset()
        for locator in self.listen:
            protocol = locator.partition("/")[0]
            if protocol in _NETWORKS - certified and not _is_loopback(locator):
                return locator
        return None


def domain_at(locator: str, name: str) -> Domain:
    """The domain at one address, such as `tcp/192.0.2.1:7447`, without settings.

    Args:
        locator: of a router or peer; with the prefix `LISTEN`, the address on which to be the
            router.
        name: what is there, in the words of a message, such as `rover side`.
    """
    listen_at = locator.removeprefix(LISTEN)
    if listen_at != locator:
        return Domain(name, "router", (), (listen_at,), is_told=True)
    return Domain(name, "client", (locator,), (), is_told=True)


def domain_of(path: Path, locator: str | None, name: str) -> Domain:
    """The domain that a file of Zenoh's settings describes.

    Args:
        path: the file.
        locator: its address, as for `domain_at`, if the file names none.
        name: what is there, in the words of a message, such as `rover side`.

    Raises:
        ValueError: if it cannot be read or is invalid, names a file that is not there, or if there
            is no address, or two. The message says what was expected and what was found.
    """
    try:
        text = read_text(path)
        found = _parse(text)
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise ValueError(f"{path}: {reason}") from error
    for key in _FILES:
        if (named := _value(found, key)) is not None and not Path(str(named)).is_file():
            raise ValueError(
                f"{path}: {key}: expected a file, found none at {one_line(str(named))}"
            )
    mode = _value(found, "mode")
    listens = _value(found, "listen/endpoints") != _value(zenoh.Config(), "listen/endpoints")
    chosen = str(mode or ("router" if listens else "client"))
    connect = tuple(_locators(_value(found, "connect/endpoints"), chosen))
    listen = tuple(_locators(_value(found, "listen/endpoints"), chosen))
    if locator is None:
        if not connect and not (listens and listen):
            raise ValueError(
                f"{path}: expected connect/endpoints or listen/endpoints, or an address on the "
                "command line, found none of them"
            )
        return Domain(name, chosen, connect, listen, is_told=False, text=text)
    there = domain_at(locator, name)._replace(text=text)
    if connect or listens:
        addresses = ", ".join((*connect, *(LISTEN + one for one in listen if listens)))
        raise ValueError(
            f"{path}: expected the address there or on the command line, found both: "
            f"{one_line(addresses)} and {locator}"
        )
    if mode not in {None, there.mode}:
        raise ValueError(
            f'{path}: mode: expected "{there.mode}", which {locator} on the command line stands '
            f'for, or the address in the file instead, found "{mode}"'
        )
    return there


def in_words(error: zenoh.ZError) -> str:
    """What Zenoh says, in one line of bounded length, without the places in its source."""
    return one_line(_PLACE.sub("", str(error)).strip().rstrip("."), _MOST_SHOWN)


def _parse(text: str) -> zenoh.Config:
    if not _OBJECT.match(text):
        raise ValueError("line 1: expected Zenoh's settings as a JSON5 object, found none")
    # Of a text that is no file, Zenoh does not say where it is wrong.
    with NamedTemporaryFile(suffix=".json5") as copy:
        copy.write(text.encode())
        copy.flush()
        try:
            return zenoh.Config.from_file(copy.name)
        except zenoh.ZError as error:
            said = str(error)
            mistake, no_json5 = _MISTAKE.search(said), _NO_JSON5.search(said)
            if (match := mistake or no_json5) is None:
                raise ValueError(in_words(error)) from error
            reason = one_line(_PLACE.sub("", match["text"]).replace('\\"', '"'), _MOST_SHOWN)
            where = f"line {match['line']}, column {match['column']}"
            what = reason if mistake else f"no valid JSON5: {reason}"
            raise ValueError(f"{where}: {what}") from error


def _value(config: zenoh.Config, key: str) -> object:
    """A setting as plain JSON; `None` where it has no value."""
    try:
        return json.loads(config.get_json(key))
    except zenoh.ZError:
        return None


def _locators(value: object, mode: str) -> Iterator[str]:
    """The addresses in one of Zenoh's forms of a list of endpoints, as they count in a mode."""
    match value:
        case str():
            yield value
        case list():
            for entry in value:
                yield from _locators(entry, mode)
        case {"locators": locators}:
            yield from _locators(locators, mode)
        case dict():
            yield from _locators(value.get(mode), mode)


def _is_loopback(locator: str) -> bool:
    address = re.split("[?#]", locator.partition("/")[2])[0]
    host = address.rpartition(":")[0].strip("[]")
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
