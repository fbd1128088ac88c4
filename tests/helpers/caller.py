"""An operator of one's own: it never drives, and calls out one goal after the other."""

from collections.abc import Sequence

from numpy.random import Generator

from farside.control import Mode
from farside.dem import Sign
from farside.ground import Situation
from farside.messages import Order, SetGoal, SetMode
from farside.node import to_ns
from farside.places import Chart, place_token
from farside.topics import OperatorEntry


class Caller:
    """Leaves the rover to itself with one goal at a time, and thinks a while before each."""

    def __init__(
        self, chart: Chart, *, rng: Generator, places: Sequence[str], think_s: float = 5.0
    ) -> None:
        for place in places:
            if place not in chart.places:
                raise ValueError(f"expected places on the map, found {place}")
        self._goals = [(place_token(place),) for place in places]
        self._thoughts_ns = [to_ns(think_s * spread) for spread in rng.uniform(0.5, 2, len(places))]
        self._reached = 0
        self._act_at_ns = 0
        self._sent: int | None = None  # the number of the command that carries the goal
        self._events = 0  # those known when it was sent

    @property
    def progress(self) -> OperatorEntry:
        """How many goals are reached, and the one that it waits for."""
        of = len(self._goals)
        if self._reached == of:
            return OperatorEntry(of, of, None)
        return OperatorEntry(self._reached, of, f"{self._goal[0]} to be reached")

    @property
    def _goal(self) -> Sign:
        return self._goals[self._reached]

    def act(self, situation: Situation) -> Sequence[Order]:
        """The next goal, once the one before is known to be reached."""
        belief, commands = situation.belief, situation.commands
        if self._sent is not None and belief.reached(self._goal, self._events):
            self._sent = None
            self._reached += 1
        if self._reached == len(self._goals) or belief.telemetry is None or situation.silent:
            return ()
        if self._sent is None:
            self._act_at_ns = self._act_at_ns or (
                situation.now_ns + self._thoughts_ns[self._reached]
            )
        elif commands.end_of(self._sent) is None:
            return ()  # on its way, or done; what was refused or came too late is sent again
        if situation.now_ns < self._act_at_ns:
            return ()
        self._act_at_ns = 0
        self._sent, self._events = commands.last_given + 2, belief.last_event
        return [SetMode(Mode.AUTONOMOUS), SetGoal(self._goal, 1.0)]
