"""The topics of the pictures: each name with its schema, in protobuf.

What is drawn has Foxglove's well-known schemas; states and numbers have schemas of their own. The
first part of a name says who knew it, as in `farside.topics`. Everything is drawn in the frame
`YARD`: metres east (x) and north (y) of the chart's south-west corner, z up.

Foxglove shows all of it. Lichtblick has no voxels, and Rerun draws neither grids nor scenes, so
the map stands as both a grid and voxels; Rerun has frames, poses and events beside these.
"""

import importlib
from typing import NamedTuple

import msgspec

from farside.logs.foxglove.protobuf import descriptor_set
from farside.logs.foxglove.states import (
    GroundNumbers,
    GroundState,
    LinkNumbers,
    LinkState,
    RoverNumbers,
    RoverState,
    TruthNumbers,
)

_PACKAGE = "farside"

YARD = "yard"
"""The frame of the chart, which all others hang on."""

FRAME_TRUTH = "rover_truth"
FRAME_ESTIMATE = "rover_estimate"
FRAME_BELIEVED = "rover_believed"
"""The frames of the rover as it was, as it placed itself, and as the ground knew it then."""


class PictureTopic(NamedTuple):
    """A topic of pictures.

    Attributes:
        name: such as `/truth/map`.
        kind: the type of its messages, or the name of Foxglove's schema, such as `foxglove.Grid`.
    """

    name: str
    kind: type[msgspec.Struct] | str

    @property
    def schema_name(self) -> str:
        """Name of the schema, such as `foxglove.Grid` or `farside.RoverState`."""
        return self.kind if isinstance(self.kind, str) else f"{_PACKAGE}.{self.kind.__name__}"

    def schema(self) -> bytes:
        """The schema as a `FileDescriptorSet`."""
        if not isinstance(self.kind, str):
            return descriptor_set(self.kind, _PACKAGE)
        # Only what writes pictures needs Foxglove's library, which takes its time to load.
        messages = importlib.import_module("foxglove.messages")
        data: bytes = getattr(messages, self.kind.removeprefix("foxglove.")).get_schema().data
        return data


PICTURES: dict[str, PictureTopic] = {}
"""Every topic of pictures by name. Each one appears in every log, used or not."""


def _picture(name: str, kind: type[msgspec.Struct] | str) -> PictureTopic:
    topic = PictureTopic(name, kind)
    PICTURES[name] = topic
    return topic


TRUTH_FRAMES = _picture("/truth/frames", "foxglove.FrameTransforms")
TRUTH_POSE_IN_YARD = _picture("/truth/pose_in_yard", "foxglove.PoseInFrame")
TRUTH_BODY = _picture("/truth/body", "foxglove.SceneUpdate")
TRUTH_MAP = _picture("/truth/map", "foxglove.Grid")
TRUTH_FLOOR = _picture("/truth/floor", "foxglove.VoxelGrid")
TRUTH_PLACES = _picture("/truth/places", "foxglove.SceneUpdate")
TRUTH_TRACK = _picture("/truth/track", "foxglove.SceneUpdate")
TRUTH_NUMBERS = _picture("/truth/numbers", TruthNumbers)

ROVER_FRAMES = _picture("/rover/frames", "foxglove.FrameTransforms")
ROVER_POSE_IN_YARD = _picture("/rover/pose_in_yard", "foxglove.PoseInFrame")
ROVER_BODY = _picture("/rover/body", "foxglove.SceneUpdate")
ROVER_POLICY = _picture("/rover/policy", "foxglove.SceneUpdate")
ROVER_POLICY_CELLS = _picture("/rover/policy_cells", "foxglove.SceneUpdate")
ROVER_STATE = _picture("/rover/state", RoverState)
ROVER_NUMBERS = _picture("/rover/numbers", RoverNumbers)
ROVER_EVENTS = _picture("/rover/events", "foxglove.Log")

LINK_STATE = _picture("/link/state", LinkState)
LINK_NUMBERS = _picture("/link/numbers", LinkNumbers)
LINK_EVENTS = _picture("/link/events", "foxglove.Log")

GROUND_FRAMES = _picture("/ground/frames", "foxglove.FrameTransforms")
GROUND_POSE_IN_YARD = _picture("/ground/pose_in_yard", "foxglove.PoseInFrame")
GROUND_BODY = _picture("/ground/body", "foxglove.SceneUpdate")
GROUND_MAP = _picture("/ground/map", "foxglove.Grid")
GROUND_FLOOR = _picture("/ground/floor", "foxglove.VoxelGrid")
GROUND_PLACES = _picture("/ground/places", "foxglove.SceneUpdate")
GROUND_POLICY = _picture("/ground/policy", "foxglove.SceneUpdate")
GROUND_PREDICTED = _picture("/ground/predicted", "foxglove.SceneUpdate")
GROUND_STATE = _picture("/ground/state", GroundState)
GROUND_NUMBERS = _picture("/ground/numbers", GroundNumbers)
GROUND_EVENTS = _picture("/ground/events", "foxglove.Log")
