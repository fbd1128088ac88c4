"""What a researcher needs around the model: worlds to play in, judgement, tables and pictures.

Nothing here is needed by the model, and the model knows nothing of it. What needs a library that
Farside's base does without says which when it is called.
"""

from typing import TYPE_CHECKING

from farside.lazily import lazily

if TYPE_CHECKING:
    from farside.dem.lab.judging import Estimate, Judged, Judgement, still, train_then_judge
    from farside.dem.lab.metrics import CycleMetrics, cycle_metrics
    from farside.dem.lab.playing import Episode, play
    from farside.dem.lab.recall import Recall, memory
    from farside.dem.lab.worlds import REWARDED, GymWorld, Situation, World

__all__ = [
    "REWARDED",
    "CycleMetrics",
    "Episode",
    "Estimate",
    "GymWorld",
    "Judged",
    "Judgement",
    "Recall",
    "Situation",
    "World",
    "cycle_metrics",
    "memory",
    "play",
    "still",
    "train_then_judge",
]

__getattr__ = lazily(
    __name__,
    {
        "REWARDED": "worlds",
        "CycleMetrics": "metrics",
        "Episode": "playing",
        "Estimate": "judging",
        "GymWorld": "worlds",
        "Judged": "judging",
        "Judgement": "judging",
        "Recall": "recall",
        "Situation": "worlds",
        "World": "worlds",
        "cycle_metrics": "metrics",
        "memory": "recall",
        "play": "playing",
        "still": "judging",
        "train_then_judge": "judging",
    },
)
