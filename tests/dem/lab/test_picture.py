"""The map as a picture: what is drawn, where, and that it stands alone."""

import math
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from farside.dem import DynamicExpectancyModel, Parameters
from farside.dem.lab import map_picture
from farside.dem.lab.graph import Graph, graph_of
from farside.dem.lab.layouts import Layout, positions

MOVES = {"N": (0, 1), "E": (1, 0), "S": (0, -1), "W": (-1, 0)}
SVG = "{http://www.w3.org/2000/svg}"


def walked(size: int = 4, cycles: int = 400, named: str = "at:{},{}") -> DynamicExpectancyModel:
    """A square of places, walked at random, and back at its start; the goal is the far corner."""
    model = DynamicExpectancyModel(dict.fromkeys(MOVES, 1.0), rng=np.random.default_rng(0))
    rng, x, y = np.random.default_rng(1), 0, 0
    for action in rng.choice(list(MOVES), cycles):
        model.sense([named.format(x, y)])
        model.perform(str(action))
        east, north = MOVES[str(action)]
        x, y = min(max(x + east, 0), size - 1), min(max(y + north, 0), size - 1)
    model.sense([named.format(x, y)])
    model.perform(None)
    model.sense([named.format(0, 0)])
    model.set_goal([named.format(size - 1, size - 1)], priority=1.0)
    return model


def drawn(model: DynamicExpectancyModel, **options: object) -> ET.Element:
    return ET.fromstring(map_picture(model, **options).svg)  # type: ignore[arg-type]  # noqa: S314


def titles(picture: ET.Element, shape: str) -> list[str]:
    """What is told of the circles, or of the paths, when one points at them."""
    groups = [group for group in picture.iter(f"{SVG}g") if group.find(f"{SVG}{shape}") is not None]
    return [group.findtext(f"{SVG}title") for group in groups]


def test_every_sign_is_a_circle_that_tells_its_numbers_and_its_best_action_an_arc() -> None:
    model = walked()
    picture = drawn(model)
    rows = model.policy_map()
    assert len(rows) == 16
    told = titles(picture, "circle")
    for row in rows:
        (words,) = (one for one in told if one.startswith(f"{row.sign[0]}\n"))
        assert row.action is None or f"best action {row.action}" in words
        assert row.action is None or f"policy value {row.value:.2f}" in words
    assert len(titles(picture, "path")) == 15


@pytest.mark.parametrize("credited", [True, False])
def test_the_arcs_lead_to_the_goal_in_as_many_steps_as_the_map_says(*, credited: bool) -> None:
    model = DynamicExpectancyModel(
        {"a": 1.0, "b": 2.0}, Parameters(own_credit=credited), rng=np.random.default_rng(0)
    )
    rng, at = np.random.default_rng(5), 0
    for action in rng.choice(["a", "b"], 600):
        model.sense([f"s{at}", "bright"])
        model.perform(str(action))
        at = int(rng.integers(12)) if rng.random() < 0.2 else (at + 1 + (action == "b")) % 12
    model.sense([f"s{at}", "bright"])
    model.perform(None)
    model.sense(["s1", "bright"])
    model.set_goal(["s7"], priority=1.0)
    graph = graph_of(model, 500)
    onward = {arc.source: arc for arc in graph.arcs}
    assert len(onward) > 8
    for node in graph.nodes:
        sign, steps = node.sign, 0
        while sign in onward:
            steps += onward[sign].action is not None
            sign = onward[sign].target
        assert math.isinf(node.value) or (sign, steps) == (graph.goal, node.depth)
    assert [arc.source for arc in graph.arcs if arc.is_ahead]
    why = model.why()
    assert onward[why.context].target == why.outcome


def test_places_stand_where_they_are_and_north_is_up() -> None:
    graph = graph_of(walked(), 500)
    assert positions(graph, Layout.AUTO, {}) == {
        (f"at:{x},{y}",): (x, y) for x in range(4) for y in range(4)
    }
    circles = {
        group.findtext(f"{SVG}title").split("\n")[0]: group.find(f"{SVG}circle")
        for group in drawn(walked()).iter(f"{SVG}g")
        if group.find(f"{SVG}circle") is not None
    }
    south, north, east = (circles[place] for place in ("at:1,0", "at:1,3", "at:3,0"))
    assert float(north.get("cy")) < float(south.get("cy")) == float(east.get("cy"))
    assert float(south.get("cx")) < float(east.get("cx"))


def test_a_token_can_be_given_a_place_and_a_sign_without_one_stands_below() -> None:
    model = walked(named="at:{}{}")
    model.perform("N")
    model.sense(["lost"])
    model.perform("N")
    model.sense(["at:00"])
    graph = graph_of(model, 500)
    places = {f"at:{x}{y}": (float(x), float(y)) for x in range(4) for y in range(4)}
    found = positions(graph, Layout.PLACES, places)
    assert found["at:21",] == (2.0, 1.0)
    assert found["lost",][1] < 0.0


def test_signs_at_one_place_stand_apart() -> None:
    graph = Graph(("at:1,1",), None, graph_of(walked(), 500).nodes[:1], (), (), 0)
    node = graph.nodes[0]
    both = [node._replace(sign=sign) for sign in [("at:1,1",), ("at:1,1", "low"), ("at:1,1", "x")]]
    found = positions(graph._replace(nodes=tuple(both)), Layout.PLACES, {})
    assert found["at:1,1",] == (1.0, 1.0)
    assert len(set(found.values())) == 3
    assert all(math.dist(point, (1.0, 1.0)) < 0.5 for point in found.values())


def test_by_value_the_goal_is_at_the_right_and_no_two_signs_coincide() -> None:
    graph = graph_of(walked(named="cell {} {}"), 500)
    found = positions(graph, Layout.VALUES, {})
    values = {node.sign: node.value for node in graph.nodes}
    across = sorted(values, key=lambda sign: found[sign][0])
    assert across[-1] == graph.goal
    assert [values[sign] for sign in across] == sorted(values.values(), reverse=True)
    assert len(set(found.values())) == 16


def test_springs_unfold_what_was_walked() -> None:
    """Neighbours are nearer than all others, and the corners farthest from the middle."""
    graph = graph_of(walked(size=5, cycles=1500, named="{} {}"), 500)
    found = positions(graph, Layout.AUTO, {})
    places = {sign: tuple(map(int, sign[0].split())) for sign in found}
    for one, here in places.items():
        for two, there in places.items():
            steps = abs(here[0] - there[0]) + abs(here[1] - there[1])
            apart = math.dist(found[one], found[two])
            assert steps == 0 or 0.6 * steps**0.9 < apart < 1.3 * steps


def test_signs_without_a_way_are_drawn_without_a_value() -> None:
    model = walked(size=2, cycles=60)
    model.perform(None)
    model.sense(["at:9,0"])
    picture = drawn(model)
    (off,) = (words for words in titles(picture, "circle") if words.startswith("at:9,0"))
    assert off.endswith("no way to the goal is known")
    assert "4 Signs with a way; 1 without one" in "".join(picture.itertext())


def test_what_is_too_much_is_left_out_and_said_so() -> None:
    picture = drawn(walked(), most=5)
    assert len(titles(picture, "circle")) == 5
    assert "11 more are left out" in "".join(picture.itertext())


def test_a_whole_leads_by_its_part_where_that_is_its_way() -> None:
    model = walked(size=3, cycles=300)
    model.withdraw_goal(["at:2,2"])
    model.set_goal(["at:2,2", "bright"], priority=1.0)
    model.withdraw_goal(["at:2,2", "bright"])
    model = DynamicExpectancyModel(
        {"E": 1.0}, Parameters(removal=False), rng=np.random.default_rng(0)
    )
    for tokens in (["a"], ["b"], ["a", "x"], ["b"]):
        model.sense(tokens)
        model.perform("E")
    model.set_goal(["a", "x"], priority=1.0)
    model.withdraw_goal(["a", "x"])
    model.set_goal(["b"], priority=1.0)
    (whole,) = (arc for arc in graph_of(model, 9).arcs if arc.source == ("a", "x"))
    assert (whole.target, whole.action) == (("a",), None)
    assert any("is on the way of its part a" in words for words in titles(drawn(model), "path"))


def test_names_from_anywhere_are_told_and_not_obeyed() -> None:
    evil = '</title><script>alert("&")</script>'
    model = walked(size=2, cycles=60, named=evil + "{} {}")
    for layout in Layout:
        picture = drawn(model, layout=layout)
        assert picture.find(f".//{SVG}script") is None
        assert evil in "".join(picture.itertext())


def test_a_picture_needs_nothing_from_elsewhere_and_shows_in_a_notebook() -> None:
    picture = map_picture(walked())
    assert picture.svg.count("http") == picture.svg.count('xmlns="http://www.w3.org/2000/svg"') == 1
    assert picture._repr_svg_() == picture.svg
    assert "prefers-color-scheme: dark" in picture.svg
    assert picture == map_picture(walked())


def test_what_cannot_be_drawn_is_refused() -> None:
    model = walked()
    with pytest.raises(ValueError, match=r"layout: expected one of auto, .+, found 'round'"):
        map_picture(model, layout="round")
    with pytest.raises(ValueError, match="most: expected 1 or more, found 0"):
        map_picture(model, most=0)
    model.withdraw_goal(["at:3,3"])
    with pytest.raises(ValueError, match="found no goal: set a goal"):
        map_picture(model)
    model.set_goal(["at:9,9"], priority=1.0)
    with pytest.raises(ValueError, match=r"whose Sign is known, found \('at:9,9',\)"):
        map_picture(model)
