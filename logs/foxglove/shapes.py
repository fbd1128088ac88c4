"""What pictures are drawn with: times, poses, colours and scenes in Foxglove's schemas.

Lengths are in metres, in the frame of the yard unless said otherwise; a height is above its ground.
"""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from foxglove.messages import (
    ArrowPrimitive,
    Color,
    CubePrimitive,
    CylinderPrimitive,
    LinePrimitive,
    LinePrimitiveLineType,
    Point3,
    Pose,
    Quaternion,
    SceneEntity,
    SceneEntityDeletion,
    SceneEntityDeletionType,
    SceneUpdate,
    SpherePrimitive,
    TextPrimitive,
    Timestamp,
    Vector3,
)

from farside.logs.foxglove.names import YARD
from farside.node import NS_PER_S

Rgb = tuple[float, float, float]

_LEVEL = Quaternion(x=0.0, y=0.0, z=0.0, w=1.0)


def stamp(t_ns: int) -> Timestamp:
    """Simulated time, 0 to 136 years, in Foxglove's form; simulated 0 is its epoch."""
    return Timestamp(sec=t_ns // NS_PER_S, nsec=t_ns % NS_PER_S)


def turned(heading_rad: float) -> Quaternion:
    """The rotation by a heading: 0 towards east, counter-clockwise from above."""
    half_rad = heading_rad / 2
    return Quaternion(x=0.0, y=0.0, z=math.sin(half_rad), w=math.cos(half_rad))


def standing(x_m: float, y_m: float, z_m: float = 0.0, heading_rad: float | None = None) -> Pose:
    """A pose on level ground."""
    rotation = _LEVEL if heading_rad is None else turned(heading_rad)
    return Pose(position=Vector3(x=x_m, y=y_m, z=z_m), orientation=rotation)


def colour(rgb: Rgb, alpha: float = 1.0) -> Color:
    """A colour; `alpha` is 0 where it cannot be seen, and 1 where nothing is seen through it."""
    red, green, blue = rgb
    return Color(r=red, g=green, b=blue, a=alpha)


def tile(centre: Pose, side_m: float, of: Color) -> CubePrimitive:
    """A flat square."""
    size = Vector3(x=side_m, y=side_m, z=0.02 * side_m)
    return CubePrimitive(pose=centre, size=size, color=of)


def arrow(tail: Pose, length_m: float, of: Color) -> ArrowPrimitive:
    """An arrow from a pose in its direction."""
    return ArrowPrimitive(
        pose=tail,
        shaft_length=0.6 * length_m,
        shaft_diameter=0.15 * length_m,
        head_length=0.4 * length_m,
        head_diameter=0.35 * length_m,
        color=of,
    )


def line(
    points: Iterable[tuple[float, float]], z_m: float, thickness_m: float, of: Color
) -> LinePrimitive:
    """A line through points, all at one height."""
    return LinePrimitive(
        type=LinePrimitiveLineType.LineStrip,
        pose=standing(0.0, 0.0, z_m),
        thickness=thickness_m,
        points=[Point3(x=x_m, y=y_m, z=0.0) for x_m, y_m in points],
        color=of,
    )


def text(words: str, at: Pose, height_m: float, of: Color) -> TextPrimitive:
    """Words that always face the viewer."""
    return TextPrimitive(pose=at, billboard=True, font_size=height_m, color=of, text=words)


class Parts(NamedTuple):
    """What an entity is drawn with."""

    arrows: Sequence[ArrowPrimitive] = ()
    cubes: Sequence[CubePrimitive] = ()
    cylinders: Sequence[CylinderPrimitive] = ()
    lines: Sequence[LinePrimitive] = ()
    spheres: Sequence[SpherePrimitive] = ()
    texts: Sequence[TextPrimitive] = ()


def entity(t_ns: int, name: str, parts: Parts, *, frame: str = YARD) -> SceneEntity:
    """What stands in a scene under a name, until something else does.

    Args:
        t_ns: since when.
        name: its name on its topic.
        parts: what it is drawn with.
        frame: the frame that it moves with.
    """
    return SceneEntity(
        timestamp=stamp(t_ns),
        frame_id=frame,
        id=name,
        frame_locked=True,
        arrows=list(parts.arrows),
        cubes=list(parts.cubes),
        cylinders=list(parts.cylinders),
        lines=list(parts.lines),
        spheres=list(parts.spheres),
        texts=list(parts.texts),
    )


def scene(*entities: SceneEntity) -> bytes:
    """Entities to add to a scene, or to replace in it."""
    return SceneUpdate(entities=list(entities)).encode()


def nothing(t_ns: int) -> bytes:
    """A scene from which all is removed."""
    # Viewers remove only what is older than the deletion.
    everything = SceneEntityDeletion(timestamp=stamp(t_ns + 1), type=SceneEntityDeletionType.All)
    return SceneUpdate(deletions=[everything]).encode()
