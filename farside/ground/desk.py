"""The command desk: numbers commands, and repeats them until they are acknowledged."""

from typing import NamedTuple

from farside.link.messages import Command, Order


class Sending(NamedTuple):
    """A command to put on the uplink; `attempt` counts from 1."""

    command: Command
    attempt: int


class CommandDesk:
    """Commands in order without a gap (go back N).

    The rover takes a command only after all before it. When an acknowledgement is overdue,
    everything unacknowledged goes out again. A command that has expired keeps its place, so that
    the count has no gap, and the rover will refuse it.

    Args:
        answer_ns: how long after sending an acknowledgement is overdue.
        valid_ns: how long after being given an order may be obeyed.
    """

    def __init__(self, answer_ns: int, valid_ns: int) -> None:
        self._answer_ns = answer_ns
        self._valid_ns = valid_ns
        self._given = 0
        self._unacked: list[Command] = []
        self._attempts: dict[int, int] = {}
        self._overdue_ns = 0

    @property
    def last_given(self) -> int:
        """Number of the last command."""
        return self._given

    def give(self, order: Order, now_ns: int) -> Sending:
        """Make a command of an order."""
        self._given += 1
        command = Command(self._given, now_ns + self._valid_ns, order)
        if not self._unacked:
            self._overdue_ns = now_ns + self._answer_ns
        self._unacked.append(command)
        self._attempts[command.number] = 1
        return Sending(command, 1)

    def acknowledge(self, number: int, now_ns: int) -> None:
        """The rover has taken all commands up to `number`."""
        if self._unacked and self._unacked[0].number <= number:
            self._overdue_ns = now_ns + self._answer_ns
        while self._unacked and self._unacked[0].number <= number:
            del self._attempts[self._unacked.pop(0).number]

    def overdue(self, now_ns: int) -> list[Sending]:
        """What to send again now."""
        if not self._unacked or now_ns < self._overdue_ns:
            return []
        self._overdue_ns = now_ns + self._answer_ns
        for command in self._unacked:
            self._attempts[command.number] += 1
        return [Sending(command, self._attempts[command.number]) for command in self._unacked]
