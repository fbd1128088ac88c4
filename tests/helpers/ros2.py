"""Computers of a ROS 2 system in this process, on the wire of rmw_zenoh and without ROS.

Each has the router that rmw_zenoh starts, with its settings, and nodes of `zenoh-ros2-sdk` that
share a session. What that library leaves out, rmw_zenoh does with Zenoh's advanced publishers and
subscribers: latched topics, which here are put in their place.
"""

import json
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from ipaddress import ip_address
from pathlib import Path
from queue import SimpleQueue
from typing import Any, NamedTuple, Self
from unittest.mock import patch

import numpy as np
import zenoh
import zenoh.ext
from zenoh_ros2_sdk import (
    MessageRegistry,
    ROS2Publisher,
    ROS2ServiceClient,
    ROS2ServiceServer,
    ROS2Subscriber,
    ZenohSession,
    get_service_names_and_types,
    get_topic_names_and_types,
    message_registry,
)
from zenoh_ros2_sdk.qos import QosDurability, QosProfile

PATIENCE_S = 30.0
_LOOK_S = 0.005

STRING = "std_msgs/msg/String"
ADD = "example_interfaces/srv/AddTwoInts"
GET_PARAMETERS = "rcl_interfaces/srv/GetParameters"
PARAMETER_VALUE = "rcl_interfaces/msg/ParameterValue"

_STRING_TYPE = 4
"""Of `rcl_interfaces/msg/ParameterType`."""

DEFINITIONS = {
    "std_msgs/msg/String.msg": "string data",
    "example_interfaces/srv/AddTwoInts.srv": "int64 a\nint64 b\n---\nint64 sum",
    "rcl_interfaces/srv/GetParameters.srv": (
        "string[] names\n---\nrcl_interfaces/msg/ParameterValue[] values"
    ),
    "rcl_interfaces/msg/ParameterValue.msg": (
        "uint8 type\nbool bool_value\nint64 integer_value\nfloat64 double_value\n"
        "string string_value\nbyte[] byte_array_value\nbool[] bool_array_value\n"
        "int64[] integer_array_value\nfloat64[] double_array_value\nstring[] string_array_value"
    ),
}
"""All that the nodes need to know of messages; the library would fetch what it is not given."""

_NO_VALUE = {
    "bool_value": False,
    "integer_value": 0,
    "double_value": 0.0,
    "byte_array_value": np.empty(0, np.uint8),
    "bool_array_value": np.empty(0, np.bool_),
    "integer_array_value": np.empty(0, np.int64),
    "double_array_value": np.empty(0, np.float64),
    "string_array_value": [],
}

_SETTINGS = """{
  mode: "router",
  scouting: { multicast: { enabled: false } },
  timestamping: { enabled: true },
  routing: { router: { peers_failover_brokering: false } },
}"""
"""Of the router, as rmw_zenoh has them."""

LATCHED = QosProfile(durability=QosDurability.TRANSIENT_LOCAL, history_depth=10)


class Heard(NamedTuple):
    """A message and when it came, on the clock `time.monotonic_ns`."""

    text: str
    at_ns: int


_attempts: list[list[str]] = []
"""To reach somebody beyond this machine, for each `nothing_fetched` in force."""


class FetchError(Exception):
    """Something would be fetched."""


def _audit(event: str, arguments: tuple[Any, ...]) -> None:
    if not _attempts:
        return
    attempt = None
    if event in {"socket.connect", "socket.sendto"}:
        address = arguments[1]
        if isinstance(address, tuple) and not ip_address(address[0]).is_loopback:
            attempt = f"a connection to {address[0]}"
    elif event == "socket.getaddrinfo" and arguments[0] not in {"127.0.0.1", "::1", "localhost"}:
        attempt = f"the address of {arguments[0]}"
    elif event == "subprocess.Popen" and "git" in Path(str(arguments[0])).name:
        attempt = "a start of git"
    if attempt is not None:
        _attempts[-1].append(attempt)
        raise FetchError(attempt)


sys.addaudithook(_audit)


@contextmanager
def nothing_fetched() -> Iterator[list[str]]:
    """Let Python reach nobody beyond this machine meanwhile, and start no git.

    Gives the attempts, which the library does not let anybody see; at the end there must be none.
    """
    attempts: list[str] = []
    _attempts.append(attempts)
    try:
        yield attempts
    finally:
        _attempts.remove(attempts)
    assert attempts == []


def write_definitions(folder: Path) -> None:
    """Write `DEFINITIONS` as the library reads them."""
    for name, text in DEFINITIONS.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def until(is_so: Callable[[], bool]) -> None:
    """Wait for what others tell this process in their own time."""
    end_s = time.monotonic() + PATIENCE_S
    while not is_so():
        if time.monotonic() > end_s:
            raise TimeoutError("expected it by now")
        time.sleep(_LOOK_S)


class Subscription:
    """What a node has heard on a topic, in order."""

    def __init__(self) -> None:
        self._heard: SimpleQueue[Heard] = SimpleQueue()

    def take(self, message: Any) -> None:
        self._heard.put(Heard(message.data, time.monotonic_ns()))

    def next(self) -> Heard:
        return self._heard.get(timeout=PATIENCE_S)

    def is_empty(self) -> bool:
        return self._heard.empty()


class Computer:
    """One computer: a router, and nodes with one session.

    Args:
        definitions: the folder that `write_definitions` wrote.
        locator: the router of another computer, to do without one of its own.
        settings: of its own router, in JSON5, but for the address.
    """

    def __init__(
        self, definitions: Path, locator: str | None = None, settings: str = _SETTINGS
    ) -> None:
        with ExitStack() as stack:
            if locator is None:
                router = stack.enter_context(zenoh.open(_at_free_port(settings)))
                [about] = [reply.ok for reply in router.get(f"@/{router.info.zid()}/router")]
                assert about is not None
                locator = json.loads(about.payload.to_bytes())["locators"][0]
            self.locator: str = locator
            self._session = ZenohSession(router_port=int(locator.rpartition(":")[2]))
            stack.callback(self._session.session.close)
            self._registry = MessageRegistry(str(definitions))
            self._stack = stack.pop_all()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    @contextmanager
    def _turn(self) -> Iterator[None]:
        """The library knows one computer in a process: this one for now."""
        with (
            patch.object(ZenohSession, "_instance", self._session),
            patch.object(message_registry, "_registry", self._registry),
        ):
            yield

    def session(self) -> zenoh.Session:
        """The session of all nodes."""
        session: zenoh.Session = self._session.session
        return session

    def make(self, kind: Callable[..., Any], *arguments: object, **options: object) -> Any:
        """Something of the library's, closed before the session is."""
        with self._turn():
            one = kind(*arguments, **options)
        self._stack.callback(one.close)
        return one

    def publisher(self, topic: str, node: str, *, latched: bool = False) -> Any:
        """A publisher of strings."""
        one = self.make(
            ROS2Publisher, topic, STRING, node_name=node, qos=LATCHED if latched else None
        )
        if latched:
            one.pub.undeclare()
            one.pub = zenoh.ext.declare_advanced_publisher(
                self.session(),
                one.keyexpr,
                congestion_control=zenoh.CongestionControl.BLOCK,
                cache=zenoh.ext.CacheConfig(LATCHED.history_depth),
                sample_miss_detection=zenoh.ext.MissDetectionConfig(
                    heartbeat=None, sporadic_heartbeat=0.5
                ),
                publisher_detection=True,
            )
        return one

    def subscription(self, topic: str, node: str, *, latched: bool = False) -> Subscription:
        """A subscription to strings; latched as rmw_zenoh does it."""
        found = Subscription()
        with patch.object(ROS2Subscriber, "_query_historical_data"):
            one = self.make(
                ROS2Subscriber,
                topic,
                STRING,
                found.take,
                node_name=node,
                qos=LATCHED if latched else None,
            )
        if latched:
            one.sub.undeclare()
            one.sub = zenoh.ext.declare_advanced_subscriber(
                self.session(),
                one.keyexpr,
                one._listener,
                history=zenoh.ext.HistoryConfig(
                    detect_late_publishers=True, max_samples=LATCHED.history_depth
                ),
                recovery=zenoh.ext.RecoveryConfig(heartbeat=True, periodic_queries=None),
                subscriber_detection=True,
            )
        return found

    def late_subscription(self, topic: str, node: str) -> Subscription:
        """A latched subscription as the library does it: by asking for what was said before."""
        found = Subscription()
        with patch.object(ROS2Subscriber, "_query_historical_data"):
            one = self.make(ROS2Subscriber, topic, STRING, found.take, node_name=node, qos=LATCHED)

        def has_asked() -> bool:
            one._query_historical_data()
            return not found.is_empty()

        # It would ask once, but at first a session of Zenoh's knows nobody.
        until(has_asked)
        return found

    def service(self, name: str, kind: str, node: str, answer: Callable[[Any], Any]) -> Any:
        """A service; `answer` makes the fields of the response out of a request."""

        def respond(request: Any) -> Any:
            return one.response_msg_class(**answer(request))

        one = self.make(ROS2ServiceServer, name, kind, respond, **self._defined(kind, node))
        return one

    def client(self, name: str, kind: str, node: str) -> Any:
        """A client of a service, once the service is known to it."""
        one = self.make(
            ROS2ServiceClient, name, kind, timeout=PATIENCE_S, **self._defined(kind, node)
        )
        until(lambda: bool(one.querier.matching_status.matching))
        return one

    def _defined(self, kind: str, node: str) -> dict[str, str]:
        with self._turn():
            self._registry.load_message_type(PARAMETER_VALUE)
        request, response = DEFINITIONS[f"{kind}.srv"].split("\n---\n")
        return {
            "node_name": node,
            "request_definition": request,
            "response_definition": response,
        }

    def text(self, value: str) -> Any:
        """A parameter's value."""
        kind = self._session.store.types[PARAMETER_VALUE]
        return kind(**_NO_VALUE | {"type": _STRING_TYPE, "string_value": value})

    def nodes(self) -> set[str]:
        """What `ros2 node list` prints."""
        replies = self._session.liveliness.get("@ros2_lv/0/*/*/*/NN/**", timeout=PATIENCE_S)
        return {str(reply.ok.key_expr).rpartition("/")[2] for reply in replies}

    def topics(self) -> dict[str, list[str]]:
        """What `ros2 topic list -t` prints."""
        with self._turn():
            return dict(get_topic_names_and_types(timeout=PATIENCE_S))

    def services(self) -> dict[str, list[str]]:
        """What `ros2 service list -t` prints."""
        with self._turn():
            return dict(get_service_names_and_types(timeout=PATIENCE_S))


def _at_free_port(settings: str) -> zenoh.Config:
    config = zenoh.Config.from_json5(settings)
    config.insert_json5("listen/endpoints", '["tcp/127.0.0.1:0"]')
    # To be asked for the port.
    config.insert_json5("adminspace/enabled", "true")
    return config
