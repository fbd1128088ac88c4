"""Queries on what the ground believed, and when."""

from collections.abc import Callable, Iterator
from operator import attrgetter
from typing import Any, cast

from msgspec.structs import replace

from farside.logs.file.reading import decode
from farside.logs.spans import Believed
from farside.logs.views.topics import TopicView
from farside.messages import BatteryChanged, FailsafeChanged, Happening, ModeChanged, Telemetry
from farside.node import to_ns, to_s
from farside.places import is_place_token
from farside.topics import (
    GROUND_BELIEF,
    GROUND_EVENT,
    GROUND_PREDICTION,
    GROUND_SILENCE,
    GROUND_TELEMETRY,
    BeliefEntry,
    BeliefItem,
    Estimate,
    EventLearned,
    Known,
    LearnedBy,
)


class GroundView(TopicView):
    """What the ground knew of the rover, which is never more than it had heard."""

    def believed_at(self, t_s: float) -> Believed:
        """What the ground believed of the rover at a time.

        That is what it noted last, with what telemetry and events have told since: a belief is
        noted when it changes or becomes stale, and not for every new position.

        Raises:
            ValueError: if `t_s` is outside the run.
        """
        self._check_time(t_s)
        self._asked_s = t_s
        now_ns = to_ns(t_s)
        noted = self._log.latest(GROUND_BELIEF, now_ns)
        belief = BeliefEntry(()) if noted is None else cast("BeliefEntry", decode(noted))
        learned_ns, heard = self._newest(now_ns)
        if heard is not None:
            belief = _taught(belief, _told_by(heard, learned_ns))
        # What happened after that was also learned after that.
        for told in self._events(0 if heard is None else heard.time_ns, now_ns):
            belief = _taught(belief, told)
        silence = self._log.latest(GROUND_SILENCE, now_ns)
        prediction = self._log.latest(GROUND_PREDICTION, now_ns)
        return Believed(
            t_s=t_s,
            belief=belief,
            telemetry=heard,
            age_s=None if heard is None else to_s(now_ns - heard.time_ns),
            silent=silence is not None and GROUND_SILENCE.decode(silence.payload).silent,
            prediction=None if prediction is None else GROUND_PREDICTION.decode(prediction.payload),
        )

    def _newest(self, now_ns: int) -> tuple[int, Telemetry | None]:
        """The newest telemetry that came straight from the rover, and when it came."""
        last = self._log.latest(GROUND_TELEMETRY, now_ns)
        if last is None:
            return 0, None
        # Frames may overtake each other: what is newer than this came after this was measured.
        start_ns = min(last.publish_time_ns, last.log_time_ns)
        records = self._log.records([GROUND_TELEMETRY], start_ns=start_ns, end_ns=now_ns)
        heard = [(record.log_time_ns, cast("Telemetry", decode(record))) for record in records]
        return max(reversed(heard), key=lambda one: one[1].time_ns)

    def _events(self, start_ns: int, now_ns: int) -> Iterator[dict[BeliefItem, Known[Any]]]:
        for record in self._log.records([GROUND_EVENT], start_ns=start_ns, end_ns=now_ns):
            event = cast("EventLearned", decode(record)).event
            item = _ITEMS.get(type(event.what))
            if item is not None:
                name, value = item
                known = Known(value(event.what), event.time_ns, record.log_time_ns, LearnedBy.EVENT)
                yield {name: known}


_ITEMS: dict[type[Happening], tuple[BeliefItem, Callable[[Any], Any]]] = {
    ModeChanged: (BeliefItem.MODE, attrgetter("mode")),
    FailsafeChanged: (BeliefItem.FAILSAFE, attrgetter("state")),
    BatteryChanged: (BeliefItem.BATTERY, attrgetter("charge")),
}


def _told_by(heard: Telemetry, learned_ns: int) -> dict[BeliefItem, Known[Any]]:
    values = {
        BeliefItem.PLACE: next(filter(is_place_token, heard.tokens), None),
        BeliefItem.POSE: Estimate(heard.x_m, heard.y_m, heard.heading_rad),
        BeliefItem.BATTERY: heard.battery,
        BeliefItem.MODE: heard.mode,
        BeliefItem.FAILSAFE: heard.failsafe,
        BeliefItem.ACTION: heard.action,
        BeliefItem.GOALS: heard.goals,
        BeliefItem.SIGNAL: heard.signal,
        BeliefItem.PROPOSAL: heard.proposal,
        BeliefItem.ON_LOSS: heard.on_loss,
        BeliefItem.ALONE_GOALS: heard.alone_goals,
    }
    return {
        item: Known(value, heard.time_ns, learned_ns, LearnedBy.TELEMETRY)
        for item, value in values.items()
    }


def _taught(belief: BeliefEntry, told: dict[BeliefItem, Known[Any]]) -> BeliefEntry:
    """A belief with what is newer in what was told; telemetry counts as newer than an event."""
    newer = {}
    for item, known in told.items():
        before: Known[Any] | None = getattr(belief, item)
        margin_ns = 0 if known.by is LearnedBy.TELEMETRY else 1
        if before is None or before.so_ns + margin_ns <= known.so_ns:
            newer[str(item)] = known
    return replace(belief, **newer)
