"""The seed's worked example: the three maps of the yard, and their pictures."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from random_walks import times_sensed
from scipy.stats import binomtest  # type: ignore[import-untyped]

from farside.dem.lab.picture import mixed, ramp
from farside.missions.commands import main as cli
from farside.missions.figure1 import example
from farside.missions.figure1.example import (
    CYCLES,
    GOALS,
    SEED,
    TALLEST,
    VISITED_TWICE,
    YARD,
    Figure1,
    blocks,
    greatest_value,
    run_figure1,
)
from farside.missions.figure1.page import write_page
from farside.missions.figure1.png import write_png
from farside.places import Cell, Chart

COST = 2.66  # of each action, in the seed


@pytest.fixture(scope="module")
def figure() -> Figure1:
    return run_figure1(SEED)


def way(chart: Chart, start: Cell, goal: Cell) -> list[Cell]:
    """The cells of a shortest path, both ends included."""
    cells = [start]
    for action in chart.way(start, goal):
        cells.append(cells[-1].beside(action))
    return cells


def cheapest(figure: Figure1, goal: str) -> dict[str, float]:
    """Least sum of 2.66 / C_m from every place to `goal`, by relaxing all arcs repeatedly."""
    values = {f"at:{goal}": 0.0}
    changed = True
    while changed:
        changed = False
        for arc in figure.model.hypotheses:
            (context,), (outcome,) = arc.context, arc.outcome
            value = values.get(outcome, float("inf")) + COST / arc.cm
            if value < values.get(context, float("inf")):
                values[context] = value
                changed = True
    return values


def test_every_place_of_the_yard_was_visited_at_least_twice(figure: Figure1) -> None:
    seen = {token for (token,) in figure.model.signs}
    assert seen == set(figure.chart.cells)
    assert figure.twice == len(seen) == 52


def test_this_holds_with_as_many_seeds_as_the_figure_says() -> None:
    sensed = times_sensed(Chart(YARD, 1.0), CYCLES, 1000, np.random.default_rng(1))
    held = int((sensed.min(axis=1) > 1).sum())
    assert binomtest(held, len(sensed), VISITED_TWICE).pvalue > 0.01


@pytest.mark.parametrize("seed", range(4))
def test_a_model_that_missed_some_places_still_gives_maps_of_the_yard(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(example, "CYCLES", 400)
    figure = run_figure1(seed)
    assert {token for (token,) in figure.model.signs} <= set(figure.chart.cells)
    for panel in figure.panels:
        assert panel.values.keys() <= figure.chart.tokens.keys()


def test_each_goal_has_a_map_of_all_places(figure: Figure1) -> None:
    assert [panel.goal for panel in figure.panels] == list(GOALS)
    for panel in figure.panels:
        assert panel.values.keys() == figure.chart.tokens.keys()
        assert panel.values[figure.chart.cells[f"at:{panel.goal}"]].value == 0.0


def test_values_are_the_least_sums_of_action_cost_over_corroboration(figure: Figure1) -> None:
    for panel in figure.panels:
        expected = cheapest(figure, panel.goal)
        for cell, row in panel.values.items():
            assert row.value == pytest.approx(expected[figure.chart.tokens[cell]], rel=1e-12)


@pytest.mark.parametrize("start", ["D", "9,1", "1,4", "9,4", "1,5", "7,2", "A", "B", "C"])
def test_columns_fall_all_along_a_shortest_path_to_each_goal(figure: Figure1, start: str) -> None:
    for panel in figure.panels:
        goal = figure.chart.cells[f"at:{panel.goal}"]
        columns = [
            panel.values[cell].value
            for cell in way(figure.chart, figure.chart.cells[f"at:{start}"], goal)
        ]
        assert columns == sorted(set(columns), reverse=True)
        assert columns[-1] == 0.0


def test_following_the_best_actions_leads_down_to_the_goal(figure: Figure1) -> None:
    chart = figure.chart
    for panel in figure.panels:
        for start in chart.tokens:
            cell = start
            while (row := panel.values[cell]).action is not None:
                beside = cell.beside(row.action)
                assert panel.values[beside].value < row.value
                assert panel.values[beside].depth == row.depth - 1
                cell = beside
            assert chart.tokens[cell] == f"at:{panel.goal}"


def test_no_value_is_below_the_true_cost_and_their_sum_is_little_above(figure: Figure1) -> None:
    """Arcs that never fail cost little more than their action after six trials, as here."""
    for panel in figure.panels:
        goal = figure.chart.cells[f"at:{panel.goal}"]
        least = {cell: COST * len(figure.chart.way(cell, goal)) for cell in panel.values}
        assert all(row.value >= least[cell] for cell, row in panel.values.items())
        assert sum(row.value for row in panel.values.values()) <= 1.25 * sum(least.values())


def test_the_same_seed_gives_the_same_lists_and_values(figure: Figure1) -> None:
    again = run_figure1(SEED)
    assert again.model.hypotheses == figure.model.hypotheses
    assert [panel.values for panel in again.panels] == [panel.values for panel in figure.panels]


def test_a_picture_has_a_block_for_each_cell_as_high_as_its_value(figure: Figure1) -> None:
    for panel in figure.panels:
        drawn = {block.cell: block for block in blocks(figure, panel)}
        rows = figure.chart.rows
        assert len(drawn) == len(rows) * len(rows[0])
        for cell, row in panel.values.items():
            assert drawn[cell].height == pytest.approx(TALLEST * row.value / greatest_value(figure))
        walls = [block for block in drawn.values() if block.words == ("wall",)]
        assert len(walls) == sum(row.count("#") for row in rows)
        assert {drawn[rock].words for rock in figure.chart.rocks} == {("rock",)}
        goal = drawn[figure.chart.cells[f"at:{panel.goal}"]]
        assert goal.words == (f"at:{panel.goal}", "the goal")


def test_places_without_a_known_path_to_the_goal_are_flat_and_labelled(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(example, "CYCLES", 40)
    figure = run_figure1(SEED)
    assert figure.panels[1].values == {}, "so soon, the robot has not seen B"
    words = {block.words[-1] for block in blocks(figure, figure.panels[1])}
    assert words == {"no known path to the goal", "wall", "rock"}


def test_colours_run_from_light_at_the_goal_to_dark_far_away() -> None:
    def light(colour: str) -> int:
        return sum(bytes.fromhex(colour[1:]))

    shades = [light(ramp(step / 50)) for step in range(51)]
    assert shades == sorted(shades, reverse=True)
    assert mixed("#000000", "#ff8000", 0.5) == "#804000"


def test_the_page_is_self_contained(figure: Figure1, tmp_path: Path) -> None:
    write_page(figure, tmp_path / "figure1.html")
    page = (tmp_path / "figure1.html").read_text(encoding="utf-8")
    assert not re.search(r"<(?:script|link|img)[^>]+(?:src|href)\s*=", page)
    assert page.count("plotly.js v") == 1, "the library is inside, once"
    for goal in GOALS:
        assert f'id="goal-{goal}"' in page
    value = figure.panels[0].values[figure.chart.cells["at:B"]]
    words = f"at:B\\u003cbr\\u003epolicy value {value.value:.2f}"
    assert words in page
    assert f"valence depth {value.depth}" in page


def test_the_png_shows_three_yards_in_the_colours_of_their_columns(
    figure: Figure1, tmp_path: Path
) -> None:
    write_png(figure, tmp_path / "figure1.png")
    with Image.open(tmp_path / "figure1.png") as picture:
        width, height = picture.size
        third = width // 3
        for number, panel in enumerate(figure.panels):
            part = picture.crop((number * third, 0, (number + 1) * third, height))
            colours = {colour for _, colour in part.getcolors(maxcolors=1 << 20)}
            expected = {
                block.colour for block in blocks(figure, panel) if block.words[0] == "wall"
            } | {"#2fae72"}
            assert {tuple(bytes.fromhex(colour[1:])) for colour in expected} <= colours


def test_the_command_writes_both_pictures_and_shows_the_maps(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["farside", "dem", "figure1", "--out", "here"])
    with pytest.raises(SystemExit) as end:
        cli.main()
    out = capsys.readouterr().out
    assert end.value.code == 0
    assert sorted(path.name for path in (tmp_path / "here").iterdir()) == [
        "figure1.html",
        "figure1.png",
    ]
    assert "52 of 52 places seen, 52 at least twice" in out
    rows = [line.split() for line in out.splitlines()]
    assert [row[0] for row in rows if len(row) > 2 and row[2] == "ms"] == list(GOALS)
    assert "here/figure1.png" in out


def test_without_the_extra_the_command_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delitem(sys.modules, "farside.missions.figure1.page", raising=False)
    monkeypatch.setitem(sys.modules, "plotly", None)
    monkeypatch.setattr(sys, "argv", ["farside", "dem", "figure1"])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert end.value.code == 2
    shown = " ".join(capsys.readouterr().err.replace("│", " ").split())
    assert "farside[figures]" in shown
    assert list(tmp_path.iterdir()) == []
