"""The safety gate in front of the wheels: what is not begun unless the operator insists."""

import math

from farside.places import ON_CHARGE
from farside.rover.battery import Battery
from farside.rover.config import DriveConfig
from farside.rover.controller import Controller
from farside.rover.failsafe.track import Track
from farside.topics import reasons

_REMEMBERED = 8  # moves that the mean duration of a move reaches back over


class SafetyGate:
    """Refuses a bump just met, and what leaves too little charge for the way to the dock.

    The way to the dock is the one that the controller knows, or the rover's own track where that
    is shorter: its cost in moves, at the energy that a move has taken lately. Where there is none,
    nothing can be said and nothing is refused.

    The rule about bumps is for orders, which may have been given before the bump could be known.
    The controller has learned from the bump, and weighs another try against a detour by itself.

    Args:
        controller: knows ways to the dock.
        track: the rover's own track since the dock.
        battery: what is left.
        drive: cost of a move for the controller, in seconds.
        reserve: so many times what the way to the dock takes counts as reserve.

    Attributes:
        factor: so many times what the way to the dock takes counts as reserve.
        reserve: whether the charge is down to the reserve; as of the last `look`.
    """

    def __init__(
        self,
        controller: Controller,
        track: Track,
        battery: Battery,
        drive: DriveConfig,
        reserve: float,
    ) -> None:
        self._controller, self._track, self._battery = controller, track, battery
        self._move_cost_s = drive.move_cost_s
        self.factor = reserve
        self._move_s = drive.move_cost_s
        self._bump: tuple[frozenset[str], str] | None = None
        self.reserve = False

    def moved(
        self, action: str, start: frozenset[str], duration_s: float, *, blocked: bool
    ) -> None:
        """A move ended that began where `start` was sensed."""
        self._move_s += (duration_s - self._move_s) / _REMEMBERED
        self._bump = (start, action) if blocked else None

    def look(self) -> None:
        """Compare the charge with what the way to the dock takes from here."""
        home = self._home_s
        # With two moves to spare, so that it is reserve before any order is refused for it.
        need_j = self._need_j(home + 2 * self._move_cost_s)
        self.reserve = 0 < home < math.inf and self._battery.charge_j < self.factor * need_j

    def refusal(self, action: str, here: frozenset[str], *, bumps: bool = True) -> str | None:
        """The reason not to begin an order's action; `None` without one.

        Args:
            action: the action.
            here: what is sensed here.
            bumps: whether a bump just met is one.
        """
        if bumps and self._bump == (here, action):
            return reasons.BLOCKED_HERE.of(action)
        home = self._home_s
        if home == math.inf:
            return None
        after = home + self._move_cost_s
        if action == self._track.back:
            after = home - self._move_cost_s
        elif (known := self._controller.expected(action)) is not None:
            after = min(after, self._controller.cost_to((ON_CHARGE,), known.outcome))
        need_j = self._need_j(after + self._move_cost_s)
        if after < home or self._battery.charge_j >= self.factor * need_j:
            return None
        return reasons.CHARGE_TOO_LOW.of(f"{self._battery.charge:.0%}")

    @property
    def _home_s(self) -> float:
        """Cost of the way to the dock from here."""
        known_s = self._controller.cost_to((ON_CHARGE,))
        moves = self._track.length
        return known_s if moves is None else min(known_s, moves * self._move_cost_s)

    def _need_j(self, cost_s: float) -> float:
        return cost_s / self._move_cost_s * self._move_s * self._battery.driving_w
