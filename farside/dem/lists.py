"""The five lists of the model: Signs, Actions, µ-hypotheses, Predictions and Goals.

Inside, Signs, Actions and hypotheses are small integers that count from 0 in order of age, and a
hypothesis is a row across typed columns: it takes tens of bytes, and numpy can view a column
without copying it. Outside, a Sign is its Tokens and an Action its name.
"""

import math
from array import array
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import msgspec

from farside.dem.equations import cost_estimate, reinforced, weakened
from farside.dem.parameters import Parameters

Sign = tuple[str, ...]
"""A conjunction of Tokens: each of them once, sorted."""


def to_sign(tokens: Iterable[str]) -> Sign:
    """The Sign of `tokens`, in whatever order they come and however often.

    Raises:
        TypeError: if `tokens` is a string, whose letters would pass for Tokens.
    """
    if isinstance(tokens, str):
        raise TypeError(f"expected Tokens, found the string {tokens!r}: write [{tokens!r}]")
    return tuple(sorted(set(tokens)))


class Goal(msgspec.Struct, frozen=True):
    """A Sign to be made active, and how much that matters beside other goals (any scale)."""

    tokens: Sign
    priority: float


class Hypothesis(msgspec.Struct, frozen=True):
    """A µ-hypothesis: context ∧ action → outcome after `delay` cycles.

    Attributes:
        context, outcome: Signs.
        action: an Action's name.
        delay: cycles from context and action to outcome, 1 or more.
        cm: corroboration measure C_m, 0 to 1.
        predictions: how often it predicted and was judged.
        successes: how many of these predictions came true.
    """

    context: Sign
    action: str
    outcome: Sign
    delay: int
    cm: float
    predictions: int
    successes: int


class Sensing(NamedTuple):
    """What `SignList.sense` found, in order of age: the active Signs, and the novel among them."""

    active: list[int]
    novel: list[int]


class SignList:
    """S, every known Sign.

    A Token makes its own Sign when it is first sensed. A conjunction of several is watched under
    one of its Tokens only, the least watched, so that finding the active Signs costs what is
    sensed and not what is known.
    """

    def __init__(self) -> None:
        self.names: list[Sign] = []
        self._ids: dict[Sign, int] = {}
        self._watched: dict[str, list[int]] = {}
        self._never_active: set[int] = set()

    def __len__(self) -> int:
        return len(self.names)

    def find(self, sign: Sign) -> int | None:
        """The id of `sign`, `None` where it is not known."""
        return self._ids.get(sign)

    def add_conjunction(self, sign: Sign) -> None:
        """Make a Sign of several Tokens known, if it is not yet."""
        if sign in self._ids:
            return
        known = self._add(sign)
        self._never_active.add(known)
        watches = [self._watched.setdefault(token, []) for token in sign]
        min(watches, key=len).append(known)

    def sense(self, tokens: Sign) -> Sensing:
        """Find the active Signs, making one for each new Token."""
        active, novel = [], []
        for token in tokens:
            sign = self._ids.get((token,))
            if sign is None:
                sign = self._add((token,))
                novel.append(sign)
            active.append(sign)
        if self._watched:
            conjunctions = self._active_conjunctions(tokens)
            active += conjunctions
            novel += self._never_active.intersection(conjunctions)
            self._never_active.difference_update(conjunctions)
        return Sensing(sorted(active), sorted(novel))

    def _active_conjunctions(self, tokens: Sign) -> list[int]:
        sensed = set(tokens)
        return [
            sign
            for token in tokens
            for sign in self._watched.get(token, ())
            if sensed.issuperset(self.names[sign])
        ]

    def _add(self, sign: Sign) -> int:
        known = self._ids[sign] = len(self.names)
        self.names.append(sign)
        return known


class ActionList:
    """A, what can be done and what it costs, ordered by name.

    Raises:
        ValueError: if there is no action, or a cost is not finite and above 0. A free action
            would make endless walks as good as short ones.
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
            ValueError: if there is none of this name.
        """
        if name not in self._ids:
            raise ValueError(
                f"unknown action {name!r}: expected one of {', '.join(map(repr, self.names))}"
            )
        return self._ids[name]


class HypothesisList:
    """H, every µ-hypothesis, indexed by (context, action) and by outcome.

    Attributes:
        context, action, outcome, delay, cm, predictions, successes: see `Hypothesis`.
        cost: cost estimate C_e, kept up with C_m.
        revision: moves on whenever a hypothesis is added or a C_m changes.
        cm_sum: sum of all C_m, kept up with each change.
    """

    def __init__(self, actions: ActionList, parameters: Parameters) -> None:
        self.context = array("i")
        self.action = array("i")
        self.outcome = array("i")
        self.delay = array("i")
        self.cm = array("d")
        self.cost = array("d")
        self.predictions = array("q")
        self.successes = array("q")
        self.revision = 0
        self.cm_sum = 0.0
        self._actions = actions
        self._parameters = parameters
        self._by_cause: dict[int, list[int]] = {}
        self._by_outcome: dict[int, list[int]] = {}

    def __len__(self) -> int:
        return len(self.cm)

    def of_cause(self, context: int, action: int) -> Sequence[int]:
        """The hypotheses that `context` and `action` make active, in order of age."""
        return self._by_cause.get(context * len(self._actions) + action, ())

    def of_outcome(self, outcome: int) -> Sequence[int]:
        """The hypotheses that end in `outcome`, in order of age."""
        return self._by_outcome.get(outcome, ())

    def holds(self, context: int, action: int, outcome: int, delay: int) -> bool:
        """Whether there is this very hypothesis."""
        return any(
            self.outcome[same] == outcome and self.delay[same] == delay
            for same in self.of_cause(context, action)
        )

    def add(self, context: int, action: int, outcome: int, delay: int) -> None:
        """Append a new hypothesis with the first C_m. The caller makes sure that it is new."""
        added = len(self)
        cm = self._parameters.initial_cm
        self.context.append(context)
        self.action.append(action)
        self.outcome.append(outcome)
        self.delay.append(delay)
        self.cm.append(cm)
        self.cost.append(cost_estimate(self._actions.costs[action], cm))
        self.predictions.append(0)
        self.successes.append(0)
        self._by_cause.setdefault(context * len(self._actions) + action, []).append(added)
        self._by_outcome.setdefault(outcome, []).append(added)
        self.revision += 1
        self.cm_sum += cm

    def corroborate(self, hypothesis: int, *, success: bool) -> None:
        """Settle a prediction of `hypothesis`: the only way in which a C_m ever changes."""
        before = self.cm[hypothesis]
        if success:
            after = reinforced(before, self._parameters.alpha)
            self.successes[hypothesis] += 1
        else:
            after = weakened(before, self._parameters.beta)
        self.predictions[hypothesis] += 1
        if after != before:
            self.cm[hypothesis] = after
            self.cost[hypothesis] = cost_estimate(
                self._actions.costs[self.action[hypothesis]], after
            )
            self.revision += 1
            self.cm_sum += after - before


class PredictionList:
    """P, the hypotheses that have predicted, by the cycle in which their outcome is due."""

    def __init__(self, reach: int) -> None:
        self._due: deque[list[int]] = deque([] for _ in range(reach))

    def add(self, hypothesis: int, delay: int) -> None:
        """Note that `hypothesis` predicts its outcome `delay` cycles from now."""
        self._due[delay - 1].append(hypothesis)

    def take_due(self) -> list[int]:
        """Move on by one cycle and take P*, the predictions due in it."""
        due = self._due.popleft()
        self._due.append([])
        return due


class GoalList:
    """G, the goals, highest priority first and ties to the older."""

    def __init__(self) -> None:
        self.ordered: tuple[Goal, ...] = ()
        self._priorities: dict[Sign, float] = {}

    def set(self, sign: Sign, priority: float) -> None:
        """Add a goal, or change its priority, which leaves it its age.

        Raises:
            ValueError: if `sign` has no Tokens or `priority` is not finite.
        """
        if not sign:
            raise ValueError("a goal: expected one Token at least, found none")
        if not math.isfinite(priority):
            raise ValueError(f"priority of goal {sign}: expected a finite number, found {priority}")
        self._priorities[sign] = priority
        self._order()

    def withdraw(self, sign: Sign) -> bool:
        """Remove a goal. False if there was none of this Sign."""
        found = self._priorities.pop(sign, None) is not None
        self._order()
        return found

    def take_satisfied(self, tokens: Sign) -> tuple[Goal, ...]:
        """Remove and return the goals that are active when `tokens` are sensed."""
        satisfied = tuple(goal for goal in self.ordered if set(goal.tokens).issubset(tokens))
        for goal in satisfied:
            self.withdraw(goal.tokens)
        return satisfied

    def _order(self) -> None:
        goals = (Goal(sign, priority) for sign, priority in self._priorities.items())
        self.ordered = tuple(sorted(goals, key=lambda goal: -goal.priority))
