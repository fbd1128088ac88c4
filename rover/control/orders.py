"""What the operator says: every command obeyed, or refused with a reason."""

import math

from farside.control import CommandStage, Mode
from farside.messages import (
    ACTS,
    Approve,
    Command,
    Drive,
    Heartbeat,
    Override,
    SetGoal,
    SetMode,
    SetOnLoss,
    TakeBack,
    Veto,
    WithdrawGoal,
)
from farside.places import ACTIONS
from farside.rover.commands import Assignment
from farside.rover.control.authority import Authority, Parts
from farside.topics import GoalSource, reasons
from farside.validation import shown


class Orders:
    """Obeys the operator's commands, or refuses them.

    Args:
        parts: the pilot's; they own what is ordered about.
        authority: who drives.
    """

    def __init__(self, parts: Parts, authority: Authority) -> None:
        self._parts, self._authority = parts, authority

    def heartbeat(self, heartbeat: Heartbeat, now_ns: int) -> None:
        """The ground was heard, and says which commands it has given so far."""
        commands = self._parts.commands
        commands.announce(heartbeat.last_command, now_ns)
        self._parts.proposals.heartbeat(now_ns, all_arrived=not commands.missing)

    def shown(self, proposal: int, now_ns: int) -> None:
        """The operator was shown a proposal."""
        self._parts.proposals.shown(proposal, now_ns)

    def take(self, command: Command, now_ns: int) -> None:
        """Obey a command, or refuse it with a reason."""
        commands, order = self._parts.commands, command.order
        commands.take(command)
        if now_ns > command.expires_ns:
            commands.end(command, CommandStage.EXPIRED, "it came too late")
            if isinstance(order, Approve | Override | Veto) and self._stands(order.proposal):
                # Its operator takes it for answered, so nobody would say anything again.
                self._parts.proposals.end(reasons.ANSWER_TOO_LATE.of())
            return
        if command.when is None:
            self._carry_out(command)
        else:
            commands.hold(command, is_action=isinstance(order, ACTS))
            self.follow(now_ns)

    def follow(self, now_ns: int) -> bool:
        """Obey what waited for its time or its turn, and may begin now; whether anything did."""
        commands, changed = self._parts.commands, False
        while (command := commands.ripe(now_ns)) is not None:
            changed = True
            why = commands.never(command)
            if why is None:
                self._carry_out(command)
            else:
                commands.end(command, CommandStage.REFUSED, why)
        return changed

    def _carry_out(self, command: Command) -> None:
        """Obey a command here and now, or refuse it."""
        commands, order = self._parts.commands, command.order
        refused = self._contradiction(command) or self._obey(command)
        if refused is not None:
            commands.end(command, CommandStage.REFUSED, refused)
            return
        if not isinstance(order, ACTS):
            commands.end(command, CommandStage.DONE)
        if not isinstance(order, TakeBack | SetOnLoss):
            # Whatever was proposed was proposed for a situation that has just changed.
            self._parts.proposals.end(reasons.CAME_BETWEEN.of(command.number))

    def _stands(self, number: int) -> bool:
        standing = self._parts.proposals.standing
        return standing is not None and standing.number == number

    def _contradiction(self, command: Command) -> str | None:
        """What in the order contradicts how things are; `None` if nothing does."""
        order, meant, mode = command.order, command.meant, self._authority.mode
        match order:
            case Drive() | Override() if order.action not in ACTIONS:
                why = f"there is no action {shown(order.action)}"
            case SetGoal() if not order.tokens:
                why = "a goal has one Token at least"
            case SetGoal() if order.priority is None or not math.isfinite(order.priority):
                why = f"a priority is a finite number, not {order.priority}"
            case Approve() | Override() | Veto() if not self._stands(order.proposal):
                why = self._parts.proposals.absence(order.proposal)
            case Drive() | Approve() | Override() if self._parts.battery.empty:
                why = reasons.BATTERY_FLAT.of()
            case Drive() | SetMode(mode=Mode.AUTONOMOUS) if meant and meant.mode is not mode:
                why = reasons.OTHER_MODE.of(meant.mode, mode)
            case _:
                return None
        return why

    def _obey(self, command: Command) -> str | None:
        """Obey; the reason if that cannot be."""
        parts, order = self._parts, command.order
        match order:
            case Drive() | Approve() | Override():
                self._wait(command, order)
            case Veto():
                parts.proposals.veto()
            case SetMode():
                parts.commands.drop_all(
                    CommandStage.SUPERSEDED,
                    reasons.MODE_CHANGED.of(command.number),
                    before=command.number,
                )
                self._authority.order(order.mode)
            case SetGoal() if order.priority is not None:
                parts.goals.want(order.tokens, order.priority, GoalSource.OPERATOR)
                parts.goals.follow_aside(parts.cycle.tokens)
            case WithdrawGoal():
                return parts.goals.withdraw(order.tokens)
            case TakeBack(number=command.number):
                return "it is this order itself"
            case TakeBack():
                return parts.commands.take_back(order.number)
            case SetOnLoss():
                self._authority.on_loss = order.on_loss
        return None

    def _wait(self, command: Command, order: Drive | Approve | Override) -> None:
        """Have the action begun as soon as the rover stands still."""
        if isinstance(order, Drive):
            self._authority.take_over()
        if not isinstance(order, Approve):
            self._parts.commands.wait(Assignment(command, order.action, force=order.force))
            return
        agreed = self._parts.proposals.standing
        assert agreed is not None  # noqa: S101 - _contradiction saw to it
        self._parts.commands.wait(
            Assignment(command, agreed.action, self._parts.proposals.chooser, agreed.goal)
        )
