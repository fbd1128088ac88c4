"""A, the Action List."""

from collections.abc import Mapping

from farside.dem.lists import given

_NAMED = 20  # so many known actions a message names


class ActionList:
    """A, the actions and their costs. The id of an action is its index.

    The first ones are ordered by name; those that are met later follow as they were met.

    Args:
        costs: the cost of each action that is known from the start.

    Attributes:
        names: the actions, by id.
        costs: the cost of each, by id.

    Raises:
        TypeError, ValueError: as `given.costs` does.
    """

    def __init__(self, costs: Mapping[str, float]) -> None:
        self.names: list[str] = []
        self.costs: list[float] = []
        self._ids: dict[str, int] = {}
        self.restore(dict(sorted(given.costs(costs).items())))

    def __len__(self) -> int:
        return len(self.names)

    @property
    def by_name(self) -> dict[str, float]:
        """The costs by name, in order of id: everything that `restore` needs."""
        return dict(zip(self.names, self.costs, strict=True))

    def restore(self, costs: Mapping[str, float]) -> None:
        """Become the list that `by_name` was taken from. This one must be empty.

        Raises:
            ValueError: if a cost is not finite and above 0.
        """
        for name, cost in costs.items():
            self.add(name, cost)

    def add(self, name: str, cost: float) -> int:
        """Add an action that is not known yet, and return its id; raises what `given.cost` does."""
        self.costs.append(given.cost(name, cost))
        self.names.append(name)
        self._ids[name] = len(self._ids)
        return self._ids[name]

    def set_cost(self, action: int, cost: float) -> None:
        """Have an action cost something else; raises what `given.cost` does."""
        self.costs[action] = given.cost(self.names[action], cost)

    @property
    def default_cost(self) -> float:
        """The cost of an action that is met: that of the dearest known one, 1 without one.

        So nothing that was found out at a known cost looks dear beside it (project default).
        """
        return max(self.costs, default=1.0)

    def find(self, name: str) -> int | None:
        """The id of an action, `None` if it is not known.

        Raises:
            TypeError: if `name` is no string.
        """
        return self._ids.get(given.name("an action", name))

    def id_of(self, name: str) -> int:
        """The id of an action.

        Raises:
            TypeError: if `name` is no string.
            ValueError: if it is unknown. The message lists the known ones.
        """
        known = self.find(name)
        if known is None:
            raise ValueError(f"unknown action {given.shown(name)}: expected {self._known()}")
        return known

    def _known(self) -> str:
        if not self.names:
            return "none: no action was performed yet"
        more = len(self) - _NAMED
        named = ", ".join(map(given.shown, self.names[:_NAMED]))
        return f"one of {named}" + (f" and {more} more" if more > 0 else "")
