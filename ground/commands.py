"""The command desk: numbers orders and sets their expiry."""

from farside.messages import Command, Order


class CommandDesk:
    """Numbers commands from 1 without a gap.

    Args:
        valid_ns: how long after it was given a command may still be begun.

    Attributes:
        last_given: number of the newest command, 0 before the first.
    """

    def __init__(self, valid_ns: int) -> None:
        self._valid_ns = valid_ns
        self.last_given = 0

    def give(self, order: Order, now_ns: int) -> Command:
        """The next command, which carries `order` and expires after the desk's validity."""
        self.last_given += 1
        return Command(self.last_given, now_ns + self._valid_ns, order)
