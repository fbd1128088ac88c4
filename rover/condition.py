"""The rover's condition: what could keep it from going on, told to the ground when it changes."""

from farside.control import BatteryState
from farside.messages import BatteryChanged, StuckChanged
from farside.node import Journal
from farside.places import ACTIONS
from farside.rover.battery import Battery
from farside.rover.events import EventQueue
from farside.topics import ROVER_BATTERY, ROVER_STUCK, BatteryEntry, StuckEntry

STUCK_AFTER = 10
"""So many blocked moves the same way in a row mean that the rover is stuck, as does a blocked move
in every direction (project default). Bumps in several directions alone do not: who tries at random
in a corner has many, and a way out."""


class Condition:
    """Notes and tells when the battery's state changes, and when the rover gets stuck or free.

    Args:
        battery: whose state to follow.
        journal, events: where changes are noted, and told to the ground.

    Attributes:
        stuck: whether the rover cannot move any more.
    """

    def __init__(self, battery: Battery, journal: Journal, events: EventQueue) -> None:
        self.stuck = False
        self._battery = battery
        self._journal, self._events = journal, events
        self._state = BatteryState.NOMINAL
        self._blocked = 0  # moves in a row
        self._same = 0  # of these, the last ones that went the same way
        self._last_way: str | None = None
        self._blocked_ways: set[str] = set()

    def begin(self) -> None:
        """Note the condition at the start; what is not nominal is told to the ground."""
        self._journal.note(ROVER_BATTERY, BatteryEntry(self._state, self._battery.charge))
        self._journal.note(ROVER_STUCK, StuckEntry(self.stuck, 0))
        self.follow_battery()

    def follow_battery(self) -> None:
        """Tell of the battery's state if it has changed since the last call."""
        state = self._battery.state
        if state is not self._state:
            self._state = state
            self._journal.note(ROVER_BATTERY, BatteryEntry(state, self._battery.charge))
            self._events.tell(BatteryChanged(state, self._battery.charge))

    def moved(self, action: str, *, blocked: bool) -> None:
        """A move has ended. It says nothing of obstacles where the battery is flat."""
        if self._battery.empty:
            return
        if blocked:
            self._blocked += 1
            self._same = self._same + 1 if action == self._last_way else 1
            self._last_way = action
            self._blocked_ways.add(action)
        else:
            self._blocked = self._same = 0
            self._blocked_ways.clear()
        if self._blocked_ways == set(ACTIONS) or self._same >= STUCK_AFTER:
            stuck = True
        else:
            stuck = self.stuck and blocked
        if stuck is not self.stuck:
            self.stuck = stuck
            self._journal.note(ROVER_STUCK, StuckEntry(stuck, self._blocked))
            self._events.tell(StuckChanged(stuck, self._blocked))
