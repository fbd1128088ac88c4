"""The table of causes: for each type of message, where to look for what led to it."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import msgspec

from farside.frames import FrameEvent, FrameFate
from farside.logs.story.causes import at_ground, authority, crossing, on_board
from farside.logs.story.causes.authority import Given
from farside.logs.story.search import Found, Search
from farside.messages import Proposal, Telemetry
from farside.topics import (
    GROUND_PROPOSAL,
    ActionEnded,
    ActionStarted,
    Bump,
    CommandEntry,
    CommandSent,
    Cycle,
    Decision,
    Estimate,
    EventLearned,
    FailsafeEntry,
    GoalEntry,
    HeldEntry,
    LifeEntry,
    ModeEntry,
    ModelSent,
    OperatorEntry,
    OrderGiven,
    PolicyMapEntry,
    Pose,
    Prediction,
    ProposalEnded,
    Review,
    ShadowEntry,
    Silence,
    StuckEntry,
)

Finder = Callable[[Search, Found[Any]], Iterator[Found[Any] | Given]]


def _proposal(search: Search, found: Found[Proposal]) -> Iterator[Found[Any]]:
    """One type on two topics: made on board, received at the ground."""
    is_ground = found.topic == GROUND_PROPOSAL.name
    yield from (at_ground.received if is_ground else on_board.proposal)(search, found)


TABLE: Mapping[type[msgspec.Struct], Finder] = {
    # on board
    ActionStarted: on_board.action_started,
    ActionEnded: on_board.action_ended,
    Decision: on_board.decision,
    CommandEntry: on_board.command,
    ModeEntry: authority.mode,
    FailsafeEntry: authority.failsafe,
    GoalEntry: on_board.goal,
    ProposalEnded: on_board.proposal_ended,
    Proposal: _proposal,
    StuckEntry: on_board.stuck,
    Cycle: on_board.cycle,
    PolicyMapEntry: on_board.policy_map,
    ModelSent: on_board.model_sent,
    Pose: on_board.moving,
    Estimate: on_board.moving,
    Bump: on_board.moving,
    # on the link
    FrameFate: crossing.fate,
    FrameEvent: crossing.event,
    # at the ground
    CommandSent: at_ground.command_sent,
    HeldEntry: at_ground.held,
    OrderGiven: at_ground.order,
    Review: at_ground.review,
    EventLearned: at_ground.received,
    Telemetry: at_ground.received,
    Silence: at_ground.silence,
    LifeEntry: at_ground.life,
    ShadowEntry: at_ground.shadow,
    Prediction: at_ground.follows_news,
    OperatorEntry: at_ground.follows_news,
}
"""What finds the records that led to one, by the type of its message.

What is not in it, or of which nothing is found, has nothing before it that the log knows: an
outage, the battery, an order of the operator, and what a run starts with.
"""


def parents_of(search: Search, found: Found[Any]) -> list[Found[Any] | Given]:
    """The records that led to one at once, the most telling first; none where it is the first.

    Raises:
        LogError: if the log is damaged where it has to look.
    """
    finder = TABLE.get(type(found.message))
    return [] if finder is None else list(finder(search, found))
