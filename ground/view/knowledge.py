"""All that the ground knows at a moment, in the terms of a view."""

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

from farside.control import BatteryState, Failsafe, Mode, OnLoss
from farside.ground.belief import Belief
from farside.ground.commands.desk import CommandDesk
from farside.ground.downlink import DownlinkPlan, GroundSilence
from farside.ground.outlook import Outlook, RoverTerms
from farside.ground.prediction import OnItsWay
from farside.ground.shadow import Shadow
from farside.ground.view.memory import Memory
from farside.link.profile.schedule import Schedule
from farside.messages import (
    Approve,
    BatteryChanged,
    Drive,
    FailsafeChanged,
    Override,
    Proposal,
    SetMode,
    SetOnLoss,
    StuckChanged,
    Telemetry,
    Tokens,
    Veto,
)
from farside.node import to_ns
from farside.places import LINK_UP, ON_CHARGE, Chart, is_place_token, place_name
from farside.topics import Prediction


class Sources(NamedTuple):
    """What a view is made from; all of it is only read.

    Attributes:
        belief, desk, silence, outlook, memory: of the ground.
        shadow: the shadow of the model on board; `None` where that is not sent.
        plan: when word is due.
        schedule: light times, rates and contacts.
        rover: what is known of the rover beforehand.
        chart: the yard, as the ground has it.
    """

    belief: Belief
    desk: CommandDesk
    silence: GroundSilence
    outlook: Outlook
    memory: Memory
    shadow: Shadow | None
    plan: DownlinkPlan
    schedule: Schedule
    rover: RoverTerms
    chart: Chart


class Knowledge:
    """What is known at `now_ns`, and what follows at once.

    Args:
        sources: what it is made from.
        now_ns: the present.

    Attributes:
        sources, now_ns: as given.
        coming: the commands not known to be over, in order.
        after: where the rover will be after each of them that asks for an action.
        predicted: where the rover is by now; `None` before anything was heard of it.
    """

    def __init__(self, sources: Sources, now_ns: int) -> None:
        self.sources, self.now_ns = sources, now_ns
        self.coming: Sequence[OnItsWay] = sources.outlook.coming
        self.after = sources.outlook.predicted_after(now_ns)
        self.predicted = sources.outlook.predicted(now_ns)

    @property
    def telemetry(self) -> Telemetry | None:
        """The newest that came straight from the rover."""
        return self.sources.belief.telemetry

    @property
    def start(self) -> Prediction | None:
        """Where the next action ordered would begin; `None` where nothing is known of that."""
        return self.after[-1] if self.after else self.predicted

    @property
    def start_place(self) -> str | None:
        """The Token of the place where it most probably would begin."""
        start = self.start
        return start.likely[0].sign[0] if start is not None and start.likely else None

    @cached_property
    def charted_place(self) -> str | None:
        """The Token of the place that the moves on their way lead to by the chart alone.

        For a model that knows nothing of these moves yet.
        """
        chart, telemetry = self.sources.chart, self.telemetry
        cell = chart.cells.get(self.heard_place or "")
        moves = [one.action for one in self.coming if one.action is not None]
        if telemetry is not None and telemetry.action is not None and telemetry.begun is None:
            moves.insert(0, telemetry.action)
        for move in moves:
            if cell is None:
                return None
            beside = cell.beside(move)
            cell = beside if beside in chart.tokens else cell
        return None if cell is None else chart.tokens[cell]

    @property
    def heard_place(self) -> str | None:
        """The Token of the place where the rover was last heard to be."""
        telemetry = self.telemetry
        return None if telemetry is None else next(filter(is_place_token, telemetry.tokens), None)

    # --- of the rover --------------------------------------------------------------------------

    @property
    def failsafe(self) -> Failsafe | None:
        """The failsafe's state as last heard."""
        known = self.sources.belief.now.failsafe
        return None if known is None else known.value

    @property
    def cause(self) -> str:
        """The reason of that state, in words; empty where it was not told."""
        told = self.sources.memory.last(FailsafeChanged)
        return told[0].why if told is not None and told[0].state is self.failsafe else ""

    @property
    def is_stuck(self) -> bool:
        """Whether the rover said that it cannot move any more."""
        told = self.sources.memory.last(StuckChanged)
        return told is not None and told[0].stuck

    @property
    def is_flat(self) -> bool:
        """Whether the rover said that its battery is flat."""
        told = self.sources.memory.last(BatteryChanged)
        return told is not None and told[0].state is BatteryState.FLAT

    @property
    def mode(self) -> Mode:
        """The mode as last heard; every mission begins in guided mode."""
        known = self.sources.belief.now.mode
        return Mode.GUIDED if known is None else known.value

    @cached_property
    def mode_then(self) -> Mode:
        """The mode after all that is on its way."""
        mode = self.mode
        for one in self.coming:
            match one.command.order:
                case SetMode(mode=ordered):
                    mode = ordered
                case Drive() if mode is Mode.AUTONOMOUS:
                    mode = Mode.GUIDED  # the operator takes over by it
        return mode

    @property
    def on_loss(self) -> OnLoss | None:
        """What it does when the link is lost, after all that is on its way; `None`: not known."""
        for one in reversed(self.coming):
            if isinstance(one.command.order, SetOnLoss):
                return one.command.order.on_loss
        return None if self.telemetry is None else self.telemetry.on_loss

    # --- the proposal --------------------------------------------------------------------------

    @cached_property
    def standing(self) -> Proposal | None:
        """The proposal that stands on board, as far as the ground knows."""
        proposal, telemetry = self.sources.belief.proposal, self.telemetry
        if proposal is None or telemetry is None or telemetry.time_ns < proposal.time_ns:
            return proposal
        return proposal if telemetry.proposal == proposal.number else None

    @cached_property
    def answer(self) -> OnItsWay | None:
        """The answer to it that is on its way."""
        proposal = self.standing
        if proposal is None:
            return None
        for one in self.coming:
            order = one.command.order
            if isinstance(order, Approve | Override | Veto) and order.proposal == proposal.number:
                return one
        return None

    @property
    def acts_ns(self) -> int | None:
        """With consent by veto: when at the earliest the rover carries out what stands."""
        proposal = self.standing
        if proposal is None or proposal.veto_window_s is None:
            return None
        shown_ns = self.sources.memory.shown_ns(proposal.number)
        return None if shown_ns is None else shown_ns + to_ns(proposal.veto_window_s)


def sign_words(tokens: Tokens) -> str:
    """A Sign in the words of a person: `B` for the place B."""
    words = {ON_CHARGE: "the dock", LINK_UP: "where the link works"}
    return " and ".join(
        place_name(one) if is_place_token(one) else words.get(one, one) for one in tokens
    )


def and_then(goals: Sequence[Tokens]) -> str:
    """Goals in the order in which they are pursued, in words."""
    return ", then ".join(sign_words(goal) for goal in goals)
