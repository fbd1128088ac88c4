"""The one owner of commands on board: every stage of each one's life, from taken to its end."""

from collections import OrderedDict
from typing import NamedTuple

from farside.control import Chooser, CommandStage
from farside.messages import Command, CommandReached, CommandsMissing, Tokens
from farside.node import NS_PER_S, Journal
from farside.rover.events import EventQueue
from farside.topics import ROVER_COMMAND, CommandEntry, reasons

_MISSING_NS = 30 * NS_PER_S  # beside a round trip: what a lossy link may well take
_ENDS_KEPT = 1000  # how commands ended: more than any sequence reaches back (project default)


class Assignment(NamedTuple):
    """An action that a command asks for.

    Attributes:
        command: the command.
        action: the action.
        chooser: who chose it.
        goal: the goal that it serves, if any.
        force: whether the operator insists.
    """

    command: Command
    action: str
    chooser: Chooser = Chooser.GUIDED
    goal: Tokens | None = None
    force: bool = False


class _Waiting(NamedTuple):
    """A command that waits: the action to begin, or for its `when` while that is `None`."""

    command: Command
    is_action: bool
    assignment: Assignment | None


class Commands:
    """Keeps the life of every command: taken → waiting → begun → done or failed.

    Or refused, expired, withdrawn, superseded. Every stage but that it waits is told to the ground,
    see `CommandReached`. What only changes a setting is done as soon as it is taken, or as soon as
    what it waits for is so. Actions begin in the order in which they were taken.

    Args:
        round_trip_ns: of the link.
        journal, events: where the stages are noted, and told to the ground.

    Attributes:
        last_taken: number of the newest command, 0 before the first.
        begun: the one whose action is under way.
        last_action: the number of the command behind the last action that ended, if there was one,
            and whether it was done.
    """

    def __init__(self, round_trip_ns: int, journal: Journal, events: EventQueue) -> None:
        self._missing_after_ns = round_trip_ns + _MISSING_NS
        self._journal, self._events = journal, events
        self._waiting: list[_Waiting] = []  # by number
        self._ends: OrderedDict[int, CommandStage] = OrderedDict()
        self._untold: list[int] = []  # taken at this moment, and nothing more so far
        self._announced = 0
        self._missing_since_ns: int | None = None
        self._missing_told = False
        self.last_taken = 0
        self.begun: Assignment | None = None
        self.last_action: tuple[int | None, bool] = (None, True)

    # --- what telemetry tells ------------------------------------------------------------------

    @property
    def waits(self) -> bool:
        """Whether any command waits."""
        return bool(self._waiting)

    @property
    def waiting(self) -> tuple[int, ...]:
        """The numbers of the commands that wait to begin, in order."""
        return tuple(one.command.number for one in self._waiting)

    @property
    def begun_number(self) -> int | None:
        """The number of the command whose action is under way."""
        return self.begun.command.number if self.begun else None

    @property
    def done_up_to(self) -> int:
        """Every command up to this number is over."""
        first = self._waiting[0].command.number if self._waiting else self.last_taken + 1
        return min(first, self.begun_number or first) - 1

    # --- commands that do not arrive -----------------------------------------------------------

    @property
    def missing(self) -> bool:
        """Whether the ground has given commands that have not arrived."""
        return self._announced > self.last_taken

    def announce(self, number: int, now_ns: int) -> None:
        """The ground says that it has given commands up to this number."""
        self._announced = max(self._announced, number)
        if self.missing and self._missing_since_ns is None:
            self._missing_since_ns = now_ns

    def tell_missing(self, now_ns: int) -> None:
        """Tell the ground if commands have not arrived for long though it is heard, or now have."""
        if self._missing_since_ns is None:
            return
        if self.missing and now_ns - self._missing_since_ns < self._missing_after_ns:
            return
        if self.missing is not self._missing_told:
            self._missing_told = self.missing
            self._events.tell(CommandsMissing(self.missing, self._announced))
        if not self.missing:
            self._missing_since_ns = None

    # --- the life of a command -----------------------------------------------------------------

    def take(self, command: Command) -> None:
        """A command was received."""
        self.last_taken = max(self.last_taken, command.number)
        self._note(command, CommandStage.TAKEN)

    def hold(self, command: Command, *, is_action: bool) -> None:
        """The command waits for what its `when` says."""
        self._waiting.append(_Waiting(command, is_action, None))
        self._note(command, CommandStage.WAITING)

    def wait(self, assignment: Assignment) -> None:
        """The command's action waits for the rover to stand still, and for those before it."""
        ready = _Waiting(assignment.command, is_action=True, assignment=assignment)
        for index, one in enumerate(self._waiting):
            if one.command.number == assignment.command.number:
                self._waiting[index] = ready
                return
        self._waiting.append(ready)
        self._note(assignment.command, CommandStage.WAITING)

    def ripe(self, now_ns: int) -> Command | None:
        """The first command whose `when` holds, or of which `never` says why it never will."""
        for one in self._waiting:
            if one.assignment is None and (
                self._holds(one.command, now_ns) or self.never(one.command) is not None
            ):
                return one.command
        return None

    def _holds(self, command: Command, now_ns: int) -> bool:
        when = command.when
        if when is None:
            return True
        if when.at_ns is not None and now_ns < when.at_ns:
            return False
        return when.after is None or self._ends.get(when.after) is CommandStage.DONE

    def never(self, command: Command) -> str | None:
        """Why what a command is to follow on will never be done; `None` while it may be."""
        after = None if command.when is None else command.when.after
        if after is None:
            return None
        if not 0 < after < command.number:
            return reasons.NEVER_AFTER.of(after, "and there is none before it")
        if after == self.begun_number or after in self.waiting:
            return None
        end = self._ends.get(after)
        if end is CommandStage.DONE:
            return None
        how = "of which nothing is known any more" if end is None else f"which was {end}"
        how = "which failed" if end is CommandStage.FAILED else how
        how = "which expired" if end is CommandStage.EXPIRED else how
        return reasons.NEVER_AFTER.of(after, how)

    def end(self, command: Command, stage: CommandStage, why: str | None = None) -> None:
        """A command is over; a reason is given unless it was done."""
        self._waiting = [one for one in self._waiting if one.command.number != command.number]
        self._ends[command.number] = stage
        if len(self._ends) > _ENDS_KEPT:
            self._ends.popitem(last=False)
        self._note(command, stage, why)

    def begin(self, forced: str | None = None) -> Assignment | None:
        """Begin the action of the first command that waits; `forced` against what reason."""
        begun = self.begun = self.next
        if begun is not None:
            self._waiting = [one for one in self._waiting if one.assignment is not begun]
            self._note(begun.command, CommandStage.BEGUN, forced)
        return begun

    def ended(self, *, blocked: bool) -> None:
        """An action has ended: that of the command begun, if there was one."""
        if self.begun is None:
            self.last_action = (None, not blocked)
            return
        command, self.begun = self.begun.command, None
        self.last_action = (command.number, not blocked)
        if blocked:
            self.end(command, CommandStage.FAILED, "its move was blocked, or given up")
        else:
            self.end(command, CommandStage.DONE)

    @property
    def next(self) -> Assignment | None:
        """The first action that waits; `None` without one, or while its `when` does not hold."""
        return next((one.assignment for one in self._waiting if one.is_action), None)

    def drop_next(self, stage: CommandStage, why: str) -> None:
        """End the first action that waits without beginning it."""
        if self.next is not None:
            self.end(self.next.command, stage, why)

    def drop_all(self, stage: CommandStage, why: str, before: int | None = None) -> None:
        """End all that wait without beginning them, up to `before`, not included."""
        for one in self._waiting:
            if before is None or one.command.number < before:
                self.end(one.command, stage, why)

    def drop_actions(self, stage: CommandStage, why: str) -> None:
        """End all actions that wait without beginning them."""
        for one in self._waiting:
            if one.is_action:
                self.end(one.command, stage, why)

    def expire(self, now_ns: int) -> bool:
        """End those that wait and may not begin any more; whether there were any."""
        late = [one.command for one in self._waiting if one.command.expires_ns < now_ns]
        for command in late:
            self.end(command, CommandStage.EXPIRED, "it came too late to begin")
        return bool(late)

    def take_back(self, number: int) -> str | None:
        """Withdraw a command that waits; the reason why not, if it cannot be."""
        for one in self._waiting:
            if one.command.number == number:
                self.end(one.command, CommandStage.WITHDRAWN, "the operator took it back")
                return None
        if number == self.begun_number:
            return f"command {number} has begun"
        if 0 < number <= self.last_taken:
            return f"command {number} is over"
        return f"there is no command {number}"

    # --- what is told --------------------------------------------------------------------------

    def _note(self, command: Command, stage: CommandStage, why: str | None = None) -> None:
        number = command.number
        self._journal.note(ROVER_COMMAND, CommandEntry(number, stage, command.order, why))
        if stage is CommandStage.TAKEN:
            self._untold.append(number)
        elif stage is not CommandStage.WAITING:
            if number in self._untold:
                self._untold.remove(number)
            # What a forced one was begun against is told by `CommandForced`.
            told = why if stage.is_last else None
            self._events.tell(CommandReached(number, stage, told))

    def tell_taken(self) -> None:
        """Tell which commands were taken at this moment and reached no other stage at it."""
        for number in self._untold:
            self._events.tell(CommandReached(number, CommandStage.TAKEN))
        self._untold.clear()
