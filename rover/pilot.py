"""The pilot: who drives, and what the rover begins next.

The pilot knows nothing of wheels: the node tells it what is so and asks, whenever the rover stands
still, what to begin. It decides from what is so at that moment, and not from how it came about.
"""

from typing import NamedTuple

from farside.control import Chooser, CommandStage, Failsafe, Mode
from farside.dem import Choice
from farside.messages import Command, CommandForced, Proposal, Tokens
from farside.places import LINK_UP, ON_CHARGE
from farside.rover.commands import Assignment
from farside.rover.config import FailsafeConfig, ReturnTo
from farside.rover.control.authority import Authority, Conditions, Parts
from farside.rover.control.orders import Orders
from farside.rover.control.proposals import Situation
from farside.rover.failsafe.table import OrdersThen
from farside.topics import GoalSource, reasons
from farside.validation import one_line


class Undertaking(NamedTuple):
    """An action to begin: who chose it, the command behind it, the goal it serves."""

    action: str
    chooser: Chooser
    command: int | None = None
    goal: Tokens | None = None


class Pilot:
    """The shared control of the seed's figure 2, on board.

    - Guided: the rover does what the operator commands, and nothing else.
    - Shared: given a goal and a known way to it, the controller proposes an action and waits for
      consent.
    - Autonomous: the controller's actions go straight to the wheels.

    Without a goal the rover never acts by itself. Who drives is the matter of
    `farside.rover.control.authority`.

    Args:
        parts: what it works with.
        config: of the failsafe.
        has_dock: whether there is a dock to charge at.

    Attributes:
        authority: who drives.
        orders: what the operator says.
    """

    def __init__(self, parts: Parts, config: FailsafeConfig, *, has_dock: bool) -> None:
        self._parts = parts
        self._return_to = config.return_to
        self.authority = Authority(parts, config, has_dock=has_dock)
        self.orders = Orders(parts, self.authority)

    def change(self, config: FailsafeConfig) -> None:
        """Go by another failsafe from now on."""
        self._return_to = config.return_to
        self.authority.change(config)

    # --- what is so ----------------------------------------------------------------------------

    def look(self, conditions: Conditions, now_ns: int) -> bool:
        """Follow what is so at this moment; true if that may change what is to begin."""
        changed = self.authority.look(conditions, now_ns)
        changed |= self._follow_commands(now_ns)
        if self._parts.proposals.standing is not None:
            self._parts.proposals.follow(self._situation())
        return changed

    def _follow_commands(self, now_ns: int) -> bool:
        commands = self._parts.commands
        commands.tell_missing(now_ns)
        if not commands.waits:
            return False
        changed = commands.expire(now_ns)
        if self._parts.battery.empty:
            commands.drop_actions(CommandStage.REFUSED, reasons.BATTERY_FLAT.of())
        return self.orders.follow(now_ns) or changed

    # --- what to do next -----------------------------------------------------------------------

    def next(self) -> Undertaking | None:
        """The action to begin now that the rover stands still; `None` to keep still."""
        if self._parts.battery.empty:
            return None
        if self._parts.watch.orders in {OrdersThen.BEGIN, OrdersThen.INSIST}:
            while (order := self._parts.commands.next) is not None:
                if (undertaking := self._begin(order)) is not None:
                    return undertaking
        if not self._parts.watch.rule.acts or self._is_charging:
            return None
        if self.authority.mode is Mode.AUTONOMOUS:
            return self._own()
        return self._consented() if self._may_propose else None

    def _begin(self, order: Assignment) -> Undertaking | None:
        """Begin a command's action, or refuse it here and now."""
        parts, here = self._parts, self._parts.cycle.tokens
        refused = self._elsewhere(order.command)
        gate = None
        if refused is None:
            # The controller has learned from a bump; an operator may not know of it yet.
            guided = order.chooser is Chooser.GUIDED
            gate = self._unsafe() or parts.gate.refusal(order.action, here, bumps=guided)
            refused = None if order.force else gate
        if refused is not None:
            parts.commands.drop_next(CommandStage.REFUSED, refused)
            return None
        number = order.command.number
        parts.commands.begin(gate)
        if gate is not None:
            parts.events.tell(CommandForced(number, gate))
        parts.cycle.decided(order.chooser, order.action, goal=order.goal, command=number)
        return Undertaking(order.action, order.chooser, number, order.goal)

    def _elsewhere(self, command: Command) -> str | None:
        """The reason not to begin a command that was meant for another situation than this."""
        meant, tokens = command.meant, self._parts.cycle.tokens
        if meant is None:
            return None
        if meant.place is not None and meant.place not in tokens:
            where = self.authority.conditions.place or "no place that it knows"
            return reasons.OTHER_PLACE.of(one_line(meant.place), where)
        if meant.after is not None and self._parts.commands.last_action != (meant.after, True):
            return reasons.NOT_AFTER.of(meant.after)
        return None

    def _unsafe(self) -> str | None:
        watch = self._parts.watch
        return watch.rule.why if watch.orders is OrdersThen.INSIST else None

    @property
    def _is_charging(self) -> bool:
        return ON_CHARGE in self._parts.cycle.tokens and self._parts.battery.low

    def _own(self) -> Undertaking | None:
        """What the rover begins of its own, towards a goal."""
        choice = self._choice(explore=True)
        return None if choice is None else self._undertake(choice)

    def _choice(self, *, explore: bool) -> Undertaking | None:
        """What to do next towards a goal: back along a track, or as the controller chooses."""
        wanted = self._parts.goals.listed
        if not wanted:
            return None
        if (back := self._way_back()) is not None:
            return Undertaking(back[0], Chooser.RETURNING, goal=back[1])
        choice = self._on_its_way() or self._parts.cycle.choose(explore=explore)
        if choice is None:
            return None
        if choice.goal is None:
            return Undertaking(choice.action, Chooser.EXPLORATORY, goal=wanted[0])
        return Undertaking(choice.action, Chooser.GOAL_DIRECTED, goal=choice.goal)

    def _on_its_way(self) -> Choice | None:
        """The next action of the way to a goal of the rover's own, where it knows one.

        It has them because something runs short, so it does not explore on the way, however curious
        it is.
        """
        top = self._parts.goals.top
        if top is None or GoalSource.INHERENT not in top.priorities:
            return None
        return self._parts.cycle.choose(explore=False)

    def _way_back(self) -> tuple[str, Tokens] | None:
        """The move back along a track and the goal it serves, if that is what the rover is to do.

        The goal is one of the rover's own that comes before all that the controller pursues. It
        goes by the track where the controller knows no way, or the mission prefers the track.
        """
        goals, top = self._parts.goals, self._parts.goals.top
        ways: list[tuple[float, str, Tokens]] = []
        for goal in goals.all:
            track = self._parts.tracks.get(goal.tokens)
            if track is None or track.back is None:
                continue
            by_track = self._return_to is ReturnTo.TRACK and goal.tokens == (LINK_UP,)
            if goal.aside is not None or by_track:
                ways.append((goal.priority, track.back, goal.tokens))
        first = max(ways, default=None)
        if first is None or (top is not None and top.priority > first[0]):
            return None
        return first[1:]

    def _undertake(self, choice: Undertaking) -> Undertaking:
        self._parts.cycle.decided(choice.chooser, choice.action, goal=choice.goal)
        return choice

    def ended(
        self, action: str, start: frozenset[str], duration_s: float, *, blocked: bool
    ) -> None:
        """An action has ended."""
        self._parts.commands.ended(blocked=blocked)
        self._parts.gate.moved(action, start, duration_s, blocked=blocked)
        self.authority.moved(blocked=blocked)

    # --- proposals -----------------------------------------------------------------------------

    def _situation(self) -> Situation:
        """What a proposal is made for."""
        top = self._parts.goals.top
        mode = self.authority.mode
        return self._parts.cycle.number, top and top.tokens, mode, self._may_propose

    @property
    def _may_propose(self) -> bool:
        """Whether the operator can be asked, and wants to be."""
        silence, rule = self._parts.silence, self._parts.watch.rule
        if silence.silent or silence.expected or self._parts.battery.empty:
            return False
        if self.authority.is_unconfirmed:
            # Only for a goal of the operator's own.
            top = self._parts.goals.top
            return top is not None and GoalSource.OPERATOR in top.priorities
        return self.authority.mode is Mode.SHARED and rule.state is Failsafe.NOMINAL

    def propose(self) -> Proposal | None:
        """A new proposal for the operator if one is due, standing from now on."""
        parts, situation = self._parts, self._situation()
        if (
            not self._may_propose
            or parts.commands.next is not None
            or self._is_charging
            or not parts.proposals.may_make(situation)
        ):
            return None
        choice = self._choice(explore=False)
        if choice is None or choice.goal is None or choice.chooser is Chooser.EXPLORATORY:
            return None
        proposal = parts.proposals.make(
            situation,
            choice.goal,
            choice.action,
            parts.cycle.path() if choice.chooser is Chooser.GOAL_DIRECTED else (),
            by_approval=self.authority.mode is not Mode.SHARED,
            model_check=parts.cycle.lists_check,
            last_command=parts.commands.last_taken,
        )
        parts.cycle.decided(
            choice.chooser, choice.action, goal=choice.goal, proposal=proposal.number
        )
        return proposal

    def _consented(self) -> Undertaking | None:
        """The proposal that stands, if no veto has come in time."""
        proposals = self._parts.proposals
        proposal = proposals.standing
        if proposal is None or not proposals.has_consent:
            return None
        agreed = Undertaking(proposal.action, proposals.chooser, goal=proposal.goal)
        proposals.end(reasons.NO_VETO.of())
        return self._undertake(agreed)
