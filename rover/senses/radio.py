"""The radio: how strong its signal is, by where the rover is."""

from itertools import product

from farside.control import Signal
from farside.places import Cell, Chart


class Radio:
    """The signal of the other end's carrier: none in terrain shadow, weak beside it.

    It says where the link can work. Whether it does, only what is heard says.
    """

    def __init__(self, chart: Chart) -> None:
        self._dark = chart.shadow
        around = list(product((-1, 0, 1), repeat=2))
        self._dim = {
            Cell(cell.east + east, cell.north + north)
            for cell in chart.shadow
            for east, north in around
        }

    def signal(self, cell: Cell) -> Signal:
        """The strength at a place."""
        if cell in self._dark:
            return Signal.NONE
        return Signal.WEAK if cell in self._dim else Signal.STRONG
