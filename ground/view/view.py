"""A view of a moment at the ground: what a person there can know and the log does not spell out."""

from enum import StrEnum

import msgspec

from farside.control import Failsafe
from farside.messages import Tokens
from farside.topics import Likely, PathReview, Prediction


class Focus(msgspec.Struct, frozen=True, omit_defaults=True):
    """What a person looks at now, and a view is to answer.

    Attributes:
        goal: the goal whose policy path is wanted; `None` for the top-goal.
        heat: whether the cost to go from every known place to that goal is wanted.
    """

    goal: Tokens | None = None
    heat: bool = False


class OptionKind(StrEnum):
    """What the ground finds of an action that could be ordered now.

    Attributes:
        FREE: nothing speaks against it.
        PROPOSED: it is what the model on board proposes.
        PROBLEMATIC: it can be done, and something speaks against it.
        INVALID: the chart has a wall there, the rover met one, or the safety gate refuses it.
    """

    FREE = "free"
    PROPOSED = "proposed"
    PROBLEMATIC = "problematic"
    INVALID = "invalid"


class Option(msgspec.Struct, frozen=True, omit_defaults=True):
    """An action that could be ordered now, by the shadow of the model.

    Attributes:
        action: the action.
        kind: what the ground finds of it.
        severity: how much speaks against it, from 0 (nothing) to 1.
        why: what speaks against it, or for it, in words; the weightiest first.
        likely: the Signs of places that it may lead to from where it would begin, the most probable
            first.
        unknown: the probability that it leads anywhere else.
    """

    action: str
    kind: OptionKind
    severity: float = 0.0
    why: tuple[str, ...] = ()
    likely: tuple[Likely, ...] = ()
    unknown: float = 1.0


class Way(msgspec.Struct, frozen=True):
    """One direction of the link, as the ground can know it beforehand.

    Attributes:
        light_ns: light time; by way of other nodes, with the waits there: up, of what is sent now;
            down, the age of the newest that can have arrived.
        is_open: whether by plan what is sent now arrives; down: whether what arrives now could be
            sent.
        changes_ns: when that changes next by plan, on the ground's clock; `None` if never.
        used: share of the rate that was used in the last ten seconds, 0 to 1 and a little above.
        queued_until_ns: until when what was given so far is being sent; `now_ns` where nothing is.
    """

    light_ns: int
    is_open: bool
    changes_ns: int | None
    used: float
    queued_until_ns: int

    def until(self, end_ns: int) -> "Way":
        """The same without a change from `end_ns` on: every plan ends with its mission."""
        if self.changes_ns is None or self.changes_ns < end_ns:
            return self
        return msgspec.structs.replace(self, changes_ns=None)


class GoalSource(StrEnum):
    """Who wants a goal, as far as the ground knows: its operator, the mission, or the rover."""

    OPERATOR = "you"
    MISSION = "mission"
    ROVER = "rover"


class KnownGoal(msgspec.Struct, frozen=True, omit_defaults=True):
    """A goal on board, as the ground knows it.

    Attributes:
        tokens: its Sign.
        priority: as far as it is known.
        source: who wants it.
        is_sent: whether an order that sets it is still on its way.
        is_withdrawn: whether an order that withdraws it is still on its way.
        is_met: whether what is on its way leads right to it.
        aside: why it is put aside, in words; `None` where it is not.
    """

    tokens: Tokens
    priority: float | None
    source: GoalSource
    is_sent: bool = False
    is_withdrawn: bool = False
    is_met: bool = False
    aside: str | None = None


class FailsafeOutlook(msgspec.Struct, frozen=True, omit_defaults=True):
    """The failsafe on board, as far as the ground can know it.

    Attributes:
        state: as last heard; `None` before that.
        hold_after_s, lost_after_s: the silence after which the rover holds, and then is alone.
        holds_ns: when it holds if it hears nothing more from now on, on the ground's clock; `None`
            where it does already or the contact plan explains the silence.
        alone_ns: the same for being alone.
        will: what it does then, in a sentence.
        cause: the reason of its state as last heard, in words; empty before that.
    """

    state: Failsafe | None
    hold_after_s: float
    lost_after_s: float
    holds_ns: int | None = None
    alone_ns: int | None = None
    will: str = ""
    cause: str = ""


class PlaceCost(msgspec.Struct, frozen=True, array_like=True):
    """The cost to go from a place, in the unit of the action costs (s)."""

    place: str
    cost_to_go: float


class GroundView(msgspec.Struct, frozen=True, omit_defaults=True):
    """What a person at the ground can know at a moment, beside what the log has by then.

    Attributes:
        now_ns: simulated time at the ground.
        up, down: the directions of the link.
        heard_ns: when a frame last arrived, 0 before the first.
        due_ns: when the next word is due, with its margin; `NEVER_NS` if it is not.
        silent_since_ns: since when something was due and nothing is heard.
        silence_expected: whether the contact plan explains that nothing is heard.
        missing_s: for how long, of what the ground remembers, it has no telemetry yet: about what
            waits in the rover's store.
        start: where the next action ordered would begin: the Signs of places, the most probable
            first.
        start_unknown: the probability that it is anywhere else.
        options: one for each action, in the order of the action list.
        after: where the rover will be after each command on its way that asks for an action.
        predicted: where the rover is by now.
        review: what the ground finds of the proposal that stands; `None` where none does.
        veto_until_ns: when the rover carries it out unless a veto has arrived; on the ground's
            clock, the last moment to send one. `None` where consent is by approval.
        path: the way to the goal in focus from where the rover will be; `None` where it is not
            known.
        heat: the cost to go from every known place, if the focus asks for it.
        goals: the goals, the top-goal first.
        alone_goals: what it would pursue when the link is lost.
        failsafe: the failsafe.
        if_nothing: what happens if the operator does nothing: one sentence, to follow on "If you do
            nothing:", without its full stop.
        rest_s: how long the battery lasts if the rover stands from now on; `None` before anything
            was heard, and on the dock.
        surprises: the share of the model's expectations that failed of late; `None` where none fell
            due.
        cm: mean C_m of the shadow's hypotheses; `None` without one.
    """

    now_ns: int
    up: Way
    down: Way
    heard_ns: int
    due_ns: int
    failsafe: FailsafeOutlook
    if_nothing: str
    silent_since_ns: int | None = None
    silence_expected: bool = False
    missing_s: float = 0.0
    start: tuple[Likely, ...] = ()
    start_unknown: float = 1.0
    options: tuple[Option, ...] = ()
    after: tuple[Prediction, ...] = ()
    predicted: Prediction | None = None
    review: PathReview | None = None
    veto_until_ns: int | None = None
    path: PathReview | None = None
    heat: tuple[PlaceCost, ...] = ()
    goals: tuple[KnownGoal, ...] = ()
    alone_goals: tuple[Tokens, ...] = ()
    rest_s: float | None = None
    surprises: float | None = None
    cm: float | None = None
