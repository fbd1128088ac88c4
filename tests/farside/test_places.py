"""The chart of a yard."""

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.places import MAX_CELLS, Cell, Chart, cell_named

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
        (("###", "#x#", "###"), 'map row 2 has "x"'),
        (("###", "#\x1b#", "###"), r'map row 2 has "\\u001b"'),
        (("####", "#AA#", "####"), "map row 2 names a second place 'A'"),
    ],
)
def test_a_bad_drawing_is_refused(rows: tuple[str, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Chart(rows, 1.0)


def test_a_map_of_more_cells_than_the_limit_is_refused() -> None:
    rows = ("#" * 1000,) * (MAX_CELLS // 1000 + 1)
    with pytest.raises(ValueError, match="expected a map of at most 250000 cells, found 251000"):
        Chart(rows, 1.0)


@given(
    inside=st.lists(st.text("#.o~", min_size=6, max_size=6), min_size=1, max_size=7).filter(
        lambda rows: any(set(row) & set(".~") for row in rows)
    ),
    x_m=st.floats(-9, 20),
    y_m=st.floats(-9, 20),
)
def test_no_place_is_nearer_than_the_nearest(inside: Sequence[str], x_m: float, y_m: float) -> None:
    chart = Chart(("#" * 8, *(f"#{row}#" for row in inside), "#" * 8), 1.5)
    point = Cell(int(x_m // 1.5), int(y_m // 1.5))

    def distance(cell: Cell) -> float:
        x, y = chart.centre_m(cell)
        return (x - x_m) ** 2 + (y - y_m) ** 2

    nearest = point if point in chart.tokens else min(chart.tokens, key=distance)
    assert chart.cell_at(x_m, y_m) == nearest


@given(
    inside=st.lists(st.text("#.", min_size=6, max_size=6), min_size=1, max_size=7),
)
def test_a_place_is_reachable_where_there_is_a_way(inside: Sequence[str]) -> None:
    chart = Chart(("#" * 8, *(f"#{row}#" for row in ("A.....", *inside)), "#" * 8), 1.0)
    start = chart.places["A"]
    reachable = chart.reachable(start)
    for cell in chart.tokens:
        if cell in reachable:
            assert isinstance(chart.way(start, cell), list)
        else:
            with pytest.raises(ValueError, match="no way"):
                chart.way(start, cell)


@given(st.floats(-5, 15), st.floats(-5, 15))
def test_every_point_has_a_nearest_place(x_m: float, y_m: float) -> None:
    chart = Chart(ROWS, 1.0)
    cell = chart.cell_at(x_m, y_m)
    if (found := Cell(int(x_m // 1), int(y_m // 1))) in chart.tokens:
        assert cell == found
    assert cell in chart.tokens


@pytest.mark.parametrize(
    ("place", "cell"),
    [
        ("3,4", Cell(3, 4)),
        ("83331,1", Cell(83331, 1)),  # the longest map of `MAX_CELLS`
        ("A", None),
        ("3,4,5", None),
        ("-1,2", None),
        ("9" * 5000 + ",1", None),
    ],
)
def test_a_place_without_a_letter_is_named_by_its_cell(place: str, cell: Cell | None) -> None:
    assert cell_named(place) == cell
