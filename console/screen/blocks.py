"""The blocks beside the map: the rover, its model, its goals, its failsafe and the link."""

import math
from collections.abc import Iterator

from farside.console.screen.mapping import place_text
from farside.console.screen.screen import GoalRow, Said, Tone
from farside.console.wording import percent, span_text
from farside.control import BatteryState, Failsafe, Mode, Signal
from farside.ground.view.view import GroundView, KnownGoal, Way
from farside.logs.picture import Picture
from farside.node import NEVER_NS, to_ns
from farside.places import BATTERY_LOW
from farside.topics import BeliefItem

_LATE_NS = 2_000_000_000  # the standing second of telemetry, and as much again
_SURPRISED = 0.3
_LASTING_S = 10_800.0  # three hours: a battery that lasts longer is no matter yet (project default)
_SOON_NS = 600_000_000_000  # ten minutes: for a way home (project default)


def is_stale(picture: Picture, item: BeliefItem) -> bool:
    """Whether something newer of an item was due."""
    return picture.belief is not None and item in picture.belief.stale


def mode_of(picture: Picture) -> Mode | None:
    """The mode as last heard."""
    return picture.mode


def mode_said(picture: Picture) -> Said:
    """The mode in capitals, as last heard."""
    mode = mode_of(picture)
    tone = Tone.CAUTION if picture.failsafe not in {None, Failsafe.NOMINAL} else Tone.PLAIN
    text = "NOT HEARD YET" if mode is None else mode.upper()
    return Said("mode", text, tone, is_stale(picture, BeliefItem.MODE))


def rover_said(picture: Picture, view: GroundView) -> tuple[Said, ...]:
    """Where it is, its charge, what it does, its radio: as of the telemetry, whose age is told."""
    return tuple(_rover(picture, view))


def _rover(picture: Picture, view: GroundView) -> Iterator[Said]:
    heard = picture.telemetry
    if heard is None:
        yield Said("", "nothing heard yet", Tone.CAUTION)
        return
    place = place_text(heard.tokens) if heard.tokens else "place not known"
    lost = not any(token.startswith("at:") for token in heard.tokens)
    yield Said("at", place, Tone.WRONG if lost else Tone.PLAIN, is_stale(picture, BeliefItem.PLACE))
    low = BATTERY_LOW in heard.tokens
    battery = percent(heard.battery) + (f", {BatteryState.LOW}" if low else "")
    if view.rest_s is not None and view.rest_s < _LASTING_S:
        battery += f", {span_text(to_ns(view.rest_s))} at rest"
    tone = Tone.CAUTION if low or _runs_out(view) else Tone.PLAIN
    yield Said("battery", battery, tone, is_stale(picture, BeliefItem.BATTERY))
    doing = "standing" if heard.action is None else f"going {heard.action}"
    since = span_text(heard.time_ns - heard.since_ns)
    yield Said("action", f"{doing} for {since}", stale=is_stale(picture, BeliefItem.ACTION))
    tilt = "level" if heard.tilt_rad is None else f"{math.degrees(heard.tilt_rad):.0f}°"
    tone = Tone.PLAIN if heard.tilt_rad is None else Tone.CAUTION
    yield Said("tilt", tilt, tone, is_stale(picture, BeliefItem.POSE))
    if heard.signal is not Signal.STRONG:
        tone = Tone.WRONG if heard.signal is Signal.NONE else Tone.CAUTION
        yield Said("signal", str(heard.signal), tone, is_stale(picture, BeliefItem.SIGNAL))
    age_ns = view.now_ns - heard.time_ns
    late = age_ns > view.down.light_ns + _LATE_NS and not view.silence_expected
    tone = Tone.CAUTION if late else Tone.PLAIN
    yield Said("telemetry", f"{span_text(age_ns)} old", tone, is_stale(picture, BeliefItem.POSE))


def _runs_out(view: GroundView) -> bool:
    """Whether a rover that stands is out of charge before an order can reach it again, or soon."""
    if view.rest_s is None:
        return False
    open_ns = view.now_ns if view.up.is_open else view.up.changes_ns or NEVER_NS
    return view.now_ns + to_ns(view.rest_s) < open_ns + view.up.light_ns + _SOON_NS


def model_said(picture: Picture, view: GroundView) -> tuple[Said, ...]:
    """The shadow of the model on board: its size, whether it is in step, how it is surprised."""
    shadow = picture.shadow
    if shadow is None:
        return (Said("", "no word of the model yet"),)
    said = [Said("", f"{shadow.signs} Signs"), Said("", f"{shadow.hypotheses} hypotheses")]
    if shadow.in_step:
        said.append(Said("", "in step"))
    else:
        said.append(Said("", f"out of step: {shadow.why}", Tone.CAUTION))
    if view.cm is not None:
        said.append(Said("mean C_m", f"{view.cm:.2f}"))
    if view.surprises is not None:
        tone = Tone.CAUTION if view.surprises > _SURPRISED else Tone.PLAIN
        said.append(Said("surprised", f"{percent(view.surprises)} of late", tone))
    return tuple(said)


def goal_rows(view: GroundView) -> tuple[GoalRow, ...]:
    """The goals, the top-goal first."""
    return tuple(GoalRow(goal.tokens, *_goal(goal)) for goal in view.goals)


def _goal(goal: KnownGoal) -> tuple[str, Tone]:
    worth = "" if goal.priority is None else f" {goal.priority:.3g}"
    text = f"{place_text(goal.tokens)}{worth} ({goal.source})"
    if goal.is_sent:
        text += ", on its way"
    if goal.aside is not None:
        return f"{text}, put aside: {goal.aside}", Tone.CAUTION
    return text, Tone.PLAIN


def failsafe_said(picture: Picture, view: GroundView) -> tuple[Said, ...]:
    """The failsafe: its state, its countdown as the ground can know it, and what it does then."""
    return tuple(_failsafe(picture, view))


def _failsafe(picture: Picture, view: GroundView) -> Iterator[Said]:
    known, now_ns = view.failsafe, view.now_ns
    if known.state is None:
        yield Said("", "not heard yet")
    else:
        tones = {Failsafe.NOMINAL: Tone.PLAIN, Failsafe.HOLD: Tone.CAUTION}
        text = str(known.state) + (f": {known.cause}" if known.cause else "")
        tone = tones.get(known.state, Tone.WRONG)
        yield Said("", text, tone, is_stale(picture, BeliefItem.FAILSAFE))
    coming = [
        f"{name} in {span_text(at_ns - now_ns)}" if at_ns > now_ns else f"may be {name} by now"
        for name, at_ns in (("on hold", known.holds_ns), ("alone", known.alone_ns))
        if at_ns is not None
    ]
    if coming:
        tone = Tone.PLAIN if view.silent_since_ns is None else Tone.CAUTION
        yield Said("if it hears nothing more", ", ".join(coming), tone)
    if known.will:
        yield Said("", known.will)


def link_said(view: GroundView) -> tuple[Said, ...]:
    """The link: contact, rate, and what waits; the status strip has light time and silence."""
    return tuple(_link(view))


def _link(view: GroundView) -> Iterator[Said]:
    for name, way in (("up", view.up), ("down", view.down)):
        yield Said(name, _way(way, view.now_ns), Tone.PLAIN if way.is_open else Tone.CAUTION)
    if view.up.queued_until_ns > view.now_ns:
        yield Said("sending", f"for {span_text(view.up.queued_until_ns - view.now_ns)} more")
    if view.missing_s >= 1:
        text = f"{view.missing_s:.0f} s of telemetry not here yet"
        yield Said("rover's store", text, Tone.CAUTION)


def status_said(picture: Picture, view: GroundView) -> tuple[Said, ...]:
    """The status strip: the light time, when it was heard, the contact, what is overdue."""
    return tuple(_status(picture, view))


def _status(picture: Picture, view: GroundView) -> Iterator[Said]:
    yield Said("link", f"{light_text(view)} of light")
    yield silence_said(view)
    if view.up.changes_ns is not None:
        yield next(said for said in link_said(view) if said.name == "up")
    overdue = picture.commands.overdue
    if overdue:
        yield Said("overdue", f"{overdue} without word", Tone.WRONG)


def light_text(view: GroundView) -> str:
    """The light time: `1.28 s`, or of both directions where they differ."""
    up, down = (f"{way.light_ns / 1e9:.2f} s" for way in (view.up, view.down))
    return up if up == down else f"{up} up, {down} down"


def _way(way: Way, now_ns: int) -> str:
    text = "open" if way.is_open else "closed by plan"
    if way.changes_ns is not None and way.changes_ns < NEVER_NS:
        then = "closes" if way.is_open else "opens"
        text += f", {then} in {span_text(way.changes_ns - now_ns)}"
    return f"{text}, {percent(min(1.0, way.used))} used" if way.is_open else text


def silence_said(view: GroundView) -> Said:
    """When the rover was heard, or for how long it has been silent, expected or not."""
    now_ns = view.now_ns
    if view.silent_since_ns is not None:
        text = f"unexpected, for {span_text(now_ns - view.silent_since_ns)}"
        return Said("silence", text, Tone.WRONG)
    if view.silence_expected:
        text = "expected"
        if view.due_ns < NEVER_NS:
            text += f", word due in {span_text(view.due_ns - now_ns)}"
        return Said("silence", text)
    if not view.heard_ns:
        return Said("heard", "not yet")
    return Said("heard", f"{span_text(now_ns - view.heard_ns)} ago")
