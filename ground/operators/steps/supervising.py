"""Goals and rules, and no driving."""

from collections.abc import Generator, Sequence

from farside.acts import Act
from farside.control import Mode
from farside.ground.config import Supervision, SupervisorConfig, WantedPlace
from farside.ground.operators.seat import Seat, Work
from farside.ground.operators.steps.goals import Pursuit, consent, send, switch, take_back
from farside.ground.rules import broken_rule
from farside.node import to_ns
from farside.places import place_token

_TIMES = 3
"""So many times the cost of the way may be taken for it; see `SupervisorConfig.patience_s`."""

_Left = tuple[tuple[WantedPlace, str], ...]
"""Goals that were not reached, each with what the progress says of it."""


def supervise(seat: Seat, config: SupervisorConfig) -> Work:
    """Send one goal after the other, and those that were not reached once more in the end."""
    ordered = sorted(config.goals, key=lambda wanted: -wanted.priority)  # equals stay in order
    left = yield from _round(seat, config, tuple((wanted, "") for wanted in ordered))
    yield from _round(seat, config, left)


def _round(
    seat: Seat, config: SupervisorConfig, goals: _Left
) -> Generator[Sequence[Act], None, _Left]:
    """Try for goals; those that were not reached."""
    mode, left = Mode(config.mode), []
    for wanted, before in goals:
        seat.take_up(before)
        seat.wait_for(f"telemetry that confirms mode {mode}")
        if seat.telemetry is None or seat.telemetry.mode is not mode:
            yield from switch(seat, mode)  # first of all, and after the rover took over
        seat.wait_for(f"goal {wanted.place} to be reached")
        if config.mode is Supervision.SHARED:
            why = yield from consent(seat, wanted, {}, to_ns(config.patience_s))
        else:
            why = yield from _alone(seat, config, wanted)
        if why is not None:
            left.append((wanted, f"goal {wanted.place}: {why}"))
            seat.give_up(left[-1][1])
    return tuple(left)


def _alone(seat: Seat, config: SupervisorConfig, wanted: WantedPlace) -> Pursuit:
    """Have the rover go to a goal by itself if the way there meets the rules."""
    token = place_token(wanted.place)
    while seat.telemetry is None or seat.situation.silent or not seat.situation.settled:
        yield ()
    review = seat.situation.review_path((token,))
    cost_s = 0.0
    if review is not None:
        cost_s = review.cost_to_go
        broken = broken_rule(review, seat.rules)
        if broken is not None:
            return broken
    elif token not in seat.telemetry.tokens:
        return "no way there is known"
    belief = seat.situation.belief
    known_events = belief.last_event
    yield from seat.insist(send(wanted))
    patience_ns = to_ns(config.patience_s + _TIMES * cost_s)
    waited_ns, before_ns = 0, seat.situation.now_ns
    while not belief.reached((token,), known_events):
        now_ns = seat.situation.now_ns
        if not (seat.situation.silent or seat.is_charging):
            waited_ns += now_ns - before_ns
        before_ns = now_ns
        if waited_ns >= patience_ns:
            yield from take_back(seat, (token,))
            return f"not reached in {config.patience_s + _TIMES * cost_s:.0f} s"
        yield ()
    return None
