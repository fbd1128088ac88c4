"""Makes docs/failsafe.html from the failsafe's table: in words, to try, and as a drawing."""

import json
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator
from html import escape
from itertools import chain, combinations
from pathlib import Path
from typing import NamedTuple

from farside.control import Cause, Failsafe
from farside.missions.format import key_texts
from farside.rover.failsafe.table import ORDERS, TABLE, Rule, rule_for

PAGE = Path(__file__).with_name("failsafe.html")
TEMPLATE = Path(__file__).with_name("failsafe.template.html")

Causes = frozenset[Cause]


class Odd(NamedTuple):
    """Causes that are never so together, or never without another."""

    all: tuple[Cause, ...]
    none: tuple[Cause, ...]
    why: str


ODD = (
    Odd((Cause.LOST,), (Cause.SILENCE,), "the link is lost only by silence"),
    Odd((Cause.SILENCE, Cause.EXPECTED_SILENCE), (), "silence is expected, or it is not"),
)


def own(rule: Rule) -> str:
    """What the rover does of its own."""
    if not rule.acts:
        return "begins nothing"
    if rule.state is Failsafe.ALONE:
        return "pursues the goals that it has, in autonomous mode from now on"
    return (
        "does what its mode says: nothing in guided mode; in shared mode what the operator, who is "
        "heard, has consented to; in autonomous mode it pursues its goals"
    )


# --- from state to state -----------------------------------------------------------------------


class Change(NamedTuple):
    """Something begins to be so, or ends."""

    cause: Cause
    begins: bool

    def after(self, causes: Causes) -> Causes:
        """What is so then."""
        if self.begins:
            return causes | {self.cause}
        heard = {Cause.SILENCE, Cause.LOST}
        return causes - (heard if self.cause is Cause.SILENCE else {self.cause})

    def may_come(self, causes: Causes) -> bool:
        """Whether it can come about when these are so."""
        if self.begins is (self.cause in causes) or is_odd(self.after(causes)):
            return False
        match self:
            case Change(Cause.LOST, False):
                return False  # it ends with the silence
            case Change(Cause.UNCONFIRMED, True):
                return rule_for(causes).state is Failsafe.ALONE
        return True


class Way(NamedTuple):
    """What leads from one state to another.

    Attributes:
        changes: each does it; where they end, the last of them does.
        when, unless: what else has to be so, and not so.
        enough: whether it is enough that those are so, and not so.
    """

    changes: tuple[Change, ...]
    when: tuple[Cause, ...]
    unless: tuple[Cause, ...]
    enough: bool


def is_odd(causes: Causes) -> bool:
    """Whether this does not come about in a run."""
    return any(causes.issuperset(odd.all) and causes.isdisjoint(odd.none) for odd in ODD)


def cause_sets() -> Iterator[Causes]:
    """Every set of causes that comes about in a run."""
    sizes = range(len(Cause) + 1)
    every = chain.from_iterable(combinations(Cause, size) for size in sizes)
    return (causes for causes in map(frozenset, every) if not is_odd(causes))


def ways() -> dict[tuple[Failsafe, Failsafe], list[Way]]:
    """Every change that leads from one state to another, tried in every set of causes."""
    changes = [Change(cause, begins) for begins in (True, False) for cause in Cause]
    found: dict[tuple[Failsafe, Failsafe], list[Way]] = defaultdict(list)
    for before in Failsafe:
        sources = [causes for causes in cause_sets() if rule_for(causes).state is before]
        for change in changes:
            led: defaultdict[Failsafe, list[Causes]] = defaultdict(list)
            for causes in filter(change.may_come, sources):
                led[rule_for(change.after(causes)).state].append(causes)
            everywhere = list(chain.from_iterable(led.values()))
            for after in [state for state in Failsafe if state in led and state is not before]:
                those = led[after]
                when = _always(those) - _always(everywhere)
                unless = _never(those) - _never(everywhere)
                fits = [one for one in everywhere if when <= one and not unless & one]
                found[before, after].append(
                    Way((change,), *_telling(when, unless), len(fits) == len(those))
                )
    pairs = [(before, after) for before in Failsafe for after in Failsafe]
    return {pair: _together(found[pair]) for pair in pairs if pair in found}


def _telling(when: Causes, unless: Causes) -> tuple[tuple[Cause, ...], tuple[Cause, ...]]:
    """The conditions without those that follow from others."""
    follows: set[Cause] = set()
    idle: set[Cause] = set()
    for odd in ODD:
        if when.issuperset(odd.all):
            follows.update(odd.none)
        if odd.none and unless.issuperset(odd.none):
            idle.update(odd.all)
        if not odd.none and when & set(odd.all):
            idle.update(odd.all)
    return _ordered(when - follows), _ordered(unless - idle)


def _together(ways: Iterable[Way]) -> list[Way]:
    """Ways that differ only in which cause begins, or in which one is the last to end, as one."""
    groups: defaultdict[object, list[Way]] = defaultdict(list)
    for way in ways:
        (change,) = way.changes
        unless = {*way.unless} if change.begins else {*way.unless, change.cause}
        groups[change.begins, way.when, frozenset(unless), way.enough].append(way)
    return [_one_of(group) for group in groups.values()]


def _one_of(group: list[Way]) -> Way:
    changes = tuple(change for way in group for change in way.changes)
    unless = {cause for way in group for cause in way.unless}
    if not changes[0].begins:
        unless -= {change.cause for change in changes}
    return group[0]._replace(changes=changes, unless=_ordered(frozenset(unless)))


def _always(sets: Iterable[Causes]) -> Causes:
    return frozenset(Cause).intersection(*sets)


def _never(sets: Iterable[Causes]) -> Causes:
    return frozenset(Cause).difference(*sets)


def _ordered(causes: Causes) -> tuple[Cause, ...]:
    return tuple(cause for cause in Cause if cause in causes)


# --- the drawing -------------------------------------------------------------------------------

WIDTH, HEIGHT = 110, 60
BOXES = {
    Failsafe.NOMINAL: (60, 20),
    Failsafe.HOLD: (60, 180),
    Failsafe.ALONE: (60, 340),
    Failsafe.SAFE: (240, 180),
}
# For each way its arrow, and where its number stands.
ARROWS = {
    (Failsafe.NOMINAL, Failsafe.HOLD): ("M95 80V176", 95, 128),
    (Failsafe.HOLD, Failsafe.NOMINAL): ("M135 180V84", 135, 128),
    (Failsafe.HOLD, Failsafe.ALONE): ("M95 240V336", 95, 288),
    (Failsafe.ALONE, Failsafe.HOLD): ("M135 340V244", 135, 288),
    (Failsafe.ALONE, Failsafe.NOMINAL): ("M60 370C8 370 8 50 56 50", 21, 210),
    (Failsafe.NOMINAL, Failsafe.SAFE): ("M170 38C260 38 315 90 315 176", 276, 74),
    (Failsafe.SAFE, Failsafe.NOMINAL): ("M275 180C275 110 240 64 174 64", 254, 112),
    (Failsafe.HOLD, Failsafe.SAFE): ("M170 198H236", 203, 198),
    (Failsafe.SAFE, Failsafe.HOLD): ("M240 224H174", 203, 224),
    (Failsafe.ALONE, Failsafe.SAFE): ("M170 382C260 382 315 330 315 244", 276, 346),
    (Failsafe.SAFE, Failsafe.ALONE): ("M275 240C275 310 240 356 174 356", 254, 308),
}


def drawing(pairs: Iterable[tuple[Failsafe, Failsafe]]) -> str:
    """The states, and numbered arrows between them."""
    parts = [
        '<svg viewBox="0 0 370 420" role="img" aria-labelledby="drawn">',
        '<title id="drawn">The four states, with an arrow for each way between them</title>',
        '<defs><marker id="head" viewBox="0 0 8 8" refX="6" refY="4" orient="auto"',
        ' markerWidth="7" markerHeight="7"><path class="head" d="M0 0L8 4L0 8z"/></marker></defs>',
    ]
    for number, pair in enumerate(pairs, 1):
        if pair not in ARROWS:
            raise SystemExit(f"{__file__}: expected an arrow in ARROWS for {pair}, found none")
        path, x, y = ARROWS[pair]
        parts += [
            f'<path class="arrow" d="{path}" marker-end="url(#head)"/>',
            f'<circle class="disc" cx="{x}" cy="{y}" r="11"/>',
            f'<text class="number" x="{x}" y="{y + 4.5}">{number}</text>',
        ]
    for state, (x, y) in BOXES.items():
        middle = x + WIDTH // 2
        parts.append(
            f'<g data-state="{state}">'
            f'<rect class="box" x="{x}" y="{y}" width="{WIDTH}" height="{HEIGHT}" rx="8"/>'
            f'<text class="name" x="{middle}" y="{y + 28}">{state}</text>'
            f'<text class="note" x="{middle}" y="{y + 48}">◀ now</text></g>'
        )
    return "\n".join([*parts, "</svg>"])


def _happening(changes: tuple[Change, ...]) -> str:
    *others, last = [_quoted(change.cause) for change in changes]
    if changes[0].begins:
        return f"{', '.join(others)} or {last} begins" if others else f"{last} begins"
    return f"the last of {', '.join(others)} and {last} ends" if others else f"{last} ends"


def way_item(pair: tuple[Failsafe, Failsafe], number: int, ways: Iterable[Way]) -> str:
    """An arrow in words: what leads along it."""
    lines = [f"<li><b>{number}</b> from <b>{pair[0]}</b> to <b>{pair[1]}</b><ul>"]
    for changes, when, unless, enough in ways:
        conditions = [f"while: {_names(when)}"] * bool(when)
        conditions += [f"unless: {_names(unless)}"] * bool(unless)
        conditions += ["where no other way applies"] * (not enough)
        small = f" <small>{'; '.join(conditions)}</small>" if conditions else ""
        lines.append(f"<li>{_happening(changes)}{small}</li>")
    return "\n".join([*lines, "</ul></li>"])


# --- the page ----------------------------------------------------------------------------------


def _quoted(text: str) -> str:
    return f"“{escape(text)}”"


def _names(causes: Iterable[Cause]) -> str:
    return ", ".join(escape(cause) for cause in causes)


def _cell(what: str, text: str) -> str:
    return f'<td data-is="{what}">{text}</td>' if text else '<td class="none"></td>'


def cause_label(cause: Cause, meaning: str) -> str:
    """A cause to toggle, with what it means."""
    told = escape(meaning.replace("`", ""))
    box = f'<input type="checkbox" value="{escape(cause)}">'
    return f"<label>{box}<span><b>{escape(cause)}</b><span>{told}</span></span></label>"


def rule_row(number: int, rule: Rule) -> str:
    """A row of the table."""
    cells = (
        f'<td class="mark">row {number}</td>',
        f'<th scope="row">{rule.state}</th>',
        _cell("when", _names(_ordered(rule.when)) or "always"),
        _cell("unless", _names(_ordered(rule.unless))),
        _cell("acts of its own", "yes" if rule.acts else "no"),
        _cell("reason", escape(rule.why)),
    )
    return f'<tr id="rule-{number}">{"".join(cells)}</tr>'


def orders_row(number: int, cause: Cause | None, then: str) -> str:
    """A row of the table for orders."""
    cells = (
        f'<td class="mark">row {number}</td>',
        _cell("when", "always" if cause is None else escape(cause)),
        _cell("orders are", escape(then)),
    )
    return f'<tr id="orders-{number}">{"".join(cells)}</tr>'


def data() -> dict[str, object]:
    """The tables for the page's script."""
    return {
        "rules": [
            {
                "state": rule.state,
                "when": _ordered(rule.when),
                "unless": _ordered(rule.unless),
                "why": rule.why,
                "own": own(rule),
            }
            for rule in TABLE
        ],
        "orders": [{"cause": cause, "then": then} for cause, then in ORDERS],
        "odd": [odd._asdict() for odd in ODD],
    }


def page() -> str:
    """The page as it should be."""
    meanings = key_texts(Cause)
    led = ways()
    parts = {
        "causes": "\n".join(cause_label(cause, meanings[cause.name]) for cause in Cause),
        "rules": "\n".join(rule_row(number, rule) for number, rule in enumerate(TABLE, 1)),
        "orders": "\n".join(orders_row(number, *row) for number, row in enumerate(ORDERS, 1)),
        "drawing": drawing(led),
        "ways": "\n".join(
            way_item(pair, number, ways) for number, (pair, ways) in enumerate(led.items(), 1)
        ),
        "data": json.dumps(data(), indent=1).replace("<", "\\u003c"),
    }
    text = TEMPLATE.read_text(encoding="utf-8")
    for name, part in parts.items():
        text = text.replace(f"<!--{{{name}}}-->", part)
    return text


if __name__ == "__main__":
    target = Path(sys.argv[1]) if sys.argv[1:] else PAGE
    target.write_text(page(), encoding="utf-8")
