"""How often, and how long ago, each Action was performed while each Sign was active."""

from array import array

import msgspec

from farside.dem.lists.packing import packed, unpack_into, widen


class TrialsState(msgspec.Struct, frozen=True, array_like=True):
    """The `packed` columns of `Trials`."""

    tries: bytes
    last: bytes


class Trials:
    """Trials of each pair of context and action, by the index of `HypothesisList.cause`.

    Attributes:
        tries: number of times that the action was performed while the context was active.
        last: cycle of the last time, -1 for never.
    """

    def __init__(self) -> None:
        self.tries = array("i")
        self.last = array("q")

    def widen(self, before: int, after: int) -> None:
        """Have `after` actions where there were `before`."""
        widen(self.tries, before, after, 0)
        widen(self.last, before, after, -1)

    def count(self, cause: int, cycle: int) -> None:
        """Count a trial in `cycle`."""
        if cause >= len(self.tries):
            missing = cause + 1 - len(self.tries)
            self.tries.extend([0] * missing)
            self.last.extend([-1] * missing)
        self.tries[cause] += 1
        self.last[cause] = cycle

    def tried(self, cause: int) -> int:
        """The number of trials."""
        return self.tries[cause] if cause < len(self.tries) else 0

    def last_tried(self, cause: int) -> int:
        """The cycle of the last trial, -1 for never."""
        return self.last[cause] if cause < len(self.last) else -1

    def forget(self, causes: range) -> None:
        """Reset the trials of a Sign that is being removed."""
        for cause in causes:
            if cause < len(self.tries):
                self.tries[cause] = 0
                self.last[cause] = -1

    def state(self) -> TrialsState:
        """Everything that `restore` needs."""
        return TrialsState(packed(self.tries), packed(self.last))

    def restore(self, state: TrialsState) -> None:
        """Become what `state` was taken from. This one must be new."""
        unpack_into(self.tries, state.tries)
        unpack_into(self.last, state.last)
