"""What happens to the lists, written down as it happens, for a shadow of them elsewhere.

Ids are those of the lists. A shadow that starts from the same lists and does the same to them
gives the same ids, so nothing that is added has to name its own.
"""

from enum import IntEnum

import msgspec


class SignAdded(msgspec.Struct, frozen=True, array_like=True, tag=0):
    """A Sign of these Tokens became known."""

    sign: tuple[str, ...]


class SignRemoved(msgspec.Struct, frozen=True, array_like=True, tag=1):
    """A Sign was forgotten."""

    sign: int


class HypothesisAdded(msgspec.Struct, frozen=True, array_like=True, tag=2):
    """A hypothesis was made, with the first C_m."""

    context: int
    action: int
    outcome: int
    delay: int
    credit: float


class HypothesisRemoved(msgspec.Struct, frozen=True, array_like=True, tag=3):
    """A hypothesis was forgotten."""

    hypothesis: int


class Verdict(IntEnum):
    """How a prediction was judged; `ALONE` and `ACCOMPANIED` as in `HypothesisList.succeed`."""

    FAILED = 0
    ALONE = 1
    ACCOMPANIED = 2


Entry = int | SignAdded | SignRemoved | HypothesisAdded | HypothesisRemoved
"""One thing that happened to the lists. A number is a prediction judged, see `judged`: by far the
most frequent, it takes one to five bytes."""


def judged(hypothesis: int, verdict: Verdict) -> int:
    """The entry for a prediction of a hypothesis that was judged."""
    return hypothesis * len(Verdict) + verdict


def judgement(entry: int) -> tuple[int, Verdict]:
    """The hypothesis and the verdict that `judged` made an entry of."""
    hypothesis, verdict = divmod(entry, len(Verdict))
    return hypothesis, Verdict(verdict)
