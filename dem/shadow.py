"""A shadow: the lists of a model elsewhere, kept identical by the changes that it reports.

The model first sends a whole, then deltas: the changes of its lists in order, not the resulting
numbers. A shadow repeats the changes on its own lists and so computes the same numbers to the last
bit.
"""

import math
from collections.abc import Iterable, Iterator, Mapping

from farside.dem.changes import (
    ActionAdded,
    CostSet,
    HypothesisAdded,
    HypothesisRemoved,
    ListChange,
    PredictionResult,
    SignAdded,
    SignRemoved,
    decoded_result,
)
from farside.dem.checking import CheckedLists, check_goals
from farside.dem.feed import FEW_CHANGES, Delta, Whole
from farside.dem.lists.actions import ActionList
from farside.dem.lists.check import lists_check
from farside.dem.lists.given import given, shown
from farside.dem.lists.goals import Goal, sought
from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.hypothesis import Hypothesis
from farside.dem.lists.signs import Sign, SignList, to_sign
from farside.dem.memory import UnreadableMemoryError, decompress
from farside.dem.parameters import Parameters, same
from farside.dem.policy.aversions import Aversion, AversionList, checked
from farside.dem.policy.planning import Planner, PolicyStep, PolicyValue, Why
from farside.dem.views import ListViews


class DeltaError(ValueError):
    """A delta that cannot be applied: an earlier one is missing, or it is of another model.

    The shadow is unchanged, unless the delta holds a change that no model can have made: then it is
    empty. To continue, it needs a whole; see `DynamicExpectancyModel.whole`.
    """


class ShadowModel(ListViews):
    """The lists of a model elsewhere, and its policy map. It learns nothing by itself.

    It is empty until a whole is applied; the first delta of any model is one.

    Args:
        action_costs: those of the model at its start; it may have met more actions since, and
            given them other costs.
        parameters: those of the model.

    Raises:
        TypeError: if the costs are no numbers by name, or the parameters are none.
        ValueError: if a cost is not finite and above 0.
    """

    def __init__(self, action_costs: Mapping[str, float], parameters: Parameters) -> None:
        self._first_actions = ActionList(action_costs).by_name
        self._parameters = given(Parameters, "parameters", parameters)
        self._agreed = [parameters]
        self._goals: tuple[Goal, ...] = ()
        self._averted: tuple[Aversion, ...] = ()
        self._number = 0
        self._check: int | None = None
        self._clear()

    def apply(self, delta: Delta) -> None:
        """Apply the next delta, or a whole.

        Raises:
            DeltaError: if it is not the next one, is a whole of a model with other actions or
                parameters, or holds an impossible change. The message says what was expected.
            UnreadableMemoryError: if the lists of a whole are damaged.
        """
        given(Delta, "delta", delta)
        try:
            check_goals(delta.goals or ())
            checked(delta.aversions or ())
        except ValueError as error:
            raise DeltaError(f"goals or aversions that no model has: {error}") from error
        if delta.whole is not None:
            self._restore(delta.whole)
        else:
            self._expect_next(delta)
        try:
            for change in delta.changes:
                self._check_change(change)
                self._repeat(change)
        except ValueError as error:
            self._clear()
            self._goals, self._averted, self._check = (), (), None
            raise DeltaError(f"a change that no model makes: {error}: ask for a whole") from error
        if delta.goals is not None:
            self._goals = delta.goals
        if delta.aversions is not None:
            self._averted = delta.aversions
            self._aversions.become(delta.aversions)
            self._hypotheses.follow_aversions()
        self._number, self._check = delta.number, delta.check
        # The maps are repaired when they are asked for; until then, what for is kept.
        if len(self._hypotheses.cost_changes) > FEW_CHANGES:
            self._planner.refresh()

    def agree(self, parameters: Parameters) -> None:
        """The model has these by now: they hold from the first whole that comes with them.

        Until then its wholes may come with any that were agreed on before.
        """
        self._agreed.append(given(Parameters, "parameters", parameters))

    def lists_check(self) -> int:
        """CRC-32 of the lists; equal to that of the model when this holds what that held."""
        return lists_check(self._actions, self._signs, self._hypotheses, self._goals, self._averted)

    @property
    def number(self) -> int:
        """Number of the last delta applied, 0 before any."""
        return self._number

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The Goal List of the model, the top-goal first."""
        return self._goals

    @property
    def aversions(self) -> tuple[Aversion, ...]:
        """The Signs that the model avoids, the oldest aversion first."""
        return self._averted

    def policy_map(self) -> tuple[PolicyValue, ...]:
        """The DPM as `DynamicExpectancyModel.policy_map` gives it."""
        self._aim()
        return self._planner.table()

    def value(self, tokens: Iterable[str]) -> float:
        """P_v of a Sign on that map; infinite if the Sign or a path is not known.

        Raises:
            TypeError: if `tokens` is a string.
        """
        sign = self._signs.find(to_sign(tokens))
        self._aim()
        return float("inf") if sign is None else self._planner.value(sign)

    def policy_path(
        self, tokens: Iterable[str], goal: Iterable[str] | None = None
    ) -> tuple[PolicyStep, ...]:
        """The best-estimate walk to the top-goal, or to `goal`, from where `tokens` are sensed.

        As `DynamicExpectancyModel.policy_path` gives it, with every known Sign active whose Tokens
        are all among them.

        Raises:
            TypeError: if `tokens` or `goal` is a string.
        """
        self._aim(goal)
        return self._planner.path(self._active(tokens))

    def why(self, tokens: Iterable[str], goal: Iterable[str] | None = None) -> Why | None:
        """The hypothesis behind the choice where `tokens` are sensed, and the runner-up.

        As `DynamicExpectancyModel.why` gives it, for the top-goal or for `goal`: `None` where the
        map suggests no action.

        Raises:
            TypeError: if `tokens` or `goal` is a string.
        """
        self._aim(goal)
        return self._planner.why(self._active(tokens))

    def cost_to(self, goal: Iterable[str], start: Iterable[str]) -> float:
        """P_v towards any Sign, of the best Sign that is active where `start` is sensed.

        As `DynamicExpectancyModel.cost_to` gives it: 0.0 if `start` implies the goal; infinite
        where no way is known.

        Raises:
            ValueError: if `goal` has no Tokens.
            TypeError: if `goal` or `start` is a string.
        """
        wanted, begin = to_sign(goal), to_sign(start)
        if not wanted:
            raise ValueError("goal: expected one Token at least, found none")
        if set(wanted).issubset(begin):
            return 0.0
        return self._planner.cost_to(wanted, self._signs.active(begin))

    def expected(self, tokens: Iterable[str], action: str) -> Hypothesis | None:
        """The most credible hypothesis of what `action` leads to where `tokens` are sensed.

        As `DynamicExpectancyModel.expected` gives it: `None` if nothing is known.

        Raises:
            ValueError: if the action is unknown. The message names the known ones.
            TypeError: if `tokens` is a string.
        """
        asked = self._actions.id_of(action)
        return self._hypotheses.most_credible(self._active(tokens), asked, self._signs.names)

    def expectations(self, tokens: Iterable[str], action: str) -> tuple[Hypothesis, ...]:
        """Every hypothesis of what `action` leads to in the next cycle, where `tokens` are sensed.

        Raises:
            ValueError: if the action is unknown. The message names the known ones.
            TypeError: if `tokens` is a string.
        """
        asked, hypotheses = self._actions.id_of(action), self._hypotheses
        return tuple(
            hypotheses.one_named(one, self._signs.names)
            for context in self._active(tokens)
            for one in hypotheses.of_cause(context, asked)
            if hypotheses.delay[one] == 1
        )

    def track_record(self) -> tuple[int, int]:
        """How often the most credible expectations of the next cycle came true, and fell due.

        Summed over each context and action that there are hypotheses of.
        """
        return self._hypotheses.track_record()

    def came_true(self, delta: Delta) -> tuple[bool, ...]:
        """Whether each of the most credible expectations that fall due in a delta came true.

        Those of the next cycle that are the most credible of their context and action by the lists
        as they are, before the delta is applied; none of a whole, of which it is not known.
        """
        if given(Delta, "delta", delta).whole is not None:
            return ()
        lists, true = self._hypotheses, []
        for change in delta.changes:
            if not isinstance(change, int):
                continue
            one, result = decoded_result(change)
            if not lists.is_living(one) or lists.delay[one] != 1:
                continue
            rivals = lists.of_cause(lists.context[one], lists.action[one])
            ranks = (
                (lists.cm[rival], -lists.born[rival]) for rival in rivals if lists.delay[rival] == 1
            )
            if max(ranks) == (lists.cm[one], -lists.born[one]):
                true.append(result is not PredictionResult.FAILED)
        return tuple(true)

    def costs_to(self, goal: Iterable[str]) -> Iterator[tuple[Sign, float]]:
        """Every known Sign from which a way to `goal` is known, oldest first, with its P_v.

        Raises:
            TypeError: if `goal` is a string.
        """
        self._aim(goal)
        for sign in self._signs.by_age():
            value = self._planner.value(sign)
            if value < math.inf:
                yield self._signs.names[sign], value

    def _active(self, tokens: Iterable[str]) -> list[int]:
        return self._signs.active(to_sign(tokens))

    def _aim(self, goal: Iterable[str] | None = None) -> None:
        wanted = sought(self._goals) if goal is None else to_sign(goal)
        self._planner.aim(wanted, [known.tokens for known in self._goals])

    def _clear(self, costs: Mapping[str, float] | None = None) -> None:
        self._actions = ActionList({})
        self._actions.restore(self._first_actions if costs is None else costs)
        self._signs = SignList()
        self._aversions = AversionList(self._signs)
        self._hypotheses = HypothesisList(self._actions, self._parameters, self._aversions)
        self._planner = Planner(self._signs, self._hypotheses, self._actions, self._parameters)

    def _restore(self, packed: bytes) -> None:
        whole = decompress(packed, Whole)
        agreed = next((one for one in self._agreed if same(whole.parameters, one)), None)
        if agreed is None or not whole.action_costs.keys() >= self._first_actions.keys():
            raise DeltaError(
                f"the lists of another model: expected the actions {shown([*self._first_actions])} "
                f"and {self._parameters}, found {shown([*whole.action_costs])} and "
                f"{whole.parameters}"
            )
        self._parameters = agreed
        try:
            actions = ActionList({})
            actions.restore(whole.action_costs)
            CheckedLists(actions, self._parameters, whole.signs, whole.hypotheses)
        except ValueError as error:
            raise UnreadableMemoryError(f"lists that no model has: {error}") from error
        self._clear(whole.action_costs)
        self._signs.restore(whole.signs)
        self._hypotheses.restore(whole.hypotheses)

    def _expect_next(self, delta: Delta) -> None:
        if self._check is None:
            raise DeltaError(f"expected a whole first, found delta {delta.number}: ask for a whole")
        if delta.number != self._number + 1:
            raise DeltaError(
                f"expected delta {self._number + 1}, found delta {delta.number}: ask for a whole"
            )
        if delta.follows != self._check:
            follows = "none" if delta.follows is None else f"{delta.follows:08x}"
            raise DeltaError(
                f"delta {delta.number} is of another model: expected it to follow "
                f"{self._check:08x}, found that it follows {follows}: ask for a whole"
            )

    def _check_change(self, change: ListChange) -> None:
        """Expect a change that a model with these lists can have made.

        Raises:
            ValueError: if it cannot.
        """
        match change:
            case int():
                self._expect_hypothesis(change // len(PredictionResult))
            case SignAdded(sign):
                known = self._signs.find(sign) is not None
                if not sign or sign != to_sign(sign) or known:
                    raise ValueError(f"expected a new Sign, found {sign}")
            case SignRemoved(sign):
                self._expect_sign(sign)
                outcomes = self._hypotheses.by_outcome
                if self._hypotheses.is_context(sign) or not outcomes.is_empty(sign):
                    raise ValueError(f"expected a Sign without hypotheses, found {sign}")
            case HypothesisAdded(context, action, outcome, delay, credit):
                self._expect_sign(context)
                self._expect_sign(outcome)
                possible = action in range(len(self._actions)) and 0 <= credit <= 1
                possible = possible and 1 <= delay <= self._parameters.reach
                if not possible or self._hypotheses.holds(context, action, outcome, delay):
                    raise ValueError(f"expected a new hypothesis, found {change}")
            case HypothesisRemoved(hypothesis):
                self._expect_hypothesis(hypothesis)
            case ActionAdded() | CostSet():
                self._check_action(change)

    def _check_action(self, change: ActionAdded | CostSet) -> None:
        known = self._actions.names
        if isinstance(change, ActionAdded):
            possible = self._actions.find(change.action) is None
        else:
            possible = change.action in range(len(known))
        if not possible or not 0.0 < change.cost < math.inf:
            raise ValueError(f"expected an action at a cost above 0, found {change}")

    def _expect_sign(self, sign: int) -> None:
        if sign not in range(len(self._signs.names)) or not self._signs.names[sign]:
            raise ValueError(f"expected a known Sign, found {sign}")

    def _expect_hypothesis(self, hypothesis: int) -> None:
        if not self._hypotheses.is_living(hypothesis):
            raise ValueError(f"expected a known hypothesis, found {hypothesis}")

    def _repeat(self, change: ListChange) -> None:
        match change:
            case int():
                self._settle(change)
            case SignAdded(sign):
                self._signs.add(sign)
            case SignRemoved(sign_id):
                self._signs.remove(sign_id)
            case HypothesisAdded(context, action, outcome, delay, credit):
                self._hypotheses.add(context, action, outcome, delay, credit)
            case HypothesisRemoved(hypothesis):
                self._hypotheses.remove(hypothesis)
            case ActionAdded(name, cost):
                self._hypotheses.register(name, cost)
            case CostSet(action_id, cost):
                self._hypotheses.set_cost(action_id, cost)

    def _settle(self, change: int) -> None:
        hypothesis, result = decoded_result(change)
        if result is PredictionResult.FAILED:
            self._hypotheses.fail(hypothesis)
        else:
            self._hypotheses.succeed(hypothesis, alone=result is PredictionResult.ALONE)
