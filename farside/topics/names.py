"""Every topic of the log: its name with the type of its messages."""

from typing import TypeVar, cast

import msgspec

from farside.frames import FrameEvent, FrameFate, FrameHop, LinkOutage
from farside.messages import Proposal, Telemetry
from farside.node import Topic
from farside.topics.ground import (
    BeliefEntry,
    CommandSent,
    EventLearned,
    HeldEntry,
    LifeEntry,
    OperatorEntry,
    OrderGiven,
    Prediction,
    Review,
    ShadowEntry,
    Silence,
)
from farside.topics.rover import (
    ActionEnded,
    ActionStarted,
    BatteryEntry,
    CommandEntry,
    Cycle,
    Decision,
    Estimate,
    FailsafeEntry,
    GoalEntry,
    ModeEntry,
    ModelSent,
    PolicyMapEntry,
    ProposalEnded,
    StoreEntry,
    StuckEntry,
)
from farside.topics.truth import Bump, Pose, Yard

T = TypeVar("T", bound=msgspec.Struct)

TOPICS: dict[str, Topic[msgspec.Struct]] = {}
"""Every topic of Farside's own by name. Each one appears in every log, used or not, as JSON."""


def _topic(name: str, kind: type[T]) -> Topic[T]:
    topic = Topic(name, kind)
    TOPICS[name] = cast("Topic[msgspec.Struct]", topic)
    return topic


TRUTH_YARD = _topic("/truth/yard", Yard)
TRUTH_POSE = _topic("/truth/pose", Pose)
TRUTH_BUMP = _topic("/truth/bump", Bump)

ROVER_ESTIMATE = _topic("/rover/estimate", Estimate)
ROVER_CYCLE = _topic("/rover/cycle", Cycle)
ROVER_ACTION_STARTED = _topic("/rover/action_started", ActionStarted)
ROVER_ACTION_ENDED = _topic("/rover/action_ended", ActionEnded)
ROVER_MODE = _topic("/rover/mode", ModeEntry)
ROVER_FAILSAFE = _topic("/rover/failsafe", FailsafeEntry)
ROVER_BATTERY = _topic("/rover/battery", BatteryEntry)
ROVER_STUCK = _topic("/rover/stuck", StuckEntry)
ROVER_COMMAND = _topic("/rover/command", CommandEntry)
ROVER_GOAL = _topic("/rover/goal", GoalEntry)
ROVER_PROPOSAL = _topic("/rover/proposal", Proposal)
ROVER_PROPOSAL_ENDED = _topic("/rover/proposal_ended", ProposalEnded)
ROVER_DECISION = _topic("/rover/decision", Decision)
ROVER_POLICY_MAP = _topic("/rover/policy_map", PolicyMapEntry)
ROVER_FRAME = _topic("/rover/frame", FrameEvent)
ROVER_STORE = _topic("/rover/store", StoreEntry)
ROVER_MODEL = _topic("/rover/model", ModelSent)

LINK_FRAME = _topic("/link/frame", FrameFate)
LINK_HOP = _topic("/link/hop", FrameHop)
LINK_OUTAGE = _topic("/link/outage", LinkOutage)

GROUND_CHART = _topic("/ground/chart", Yard)
GROUND_FRAME = _topic("/ground/frame", FrameEvent)
GROUND_TELEMETRY = _topic("/ground/telemetry", Telemetry)
GROUND_STORED_TELEMETRY = _topic("/ground/stored_telemetry", Telemetry)
GROUND_ORDER = _topic("/ground/order", OrderGiven)
GROUND_COMMAND = _topic("/ground/command", CommandSent)
GROUND_LIFE = _topic("/ground/life", LifeEntry)
GROUND_HELD = _topic("/ground/held", HeldEntry)
GROUND_EVENT = _topic("/ground/event", EventLearned)
GROUND_PROPOSAL = _topic("/ground/proposal", Proposal)
GROUND_REVIEW = _topic("/ground/review", Review)
GROUND_OPERATOR = _topic("/ground/operator", OperatorEntry)
GROUND_SILENCE = _topic("/ground/silence", Silence)
GROUND_BELIEF = _topic("/ground/belief", BeliefEntry)
GROUND_PREDICTION = _topic("/ground/prediction", Prediction)
GROUND_SHADOW = _topic("/ground/shadow", ShadowEntry)
