"""Modes and goals: set, waited for, answered for, and taken back."""

from collections.abc import Generator, Sequence

from farside.acts import Act
from farside.control import CommandStage, Mode
from farside.ground.config import AwaitReached, Leave, Pursue, WaitUntil, WantedPlace
from farside.ground.operators.seat import Seat, Work
from farside.ground.rules import broken_rule
from farside.messages import (
    Approve,
    Order,
    Override,
    Proposal,
    SetGoal,
    SetMode,
    Tokens,
    Veto,
    WithdrawGoal,
)
from farside.node import to_ns
from farside.places import place_token

Pursuit = Generator[Sequence[Act], None, str | None]
"""The work for a goal; it returns why the goal was not reached, `None` if it was."""


def switch(seat: Seat, mode: Mode) -> Work:
    """Change the mode, and wait until telemetry confirms it."""
    yield from _carry_through(seat, [SetMode(mode)], mode)


def leave(seat: Seat, step: Leave) -> Work:
    """Leave the rover alone with goals: all is said at once, and again what was not done."""
    orders: list[Order] = [SetMode(Mode.AUTONOMOUS), *map(send, step.goals)]
    yield from _carry_through(seat, orders, Mode.AUTONOMOUS)


def _carry_through(seat: Seat, orders: list[Order], mode: Mode) -> Work:
    """Give orders until all of them are done, and telemetry confirms the mode that they lead to.

    Word that an order was not done may come after telemetry that says that it is over.
    """
    while True:
        given = dict(enumerate(orders, start=seat.situation.commands.last_given + 1))
        yield orders
        while not (orders := _undone(seat, given)):
            if seat.situation.settled and _is_in(seat, mode):
                return
            yield ()


def _undone(seat: Seat, given: dict[int, Order]) -> list[Order]:
    """The orders that are known not to have been done, once all of them are over."""
    if not seat.situation.settled:
        return []
    ends = seat.situation.commands.end_of
    return [order for number, order in given.items() if ends(number) is not None]


def _is_in(seat: Seat, mode: Mode) -> bool:
    return seat.telemetry is not None and seat.telemetry.mode is mode


def pursue(seat: Seat, step: Pursue) -> Work:
    """Send a goal, and answer the proposals for it; give it up if one of them breaks a rule."""
    goal = WantedPlace(place=step.place, priority=step.priority)
    overrides = {override.proposal: override.action for override in step.overrides}
    why = yield from consent(seat, goal, overrides)
    if why is not None:
        seat.give_up(f"goal {step.place}: {why}")


def consent(
    seat: Seat,
    wanted: WantedPlace,
    overrides: dict[int, str],
    patience_ns: int | None = None,
) -> Pursuit:
    """Send a goal, and answer proposals until it is known to be reached.

    A proposal that meets the rules is approved, where that is asked for. For any other there is a
    veto, and the goal is taken back.

    Args:
        seat: the operator's.
        wanted: the goal.
        overrides: proposals, counted from 1, to answer with another action.
        patience_ns: the goal is taken back, too, when the rover was heard and stood still for this
            long, and proposed nothing.
    """
    belief = seat.situation.belief
    goal = (place_token(wanted.place),)
    known_events = belief.last_event
    seen = answered = belief.proposal.number if belief.proposal else 0
    sent: int | None = None
    idle_since_ns: int | None = None
    while not belief.reached(goal, known_events):
        proposal, now_ns = belief.proposal, seat.situation.now_ns
        if sent is None or seat.situation.commands.end_of(sent) is not None:
            sent = seat.situation.commands.last_given + 1
            yield [send(wanted)]
        elif proposal is not None and proposal.number > answered:
            answered, idle_since_ns = proposal.number, None
            override = overrides.get(answered - seen)
            broken = None if override else _broken(seat, proposal)
            yield _answer(proposal, override, broken)
            if broken is not None:
                yield from take_back(seat, goal)
                return f"vetoed proposal {proposal.number}, {broken}"
        elif patience_ns is not None and _is_idle(seat):
            idle_since_ns = now_ns if idle_since_ns is None else idle_since_ns
            if now_ns - idle_since_ns >= patience_ns:
                yield from take_back(seat, goal)
                return "nothing was proposed"
            yield ()
        else:
            idle_since_ns = None
            yield ()
    return None


def take_back(seat: Seat, goal: Tokens) -> Work:
    """Take a goal back; what came too late is given again."""
    while True:
        end = yield from seat.tell(WithdrawGoal(goal))
        if end is None or end.stage is CommandStage.REFUSED:  # there is no such goal any more
            return


def wait_for_goal(seat: Seat, step: AwaitReached) -> Work:
    """Wait until a goal that someone else set is known to be reached."""
    belief = seat.situation.belief
    known_events = 0 if step.already else belief.last_event
    while not belief.reached((place_token(step.place),), known_events):
        yield ()


def wait(seat: Seat, step: WaitUntil) -> Work:
    """Wait until a time."""
    while seat.situation.now_ns < to_ns(step.until_s):
        yield ()


def send(wanted: WantedPlace) -> SetGoal:
    """The order for a goal."""
    return SetGoal((place_token(wanted.place),), wanted.priority)


def _broken(seat: Seat, proposal: Proposal) -> str | None:
    """The rule that a proposal breaks, in words."""
    if not seat.rules:
        return None
    return broken_rule(seat.situation.review(proposal), seat.rules)


def _answer(proposal: Proposal, override: str | None, broken: str | None) -> list[Order]:
    if override is not None:
        return [Override(proposal.number, override)]
    if broken is not None:
        return [Veto(proposal.number)]
    # What would be carried out without a veto needs no approval.
    return [Approve(proposal.number)] if proposal.veto_window_s is None else []


def _is_idle(seat: Seat) -> bool:
    """Whether the rover is heard, and stands, and has nothing left to be told."""
    telemetry = seat.telemetry
    if telemetry is None or seat.situation.silent or not seat.situation.settled:
        return False
    return telemetry.action is None and telemetry.proposal is None and not seat.is_charging
