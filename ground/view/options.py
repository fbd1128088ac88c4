"""What speaks for and against each action that could be ordered now."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from farside.control import CommandStage, Failsafe, Mode
from farside.ground.commands.life import Life
from farside.ground.foresight import Outcome
from farside.ground.view.knowledge import Knowledge, sign_words
from farside.ground.view.view import Option, OptionKind
from farside.messages import Drive, Proposal, SetMode
from farside.places import ACTIONS, ON_CHARGE, place_name
from farside.topics import Likely

_UNSURE = 0.5
"""Below this probability a thing is not relied on (project default)."""

_OUT_OF_COVERAGE, _CONTRADICTS, _STUCK, _ELSEWHERE = 0.6, 0.5, 0.5, 0.5
_DRAINS = 0.9
"""How much each speaks against an action, of 1 (project defaults)."""

_BACK = {"N": "S", "E": "W", "S": "N", "W": "E"}


class Trouble(NamedTuple):
    """Something that speaks against an action.

    Attributes:
        severity: how much, from 0 to 1; 1 forbids it.
        why: what, in words.
    """

    severity: float
    why: str


def options(known: Knowledge) -> tuple[Option, ...]:
    """Every action of the list, from where the next one would begin."""
    return tuple(_option(known, action) for action in ACTIONS)


def _option(known: Knowledge, action: str) -> Option:
    place = known.start_place or known.charted_place
    outcomes = () if place is None else known.sources.outlook.outcomes(place, action)
    troubles = sorted(_troubles(known, place, action, outcomes), key=lambda one: -one.severity)
    why = [trouble.why for trouble in troubles]
    severity = troubles[0].severity if troubles else 0.0
    proposed = _proposed(known, action)
    if severity >= 1:
        kind = OptionKind.INVALID
    elif proposed is not None:
        kind = OptionKind.PROPOSED
        why.insert(0, f"proposed, to {sign_words(proposed.goal)}")
    elif troubles:
        kind = OptionKind.PROBLEMATIC
    else:
        kind = OptionKind.FREE
        if not outcomes and place is not None and known.sources.shadow is not None:
            why.append("not tried here yet")
        if known.start_place is None and place is not None:
            why.append(f"begins at {place_name(place)} by the chart alone")
    if known.mode_then is Mode.AUTONOMOUS and kind is not OptionKind.INVALID:
        why.append("you take over by it: the mode will be guided")
    likely = tuple(Likely((one.place,), round(one.probability, 4)) for one in outcomes)
    unknown = max(0.0, round(1 - sum(one.probability for one in likely), 4))
    return Option(action, kind, round(severity, 3), tuple(why), likely, unknown)


def _proposed(known: Knowledge, action: str) -> Proposal | None:
    """The proposal of this action, if it waits for a word and begins where the next one would."""
    proposal = known.standing
    if proposal is None or known.answer is not None or proposal.action != action:
        return None
    return None if any(one.action for one in known.coming) else proposal


def _troubles(
    known: Knowledge, place: str | None, action: str, outcomes: tuple[Outcome, ...]
) -> Iterator[Trouble]:
    yield from _of_the_rover(known)
    yield from _contradictions(known, action)
    start = known.start
    if place is None:
        yield Trouble(_ELSEWHERE, "it is not known where it would begin")
        return
    if start is not None and start.likely and start.likely[0].probability < _UNSURE:
        sure = start.likely[0].probability
        yield Trouble(_ELSEWHERE, f"only {sure:.0%} sure where it would begin")
    yield from _of_the_place(known, place, action, outcomes)
    yield from _refused(known, place, action)
    yield from _drains(known, place, outcomes)


def _of_the_rover(known: Knowledge) -> Iterator[Trouble]:
    if known.is_flat:
        yield Trouble(1.0, "the battery is flat")
    if known.failsafe is not Failsafe.SAFE:
        return
    if known.is_stuck:
        # It may be driven, since that may free it.
        yield Trouble(_STUCK, "the rover is stuck")
    else:
        yield Trouble(1.0, known.cause or "the rover is in its safe state")


def _contradictions(known: Knowledge, action: str) -> Iterator[Trouble]:
    moves = [one for one in known.coming if one.action is not None]
    if moves and moves[-1].action == _BACK[action]:
        number, other = moves[-1].command.number, moves[-1].action
        yield Trouble(_CONTRADICTS, f"command {number}, on its way, goes {other}")
    for one in known.coming:
        order = one.command.order
        if isinstance(order, SetMode) and order.mode is not known.mode:
            number = one.command.number
            yield Trouble(_CONTRADICTS, f"command {number}, on its way, brings mode {order.mode}")
    if known.answer is not None and known.standing is not None:
        yield Trouble(
            _CONTRADICTS, f"your answer to proposal {known.standing.number} is on its way"
        )


def _of_the_place(
    known: Knowledge, place: str, action: str, outcomes: tuple[Outcome, ...]
) -> Iterator[Trouble]:
    """By the chart, and by what the model knows."""
    chart = known.sources.chart
    onward = [one for one in outcomes if one.place != place]
    blocked = sum(one.probability for one in outcomes if one.place == place)
    cell = chart.cells.get(place)
    if cell is not None and (beside := cell.beside(action)) not in chart.tokens:
        what = "a rock" if beside in chart.rocks else "a wall"
        # What the rover has done can be done, whatever the chart says.
        yield Trouble(_UNSURE if onward else 1.0, f"{what} is there on the chart")
    elif cell is not None and beside in chart.shadow:
        yield Trouble(_OUT_OF_COVERAGE, "leads out of coverage")
    if blocked and not onward:
        yield Trouble(1.0, "a wall was met here")
    elif blocked:
        yield Trouble(min(blocked, 0.99), f"blocked here before ({blocked:.0%} likely)")
    if onward and outcomes[0].probability < _UNSURE:
        sure = outcomes[0].probability
        yield Trouble(1 - sure, f"only {sure:.0%} sure where it leads")


def _refused(known: Knowledge, place: str, action: str) -> Iterator[Trouble]:
    """What the safety gate has said of this very move, if the rover still stands there."""
    if known.coming or known.heard_place != place:
        return
    life = _last_move(known)
    if life is None or life.action != action or life.end is None:
        return
    if life.end.stage is CommandStage.FAILED:
        yield Trouble(1.0, "blocked here just now")
    elif life.end.stage is CommandStage.REFUSED and isinstance(life.command.order, Drive):
        yield Trouble(1.0, f"refused here just now: {life.end.why}")


def _last_move(known: Knowledge) -> Life | None:
    """The newest command for an action that is over."""
    moves = [life for life in known.sources.desk.over if life.is_action]
    return max(moves, key=lambda life: life.number, default=None)


def _drains(known: Knowledge, place: str, outcomes: tuple[Outcome, ...]) -> Iterator[Trouble]:
    """Whether too little charge would be left for the way to the dock, as the safety gate asks."""
    telemetry, energy = known.telemetry, known.sources.rover.energy
    if telemetry is None or not outcomes:
        return
    home_s, after_s = _home_s(known, place), _home_s(known, outcomes[0].place)
    if not home_s <= after_s < math.inf:
        return
    moves = after_s / energy.move_cost_s + 1
    need_j = moves * known.sources.outlook.move_s() * energy.driving_w * energy.reserve
    charge_j = telemetry.battery * energy.capacity_j
    if charge_j < need_j:
        yield Trouble(_DRAINS, f"a charge of {telemetry.battery:.0%} may not reach the dock then")


def _home_s(known: Knowledge, place: str) -> float:
    """Cost of the way to the dock by the model; infinite where none is known."""
    shadow, chart = known.sources.shadow, known.sources.chart
    if shadow is None or chart.dock is None:
        return math.inf
    at_dock = place == chart.tokens[chart.dock]
    return 0.0 if at_dock else shadow.model.cost_to((ON_CHARGE,), (place,))
