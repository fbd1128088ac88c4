"""A controller that chooses nothing of itself: it takes its actions from outside a run."""

from farside.dem import Choice
from farside.rover.plain import PlainController


class QueuedController(PlainController):
    """Chooses what was put, once; without that it has the rover stand.

    It never says which goal an action serves, so in shared mode it proposes nothing.

    Attributes:
        is_asked: whether it was asked what to do, had nothing, and nothing was put since.
    """

    is_asked = False
    _put: str | None = None

    def put(self, action: str | None) -> None:
        """Choose this action the next time, in place of what was put before; `None` for nothing.

        Raises:
            ValueError: if the action is unknown.
        """
        if action is not None and action not in self.action_costs:
            known = ", ".join(self.actions)
            raise ValueError(f"expected one of the actions {known}, found {action!r}")
        self._put, self.is_asked = action, False

    def choose(self, *, explore: bool = True) -> Choice | None:
        """What was put; see `Controller`."""
        if not (explore and self.goals):
            return None
        action, self._put = self._put, None
        self.is_asked = action is None
        return None if action is None else Choice(action)
