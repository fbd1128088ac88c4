"""ROS 2 across the link: peers on the wire of rmw_zenoh, on one computer and on two."""

import json
import re
import shlex
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import zenoh_ros2_sdk
from linking import LinkProcess, unused_port
from ros2 import (
    ADD,
    GET_PARAMETERS,
    STRING,
    Computer,
    nothing_fetched,
    until,
    write_definitions,
)
from zenoh_ros2_sdk import ROS2Publisher
from zenoh_ros2_sdk.attachment import Attachment

from farside.node import to_ns

pytestmark = pytest.mark.processes

PAGE = Path(__file__).parents[2] / "docs" / "ros2.md"
LIGHT_NS = to_ns(1.282)
"""To the Moon, as the preset has it."""


@pytest.fixture(scope="module")
def definitions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The definitions of all messages here."""
    folder = tmp_path_factory.mktemp("definitions")
    write_definitions(folder)
    return folder


@pytest.fixture(autouse=True)
def guard(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Nothing is fetched."""
    monkeypatch.setenv("ZENOH_ROS2_SDK_CACHE", str(tmp_path / "cache"))
    with nothing_fetched():
        yield


def test_what_is_not_given_would_be_fetched_and_is_refused(definitions: Path) -> None:
    with Computer(definitions) as one, nothing_fetched() as attempts:
        with pytest.raises(ValueError, match="not found in registry"):
            one.make(ROS2Publisher, "/cmd_vel", "geometry_msgs/msg/Twist", node_name="driver")
        assert set(attempts) == {"a start of git"}
        attempts.clear()


def add(request: Any) -> dict[str, int]:
    return {"sum": request.a + request.b}


def parameters(computer: Computer, values: dict[str, str]) -> Callable[[Any], dict[str, object]]:
    """Answers of a node that is asked for its parameters."""
    return lambda request: {"values": [computer.text(values[name]) for name in request.names]}


def test_the_peers_work_with_each_other_on_one_router(definitions: Path) -> None:
    with Computer(definitions) as one, Computer(definitions, one.locator) as two:
        one.publisher("/map", "mapper", latched=True).publish(data="before")
        heard = two.subscription("/chatter", "listener")
        talker = one.publisher("/chatter", "talker")
        one.service("/add", ADD, "adder", add)
        one.service("/adder/get_parameters", GET_PARAMETERS, "adder", parameters(one, {"a": "b"}))
        until(lambda: two.nodes() == {"mapper", "listener", "talker", "adder"})
        until(lambda: two.topics() == {"/map": [STRING], "/chatter": [STRING]})
        until(lambda: two.services() == {"/add": [ADD], "/adder/get_parameters": [GET_PARAMETERS]})
        until(lambda: one.nodes() == two.nodes())
        talker.publish(data="hello")
        assert heard.next().text == "hello"
        assert two.subscription("/map", "viewer", latched=True).next().text == "before"
        assert two.late_subscription("/map", "late").next().text == "before"
        assert two.client("/add", ADD, "caller").call(a=2, b=3).sum == 5
        asked = two.client("/adder/get_parameters", GET_PARAMETERS, "asker").call(names=["a"])
        assert [value.string_value for value in asked.values] == ["b"]


@contextmanager
def across(rover: Computer, ground: Computer, line: str) -> Iterator[LinkProcess]:
    """The command of the page, or another, between the routers of two computers."""
    assert rover.locator != ground.locator
    for name, there in (("tcp/rover.local:7447", rover), ("tcp/localhost:7447", ground)):
        assert name in line
        line = line.replace(name, there.locator)
    farside, link, *options = shlex.split(line)
    assert (farside, link) == ("farside", "link")
    with LinkProcess(*options) as process:
        yield process.passes()


def of_page() -> tuple[list[str], str]:
    """The two config files and the command."""
    text = PAGE.read_text()
    files = re.findall(r"^```json5\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    [line] = re.findall(r"^```\n(farside link .*?)^```", text, re.MULTILINE | re.DOTALL)
    return files, line.replace("\\\n", " ")


def test_the_recipe_of_the_page_takes_a_ros_system_across_to_the_moon(definitions: Path) -> None:
    """Topic, latched topic, service and graph; nothing comes before its light time."""
    (of_rover, of_ground), line = of_page()
    assert "--preset moon" in line
    with (
        Computer(definitions, settings=of_rover) as rover,
        Computer(definitions, settings=of_ground) as ground,
        across(rover, ground, line),
    ):
        began_ns = time.monotonic_ns()
        rover.publisher("/map", "mapper", latched=True).publish(data="before")
        rover.service("/add", ADD, "adder", add)
        talker = rover.publisher("/chatter", "talker")
        heard = ground.subscription("/chatter", "listener")
        until(lambda: {"mapper", "adder", "talker"} <= ground.nodes())
        assert time.monotonic_ns() - began_ns >= LIGHT_NS
        assert ground.topics()["/map"] == [STRING]
        # All at once, to wait for one round trip.
        asked_ns = time.monotonic_ns()
        viewed = ground.subscription("/map", "viewer", latched=True)
        talker.publish(data="hello")
        assert ground.client("/add", ADD, "caller").call(a=2, b=3).sum == 5
        assert time.monotonic_ns() - asked_ns >= 2 * LIGHT_NS
        hello, before = heard.next(), viewed.next()
        assert (hello.text, before.text) == ("hello", "before")
        assert hello.at_ns - asked_ns >= LIGHT_NS
        # Asked for, it takes a round trip; but it may still be on its way as it was published.
        assert before.at_ns - began_ns >= LIGHT_NS
        until(lambda: {"listener", "viewer", "caller"} <= rover.nodes())


NEAR = (
    "farside link --rover-side tcp/rover.local:7447 --ground-side tcp/localhost:7447 "
    "--up '0/**' --up '@ros2_lv/0/**' --down '0/**' --down '@ros2_lv/0/**' "
    "--set up.delay_s=0.05 --set down.delay_s=0.05"
)


class Pair(NamedTuple):
    """Two computers with the link between them."""

    rover: Computer
    ground: Computer


@pytest.fixture(scope="module")
def near(definitions: Path) -> Iterator[Pair]:
    """As near as may be; a link starts slowly, so several stories are told on this one."""
    with (
        Computer(definitions) as rover,
        Computer(definitions) as ground,
        across(rover, ground, NEAR),
    ):
        yield Pair(rover, ground)


def test_the_wire_is_the_same_on_both_sides(near: Pair) -> None:
    """Key, payload, encoding, and who says it as which of how many."""
    rover, ground = near
    pilot = ground.publisher("/cmd", "pilot")
    at_ground, at_rover = (
        computer.session().declare_subscriber(pilot.keyexpr) for computer in (ground, rover)
    )
    until(lambda: "pilot" in rover.nodes())
    for word in ("go", "stop"):
        pilot.publish(data=word)
    for number in range(2):
        sent, received = at_ground.recv(), at_rover.recv()
        assert received.key_expr == sent.key_expr
        assert received.payload == sent.payload
        assert received.encoding == sent.encoding
        assert received.timestamp == sent.timestamp
        attachment = Attachment.from_bytes(received.attachment.to_bytes())
        assert attachment == Attachment.from_bytes(sent.attachment.to_bytes())
        assert (attachment.sequence_id, attachment.gid) == (number, pilot.publisher_gid)


def test_parameters_and_late_subscriptions_work_in_both_directions(near: Pair) -> None:
    rover, ground = near
    for here, there, name in ((rover, ground, "driver"), (ground, rover, "planner")):
        latched = here.publisher(f"/{name}_state", name, latched=True)
        latched.publish(data="1")
        asked = f"/{name}/get_parameters"
        here.service(asked, GET_PARAMETERS, name, parameters(here, {"name": name}))
        heard = there.late_subscription(f"/{name}_state", f"watches_{name}")
        assert heard.next().text == "1"
        latched.publish(data="2")
        while heard.next().text != "2":
            pass
        client = there.client(asked, GET_PARAMETERS, f"asks_{name}")
        [value] = client.call(names=["name"]).values
        assert value.string_value == name


def test_the_graph_follows_nodes_that_come_and_go_and_an_outage(near: Pair) -> None:
    rover, ground = near

    def change(**how: object) -> None:
        payload = json.dumps(how)
        while not (replies := list(ground.session().get("farside/link/control", payload=payload))):
            pass
        assert replies[0].ok is not None

    first = rover.publisher("/first", "first")
    rover.publisher("/second", "second")
    until(lambda: {"first", "second"} <= ground.nodes())
    change(both={"out": True})
    first.close()
    rover.publisher("/third", "third")
    until(lambda: "first" not in rover.nodes() and "third" in rover.nodes())
    # What the control says next it says after the relay has taken the tokens of before.
    change(both={"out": True})
    assert {"first", "second"} <= ground.nodes()
    assert "third" not in ground.nodes()
    change(both={"out": False})
    until(lambda: "first" not in ground.nodes() and "third" in ground.nodes())
    assert "second" in ground.nodes()


def test_the_link_joins_as_a_node_does_or_is_the_router_of_its_side(
    definitions: Path, tmp_path: Path
) -> None:
    """With the settings that rmw_zenoh gives to a node, and with none; without the graph."""
    settings = Path(zenoh_ros2_sdk.__file__).parent / "config" / "default_session_config.json5"
    at = f"tcp/127.0.0.1:{unused_port()}"
    with Computer(definitions) as rover:
        of_node = tmp_path / "node.json5"
        of_node.write_text(settings.read_text().replace("tcp/localhost:7447", rover.locator))
        sides = [f"--rover-config={of_node}", f"--ground-side=listen/{at}"]
        with LinkProcess(*sides, "--down=0/chatter/**") as between:
            between.passes()
            with Computer(definitions, at) as ground:
                heard = ground.subscription("/chatter", "listener")
                talker = rover.publisher("/chatter", "talker")
                until(lambda: bool(talker.pub.matching_status.matching))
                talker.publish(data="hello")
                assert heard.next().text == "hello"
                until(lambda: ground.nodes() == {"listener"})
