"""What an order is meant for, as far as the ground can know when it gives it."""

from collections.abc import Callable

from farside.control import Mode
from farside.messages import ACTS, Drive, Meant, Order, SetMode, Telemetry
from farside.places import is_place_token


class Meaning:
    """Says what each order is meant for.

    A drive is meant for the place where the rover is known to be; behind other actions that are not
    known to be over it is meant to follow on the last of them. Every order is meant for the mode
    that the rover will be in by then, as far as the ground can know. What waits for a time or
    a turn on board changes the mode for those only that wait, too.
    """

    def __init__(self) -> None:
        self._telemetry: Telemetry | None = None
        self._modes: dict[int, Mode] = {}  # that commands not known to be over lead to
        self._later: set[int] = set()  # those of them that wait on board
        self._actions: list[int] = []  # commands for actions that are not known to be over

    def copy(self) -> "Meaning":
        """One that knows the same and learns by itself."""
        twin = Meaning()
        twin._telemetry = self._telemetry
        twin._modes, twin._later = dict(self._modes), set(self._later)
        twin._actions = list(self._actions)
        return twin

    def learn(self, telemetry: Telemetry | None, is_settled: Callable[[int], bool]) -> None:
        """What the newest telemetry says, and which commands beside those it calls over are so."""
        self._telemetry = telemetry
        done = 0 if telemetry is None else telemetry.commands_done
        over = [n for n in self._modes if n <= done or is_settled(n)]
        for number in over:
            del self._modes[number]
            self._later.discard(number)
        self._actions = [n for n in self._actions if n > done and not is_settled(n)]

    def of(self, order: Order, number: int, *, waits: bool) -> Meant:
        """What the next order, of this number, is meant for; `waits` for a time or a turn."""
        meant = self._meant(order, waits=waits)
        if isinstance(order, SetMode):
            self._modes[number] = order.mode
        elif isinstance(order, Drive) and meant.mode is Mode.AUTONOMOUS:
            self._modes[number] = Mode.GUIDED  # the operator takes over by it
        if waits and number in self._modes:
            self._later.add(number)
        if isinstance(order, ACTS):
            self._actions.append(number)
        return meant

    def _meant(self, order: Order, *, waits: bool) -> Meant:
        known = self._telemetry
        mode = Mode.GUIDED if known is None else known.mode  # in which every mission begins
        leading = [n for n in self._modes if waits or n not in self._later]
        if leading:
            mode = self._modes[max(leading)]
        if not isinstance(order, Drive):
            return Meant(mode)
        if self._actions:
            return Meant(mode, after=self._actions[-1])
        tokens = () if known is None else known.tokens
        return Meant(mode, place=next(filter(is_place_token, tokens), None))
