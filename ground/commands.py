"""The command desk: numbers the orders, and says until when each may be obeyed."""

from farside.messages import Command, Order


class CommandDesk:
    """Commands in order without a gap.

    Args:
        valid_ns: how long after being given an order may be obeyed.

    Attributes:
        last_given: number of the last command.
    """

    def __init__(self, valid_ns: int) -> None:
        self._valid_ns = valid_ns
        self.last_given = 0

    def give(self, order: Order, now_ns: int) -> Command:
        """Make a command of an order."""
        self.last_given += 1
        return Command(self.last_given, now_ns + self._valid_ns, order)
