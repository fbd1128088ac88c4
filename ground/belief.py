"""What the ground knows of the rover, item by item, and how old it is."""

from bisect import bisect_right, insort
from collections import OrderedDict, deque
from collections.abc import Iterator
from itertools import pairwise
from operator import attrgetter

from msgspec.structs import replace

from farside.ground.downlink import DownlinkPlan
from farside.messages import (
    BatteryChanged,
    Event,
    FailsafeChanged,
    GoalReached,
    ModeChanged,
    Proposal,
    Telemetry,
    Tokens,
)
from farside.node import NEVER_NS, NS_PER_S, Journal
from farside.places import is_place_token
from farside.topics import (
    GROUND_BELIEF,
    BeliefEntry,
    BeliefItem,
    Estimate,
    Known,
    LearnedBy,
)

_USUAL_INTERVALS = 3
_MARGIN_NS = 5 * NS_PER_S
_PROPOSALS_KEPT = 64  # an answer to an older one would be refused on board
_GOALS_KEPT = 1000
_time_ns = attrgetter("time_ns")

HISTORY = 1000
"""How many messages of telemetry, and how many events, a belief keeps (project default); the log
has them all."""

# Of a value that changes all the time no change is noted by itself.
_STEADY = tuple(item for item in BeliefItem if item not in {BeliefItem.POSE, BeliefItem.BATTERY})


class Belief:
    """The one owner of what the ground knows of the rover.

    An item is as of the newest word of it that came straight from the rover. What had waited in
    the rover's store fills the history, and never the present. An item is stale when something
    newer than it was due and has not come: by the contact plan, at this light time, in the
    interval in which the rover reports.

    Args:
        plan: when word is due.
        journal: where it is noted, whenever an item changes or becomes stale.

    Attributes:
        now: all items; which of them are stale as of the last `look`.
        telemetry: the newest that came straight from the rover, by its time stamp; `None` before
            the first.
        unbroken_ns: since when it has been coming without a gap, by its time stamps; -1 before the
            first.
        heard_ns: when a frame last arrived.
        events: the last `HISTORY` events, in the rover's order and without a gap.
        last_event: the number of the last one, 0 before the first.
        proposal: the newest proposal; `None` before the first.
    """

    def __init__(self, plan: DownlinkPlan, journal: Journal) -> None:
        self._plan, self._journal = plan, journal
        self.now = BeliefEntry(())
        self.telemetry: Telemetry | None = None
        self.unbroken_ns = -1
        self._interval_ns = 0
        self.heard_ns = 0
        self.events: deque[Event] = deque(maxlen=HISTORY)
        self.last_event = 0
        self._reached: OrderedDict[Tokens, int] = OrderedDict()  # by which event
        self.proposal: Proposal | None = None
        self._proposals: OrderedDict[int, Proposal] = OrderedDict()
        self._history: list[Telemetry] = []
        self._noted: tuple[object, ...] = ((), *(None for _ in _STEADY))
        self._look_at_ns = 0

    # --- what is learned -----------------------------------------------------------------------

    def learn(self, telemetry: Telemetry, now_ns: int, *, stored: bool = False) -> None:
        """Telemetry has arrived; `stored` if it had waited in the rover's store."""
        insort(self._history, telemetry, key=_time_ns)
        if len(self._history) > HISTORY:
            del self._history[0]
        if stored or (self.telemetry is not None and telemetry.time_ns < self.telemetry.time_ns):
            return
        self._follow_gaps(telemetry)
        self.telemetry = telemetry
        self._take(telemetry, now_ns)

    def _follow_gaps(self, telemetry: Telemetry) -> None:
        if self.telemetry is None:
            self.unbroken_ns = telemetry.time_ns
            return
        interval_ns = telemetry.time_ns - self.telemetry.time_ns
        # A message or two lost by chance are no gap.
        if interval_ns > _USUAL_INTERVALS * self._interval_ns + _MARGIN_NS:
            self.unbroken_ns = telemetry.time_ns
        self._interval_ns = interval_ns

    def _take(self, telemetry: Telemetry, now_ns: int) -> None:
        place = next(filter(is_place_token, telemetry.tokens), None)
        so_ns, by = telemetry.time_ns, LearnedBy.TELEMETRY
        now = BeliefEntry(
            stale=self.now.stale,
            place=Known(place, so_ns, now_ns, by),
            pose=Known(
                Estimate(telemetry.x_m, telemetry.y_m, telemetry.heading_rad), so_ns, now_ns, by
            ),
            battery=Known(telemetry.battery, so_ns, now_ns, by),
            mode=Known(telemetry.mode, so_ns, now_ns, by),
            failsafe=Known(telemetry.failsafe, so_ns, now_ns, by),
            action=Known(telemetry.action, so_ns, now_ns, by),
            goals=Known(telemetry.goals, so_ns, now_ns, by),
            signal=Known(telemetry.signal, so_ns, now_ns, by),
            proposal=Known(telemetry.proposal, so_ns, now_ns, by),
            on_loss=Known(telemetry.on_loss, so_ns, now_ns, by),
            alone_goals=Known(telemetry.alone_goals, so_ns, now_ns, by),
        )
        # Of these alone an event may have told something newer.
        for item in ("battery", "mode", "failsafe"):
            newer = getattr(self.now, item)
            if newer is not None and newer.so_ns > so_ns:
                now = replace(now, **{item: newer})
        self.now = now
        self._look_at_ns = 0

    def tell(self, event: Event, now_ns: int) -> None:
        """An event has arrived."""
        self.events.append(event)
        self.last_event = event.number
        match event.what:
            case ModeChanged(mode=mode):
                self._take_event(BeliefItem.MODE, mode, event, now_ns)
            case FailsafeChanged(state=state):
                self._take_event(BeliefItem.FAILSAFE, state, event, now_ns)
            case BatteryChanged(charge=charge):
                self._take_event(BeliefItem.BATTERY, charge, event, now_ns)
            case GoalReached(tokens=tokens):
                self._reached.pop(tokens, None)
                self._reached[tokens] = event.number
                if len(self._reached) > _GOALS_KEPT:
                    self._reached.popitem(last=False)

    def _take_event(self, item: BeliefItem, value: object, event: Event, now_ns: int) -> None:
        before = getattr(self.now, item)
        if before is None or before.so_ns < event.time_ns:
            known = Known(value, event.time_ns, now_ns, LearnedBy.EVENT)
            self.now = replace(self.now, **{item: known})
            self._look_at_ns = 0

    def consider(self, proposal: Proposal) -> None:
        """Keep a proposal; the newest is `proposal`."""
        self._proposals[proposal.number] = proposal
        if len(self._proposals) > _PROPOSALS_KEPT:
            self._proposals.popitem(last=False)
        if self.proposal is None or proposal.number > self.proposal.number:
            self.proposal = proposal

    # --- how old it is -------------------------------------------------------------------------

    def look(self, now_ns: int) -> None:
        """Bring up to `now_ns` which items are stale, and note what has changed."""
        if now_ns < self._look_at_ns:
            return
        due_ns = {so_ns: self._plan.next_due_ns(so_ns) for so_ns in self._times_ns()}
        stale = tuple(item for item, so_ns in self._known() if due_ns[so_ns] < now_ns)
        self._look_at_ns = 1 + min(
            (due for due in due_ns.values() if due >= now_ns), default=NEVER_NS
        )
        self.now = replace(self.now, stale=stale)
        values = (getattr(self.now, item) for item in _STEADY)
        noted = (stale, *(None if known is None else (known.value,) for known in values))
        if noted != self._noted:
            self._noted = noted
            newest_ns = max(self._times_ns(), default=now_ns)
            self._journal.note(GROUND_BELIEF, self.now, publish_time_ns=newest_ns)

    def _known(self) -> Iterator[tuple[BeliefItem, int]]:
        for item in BeliefItem:
            known = getattr(self.now, item)
            if known is not None:
                yield item, known.so_ns

    def _times_ns(self) -> list[int]:
        return list(dict.fromkeys(so_ns for _, so_ns in self._known()))

    def is_stale(self, item: BeliefItem) -> bool:
        """Whether something newer of an item was due as of the last `look`."""
        return item in self.now.stale

    # --- what was ------------------------------------------------------------------------------

    def was(self, time_ns: int) -> Telemetry | None:
        """The newest telemetry of what was so at `time_ns` or before, whenever it arrived.

        `None` if the last `HISTORY` messages do not go back so far.
        """
        after = bisect_right(self._history, time_ns, key=_time_ns)
        return self._history[after - 1] if after else None

    def gaps(self, usual_ns: int) -> Iterator[tuple[int, int]]:
        """Where the telemetry of the last `HISTORY` messages has gaps longer than `usual_ns`."""
        for before, after in pairwise(self._history):
            if after.time_ns - before.time_ns > usual_ns:
                yield before.time_ns, after.time_ns

    def proposal_numbered(self, number: int) -> Proposal | None:
        """The proposal with this number, if it has arrived."""
        return self._proposals.get(number)

    def reached(self, tokens: Tokens, since_event: int = 0) -> bool:
        """Whether an event after number `since_event` says that a goal was reached."""
        return self._reached.get(tokens, 0) > since_event
