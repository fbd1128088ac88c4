"""What a view needs of the past, and nobody else keeps: told of it as it comes, it only listens."""

from collections import deque
from collections.abc import Iterable
from typing import TypeVar

from farside.acts import Act, Planned
from farside.ground.commands.timing import Timing
from farside.link.profile.schedule import Schedule
from farside.messages import Event, Happening, SetGoal, Tokens, WithdrawGoal
from farside.node import NEVER_NS, NS_PER_S, Direction, Frame

_LATELY_NS = 10 * NS_PER_S
_KEPT = 1000  # goals, and proposals shown

_Happening = TypeVar("_Happening", bound=Happening)


class Memory:
    """Keeps the newest event of each kind, the operator's goals, and how the link was used.

    Nothing in it depends on when, or how often, somebody looks.

    Args:
        schedule: light times, rates and contacts.

    Attributes:
        goals: the goals that the operator set and has not withdrawn, with their priorities.
        reaches_ns: when by plan the newest frame sent so far is at the rover, if it left while the
            plan had the uplink open; 0 before the first.
    """

    def __init__(self, schedule: Schedule) -> None:
        self._schedule = schedule
        self._timing = Timing(schedule)
        self.goals: dict[Tokens, float | None] = {}
        self.reaches_ns = 0
        self._events: dict[type[object], Event] = {}
        self._shown_ns: dict[int, int] = {}
        # When each frame left or arrived, and for how long it was being sent.
        self._used: dict[Direction, deque[tuple[int, int]]] = {way: deque() for way in Direction}

    def give(self, act: Act) -> None:
        """The operator gave this."""
        match act.order if isinstance(act, Planned) else act:
            case SetGoal(tokens=tokens, priority=priority):
                self.goals.pop(_sign(tokens), None)
                self.goals[_sign(tokens)] = priority
                _forget(self.goals)
            case WithdrawGoal(tokens=tokens):
                self.goals.pop(_sign(tokens), None)

    def tell(self, event: Event) -> None:
        """An event has arrived."""
        self._events[type(event.what)] = event

    def last(self, kind: type[_Happening]) -> tuple[_Happening, int] | None:
        """The newest event of a kind: what, and when it was so; `None` before the first."""
        event = self._events.get(kind)
        if event is None or not isinstance(event.what, kind):
            return None
        return event.what, event.time_ns

    def show(self, proposal: int, now_ns: int) -> None:
        """The rover is told that the operator was shown a proposal."""
        self._shown_ns[proposal] = self._timing.arrives_ns(self._timing.leaves_ns(now_ns, 0))
        _forget(self._shown_ns)

    def shown_ns(self, proposal: int) -> int | None:
        """When at the earliest word is at the rover that a proposal was shown; `None` for none."""
        return self._shown_ns.get(proposal)

    # --- the link ------------------------------------------------------------------------------

    def send(self, frames: Iterable[Frame]) -> None:
        """These frames leave."""
        for frame in frames:
            self._use(Direction.UP, frame)
            if self._timing.is_open(frame.time_ns):
                leaves_ns = self._timing.leaves_ns(frame.time_ns, len(frame.payload))
                arrives_ns = self._timing.arrives_ns(leaves_ns)
                if arrives_ns < NEVER_NS:
                    self.reaches_ns = max(self.reaches_ns, arrives_ns)

    def expect(self, frames: Iterable[Frame]) -> None:
        """These frames arrive, each at its time, which may lie ahead."""
        for frame in frames:
            self._use(Direction.DOWN, frame)

    def _use(self, way: Direction, frame: Frame) -> None:
        used = self._used[way]
        used.append(
            (frame.time_ns, self._schedule.sending_ns(way, frame.time_ns, len(frame.payload)))
        )
        while used[0][0] <= frame.time_ns - 2 * _LATELY_NS:
            used.popleft()

    def used(self, way: Direction, now_ns: int) -> float:
        """The share of the last ten seconds in which frames were being sent, 0 without a rate."""
        since_ns = max(0, now_ns - _LATELY_NS)
        sending_ns = sum(lasts for at_ns, lasts in self._used[way] if since_ns < at_ns <= now_ns)
        return sending_ns / (now_ns - since_ns) if now_ns > since_ns else 0.0


_Key = TypeVar("_Key")
_Value = TypeVar("_Value")


def _forget(kept: dict[_Key, _Value]) -> None:
    if len(kept) > _KEPT:
        del kept[next(iter(kept))]


def _sign(tokens: Tokens) -> Tokens:
    return tuple(sorted(set(tokens)))
