"""The walk that teaches: every move once, as short as can be, and past what is blocked."""

from collections import Counter
from random import Random

from hypothesis import given
from hypothesis import strategies as st

from farside.ground.operators.lessons import Lessons, Move
from farside.places import Cell, Chart


@st.composite
def yards(draw: st.DrawFn) -> tuple[Chart, Cell]:
    """A yard of up to 6 by 6 places with rocks and shadow, and a place in it that is in neither."""
    width, height = draw(st.integers(1, 6)), draw(st.integers(1, 6))
    rows = ["".join(draw(st.sampled_from("....o~#")) for _ in range(width)) for _ in range(height)]
    east, south = draw(st.integers(0, width - 1)), draw(st.integers(0, height - 1))
    rows[south] = rows[south][:east] + "S" + rows[south][east + 1 :]
    edge = "#" * (width + 2)
    chart = Chart((edge, *(f"#{row}#" for row in rows), edge), 1.0)
    return chart, chart.places["S"]


def moves_in(chart: Chart, start: Cell) -> set[Move]:
    """Every move of the part of a yard in which an order arrives, by another way of looking."""
    lit, seen = {start}, set[Cell]()
    while lit - seen:
        cell = min(lit - seen)
        seen.add(cell)
        lit |= {beside for _, beside in chart.neighbours(cell) if beside not in chart.shadow}
    return {
        Move(cell, action)
        for cell in seen
        for action, beside in chart.neighbours(cell)
        if beside not in chart.shadow
    }


@given(yards(), st.integers(1, 3), st.integers(1, 5))
def test_it_makes_every_move_as_often_as_asked_and_none_more_and_comes_back(
    yard: tuple[Chart, Cell], times: int, ahead: int
) -> None:
    chart, start = yard
    lessons, cell, made = Lessons(chart, start, times), start, Counter[Move]()
    while moves := lessons.plan(cell, ahead):
        assert len(moves) <= ahead
        for move in moves:
            assert move.cell == cell
            made[move] += 1
            lessons.note_made(move)
            cell = move.to
    assert made == dict.fromkeys(moves_in(chart, start), times)
    assert cell == start
    assert lessons.left == []
    assert lessons.made == lessons.of == sum(made.values())


@given(yards(), st.randoms(use_true_random=False), st.integers(1, 4))
def test_whatever_is_blocked_it_comes_to_an_end_and_gives_up_only_what_cannot_be_made(
    yard: tuple[Chart, Cell], chance: Random, ahead: int
) -> None:
    """Some moves are always blocked, others by chance."""
    chart, start = yard
    every = sorted(moves_in(chart, start))
    never = set(chance.sample(every, len(every) // 4))
    lessons, cell, steps = Lessons(chart, start, 1), start, 0
    blocked, made = Counter[Move](), set[Move]()
    while moves := lessons.plan(cell, ahead):
        for move in moves:
            steps += 1
            assert steps < 20 * len(every) + 100, "it does not try for ever"
            if move in never or chance.random() < 0.1:
                blocked[move] += 1
                lessons.note_blocked(move)
                break
            del blocked[move]
            made.add(move)
            lessons.note_made(move)
            cell = move.to
    given_up = {move for move in every if blocked[move] == 3}
    reached, found = set[Cell](), {cell}
    while found - reached:
        here = min(found - reached)
        reached.add(here)
        found |= {move.to for move in every if move.cell == here and move not in given_up}
    assert max(blocked.values(), default=0) <= 3
    assert set(lessons.left) == set(every) - made
    assert {move for move in lessons.left if move.cell in reached} <= given_up


def test_a_move_that_was_blocked_is_tried_last_and_three_times_at_most() -> None:
    chart = Chart(("#####", "#ABC#", "#####"), 1.0)
    a, b, c = (chart.places[name] for name in "ABC")
    lessons = Lessons(chart, b, 1)
    tried = []
    cell = b
    while moves := lessons.plan(cell, 1):
        tried.append((cell, moves[0].action))
        if moves[0].to == c:
            lessons.note_blocked(moves[0])
        else:
            lessons.note_made(moves[0])
            cell = moves[0].to
    assert tried == [(b, "E"), (b, "W"), (a, "E"), (b, "E"), (b, "E")]
    assert lessons.left == [Move(b, "E"), Move(c, "W")]


def test_it_would_rather_go_on_than_turn() -> None:
    chart = Chart(("#####", "#...#", "#...#", "#...#", "#####"), 1.0)
    moves = Lessons(chart, Cell(2, 1), 1).plan(Cell(2, 1), 3, "N")
    assert [move.action for move in moves] == ["N", "N", "E"]


def test_a_way_to_a_place_leads_past_what_is_blocked_while_there_is_another() -> None:
    chart = Chart(("####", "#AB#", "#CD#", "####"), 1.0)
    a, b = chart.places["A"], chart.places["B"]
    lessons = Lessons(chart, a, 1)
    assert [move.action for move in lessons.way_to(a, b)] == ["E"]
    lessons.note_blocked(Move(a, "E"))
    assert [move.action for move in lessons.way_to(a, b)] == ["S", "E", "N"]
    assert lessons.way_to(b, b) == []
