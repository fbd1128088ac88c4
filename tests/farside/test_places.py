"""The chart of a yard."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.places import Cell, Chart

ROWS = ("######", "#A.#B#", "#.o..#", "######")


def test_places_have_names_from_the_drawing() -> None:
    chart = Chart(ROWS, 2.0)
    assert chart.tokens[Cell(1, 2)] == "at:A"
    assert chart.tokens[Cell(1, 1)] == "at:1,1"
    assert chart.centre_m(Cell(1, 2)) == (3.0, 5.0)
    assert chart.rocks == [Cell(2, 1)]
    assert sorted(chart.cells) == ["at:1,1", "at:2,2", "at:3,1", "at:4,1", "at:A", "at:B"]


def test_a_way_goes_round_walls_and_rocks() -> None:
    chart = Chart(("#####", "#A#B#", "#...#", "#####"), 1.0)
    assert chart.way(chart.cells["at:A"], chart.cells["at:B"]) == ["S", "E", "E", "N"]
    assert chart.way(chart.cells["at:A"], chart.cells["at:A"]) == []


def test_a_place_behind_rock_cannot_be_reached() -> None:
    chart = Chart(ROWS, 1.0)
    with pytest.raises(ValueError, match="no way from at:A to at:B"):
        chart.way(chart.cells["at:A"], chart.cells["at:B"])


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ((), "an empty map"),
        (("###", "##"), "map row 2 has 2 cells, the first row 3"),
        (("###", "..#", "###"), "not walled in"),
        (("###", "#x#", "###"), "map row 2 has 'x'"),
        (("####", "#AA#", "####"), "map row 2 names a second place 'A'"),
    ],
)
def test_a_bad_drawing_is_refused(rows: tuple[str, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Chart(rows, 1.0)


@given(st.floats(-5, 15), st.floats(-5, 15))
def test_every_point_has_a_nearest_place(x_m: float, y_m: float) -> None:
    chart = Chart(ROWS, 1.0)
    cell = chart.cell_at(x_m, y_m)
    if (found := Cell(int(x_m // 1), int(y_m // 1))) in chart.tokens:
        assert cell == found
    assert cell in chart.tokens
