"""A run as lines of text: one for each log entry that is an event worth reading."""

from typing import Any, NamedTuple

from farside.control import BatteryState, CommandStage, Failsafe, Verdict
from farside.frames import LinkOutage, OutageReason
from farside.logs.file.reading import LogEntry
from farside.messages import (
    Approve,
    BatteryChanged,
    CommandForced,
    CommandReached,
    CommandsMissing,
    Drive,
    Event,
    FailsafeChanged,
    GoalAside,
    GoalReached,
    Happening,
    LinkBack,
    ModeChanged,
    Order,
    Override,
    SetGoal,
    SetMode,
    SetOnLoss,
    StuckChanged,
    TakeBack,
    Tokens,
    Veto,
    When,
    WithdrawGoal,
)
from farside.node import Direction, Role, Topic, to_s
from farside.topics import (
    GROUND_COMMAND,
    GROUND_EVENT,
    GROUND_HELD,
    GROUND_LIFE,
    GROUND_OPERATOR,
    GROUND_REVIEW,
    GROUND_SHADOW,
    GROUND_SILENCE,
    LINK_OUTAGE,
    ROVER_ACTION_ENDED,
    ROVER_BATTERY,
    ROVER_COMMAND,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_STUCK,
    ActionEnded,
    Answer,
    BatteryEntry,
    CommandEntry,
    CommandSent,
    EventLearned,
    FailsafeEntry,
    GoalChange,
    GoalEntry,
    HeldEntry,
    HeldFate,
    LifeEntry,
    ModeEntry,
    OperatorEntry,
    Review,
    ShadowEntry,
    Silence,
    StuckEntry,
)
from farside.validation import one_line

_LINE_LENGTH = 400


class EventLine(NamedTuple):
    """One event of a run; see `event_line` for what its text holds.

    Attributes:
        t_ns: its log time.
        role: the role that recorded it.
        text: what happened.
        routine: whether it is one of many alike, such as a step of a tour; displays may dim it.
    """

    t_ns: int
    role: Role
    text: str
    routine: bool = False


EVENT_TOPICS: tuple[Topic[Any], ...] = (
    ROVER_MODE,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_COMMAND,
    ROVER_ACTION_ENDED,
    ROVER_BATTERY,
    ROVER_STUCK,
    LINK_OUTAGE,
    GROUND_COMMAND,
    GROUND_EVENT,
    GROUND_HELD,
    GROUND_LIFE,
    GROUND_OPERATOR,
    GROUND_REVIEW,
    GROUND_SHADOW,
    GROUND_SILENCE,
)
"""The topics with event lines; see `event_line`."""


HAPPENED = {
    CommandStage.TAKEN: "arrived",
    CommandStage.BEGUN: "began",
    CommandStage.DONE: "done",
}
"""What is said of a command that came to a stage."""

MISSED = {
    CommandStage.TAKEN: "should have arrived",
    CommandStage.BEGUN: "should have begun",
    CommandStage.DONE: "should have been done",
}
"""What is said of a command that is not heard to have come to a stage."""


def time_text(t_ns: int) -> str:
    """Simulated time in seconds, as mission files and `--start` take it: tenths, `754.5 s`."""
    seconds, tenths = divmod(t_ns // 100_000_000, 10)
    return f"{seconds}.{tenths} s"


def sign_text(sign: Tokens) -> str:
    """A Sign for people: its Tokens joined by plus signs, such as `at:D + on_charge`."""
    return one_line(" + ".join(sign), _LINE_LENGTH)


def event_line(entry: LogEntry) -> EventLine | None:
    """The line for a log entry; `None` for measurements and for what another line already says.

    Its text is fit for a terminal, whatever the log holds, and cut after `_LINE_LENGTH` characters.
    """
    line = _line(entry)
    return line and line._replace(text=one_line(line.text, _LINE_LENGTH))


def _line(entry: LogEntry) -> EventLine | None:
    t_ns = entry.log_time_ns
    match entry.message:
        case ModeEntry(mode=mode, why=why):
            return EventLine(t_ns, Role.ROVER, f"mode {mode}: {why}")
        case FailsafeEntry(state=state, why=why, silence_s=silence_s):
            return EventLine(t_ns, Role.ROVER, _failsafe(state, why, silence_s))
        case GoalEntry() as goal:
            return EventLine(t_ns, Role.ROVER, _goal(goal))
        case CommandEntry(stage=stage, why=str()) as command:
            routine = stage is CommandStage.FAILED  # the blocked move has a line of its own
            return EventLine(t_ns, Role.ROVER, _command(command), routine)
        case _:
            return _condition_line(entry) or _link_or_ground_line(entry) or _known_line(entry)


def _condition_line(entry: LogEntry) -> EventLine | None:
    t_ns = entry.log_time_ns
    match entry.message:
        case ActionEnded(action=action, duration_s=duration_s, blocked=True):
            text = f"{action} was blocked after {duration_s:.1f} s"
            return EventLine(t_ns, Role.ROVER, text, routine=True)
        case BatteryEntry(state=battery, charge=charge):
            return EventLine(t_ns, Role.ROVER, _battery(battery, charge))
        case StuckEntry(stuck=stuck, moves=moves) if stuck or t_ns > 0:
            return EventLine(t_ns, Role.ROVER, _stuck(stuck=stuck, moves=moves))
        case _:
            return None


OUTAGES = {
    OutageReason.BLACKOUT: "blackout",
    OutageReason.PASS: "gap between passes",
    OutageReason.CONTACT: "gap between contacts",
    OutageReason.CONJUNCTION: "solar conjunction",
    OutageReason.CONTROL: "manual outage",
}
"""What an outage is called."""


def _link_or_ground_line(entry: LogEntry) -> EventLine | None:
    t_ns = entry.log_time_ns
    match entry.message:
        case LinkOutage(direction=direction, down=down, reason=reason):
            way = "uplink" if direction is Direction.UP else "downlink"
            text = f"{way}: {OUTAGES[reason]} {'begins' if down else 'ends'}"
            return EventLine(t_ns, Role.LINK, text)
        case CommandSent(number=number, order=order, when=when):
            text = f"command {number}: {order_text(order)}{when_text(when)}"
            routine = isinstance(order, Approve) or (isinstance(order, Drive) and not order.force)
            return EventLine(t_ns, Role.GROUND, text, routine)
        case EventLearned(event=Event(what=CommandReached(why=None))):
            return None  # of one that is done, or begins, the order and the move say enough
        case EventLearned(event=event):
            text = f"learns of {time_text(event.time_ns)}: {happening_text(event.what)}"
            return EventLine(t_ns, Role.GROUND, text)
        case Silence(silent=silent, expected=expected):
            text = "hears nothing from the rover" if silent or expected else "hears the rover"
            text += ", as planned" if expected else ""
            return EventLine(t_ns, Role.GROUND, text)
        case _:
            return None


def _known_line(entry: LogEntry) -> EventLine | None:
    """The line for what the ground concludes from what it heard, or did not hear."""
    match entry.message:
        case LifeEntry() as life:
            text = _verdict(life)
        case HeldEntry() as held:
            text = _held(held)
        case ShadowEntry(in_step=in_step, why=why):
            text = "the shadow of the model is in step"
            if not in_step:
                text = f"the shadow of the model is out of step: {why}"
        case Review(review=review) as answered if review.conflicts:
            text = _review(answered)
        case OperatorEntry(left=(*_, left)):
            text = f"gives up {left}"
        case _:
            return None
    return EventLine(entry.log_time_ns, Role.GROUND, text) if text else None


def _verdict(life: LifeEntry) -> str:
    stage, due_ns, so_ns = life.stage, life.due_ns, life.so_ns
    if stage is None or due_ns is None:
        return ""
    happened = f"command {life.number} {HAPPENED.get(stage, stage)}"
    match life.verdict:
        case Verdict.ON_TIME:
            return f"{happened} on time after all"
        case Verdict.LATE if so_ns is not None:
            late_s = to_s(so_ns - due_ns)
            by = f"{late_s:.1f} s" if late_s >= 0.1 else "less than 0.1 s"
            return f"{happened} late, {by} after it was due"
        case Verdict.OVERDUE:
            missed = MISSED.get(stage, str(stage))
            return f"command {life.number} overdue: {missed} by {time_text(due_ns)}, no word"
        case _:
            return ""


def _held(held: HeldEntry) -> str:
    orders = ", then ".join(map(order_text, held.orders))
    match held.fate:
        case HeldFate.HELD:
            text = f"holds until the link is up: {orders}"
        case HeldFate.RELEASED:
            numbers = ", ".join(map(str, held.commands))
            plural = "s" if len(held.commands) != 1 else ""
            text = f"sends what it held, as command{plural} {numbers}: {orders}"
        case HeldFate.GIVEN_UP:
            text = f"gives up what it held: {orders}"
    return text


_ANSWERS = {
    Answer.APPROVED: "approves proposal {} ({}), although",
    Answer.OVERRIDDEN: "overrides proposal {} ({}):",
    Answer.VETOED: "vetoes proposal {} ({}):",
}


def _review(review: Review) -> str:
    answer = _ANSWERS[review.answer].format(review.proposal, review.action)
    return f"{answer} {'; '.join(review.review.conflicts)}"


def _failsafe(state: Failsafe, why: str, silence_s: float) -> str:
    text = f"failsafe {state}: {why}"
    if state in {Failsafe.HOLD, Failsafe.ALONE} and silence_s >= 1:
        text += f", after {silence_s:.1f} s of silence"
    return text


def _command(entry: CommandEntry) -> str:
    text = f"command {entry.number} ({order_text(entry.order)})"
    if entry.stage is CommandStage.BEGUN:
        return f"{text} begins although {entry.why}, as the operator insists"
    return f"{text} {entry.stage}: {entry.why}"


def _battery(state: BatteryState, charge: float) -> str:
    if state is BatteryState.FLAT:
        return "battery flat: the rover cannot move"
    return f"battery {state}, {charge:.0%}"


def _stuck(*, stuck: bool, moves: int) -> str:
    if stuck:
        return f"stuck: the last {moves} moves were blocked"
    return "moves again"


def _goal(goal: GoalEntry) -> str:
    text = f"goal {sign_text(goal.tokens)} {goal.change}"
    if goal.change is GoalChange.SET:
        text += f" ({goal.source}, priority {goal.priority:.3g})"
    if goal.why is not None:
        text += f": {goal.why}"
    return text


def order_text(order: Order) -> str:
    """An order for people, such as `drive N` or `approve proposal 14`."""
    match order:
        case Drive(action=action, force=force):
            text = f"drive {action}{_forced(force=force)}"
        case Approve(proposal=proposal):
            text = f"approve proposal {proposal}"
        case Override(proposal=proposal, action=action, force=force):
            text = f"override proposal {proposal} with {action}{_forced(force=force)}"
        case Veto(proposal=proposal):
            text = f"veto proposal {proposal}"
        case TakeBack(number=number):
            text = f"take back command {number}"
        case SetOnLoss(on_loss=on_loss):
            text = f"{on_loss} on loss of the link"
        case SetMode(mode=mode):
            text = f"mode {mode}"
        case SetGoal(tokens=tokens, priority=priority):
            worth = "none" if priority is None else f"{priority:.3g}"
            text = f"goal {sign_text(tokens)}, priority {worth}"
        case WithdrawGoal(tokens=tokens):
            text = f"withdraw goal {sign_text(tokens)}"
    return text


def when_text(when: When | None) -> str:
    """What a command waits for on board, to follow its order; nothing if it waits for nothing."""
    text = ""
    if when is not None and when.after is not None:
        text += f", after command {when.after}"
    if when is not None and when.at_ns is not None:
        text += f", not before {time_text(when.at_ns)}"
    return text


def _forced(*, force: bool) -> str:
    return ", forced" if force else ""


def happening_text(what: Happening) -> str:
    """What happened on board, for people, such as `goal at:A reached`; not yet fit for a line."""
    match what:
        case ModeChanged(mode=mode, why=why):
            text = f"mode {mode}: {why}"
        case FailsafeChanged(state=state, why=reason, silence_ns=silence_ns):
            text = _failsafe(state, reason, to_s(silence_ns))
        case LinkBack():
            text = _link_back(what)
        case GoalReached(tokens=tokens):
            text = f"goal {sign_text(tokens)} reached"
        case GoalAside(tokens=tokens, why=aside):
            text = f"goal {sign_text(tokens)} "
            text += "taken up again" if aside is None else f"put aside: {aside}"
        case BatteryChanged(state=battery, charge=charge):
            text = _battery(battery, charge)
        case StuckChanged(stuck=stuck, moves=moves):
            text = _stuck(stuck=stuck, moves=moves)
        case _:
            text = _of_commands(what)
    return text


def _of_commands(what: CommandReached | CommandForced | CommandsMissing) -> str:
    match what:
        case CommandReached(number=number, stage=stage, why=reason):
            return f"command {number} {stage}: {reason}"
        case CommandForced(number=number, why=reason):
            return f"command {number} begins although {reason}, as the operator insists"
        case CommandsMissing(missing=missing, last=last):
            if missing:
                return f"commands up to {last} do not arrive, though the ground is heard"
            return f"commands up to {last} have arrived after all"


def _link_back(what: LinkBack) -> str:
    """What the rover did while the link was lost."""
    text = f"the link is back after {to_s(what.silence_ns):.1f} s; meanwhile "
    text += {0: "no moves", 1: "1 move"}.get(what.moves, f"{what.moves} moves")
    if what.bumps:
        text += f" ({what.bumps} blocked)"
    if what.reached:
        text += f", and reached {', '.join(map(sign_text, what.reached))}"
    return text
