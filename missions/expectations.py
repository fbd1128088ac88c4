"""Judging a run by the expectations of its mission."""

from collections import Counter
from collections.abc import Callable

from farside.control import CommandStage, Mode, ModeCause
from farside.frames import Fate, FrameFate
from farside.logs.result import Judgement
from farside.logs.spans import OutageSpan
from farside.logs.views.run import RunView
from farside.missions.schema import (
    AutonomyExpected,
    ChargeExpected,
    Expectation,
    NoCrossingExpected,
    ObedienceExpected,
    ReachedExpected,
)
from farside.missions.surprises import surprises
from farside.node import Direction, to_ns
from farside.places import place_token
from farside.topics import GROUND_COMMAND, ROVER_COMMAND

_NOT_DONE = [stage for stage in CommandStage if stage.is_last and stage is not CommandStage.DONE]


def judge(expectation: Expectation, run: RunView) -> Judgement:
    """Judge whether a run met one expectation."""
    match expectation:
        case ReachedExpected():
            return _reached(expectation, run)
        case AutonomyExpected():
            return _autonomy(expectation, run)
        case ObedienceExpected():
            return _obedience(run)
        case NoCrossingExpected():
            return _no_crossing(run)
        case ChargeExpected():
            return _charge(expectation, run)


def _reached(expectation: ReachedExpected, run: RunView) -> Judgement:
    token = place_token(expectation.place)
    reached_s = run.reached(token)
    name = f"goal {token} reached"
    if expectation.in_blackout:
        name += " during a blackout"
    if reached_s is None:
        return Judgement(name, met=False, detail="never reached as a goal")
    met = not expectation.in_blackout or all(
        _during(_outages(run, direction), reached_s) for direction in Direction
    )
    detail = f"reached at {reached_s:.1f} s"
    return Judgement(name, met, detail if met else f"{detail}, while the link was up")


def _autonomy(expectation: AutonomyExpected, run: RunView) -> Judgement:
    within_s = expectation.within_s
    name = f"autonomy within {within_s:g} s of each loss of the uplink, never otherwise"
    # What the contact plan foresees is no loss.
    outages = [out for out in _outages(run, Direction.UP) if not out.reason.is_foreseen]
    taken_s = [
        mode.t_s
        for mode in run.modes
        if mode.mode is Mode.AUTONOMOUS and mode.why is ModeCause.LINK_LOST
    ]
    unfounded = [
        f"{t_s:.1f} s"
        for t_s in taken_s
        if not any(outage.start_s <= t_s <= outage.start_s + within_s for outage in outages)
    ]
    missed = [
        f"{outage.start_s:.1f} s"
        for outage in outages
        if outage.start_s + within_s < outage.end_s
        and run.mode_at(outage.start_s + within_s) is not Mode.AUTONOMOUS
    ]
    if unfounded:
        return Judgement(name, met=False, detail=f"taken without a loss at {', '.join(unfounded)}")
    if missed:
        return Judgement(name, met=False, detail=f"not taken after losses at {', '.join(missed)}")
    detail = f"taken at {', '.join(f'{t_s:.1f} s' for t_s in taken_s)}" if taken_s else "not taken"
    return Judgement(name, met=True, detail=detail)


def _obedience(run: RunView) -> Judgement:
    name = "no order but the operator's, and nothing of the rover's own against it"
    found = next(surprises(run), None)
    if found is not None:
        return Judgement(name, met=False, detail=f"{found.what}, at {found.t_s:.1f} s")
    sent = sum(1 for _ in run.each(GROUND_COMMAND))
    stages = Counter(entry.stage for _, entry in run.each(ROVER_COMMAND))
    detail = f"{sent} sent, {stages[CommandStage.DONE]} done"
    not_done = ", ".join(f"{stages[stage]} {stage}" for stage in _NOT_DONE if stages[stage])
    return Judgement(name, met=True, detail=f"{detail}, {not_done}" if not_done else detail)


def _no_crossing(run: RunView) -> Judgement:
    name = "no frame delivered that had to cross an outage"
    for direction, at_rover in (
        (Direction.UP, _arrival_ns),
        (Direction.DOWN, _sending_ns),
    ):
        frame = _crossing(run, direction, at_rover)
        if frame is not None:
            detail = f"{direction} frame {frame.sequence} arrived"
            return Judgement(name, met=False, detail=detail)
    return Judgement(
        name, met=True, detail=f"{sum(1 for _ in run.each_frame(fate=Fate.DELIVERED))} delivered"
    )


def _charge(expectation: ChargeExpected, run: RunView) -> Judgement:
    name = "battery never flat"
    if expectation.at_least:
        name = f"charge at least {expectation.at_least:.4g}, {name}"
    least = run.least_charge
    if least is None:
        return Judgement(name, met=False, detail="the charge was never measured")
    detail = f"least charge {least.charge:.4g} at {least.t_s:.1f} s"
    return Judgement(name, met=0 < least.charge >= expectation.at_least, detail=detail)


def _crossing(
    run: RunView, direction: Direction, at_rover: Callable[[FrameFate], tuple[int, int]]
) -> FrameFate | None:
    """The first delivered frame that passed the rover's end of the link during an outage.

    Args:
        run: the run.
        direction: of the frames.
        at_rover: the span in ns in which a frame passes the rover's end.
    """
    outages_ns = [(to_ns(out.start_s), to_ns(out.end_s)) for out in _outages(run, direction)]
    for frame in run.each_frame(direction, Fate.DELIVERED):
        first_ns, last_ns = at_rover(frame)
        if any(begin <= last_ns and first_ns < end for begin, end in outages_ns):
            return frame
    return None


def _arrival_ns(frame: FrameFate) -> tuple[int, int]:
    assert frame.arrival_ns is not None  # noqa: S101 - only delivered frames come here
    return frame.arrival_ns, frame.arrival_ns


def _sending_ns(frame: FrameFate) -> tuple[int, int]:
    return frame.sent_ns, frame.sent_end_ns


def _outages(run: RunView, direction: Direction) -> list[OutageSpan]:
    return [outage for outage in run.outages if outage.direction is direction]


def _during(outages: list[OutageSpan], t_s: float) -> bool:
    return any(outage.start_s <= t_s < outage.end_s for outage in outages)
