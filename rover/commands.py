"""The one owner of commands on board: every stage of each one's life, from taken to its end."""

from collections import deque
from typing import NamedTuple

from farside.control import Chooser, CommandStage
from farside.messages import Command, CommandEnded, CommandsMissing, Order, Tokens
from farside.node import NS_PER_S, Journal
from farside.rover.events import EventQueue
from farside.topics import ROVER_COMMAND, CommandEntry

_MISSING_NS = 30 * NS_PER_S  # beside a round trip: what a lossy link may well take


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


class Commands:
    """Keeps the life of every command: taken → waiting → begun → done or failed.

    Or refused, expired, withdrawn, superseded: whatever is over without being done is told to the
    ground, with the reason. What only changes a setting is done as soon as it is taken.

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
        self._waiting: deque[Assignment] = deque()
        self._announced = 0
        self._missing_since_ns: int | None = None
        self._missing_told = False
        self.last_taken = 0
        self.begun: Assignment | None = None
        self.last_action: tuple[int | None, bool] = (None, True)

    # --- what telemetry tells ------------------------------------------------------------------

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
        if self.begun is not None:
            return self.begun.command.number - 1
        return self._waiting[0].command.number - 1 if self._waiting else self.last_taken

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
        self._note(command.number, CommandStage.TAKEN, command.order)

    def wait(self, assignment: Assignment) -> None:
        """The command's action waits for the rover to stand still."""
        self._waiting.append(assignment)
        self._note(assignment.command.number, CommandStage.WAITING, assignment.command.order)

    def end(self, command: Command, stage: CommandStage, why: str | None = None) -> None:
        """A command is over; a reason is given unless it was done."""
        self._note(command.number, stage, command.order, why)
        if why is not None:
            self._events.tell(CommandEnded(command.number, stage, why))

    def begin(self, forced: str | None = None) -> Assignment:
        """Begin the action of the first command that waits; `forced` against what reason."""
        self.begun = self._waiting.popleft()
        self._note(self.begun.command.number, CommandStage.BEGUN, self.begun.command.order, forced)
        return self.begun

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
        """The first command that waits."""
        return self._waiting[0] if self._waiting else None

    def drop_next(self, stage: CommandStage, why: str) -> None:
        """End the first command that waits without beginning it."""
        self.end(self._waiting.popleft().command, stage, why)

    def drop_all(self, stage: CommandStage, why: str) -> None:
        """End all that wait without beginning them."""
        while self._waiting:
            self.drop_next(stage, why)

    def expire(self, now_ns: int) -> None:
        """End those that wait and may not begin any more."""
        if not any(one.command.expires_ns < now_ns for one in self._waiting):
            return
        waiting, self._waiting = self._waiting, deque()
        for one in waiting:
            if one.command.expires_ns < now_ns:
                self.end(one.command, CommandStage.EXPIRED, "it came too late to begin")
            else:
                self._waiting.append(one)

    def take_back(self, number: int) -> str | None:
        """Withdraw a command that waits; the reason why not, if it cannot be."""
        for one in self._waiting:
            if one.command.number == number:
                self._waiting.remove(one)
                self.end(one.command, CommandStage.WITHDRAWN, "the operator took it back")
                return None
        if number == self.begun_number:
            return f"command {number} has begun"
        if 0 < number <= self.last_taken:
            return f"command {number} is over"
        return f"there is no command {number}"

    def _note(self, number: int, stage: CommandStage, order: Order, why: str | None = None) -> None:
        self._journal.note(ROVER_COMMAND, CommandEntry(number, stage, order, why))
