"""The command desk: the one owner of commands at the ground."""

from collections import OrderedDict
from typing import NamedTuple

from farside.control import CommandStage, Mode
from farside.messages import (
    Approve,
    Command,
    CommandEnded,
    Drive,
    Meant,
    Order,
    Override,
    SetMode,
    Telemetry,
)
from farside.places import is_place_token

_ENDS_KEPT = 1000  # of commands that were not done: more than any operator looks back
_LONGER, _LONGEST = 4, 16  # times the validity that the mission gives


class _Open(NamedTuple):
    command: Command
    arrives_ns: int


class CommandDesk:
    """Numbers commands from 1 without a gap, sets their expiry, and says what each is meant for.

    A drive is meant for the place where the rover is known to be; behind other actions that are not
    known to be over it is meant to follow on the last of them. Every order is meant for the mode
    that the rover will be in by then, as far as the ground can know.

    On a link that is open now and then, what is ordered when one opening is over expires before the
    next, every time. So after a command that expired the next ones are valid for four times as long
    as that one, up to sixteen times what the mission gives (project defaults), until one is done.

    Args:
        valid_ns: how long after it was given a command may still be begun.

    Attributes:
        last_given: number of the newest command, 0 before the first.
    """

    def __init__(self, valid_ns: int, light_ns: int = 0) -> None:
        self._valid_ns = valid_ns
        self.last_given = 0
        self.open: list[_Open] = []
        self._light_ns = light_ns
        self._telemetry: Telemetry | None = None
        self._modes: dict[int, Mode] = {}  # that commands not known to be over lead to
        self._actions: list[int] = []  # commands for actions that are not known to be over
        self._ends: OrderedDict[int, CommandEnded] = OrderedDict()
        self._times = 1  # as long as `valid_ns` the next command is valid
        self._given_times: OrderedDict[int, int] = OrderedDict()

    # --- what is learned -----------------------------------------------------------------------

    def learn(self, telemetry: Telemetry) -> None:
        """Telemetry says up to which number commands are over."""
        if self._telemetry is None or telemetry.time_ns >= self._telemetry.time_ns:
            self._telemetry = telemetry
        self._forget()

    def learn_end(self, end: CommandEnded) -> None:
        """A command is over and was not done."""
        if end.stage is CommandStage.EXPIRED:
            times = self._given_times.get(end.number, self._times)
            self._times = min(_LONGEST, max(self._times, _LONGER * times))
        self._ends[end.number] = end
        if len(self._ends) > _ENDS_KEPT:
            self._ends.popitem(last=False)
        self._forget()

    def _forget(self) -> None:
        done = self._telemetry.commands_done if self._telemetry else 0
        self.open = [
            one
            for one in self.open
            if one.command.number > done and one.command.number not in self._ends
        ]
        self._modes = {
            number: mode
            for number, mode in self._modes.items()
            if number > done and number not in self._ends
        }
        self._actions = [
            number for number in self._actions if number > done and number not in self._ends
        ]

    @property
    def is_settled(self) -> bool:
        """Whether all commands given so far are known to be over."""
        telemetry = self._telemetry
        return telemetry is not None and telemetry.commands_done >= self.last_given

    def end_of(self, number: int) -> CommandEnded | None:
        """How a command ended that was not done; `None` if it was, or nothing is known yet."""
        return self._ends.get(number)

    # --- what is given -------------------------------------------------------------------------

    def give(self, order: Order, now_ns: int) -> Command:
        """The next command, which carries `order` and says when it expires."""
        if self.is_settled and self.last_given and self.last_given not in self._ends:
            self._times = 1
        self.last_given += 1
        number = self.last_given
        meant = self._meant(order)
        if isinstance(order, SetMode):
            self._modes[number] = order.mode
        elif isinstance(order, Drive) and meant.mode is Mode.AUTONOMOUS:
            self._modes[number] = Mode.GUIDED  # the operator takes over by it
        if isinstance(order, Drive | Approve | Override):
            self._actions.append(number)
        self._given_times[number] = self._times
        if len(self._given_times) > _ENDS_KEPT:
            self._given_times.popitem(last=False)
        command = Command(number, now_ns + self._times * self._valid_ns, order, meant)
        self.open.append(_Open(command, now_ns + self._light_ns))
        return command

    def _meant(self, order: Order) -> Meant:
        known = self._telemetry
        mode = Mode.GUIDED if known is None else known.mode  # in which every mission begins
        if self._modes:
            mode = self._modes[max(self._modes)]
        if not isinstance(order, Drive):
            return Meant(mode)
        if self._actions:
            return Meant(mode, after=self._actions[-1])
        tokens = () if known is None else known.tokens
        return Meant(mode, place=next(filter(is_place_token, tokens), None))
