"""What all steps of an operator's work share: what is known now, and how far the work has come."""

from collections.abc import Generator, Sequence

from msgspec.structs import replace

from farside.acts import Act
from farside.ground.config import Rule
from farside.ground.operators.operator import Situation
from farside.messages import CommandReached, Order, Telemetry
from farside.places import BATTERY_LOW, ON_CHARGE, Cell, Chart, place_name
from farside.topics import OperatorEntry

Work = Generator[Sequence[Act], None, None]
"""A piece of an operator's work: on every tick the orders to give, none to wait."""


class Seat:
    """The operator's seat: what the work looks at and where it notes how far it is.

    Args:
        chart: the chart of the yard.
        of: how many steps there are.
        rules: what a path must meet for the operator to agree to it.

    Attributes:
        situation: what is known on the present tick.
        progress: see `farside.ground.operators.operator.Operator`.
    """

    situation: Situation

    def __init__(self, chart: Chart, of: int, rules: tuple[Rule, ...] = ()) -> None:
        self.chart, self.rules = chart, rules
        self.progress = OperatorEntry(0, of, None)

    def change(self, of: int, rules: tuple[Rule, ...]) -> None:
        """There are so many steps, and these rules, from now on."""
        self.rules = rules
        if of != self.progress.of:
            self.progress = replace(self.progress, of=of)

    def wait_for(self, what: str) -> None:
        """Note what the work waits for."""
        if self.progress.waiting_for != what:
            self.progress = replace(self.progress, waiting_for=what)

    def begin(self, step: int, wanted: str) -> None:
        """Note that a step begins, and what has to happen for it to be over."""
        self.progress = replace(self.progress, step=step, waiting_for=wanted)

    def end(self) -> None:
        """Note that the work is over."""
        self.progress = replace(self.progress, step=self.progress.of, waiting_for=None)

    def give_up(self, what: str) -> None:
        """Note something that is given up, with the reason."""
        if what not in self.progress.left:
            self.progress = replace(self.progress, left=(*self.progress.left, what))

    def take_up(self, what: str) -> None:
        """Forget that something was given up."""
        left = tuple(entry for entry in self.progress.left if entry != what)
        self.progress = replace(self.progress, left=left)

    @property
    def telemetry(self) -> Telemetry | None:
        """The newest telemetry."""
        return self.situation.belief.telemetry

    @property
    def battery(self) -> float:
        """The newest state of charge, 1 before anything is known."""
        return 1.0 if self.telemetry is None else self.telemetry.battery

    @property
    def is_low(self) -> bool:
        """Whether the battery is known to need charging."""
        return self.telemetry is not None and BATTERY_LOW in self.telemetry.tokens

    @property
    def is_charging(self) -> bool:
        """Whether the rover is known to stand at the dock until it is charged."""
        return self.is_low and self.telemetry is not None and ON_CHARGE in self.telemetry.tokens

    @property
    def cell(self) -> Cell | None:
        """Where the rover is known to be, if it knows."""
        tokens = () if self.telemetry is None else self.telemetry.tokens
        cells = (self.chart.cells.get(token) for token in tokens)
        return next((cell for cell in cells if cell is not None), None)

    def name(self, cell: Cell) -> str:
        """The name of a place."""
        return place_name(self.chart.tokens[cell])

    def standing(self, goal: str) -> Cell | None:
        """The place where the rover is known to stand now; `None` while that is not sure.

        Args:
            goal: what the work is for, in words.
        """
        if self.telemetry is None or self.situation.silent or not self.situation.settled:
            self.wait_for(goal)
            return None
        if self.cell is None:
            self.wait_for("the rover to know where it is")
        return self.cell

    def tell(self, order: Order) -> Generator[Sequence[Act], None, CommandReached | None]:
        """Give an order, and wait until it is known to be over.

        Returns:
            how it ended if it was not done.
        """
        number = self.situation.commands.last_given + 1
        yield [order]
        while not self.situation.settled:
            yield ()
        return self.situation.commands.end_of(number)

    def insist(self, order: Order) -> Work:
        """Give an order until it is done: what came too late, or was refused, is given again."""
        while (yield from self.tell(order)) is not None:
            pass
