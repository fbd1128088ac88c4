"""Where the rover is to one who knows of it: its frame, its pose, and a body that shows it."""

from collections.abc import Sequence

import msgspec
from foxglove.messages import (
    CylinderPrimitive,
    FrameTransform,
    FrameTransforms,
    Pose,
    PoseInFrame,
    Quaternion,
    Vector3,
)

from farside.logs.foxglove.maps import Places
from farside.logs.foxglove.names import YARD, PictureTopic
from farside.logs.foxglove.shapes import (
    Parts,
    Rgb,
    arrow,
    colour,
    entity,
    scene,
    stamp,
    standing,
    text,
    turned,
)
from farside.messages import Coordinate
from farside.node import Record

Drawn = Sequence[Record]
"""The pictures of a record."""

_RADIUS = 0.3  # of a cell


class Where(msgspec.Struct, frozen=True, gc=False):
    """A pose, as it stands in several messages: metres east and north, heading in radians."""

    x_m: Coordinate
    y_m: Coordinate
    heading_rad: float


class TruePose(Where, frozen=True, gc=False):
    """A `farside.topics.Pose`, as far as it is drawn."""

    battery: float
    speed_m_s: float


class HeardPose(Where, frozen=True, gc=False):
    """A `farside.messages.Telemetry`, as far as it is drawn."""

    time_ns: int
    battery: float
    commands_done: int


class Whereabouts:
    """The rover as one party has it.

    Viewers draw a frame between two messages as on the way from one to the next. So a message also
    says again what was so before it: until then, the frame stays.

    Args:
        frame: name of its frame.
        frames, pose, body: the topics.
        places: the yard, which says how large to draw it.
        tint: its colour.
        alpha: how solid it looks.
    """

    def __init__(
        self,
        frame: str,
        frames: PictureTopic,
        pose: PictureTopic,
        body: PictureTopic,
        *,
        places: Places,
        tint: Rgb,
        alpha: float,
    ) -> None:
        self._frame, self._places = frame, places
        self._frames, self._pose, self._body = frames.name, pose.name, body.name
        self._tint, self._alpha = tint, alpha
        self._at: Where | None = None
        self._told_ns = 0

    def see(self, t_ns: int, at: Where, *, held_ns: int, so_ns: int | None = None) -> Drawn:
        """The pictures of a pose; none if it has not changed.

        Args:
            t_ns: log time.
            at: the pose.
            held_ns: until when the pose before was so, as far as was known.
            so_ns: when it was so; `t_ns` by default.
        """
        before = self._at
        if at == before:
            return ()
        so_ns = t_ns if so_ns is None else so_ns
        rotation = turned(at.heading_rad)
        transforms = [self._transform(t_ns, at, rotation)]
        if before is not None and held_ns > self._told_ns:
            transforms.insert(0, self._transform(held_ns, before, turned(before.heading_rad)))
        self._at, self._told_ns = at, t_ns
        position = Vector3(x=at.x_m, y=at.y_m, z=0.0)
        pose = Pose(position=position, orientation=rotation)
        framed = PoseInFrame(timestamp=stamp(t_ns), frame_id=YARD, pose=pose)
        drawn = [
            Record(self._frames, t_ns, so_ns, FrameTransforms(transforms=transforms).encode()),
            Record(self._pose, t_ns, so_ns, framed.encode()),
        ]
        if before is None:
            drawn.append(Record(self._body, t_ns, t_ns, self._drawn(t_ns)))
        return drawn

    def _transform(self, t_ns: int, at: Where, rotation: Quaternion) -> FrameTransform:
        return FrameTransform(
            timestamp=stamp(t_ns),
            parent_frame_id=YARD,
            child_frame_id=self._frame,
            translation=Vector3(x=at.x_m, y=at.y_m, z=0.0),
            rotation=rotation,
        )

    def _drawn(self, t_ns: int) -> bytes:
        """A drum with an arrow ahead, which moves with the frame."""
        radius_m = _RADIUS * self._places.cell_m
        tint = colour(self._tint, self._alpha)
        drum = CylinderPrimitive(
            pose=standing(0.0, 0.0, radius_m / 2),
            size=Vector3(x=2 * radius_m, y=2 * radius_m, z=radius_m),
            bottom_scale=1.0,
            top_scale=0.8,
            color=tint,
        )
        ahead = arrow(standing(0.0, 0.0, 1.1 * radius_m), 1.5 * radius_m, tint)
        above = standing(0.0, 0.0, 2 * radius_m)
        name = text(self._frame.removeprefix("rover_"), above, 0.8 * radius_m, tint)
        parts = Parts(arrows=[ahead], cylinders=[drum], texts=[name])
        return scene(entity(t_ns, "body", parts, frame=self._frame))
