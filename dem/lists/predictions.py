"""P, the Prediction List."""

from collections import deque


class PredictionList:
    """P, the hypotheses with open predictions, by the cycle in which the outcome is due."""

    def __init__(self, reach: int) -> None:
        # As keys, in the order in which they were made: one can be dropped without a search.
        self._due: deque[dict[int, None]] = deque({} for _ in range(reach))

    def extend(self, cycles: int) -> None:
        """Take predictions for so many cycles more than before."""
        self._due.extend({} for _ in range(cycles))

    def add(self, hypothesis: int, delay: int) -> None:
        """Note that `hypothesis` predicts its outcome `delay` cycles from now."""
        self._due[delay - 1][hypothesis] = None

    def take_due(self) -> list[int]:
        """Advance by one cycle and take P*, the predictions due in it."""
        due = self._due.popleft()
        self._due.append({})
        return list(due)

    def forget(self, hypothesis: int) -> None:
        """Drop the predictions of a hypothesis that is being removed."""
        for due in self._due:
            due.pop(hypothesis, None)

    def state(self) -> tuple[tuple[int, ...], ...]:
        """Everything that `restore` needs: the hypotheses, by number of cycles until due."""
        return tuple(tuple(due) for due in self._due)

    def restore(self, state: tuple[tuple[int, ...], ...]) -> None:
        """Become the list that `state` was taken from. This one must be new."""
        self._due = deque(dict.fromkeys(due) for due in state)
