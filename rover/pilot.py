"""The pilot: chooses the next action by mode, from the operator's orders or the DEM.

The pilot holds the mode, the operator's orders, the outstanding proposal and the DEM. It knows
nothing of wheels: the node passes it what was sensed, and asks for the next action when the rover
stands still.
"""

from collections import deque
from typing import NamedTuple

from farside.dem import DynamicExpectancyModel, Sensed
from farside.messages import (
    Approve,
    Chooser,
    Command,
    CommandRefused,
    Drive,
    Failsafe,
    Mode,
    ModeCause,
    ModeChanged,
    Override,
    Proposal,
    ProposedStep,
    SetGoal,
    SetMode,
    Tokens,
    WithdrawGoal,
)
from farside.node import Journal
from farside.places import ACTIONS, ON_CHARGE
from farside.rover.battery import Battery
from farside.rover.events import EventQueue
from farside.rover.goals import Goals
from farside.topics import (
    ROVER_COMMAND,
    ROVER_MODE,
    ROVER_PROPOSAL,
    CommandTaken,
    GoalSource,
    ModeEntry,
)


class Undertaking(NamedTuple):
    """An action to begin: who chose it, the command behind it, the goal it serves."""

    action: str
    chooser: Chooser
    command: int | None = None
    goal: Tokens | None = None


class Pilot:
    """The shared control of the seed's figure 2, on board.

    - Guided: the rover does what the operator commands, and nothing else.
    - Shared: given a goal, the DEM proposes an action and waits for the operator's answer.
      Silence is not consent.
    - Autonomous: the DEM's actions go straight to the wheels.

    Orders come first in every mode. Without a goal the rover never acts by itself. In hold nothing
    new begins. When the link is lost, waiting orders are dropped and, if there is any goal, the
    mode changes to autonomous with the mission goals on the Goal List.
    """

    def __init__(
        self,
        model: DynamicExpectancyModel,
        goals: Goals,
        battery: Battery,
        journal: Journal,
        events: EventQueue,
    ) -> None:
        self._model = model
        self._goals = goals
        self._battery = battery
        self._journal, self._events = journal, events
        self._orders: deque[Undertaking] = deque()
        self._failsafe = Failsafe.NOMINAL
        self._proposals = 0
        self._tokens: frozenset[str] = frozenset()
        self.proposal: Proposal | None = None
        self.mode = Mode.GUIDED
        journal.note(ROVER_MODE, ModeEntry(Mode.GUIDED, ModeCause.START))

    # --- what the rover senses ---------------------------------------------------------------

    def sense(self, tokens: frozenset[str]) -> Sensed:
        """Begin a cycle of the DEM with these Tokens."""
        self._tokens = tokens
        self.proposal = None
        self.feel()
        sensed = self._model.sense(tokens)
        for goal in sensed.reached:
            self._goals.reached(goal)
        return sensed

    def feel(self) -> None:
        """Update the inherent goals: a low battery wants charging."""
        if self._battery.low and ON_CHARGE not in self._tokens:
            self._goals.want((ON_CHARGE,), self._battery.urgency, GoalSource.INHERENT)
        if self.proposal is not None and self.goals[:1] != (self.proposal.goal,):
            self.proposal = None

    @property
    def goals(self) -> tuple[Tokens, ...]:
        """The Goal List, top-goal first."""
        return self._goals.listed

    @property
    def waiting_command(self) -> int | None:
        """Number of the oldest command whose action has not begun; `None` without one."""
        return self._orders[0].command if self._orders else None

    # --- what the operator says --------------------------------------------------------------

    def take(self, command: Command) -> None:
        """Obey a command, or refuse it with a reason."""
        refused = self._refusal(command)
        self._journal.note(ROVER_COMMAND, CommandTaken(command.number, command.order, refused))
        if refused is None:
            self._obey(command)
        else:
            self._events.tell(CommandRefused(command.number, refused))

    def _refusal(self, command: Command) -> str | None:
        order = command.order
        if self._journal.now_ns > command.expires_ns:
            return "it came too late"
        if isinstance(order, Drive | Override) and order.action not in ACTIONS:
            return f"there is no action {order.action}"
        if isinstance(order, Approve | Override):
            if self.proposal is None:
                return f"proposal {order.proposal} is no more"
            if self.proposal.number != order.proposal:
                return f"proposal {order.proposal} gave way to {self.proposal.number}"
        if isinstance(order, WithdrawGoal) and not self._goals.wants(
            order.tokens, GoalSource.OPERATOR
        ):
            return "it is no goal of the operator's"
        return None

    def _obey(self, command: Command) -> None:
        order = command.order
        match order:
            case Drive() | Override():
                self._orders.append(Undertaking(order.action, Chooser.GUIDED, command.number))
            case Approve():
                assert self.proposal is not None  # noqa: S101 - _refusal saw to it
                agreed = self.proposal
                self._orders.append(
                    Undertaking(agreed.action, agreed.chooser, command.number, agreed.goal)
                )
            case SetMode():
                self._switch(order.mode, ModeCause.OPERATOR)
            case SetGoal():
                self._goals.want(order.tokens, order.priority, GoalSource.OPERATOR)
            case WithdrawGoal():
                self._goals.give_up(order.tokens, GoalSource.OPERATOR)
        # Whatever was proposed was proposed for a situation that has just changed.
        self.proposal = None

    def _switch(self, mode: Mode, why: ModeCause) -> None:
        if mode is self.mode:
            return
        self.mode = mode
        self.proposal = None
        self._journal.note(ROVER_MODE, ModeEntry(mode, why))
        self._events.tell(ModeChanged(mode, why))
        if mode is not Mode.AUTONOMOUS:
            self._goals.put_down_mission()

    # --- what the link does ------------------------------------------------------------------

    def failsafe(self, state: Failsafe) -> None:
        """Respond to a new state of the failsafe."""
        self._failsafe = state
        if state is Failsafe.NOMINAL:
            return
        self.proposal = None
        if state is Failsafe.LOST:
            self._drop_orders()
            if self._goals.any_for_alone:
                self._switch(Mode.AUTONOMOUS, ModeCause.LINK_LOST)
                self._goals.take_up_mission()

    def _drop_orders(self) -> None:
        for order in self._orders:
            if order.command is not None:
                self._events.tell(
                    CommandRefused(order.command, "the link was lost before it began")
                )
        self._orders.clear()

    # --- what to do next ---------------------------------------------------------------------

    def next(self) -> Undertaking | None:
        """The action to begin now that the rover stands still; `None` to keep still."""
        if self._failsafe is Failsafe.HOLD or self._battery.empty:
            return None
        if self._orders:
            return self._orders.popleft()
        if self.mode is Mode.AUTONOMOUS and self._wants_to_act:
            choice = self._model.choose()
            chooser = Chooser.GOAL_DIRECTED if choice.goal else Chooser.EXPLORATORY
            return Undertaking(choice.action, chooser, goal=choice.goal)
        return None

    def propose(self) -> Proposal | None:
        """A new proposal for the operator if one is due, outstanding from now on."""
        if (
            self.mode is not Mode.SHARED
            or self._failsafe is not Failsafe.NOMINAL
            or self.proposal is not None
            or self._orders
            or not self._wants_to_act
        ):
            return None
        choice = self._model.choose()
        self._proposals += 1
        self.proposal = Proposal(
            number=self._proposals,
            time_ns=self._journal.now_ns,
            goal=self.goals[0],
            action=choice.action,
            chooser=Chooser.GOAL_DIRECTED if choice.goal else Chooser.EXPLORATORY,
            path=tuple(
                ProposedStep(step.sign, step.action, step.cost_to_go)
                for step in self._model.policy_path()
            ),
        )
        self._journal.note(ROVER_PROPOSAL, self.proposal)
        return self.proposal

    @property
    def _wants_to_act(self) -> bool:
        charging = ON_CHARGE in self._tokens and self._battery.low
        return bool(self.goals) and not charging
