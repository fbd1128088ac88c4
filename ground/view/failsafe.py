"""The failsafe on board: its countdown as the ground can know it, and what it would do."""

from farside.control import CommandStage, Failsafe, OnLoss
from farside.ground.view.knowledge import Knowledge, and_then
from farside.ground.view.view import FailsafeOutlook
from farside.messages import FailsafeChanged
from farside.node import NEVER_NS, Direction, to_s

_LOOKED_BACK = 16  # commands that are over


def failsafe_outlook(known: Knowledge) -> FailsafeOutlook:
    """What the ground can know of the failsafe at this moment."""
    rover, state = known.sources.rover, known.failsafe
    heard_ns = _last_heard_ns(known)
    holds_ns = alone_ns = None
    if state in {None, Failsafe.NOMINAL}:
        holds_ns = _after(known, heard_ns, rover.hold_after_ns)
    if state in {None, Failsafe.NOMINAL, Failsafe.HOLD} and not _stays(known):
        alone_ns = _after(known, heard_ns, rover.alone_after_ns)
    return FailsafeOutlook(
        state=state,
        hold_after_s=to_s(rover.hold_after_ns),
        lost_after_s=to_s(rover.alone_after_ns),
        holds_ns=holds_ns,
        alone_ns=alone_ns,
        will=_will(known),
        cause=known.cause,
    )


def _last_heard_ns(known: Knowledge) -> int:
    """When the rover has heard the ground last if it hears nothing more.

    By plan that is when the newest frame sent so far arrives. In a silence that the plan does not
    explain, the uplink may have failed as well: then it is what is known to have arrived.
    """
    told = known.sources.memory.last(FailsafeChanged)
    if known.failsafe is Failsafe.HOLD and told is not None:
        event, so_ns = told
        if event.silence_ns >= known.sources.rover.hold_after_ns:
            return so_ns - event.silence_ns
    if known.sources.silence.state.silent:
        return _proven_ns(known)
    return known.sources.memory.reaches_ns


def _proven_ns(known: Knowledge) -> int:
    """By when the rover is known to have heard the ground: by a command taken, or its own word."""
    desk, telemetry = known.sources.desk, known.telemetry
    lives = (*desk.over[-_LOOKED_BACK:], *desk.live)
    proven_ns = [life.stages[CommandStage.TAKEN].so_ns or 0 for life in lives]
    if telemetry is not None and telemetry.failsafe is Failsafe.NOMINAL:
        # Else it would have held by then.
        proven_ns.append(telemetry.time_ns - known.sources.rover.hold_after_ns)
    return max(proven_ns, default=0)


def _after(known: Knowledge, heard_ns: int, silence_ns: int) -> int | None:
    """When so much silence that the contact plan does not explain has passed on board."""
    schedule = known.sources.schedule
    until_ns = schedule.unheard_until_ns(Direction.UP, heard_ns, silence_ns, known.now_ns)
    return None if until_ns >= NEVER_NS else until_ns


def _stays(known: Knowledge) -> bool:
    """Whether it holds when the link is lost, and does not act alone."""
    if known.on_loss is OnLoss.HOLD:
        return True
    return known.telemetry is not None and not known.telemetry.alone_goals


def _will(known: Knowledge) -> str:
    rover, telemetry = known.sources.rover, known.telemetry
    holds = f"holds {to_s(rover.hold_after_ns):g} s into a silence"
    if known.on_loss is OnLoss.HOLD:
        return f"{holds}, and goes on holding: it may not act alone"
    alone = f"{holds}, alone at {to_s(rover.alone_after_ns):g} s"
    if telemetry is None:
        return alone
    if not telemetry.alone_goals:
        return f"{holds}, and goes on holding: it has no goal"
    return f"{alone}: goes to {and_then(telemetry.alone_goals)}"
