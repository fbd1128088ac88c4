"""ROS 2 across the link: peers on the wire of rmw_zenoh, on one computer and on two."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
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

pytestmark = pytest.mark.processes


@pytest.fixture(autouse=True)
def definitions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The definitions of all messages here; nothing is fetched."""
    folder = tmp_path / "definitions"
    write_definitions(folder)
    monkeypatch.setenv("ZENOH_ROS2_SDK_CACHE", str(tmp_path / "cache"))
    with nothing_fetched():
        yield folder


def test_what_is_not_given_would_be_fetched_and_is_refused(definitions: Path) -> None:
    with Computer(definitions) as one, nothing_fetched() as attempts:
        with pytest.raises(ValueError, match="not found in registry"):
            one.make(ROS2Publisher, "/cmd_vel", "geometry_msgs/msg/Twist", node_name="driver")
        assert set(attempts) == {"a start of git"}
        attempts.clear()


def add(request: Any) -> dict[str, int]:
    return {"sum": request.a + request.b}


def parameters(computer: Computer, values: dict[str, str]) -> Any:
    """Answers of a node that is asked for its parameters."""

    def answer(request: Any) -> dict[str, object]:
        return {"values": [computer.text(values[name]) for name in request.names]}

    return answer


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
