"""The pictures of a run, made from its records as they come."""

from collections.abc import Callable, Iterable
from typing import Any

import msgspec

from farside.logs.events import EVENT_TOPICS
from farside.logs.file.reading import LogEntry
from farside.logs.foxglove.links import LinkSide
from farside.logs.foxglove.maps import Drawing, Places, yard_pictures
from farside.logs.foxglove.names import (
    FRAME_BELIEVED,
    FRAME_ESTIMATE,
    FRAME_TRUTH,
    GROUND_BODY,
    GROUND_FLOOR,
    GROUND_FRAMES,
    GROUND_MAP,
    GROUND_PLACES,
    GROUND_POSE_IN_YARD,
    ROVER_BODY,
    ROVER_FRAMES,
    ROVER_POSE_IN_YARD,
    TRUTH_BODY,
    TRUTH_FLOOR,
    TRUTH_FRAMES,
    TRUTH_MAP,
    TRUTH_PLACES,
    TRUTH_POSE_IN_YARD,
    PictureTopic,
)
from farside.logs.foxglove.paths import GroundPolicy, PolicyScenes, Predicted, Track
from farside.logs.foxglove.poses import Drawn, HeardPose, TruePose, Where, Whereabouts
from farside.logs.foxglove.sides import (
    Believed,
    GroundSide,
    RoverSide,
    TruthSide,
)
from farside.node import Record, Topic
from farside.topics import (
    GROUND_BELIEF,
    GROUND_CHART,
    GROUND_PREDICTION,
    GROUND_PROPOSAL,
    GROUND_REVIEW,
    GROUND_SHADOW,
    GROUND_SILENCE,
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    LINK_FRAME,
    LINK_OUTAGE,
    ROVER_ACTION_ENDED,
    ROVER_ACTION_STARTED,
    ROVER_BATTERY,
    ROVER_CYCLE,
    ROVER_DECISION,
    ROVER_ESTIMATE,
    ROVER_FAILSAFE,
    ROVER_MODE,
    ROVER_POLICY_MAP,
    ROVER_PROPOSAL,
    ROVER_PROPOSAL_ENDED,
    ROVER_STUCK,
    TRUTH_POSE,
    TRUTH_YARD,
)

_Draw = Callable[[int, Any], Drawn]

# Of these, less is read than they hold: a map is large, and poses and frames are many.
_PARTS: dict[str, type[msgspec.Struct]] = {
    TRUTH_YARD.name: Drawing,
    GROUND_CHART.name: Drawing,
    TRUTH_POSE.name: TruePose,
    ROVER_ESTIMATE.name: Where,
    GROUND_TELEMETRY.name: HeardPose,
    GROUND_STORED_TELEMETRY.name: HeardPose,
    GROUND_BELIEF.name: Believed,
}


class Pictures:
    """Draws a run for Foxglove, Lichtblick and Rerun; see `farside.logs.foxglove.names`.

    The same records give the same pictures, however they are divided. Those of `/ground` are drawn
    from records of `/ground` alone. A picture has the log time of the record that it follows.
    """

    def __init__(self) -> None:
        self._topics: dict[str, _Source] = {}
        self._draws: dict[str, Callable[[Record, list[Record]], None]] = {}
        self._truth_and_rover()
        self._link()
        self._ground()

    def beside(self, records: Iterable[Record]) -> list[Record]:
        """The records, each followed by its pictures.

        Args:
            records: the next records of the run, in log order. One that is not of the type of its
                topic has no picture.
        """
        both: list[Record] = []
        for record in records:
            both.append(record)
            draw = self._draws.get(record.topic)
            if draw is not None:
                draw(record, both)
        return both

    def _on(self, topic: Topic[Any], *draws: _Draw) -> None:
        source = self._topics.get(topic.name)
        if source is None:
            part = _PARTS.get(topic.name)
            decode = topic.decode if part is None else msgspec.json.Decoder(part).decode
            source = self._topics[topic.name] = _Source(decode)
            self._draws[topic.name] = source.draw
        source.draws += draws

    # --- who knows what ------------------------------------------------------------------------

    def _truth_and_rover(self) -> None:
        places, side = Places(), RoverSide()
        track, policy = Track(places), PolicyScenes(places)
        self._on(TRUTH_YARD, _Yard(places, TRUTH_MAP, TRUTH_FLOOR, TRUTH_PLACES))
        true = Whereabouts(
            FRAME_TRUTH,
            TRUTH_FRAMES,
            TRUTH_POSE_IN_YARD,
            TRUTH_BODY,
            places=places,
            tint=(0.25, 0.25, 0.25),
            alpha=1.0,
        )
        estimate = Whereabouts(
            FRAME_ESTIMATE,
            ROVER_FRAMES,
            ROVER_POSE_IN_YARD,
            ROVER_BODY,
            places=places,
            tint=(0.34, 0.71, 0.91),
            alpha=0.6,
        )
        self._on(TRUTH_POSE, _Seen(true), track.pose, TruthSide().condition)
        self._on(ROVER_ESTIMATE, _Seen(estimate))
        self._on(ROVER_MODE, track.mode, side.state)
        for topic in (
            ROVER_FAILSAFE,
            ROVER_BATTERY,
            ROVER_STUCK,
            ROVER_ACTION_STARTED,
            ROVER_ACTION_ENDED,
        ):
            self._on(topic, side.state)
        self._on(ROVER_CYCLE, side.cycle)
        self._on(ROVER_POLICY_MAP, policy.policy_map, side.state)
        self._on(ROVER_DECISION, policy.decision)
        self._on(ROVER_PROPOSAL, policy.proposal)
        self._on(ROVER_PROPOSAL_ENDED, policy.proposal_ended)
        self._tell(side.event, "/rover/")

    def _link(self) -> None:
        side = LinkSide()
        self._on(TRUTH_YARD, side.start)
        self._draws[LINK_FRAME.name] = side.frame
        self._on(LINK_OUTAGE, side.outage)
        self._tell(side.event, "/link/")

    def _ground(self) -> None:
        places, side = Places(), GroundSide()
        policy, predicted = GroundPolicy(places), Predicted(places)
        believed = Whereabouts(
            FRAME_BELIEVED,
            GROUND_FRAMES,
            GROUND_POSE_IN_YARD,
            GROUND_BODY,
            places=places,
            tint=(0.90, 0.60, 0.0),
            alpha=0.6,
        )
        heard = _Heard(believed, side)
        self._on(GROUND_CHART, _Yard(places, GROUND_MAP, GROUND_FLOOR, GROUND_PLACES))
        self._on(GROUND_TELEMETRY, heard)
        self._on(GROUND_STORED_TELEMETRY, heard)
        self._on(GROUND_BELIEF, side.state, policy.belief)
        self._on(GROUND_SILENCE, side.state)
        self._on(GROUND_SHADOW, side.state)
        self._on(GROUND_PREDICTION, predicted.prediction, side.prediction)
        self._on(GROUND_PROPOSAL, policy.proposal)
        self._on(GROUND_REVIEW, policy.review)
        self._tell(side.event, "/ground/")

    def _tell(self, event: Callable[[LogEntry], Drawn], of: str) -> None:
        for topic in EVENT_TOPICS:
            if topic.name.startswith(of):
                self._on(topic, _Event(topic.name, event))


class _Source:
    """A topic that pictures are drawn from.

    Attributes:
        draws: what draws them, in order.
    """

    def __init__(self, decode: Callable[[bytes], Any]) -> None:
        self._decode = decode
        self.draws: list[_Draw] = []

    def draw(self, record: Record, drawn: list[Record]) -> None:
        """Add the pictures of a record."""
        try:
            message = self._decode(record.payload)
        except (msgspec.MsgspecError, ValueError, RecursionError):
            return
        t_ns = record.log_time_ns
        for draw in self.draws:
            drawn += draw(t_ns, message)


class _Event:
    """Tells what happened by a message of a topic."""

    def __init__(self, topic: str, event: Callable[[LogEntry], Drawn]) -> None:
        self._topic, self._event = topic, event

    def __call__(self, t_ns: int, message: msgspec.Struct) -> Drawn:
        return self._event(LogEntry(t_ns, t_ns, self._topic, message))


class _Yard:
    """Draws a map, and has the places learn it."""

    def __init__(self, places: Places, *topics: PictureTopic) -> None:
        self._places, self._topics = places, topics

    def __call__(self, t_ns: int, drawing: Drawing) -> Drawn:
        self._places.learn(drawing)
        return yard_pictures(t_ns, drawing, *self._topics)


class _Seen:
    """Draws the rover where it was, or where it placed itself, at each pose of a row of them."""

    def __init__(self, rover: Whereabouts) -> None:
        self._rover = rover
        self._last_ns = 0

    def __call__(self, t_ns: int, at: Where) -> Drawn:
        held_ns, self._last_ns = self._last_ns, t_ns
        where = Where(at.x_m, at.y_m, at.heading_rad)
        return self._rover.see(t_ns, where, held_ns=held_ns)


class _Heard:
    """Draws the rover where the newest telemetry has it, from when that arrives."""

    def __init__(self, rover: Whereabouts, side: GroundSide) -> None:
        self._rover, self._side = rover, side
        self._newest_ns = -1

    def __call__(self, t_ns: int, telemetry: HeardPose) -> Drawn:
        if telemetry.time_ns <= self._newest_ns:
            return ()
        self._newest_ns = telemetry.time_ns
        at = Where(telemetry.x_m, telemetry.y_m, telemetry.heading_rad)
        # What is not known before it arrives is not to be seen coming.
        seen = self._rover.see(t_ns, at, held_ns=t_ns - 1, so_ns=telemetry.time_ns)
        return (*seen, *self._side.hear(t_ns, telemetry))
