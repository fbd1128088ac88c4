"""A, the Action List."""

import math
from collections.abc import Mapping


class ActionList:
    """A, the actions and their costs, ordered by name. The id of an action is its index.

    Raises:
        ValueError: if there is no action, or a cost is not finite and above 0. With a free action,
            an endless walk would cost no more than a short one.
    """

    def __init__(self, costs: Mapping[str, float]) -> None:
        if not costs:
            raise ValueError("expected the cost of one action at least, found none")
        self.names = tuple(sorted(costs))
        self.costs = tuple(costs[name] for name in self.names)
        self._ids = {name: action for action, name in enumerate(self.names)}
        for name, cost in zip(self.names, self.costs, strict=True):
            if not 0.0 < cost < math.inf:
                raise ValueError(f"cost of action {name!r}: expected above 0, found {cost}")

    def __len__(self) -> int:
        return len(self.names)

    def id_of(self, name: str) -> int:
        """The id of an action.

        Raises:
            ValueError: if the name is unknown. The message lists the known ones.
        """
        if name not in self._ids:
            raise ValueError(
                f"unknown action {name!r}: expected one of {', '.join(map(repr, self.names))}"
            )
        return self._ids[name]
