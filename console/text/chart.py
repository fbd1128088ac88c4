"""The map of a screen: what is heard and what is predicted, which never look alike."""

from collections.abc import Iterator

from rich.text import Text

from farside.console.screen.screen import Ghost, MapView, Spot
from farside.console.text.words import DIM, flowing, told
from farside.console.wording import percent
from farside.logs.terminal.yard import DrawnMap, Mark, draw_chart, heading
from farside.places import Cell, Chart, place_name

_HEARD, _FORESEEN, _PATH, _GOAL = "bold magenta", "magenta", "cyan", "bold yellow"
_SURE = 0.5  # below this a region is drawn, not a ghost
_NUMBERS = "①②③④⑤⑥⑦⑧⑨"
_BEYOND = "◯"
_STEPS = 10  # of the cost to go, from 0 to 9


def order_mark(index: int) -> str:
    """The mark of the place after the command that is so many commands away, from 0 on."""
    return _NUMBERS[index] if index < len(_NUMBERS) else _BEYOND


def draw_map(view: MapView, chart: Chart | None, width: int, height: int) -> DrawnMap:
    """The map in at most so many columns and rows, with the rover in the middle if it is larger."""
    if chart is None:
        return DrawnMap([Text("no map yet", style=DIM)], "")
    return draw_chart(chart, dict(_marks(view, chart)), _middle(view, chart), width, height)


def legend(view: MapView, width: int) -> Text:
    """What the marks mean, with the ages and probabilities of what they stand for, in one row."""
    parts = [_key("◇?" if view.heard_stale else "◇", _HEARD, view.heard_label or "not heard yet")]
    if view.now is not None and view.now.spots:
        sure = percent(view.now.spots[0].amount)
        parts.append(_key("◌" if _is_sure(view.now) else "░", _FORESEEN, f"by now {sure}"))
    if view.after:
        marks = "".join(dict.fromkeys(order_mark(index) for index in range(len(view.after))))
        parts.append(_key(marks, _FORESEEN, "after each command"))
    if view.heat:
        parts.append(_key("0-9", DIM, "near to far"))
    if view.goals:
        parts.append(_key("◆", _GOAL, "goal"))
    return flowing(parts, width, "  ")[0]


def _key(mark: str, style: str, words: str) -> Text:
    return Text.assemble((mark, style), " ", told(words))


def _middle(view: MapView, chart: Chart) -> Cell | None:
    if view.heard is not None:
        return chart.cell_at(view.heard.x_m, view.heard.y_m)
    if view.now is not None and view.now.spots:
        return _cell(view.now.spots[0])
    return None


def _marks(view: MapView, chart: Chart) -> Iterator[tuple[Cell, Mark]]:
    """What stands on the places, the most important last."""
    for spot in view.track:
        yield _cell(spot), ("·", DIM)
    yield from _heat(view.heat)
    for spot in view.policy:
        yield _cell(spot), ("•", _PATH)
    for spot in view.committed:
        yield _cell(spot), ("━", _FORESEEN)
    path = {_cell(spot) for spot in view.policy}
    for token, cell in chart.cells.items():
        name = place_name(token)
        if name.isalpha():
            yield cell, (f"{name}•" if cell in path else name, "bold")
    for goal in view.goals:
        cell = Cell(goal.east, goal.north)
        name = goal.name if goal.name.isalpha() and len(goal.name) == 1 else ""
        yield cell, (f"{name}{'◈' if goal.is_sent else '◆'}", _GOAL)
    for index, ghost in reversed(tuple(enumerate(view.after))):
        yield from _ghost(ghost, order_mark(index))
    if view.now is not None:
        yield from _ghost(view.now, "◌")
    if view.heard is not None:
        after = "?" if view.heard_stale else heading(view.heard.heading_rad)
        yield chart.cell_at(view.heard.x_m, view.heard.y_m), (f"◇{after}", _HEARD)


def _ghost(ghost: Ghost, mark: str) -> Iterator[tuple[Cell, Mark]]:
    """The place, or where none is likely enough the region."""
    if _is_sure(ghost):
        yield _cell(ghost.spots[0]), (mark, _FORESEEN)
        return
    for spot in ghost.spots:
        yield _cell(spot), ("░░", _FORESEEN)


def _is_sure(ghost: Ghost) -> bool:
    return bool(ghost.spots) and ghost.spots[0].amount >= _SURE


def _heat(heat: tuple[Spot, ...]) -> Iterator[tuple[Cell, Mark]]:
    most = max((spot.amount for spot in heat), default=0.0) or 1.0
    for spot in heat:
        share = min(max(spot.amount / most, 0.0), 1.0)
        yield _cell(spot), (str(min(int(share * _STEPS), _STEPS - 1)), DIM)


def _cell(spot: Spot) -> Cell:
    return Cell(spot.east, spot.north)
