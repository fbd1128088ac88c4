"""Looking at a moment from the ground: what a person there can know, made from what is known.

It only reads. However often somebody looks, nothing that happens is another thing for it.
"""

from farside.ground.commands.timing import Timing
from farside.ground.view.failsafe import failsafe_outlook
from farside.ground.view.goals import known_goals
from farside.ground.view.knowledge import Knowledge, Sources
from farside.ground.view.nothing import if_nothing
from farside.ground.view.options import options
from farside.ground.view.view import Focus, GroundView, KnownGoal, PlaceCost, Way
from farside.messages import Tokens
from farside.node import NEVER_NS, NS_PER_S, Direction, to_s
from farside.places import ON_CHARGE, is_place_token

_GAP = 3  # usual intervals, and a margin: what is lost by chance is not missed
_GAP_MARGIN_NS = 5 * NS_PER_S
_LATELY_NS = 300 * NS_PER_S


def look(sources: Sources, focus: Focus, now_ns: int, queued_until_ns: int) -> GroundView:
    """What can be known at a moment.

    Args:
        sources: what the ground holds.
        focus: what the person looks at.
        now_ns: the present.
        queued_until_ns: until when the ground's transmitter sends what it was given so far.
    """
    known = Knowledge(sources, now_ns)
    goals = known_goals(known)
    failsafe = failsafe_outlook(known)
    top = _top(goals)
    wanted = focus.goal or top
    outlook, silence, start = sources.outlook, sources.silence, known.start
    path = None if wanted is None else outlook.review_path_from(start, wanted, now_ns)
    way = path
    if top != wanted:
        way = None if top is None else outlook.review_path_from(start, top, now_ns)
    standing, telemetry = known.standing, known.telemetry
    return GroundView(
        now_ns=now_ns,
        up=_up(known, queued_until_ns),
        down=_down(known),
        heard_ns=sources.belief.heard_ns,
        due_ns=silence.due_ns,
        failsafe=failsafe,
        if_nothing=if_nothing(known, failsafe, goals, way),
        silent_since_ns=silence.since_ns,
        silence_expected=silence.state.expected,
        missing_s=_missing_s(known),
        start=() if start is None else start.likely,
        start_unknown=1.0 if start is None else start.unknown,
        options=options(known),
        after=known.after,
        predicted=known.predicted,
        review=None if standing is None else outlook.review(standing, now_ns),
        veto_until_ns=_veto_until_ns(known, queued_until_ns),
        path=path,
        heat=_heat(known, wanted) if focus.heat and wanted is not None else (),
        goals=goals,
        alone_goals=() if telemetry is None else telemetry.alone_goals,
        rest_s=_rest_s(known),
        surprises=_surprises(known),
        cm=_cm(known),
    )


def _top(goals: tuple[KnownGoal, ...]) -> Tokens | None:
    for goal in goals:
        if goal.aside is None and not goal.is_withdrawn and not goal.is_met:
            return goal.tokens
    return None


# --- the link ----------------------------------------------------------------------------------


def _up(known: Knowledge, queued_until_ns: int) -> Way:
    schedule, now_ns = known.sources.schedule, known.now_ns
    opens_ns = schedule.opens_ns(Direction.UP, now_ns)
    changes_ns = opens_ns if opens_ns > now_ns else schedule.closes_ns(Direction.UP, now_ns)
    return Way(
        light_ns=schedule.delay_ns(Direction.UP, now_ns),
        is_open=opens_ns == now_ns,
        changes_ns=None if changes_ns >= NEVER_NS else changes_ns,
        used=known.sources.memory.used(Direction.UP, now_ns),
        queued_until_ns=queued_until_ns,
    )


def _down(known: Knowledge) -> Way:
    schedule, now_ns = known.sources.schedule, known.now_ns
    sent_ns = schedule.sent_by_ns(Direction.DOWN, now_ns)
    opens_ns = schedule.opens_ns(Direction.DOWN, sent_ns)
    changes_ns = opens_ns if opens_ns > sent_ns else schedule.closes_ns(Direction.DOWN, sent_ns)
    is_last = changes_ns >= NEVER_NS
    return Way(
        light_ns=now_ns - sent_ns,
        is_open=schedule.is_heard(Direction.DOWN, now_ns),
        changes_ns=None if is_last else changes_ns + schedule.delay_ns(Direction.DOWN, changes_ns),
        used=known.sources.memory.used(Direction.DOWN, now_ns),
        queued_until_ns=now_ns,
    )


def _missing_s(known: Knowledge) -> float:
    telemetry = known.telemetry
    if telemetry is None:
        return 0.0
    belief, schedule, now_ns = known.sources.belief, known.sources.schedule, known.now_ns
    interval_ns = known.sources.plan.interval_ns(now_ns)
    usual_ns = _GAP * interval_ns + _GAP_MARGIN_NS
    newest_ns = schedule.sent_by_ns(Direction.DOWN, now_ns)  # that can be known
    gaps = [*belief.gaps(usual_ns), (telemetry.time_ns, newest_ns)]
    return sum(
        to_s(after_ns - before_ns - interval_ns)
        for before_ns, after_ns in gaps
        if after_ns - before_ns > usual_ns
    )


def _veto_until_ns(known: Knowledge, queued_until_ns: int) -> int | None:
    """The last moment at which a veto that is sent still arrives in time, with its margin."""
    acts_ns = known.acts_ns
    if acts_ns is None:
        return None
    timing, now_ns = Timing(known.sources.schedule), known.now_ns
    ready_ns = max(now_ns, queued_until_ns)
    until_ns = timing.withdraw_until_ns(ready_ns, acts_ns)
    if until_ns is not None:
        return until_ns
    # Too late already: by as much as it would arrive too late.
    return now_ns - (timing.withdrawn_ns(ready_ns) - acts_ns)


def _rest_s(known: Knowledge) -> float | None:
    """As if it had stood since it was heard."""
    telemetry, energy = known.telemetry, known.sources.rover.energy
    if telemetry is None or ON_CHARGE in telemetry.tokens or energy.idle_w <= 0:
        return None
    left_j = telemetry.battery * energy.capacity_j
    return max(0.0, left_j / energy.idle_w - to_s(known.now_ns - telemetry.time_ns))


# --- the model ---------------------------------------------------------------------------------


def _heat(known: Knowledge, goal: Tokens) -> tuple[PlaceCost, ...]:
    shadow = known.sources.shadow
    if shadow is None:
        return ()
    return tuple(
        PlaceCost(sign[0], cost)
        for sign, cost in shadow.model.costs_to(goal)
        if len(sign) == 1 and is_place_token(sign[0])
    )


def _surprises(known: Knowledge) -> float | None:
    shadow = known.sources.shadow
    if shadow is None:
        return None
    since_ns = known.now_ns - _LATELY_NS
    judged = [one.is_true for one in shadow.judged if one.by_ns >= since_ns]
    return 1 - sum(judged) / len(judged) if judged else None


def _cm(known: Knowledge) -> float | None:
    shadow = known.sources.shadow
    if shadow is None or not shadow.model.hypothesis_count:
        return None
    return shadow.model.mean_cm
