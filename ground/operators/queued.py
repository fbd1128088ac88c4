"""Orders from outside a run: a person's, or a program's that watches it."""

from collections.abc import Sequence

import msgspec

from farside.acts import Act
from farside.ground.operators.operator import Situation
from farside.topics import OperatorEntry

_encode = msgspec.json.Encoder().encode
_decoder: msgspec.json.Decoder[Act] = msgspec.json.Decoder(Act)


class QueuedOperator:
    """Gives what was put, on the next tick, in order.

    Attributes:
        progress: see `Operator`: how many acts were given so far, of how many.
    """

    def __init__(self) -> None:
        self._waiting: list[Act] = []
        self.progress = OperatorEntry(0, 0, None)

    def put(self, acts: Sequence[Act]) -> None:
        """Have these given on the next tick, behind what was put before."""
        self._waiting += acts

    def act(self, situation: Situation) -> Sequence[Act]:  # noqa: ARG002 - it does not look
        """What was put since the last time; see `Operator`."""
        given, self._waiting = self._waiting, []
        if given:
            count = self.progress.of + len(given)
            self.progress = OperatorEntry(count, count, None)
        return given


def as_logged(act: Act) -> Act:
    """An act as the log will give it back, so that what is given again is the very same.

    JSON has no number that is not finite: a goal's priority like that becomes `None`, which the
    rover refuses as well.

    Raises:
        msgspec.ValidationError: if it is none.
    """
    return _decoder.decode(_encode(act))
