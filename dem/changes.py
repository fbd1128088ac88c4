"""The changes of the lists, one by one, for a shadow that repeats them elsewhere.

Ids are those of the lists. A shadow that begins with the same lists and repeats the same changes
assigns the same ids, so an addition does not have to name its own.
"""

from enum import IntEnum

import msgspec


class SignAdded(msgspec.Struct, frozen=True, array_like=True, tag=0):
    """A Sign of these Tokens became known."""

    sign: tuple[str, ...]


class SignRemoved(msgspec.Struct, frozen=True, array_like=True, tag=1):
    """The Sign with this id was removed."""

    sign: int


class HypothesisAdded(msgspec.Struct, frozen=True, array_like=True, tag=2):
    """A hypothesis was created, with the initial C_m and this credit."""

    context: int
    action: int
    outcome: int
    delay: int
    credit: float


class HypothesisRemoved(msgspec.Struct, frozen=True, array_like=True, tag=3):
    """The hypothesis with this id was removed."""

    hypothesis: int


class PredictionResult(IntEnum):
    """The result of a prediction; a success is `ALONE` or not as in `HypothesisList.succeed`."""

    FAILED = 0
    ALONE = 1
    ACCOMPANIED = 2


class ActionAdded(msgspec.Struct, frozen=True, array_like=True, tag=4):
    """An action was met for the first time, and has this cost."""

    action: str
    cost: float


class CostSet(msgspec.Struct, frozen=True, array_like=True, tag=5):
    """The action with this id has another cost from now on."""

    action: int
    cost: float


ListChange = (
    int | SignAdded | SignRemoved | HypothesisAdded | HypothesisRemoved | ActionAdded | CostSet
)
"""A change of the lists. An integer is the result of a prediction, see `encoded_result`: the most
frequent change by far, it takes one to five bytes."""


def encoded_result(hypothesis: int, result: PredictionResult) -> int:
    """The change that a prediction of `hypothesis` had this result."""
    return hypothesis * len(PredictionResult) + result


def decoded_result(change: int) -> tuple[int, PredictionResult]:
    """The hypothesis and the result that `encoded_result` was given."""
    hypothesis, result = divmod(change, len(PredictionResult))
    return hypothesis, PredictionResult(result)
