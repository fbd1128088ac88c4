"""What a researcher needs around the model: worlds to play in, judgement, tables and pictures.

Nothing here is needed by the model, and the model knows nothing of it. What needs a library that
Farside's base does without says which when it is called.
"""

from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.dem.lab.judging import Estimate, Judged, Judgement, still, train_then_judge
    from farside.dem.lab.layouts import Layout
    from farside.dem.lab.metrics import CycleMetrics, cycle_metrics
    from farside.dem.lab.observations import (
        as_one,
        bins,
        each,
        fields,
        label,
        one_hot,
        tiles,
        tokens_of,
    )
    from farside.dem.lab.picture import Picture, map_picture
    from farside.dem.lab.playing import Episode, play
    from farside.dem.lab.remembering import memory
    from farside.dem.lab.tables import SignRow, Table, hypotheses, policy, signs
    from farside.dem.lab.worlds import FAILED, REWARDED, GymWorld, Situation, World

__all__ = [
    "FAILED",
    "REWARDED",
    "CycleMetrics",
    "Episode",
    "Estimate",
    "GymWorld",
    "Judged",
    "Judgement",
    "Layout",
    "Picture",
    "SignRow",
    "Situation",
    "Table",
    "World",
    "as_one",
    "bins",
    "cycle_metrics",
    "each",
    "fields",
    "hypotheses",
    "label",
    "map_picture",
    "memory",
    "one_hot",
    "play",
    "policy",
    "signs",
    "still",
    "tiles",
    "tokens_of",
    "train_then_judge",
]

__getattr__ = lazily(
    __name__,
    {
        "FAILED": "worlds",
        "REWARDED": "worlds",
        "CycleMetrics": "metrics",
        "Episode": "playing",
        "Estimate": "judging",
        "GymWorld": "worlds",
        "Judged": "judging",
        "Judgement": "judging",
        "Layout": "layouts",
        "Picture": "picture",
        "SignRow": "tables",
        "Situation": "worlds",
        "Table": "tables",
        "World": "worlds",
        "as_one": "observations",
        "bins": "observations",
        "cycle_metrics": "metrics",
        "each": "observations",
        "fields": "observations",
        "hypotheses": "tables",
        "label": "observations",
        "map_picture": "picture",
        "memory": "remembering",
        "one_hot": "observations",
        "play": "playing",
        "policy": "tables",
        "signs": "tables",
        "still": "judging",
        "tiles": "observations",
        "tokens_of": "observations",
        "train_then_judge": "judging",
    },
)
