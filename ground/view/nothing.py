"""What happens if the operator does nothing: one sentence, true whatever is so."""

from collections.abc import Iterator, Sequence

from farside.control import Failsafe, Mode
from farside.ground.prediction import OnItsWay
from farside.ground.view.knowledge import Knowledge, and_then, sign_words
from farside.ground.view.view import FailsafeOutlook, KnownGoal
from farside.messages import TakeBack, Tokens, Veto
from farside.node import to_s
from farside.places import BATTERY_LOW, ON_CHARGE
from farside.topics import PathReview

_LISTED = 6  # commands told one by one


def if_nothing(
    known: Knowledge,
    failsafe: FailsafeOutlook,
    goals: Sequence[KnownGoal],
    way: PathReview | None,
) -> str:
    """What happens if the operator does nothing.

    Args:
        known: what is known.
        failsafe: the outlook on the failsafe.
        goals: the goals, the top-goal first, after all that is on its way.
        way: the way to the first of them that is not put aside; `None` where it is not known.
    """
    said = f"the rover {_course(known, failsafe, goals, way)}"
    silence = known.sources.silence
    if silence.state.silent:
        said = (
            f"nothing is heard, though it should be: if the rover hears nothing either, it "
            f"{_alone(known, failsafe)}; if it does hear, it {said.removeprefix('the rover ')}"
        )
    elif known.telemetry is None:
        said = f"nothing has been heard of the rover yet: it {said.removeprefix('the rover ')}"
    elif silence.state.expected:
        said = f"nothing is heard, as planned: {said}"
    held = sum(len(one.acts) for one in known.sources.desk.held.values())
    if held:
        orders = "the order" if held == 1 else f"the {held} orders"
        said = f"{said}; {orders} held here will be sent once the link is up"
    return said


def _alone(known: Knowledge, failsafe: FailsafeOutlook) -> str:
    """What the rover does if it does not hear the ground."""
    if failsafe.alone_ns is None:
        return "goes on by itself" if known.failsafe is Failsafe.ALONE else "stands"
    left_ns = failsafe.alone_ns - known.now_ns
    goals = () if known.telemetry is None else known.telemetry.alone_goals
    where = f"goes to {and_then(goals)} by itself" if goals else "goes to its goals by itself"
    if left_ns <= 0:
        return f"may be alone by now, and {where}"
    return f"holds, and in {to_s(left_ns):.0f} s at the earliest {where}"


def _course(
    known: Knowledge,
    failsafe: FailsafeOutlook,
    goals: Sequence[KnownGoal],
    way: PathReview | None,
) -> str:
    """What the rover does, as phrases that follow on "the rover"."""
    if known.is_flat:
        return "stands: its battery is flat"
    match known.failsafe:
        case Failsafe.SAFE if not known.is_stuck or not known.coming:
            return f"stands: {known.cause or 'something is wrong with it'}"
        case Failsafe.ALONE:
            listed = () if known.telemetry is None else known.telemetry.goals
            where = f"goes on to {and_then(listed)}" if listed else "goes on"
            return f"has lost the link, and {where} by itself"
        case Failsafe.HOLD if failsafe.alone_ns is not None and known.cause:
            if not known.coming and known.standing is None:
                return f"stands: {known.cause}"
    return ", then ".join([*_before(known), _last(known, goals, way)])


def _before(known: Knowledge) -> Iterator[str]:
    """What is settled already: the move under way, and the commands on their way."""
    telemetry = known.telemetry
    if telemetry is not None and telemetry.action is not None and telemetry.begun is None:
        yield f"ends its move {telemetry.action}"
    # What has expired by now has begun, or never will.
    ahead = [one for one in known.coming if one.command.expires_ns >= known.now_ns]
    back = {order.number: number for number, order in _take_backs(ahead)}
    orders = [
        _named(one, back.get(one.command.number))
        for one in ahead
        if not one.lapses and not isinstance(one.command.order, TakeBack)
    ]
    if len(orders) == 1:
        yield f"carries out command {orders[0]}"
    elif len(orders) > _LISTED:
        yield f"carries out {len(orders)} commands, {orders[0]} to {orders[-1]}"
    elif orders:
        yield f"carries out commands {', '.join(orders[:-1])} and {orders[-1]}"
    lapsing = [one.command.number for one in ahead if one.lapses]
    if len(lapsing) == 1:
        yield f"lets command {lapsing[0]} expire before its turn"
    elif lapsing:
        yield f"lets {len(lapsing)} commands from {lapsing[0]} on expire before their turn"
    if telemetry is not None and {ON_CHARGE, BATTERY_LOW} <= set(telemetry.tokens):
        yield "charges"


def _take_backs(ahead: Sequence[OnItsWay]) -> Iterator[tuple[int, TakeBack]]:
    for one in ahead:
        if isinstance(one.command.order, TakeBack):
            yield one.command.number, one.command.order


def _named(one: OnItsWay, taken_back_by: int | None) -> str:
    """A command by its number, and what may become of it."""
    unless = "" if taken_back_by is None else f"unless {taken_back_by} takes it back in time"
    said = "; ".join(filter(None, [one.action, unless]))
    return f"{one.command.number} ({said})" if said else f"{one.command.number}"


def _last(known: Knowledge, goals: Sequence[KnownGoal], way: PathReview | None) -> str:
    wanted = [
        goal.tokens
        for goal in goals
        if goal.aside is None and not goal.is_withdrawn and not goal.is_met
    ]
    # Whatever is proposed ends when a command arrives.
    if known.standing is not None and not known.coming:
        return _consent(known)
    if known.failsafe is Failsafe.HOLD:
        return f"stands: {known.cause or 'nothing is heard on board'}"
    match known.mode_then:
        case Mode.GUIDED:
            return "stands and waits for your orders"
        case Mode.SHARED:
            return _shared(known, goals, wanted, way)
        case Mode.AUTONOMOUS:
            return _autonomous(known, goals, wanted, way)


def _consent(known: Knowledge) -> str:
    proposal, acts_ns = known.standing, known.acts_ns
    if proposal is None or acts_ns is None:
        return "stands and waits for your word"
    left_ns = acts_ns - known.now_ns
    if left_ns <= 0:
        return f"goes {proposal.action}: the veto window is over"
    return f"goes {proposal.action} in {to_s(left_ns):.1f} s at the earliest"


def _shared(
    known: Knowledge,
    goals: Sequence[KnownGoal],
    wanted: Sequence[Tokens],
    way: PathReview | None,
) -> str:
    if not wanted:
        return _at_rest(goals)
    if known.answer is not None and isinstance(known.answer.command.order, Veto):
        return "stands, and proposes nothing more from here"
    telemetry = known.telemetry
    settled = telemetry is not None and telemetry.mode is Mode.SHARED and telemetry.action is None
    if (settled and not known.coming) or known.sources.silence.state.expected:
        return "stands, and proposes nothing now"
    if way is None:
        return "stands, unless it knows a way to propose"
    return f"proposes its next step to {sign_words(way.goal)}{_for_consent(known)}"


def _for_consent(known: Knowledge) -> str:
    """What a proposal waits for, as the last one said; nothing where there was none."""
    proposal = known.sources.belief.proposal
    if proposal is None:
        return ""
    if proposal.veto_window_s is None:
        return " and waits for your word"
    return ", and takes it unless you veto in time"


def _at_rest(goals: Sequence[KnownGoal]) -> str:
    aside = next((goal for goal in goals if goal.aside is not None and not goal.is_withdrawn), None)
    if aside is not None:
        return f"stands: it cannot pursue {sign_words(aside.tokens)}, as {aside.aside}"
    return "stands: it has no goal"


def _autonomous(
    known: Knowledge,
    goals: Sequence[KnownGoal],
    wanted: Sequence[Tokens],
    way: PathReview | None,
) -> str:
    if not wanted and not known.sources.rover.explores:
        return _at_rest(goals)
    if wanted and (way is not None or known.sources.shadow is None):
        return f"goes on to {and_then(wanted)} by itself"
    left = wanted or [goal.tokens for goal in goals if not goal.is_withdrawn]
    if not left:
        return _at_rest(goals)
    top = sign_words(left[0])
    if known.sources.rover.explores:
        return f"explores by itself, as no way to {top} is known"
    return f"stands, unless it knows a way to {top}"
