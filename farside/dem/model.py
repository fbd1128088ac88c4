"""The cycle of the Dynamic Expectancy Model: sense and learn, choose, perform and predict."""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence

import msgspec
from numpy.random import Generator

from farside.dem.lists import (
    ActionList,
    Goal,
    GoalList,
    Hypothesis,
    HypothesisList,
    PredictionList,
    Sign,
    SignList,
    to_sign,
)
from farside.dem.parameters import Parameters
from farside.dem.policy import DynamicPolicyMap, PathStep, PolicyValue

_DEFAULTS = Parameters()


class Sensed(msgspec.Struct, frozen=True):
    """What a cycle sensed and learned.

    Attributes:
        tokens: what was sensed, sorted.
        active: the active Signs S*, in order of age, as all Signs here.
        novel: those active for the first time ever.
        unexpected: those others that no due prediction named; all of them where none was due.
        succeeded, failed: how many due predictions came true, or did not.
        created: how many hypotheses were made.
        reached: goals satisfied and removed, highest first.
    """

    tokens: Sign
    active: tuple[Sign, ...]
    novel: tuple[Sign, ...]
    unexpected: tuple[Sign, ...]
    succeeded: int
    failed: int
    created: int
    reached: tuple[Goal, ...]


class Choice(msgspec.Struct, frozen=True):
    """The action that the model would take, and why.

    Attributes:
        action: its name.
        goal: the top-goal's Sign, `None` where the choice is exploratory.
        sign: the active Sign that it acts from, `None` where exploratory.
        cost_to_go: policy value P_v of `sign`, `None` where exploratory.
    """

    action: str
    goal: Sign | None = None
    sign: Sign | None = None
    cost_to_go: float | None = None


class DynamicExpectancyModel:
    """Learns what follows from what is done, and how to reach goals by it.

    A cycle is `sense`, then `choose` where the model is to choose, then `perform` with the action
    that was really performed. Learning takes the action from `perform` alone, so it is the same
    whoever chose it. Goals may be set and withdrawn at any point.

    Args:
        action_costs: cost of each action, above 0, in one unit (s, J).
        parameters: how to learn.
        rng: the only source of randomness: one draw for each opportunity to create a hypothesis
            and one for each exploratory choice.

    Raises:
        ValueError: if there is no action, or a cost is not finite and above 0.
    """

    def __init__(
        self,
        action_costs: Mapping[str, float],
        parameters: Parameters = _DEFAULTS,
        *,
        rng: Generator,
    ) -> None:
        self._rng = rng
        self._learning_probability = parameters.learning_probability
        self._signs = SignList()
        self._actions = ActionList(action_costs)
        self._hypotheses = HypothesisList(self._actions, parameters)
        self._predictions = PredictionList(parameters.reach)
        self._goals = GoalList()
        self._active: list[int] = []
        self._awaits_action = False
        # What was active and what was done, one cycle ago first.
        self._traces: deque[tuple[list[int], int | None]] = deque(maxlen=parameters.reach)
        self._map: DynamicPolicyMap | None = None
        self._map_key: tuple[int | None, int, int] = (None, 0, 0)

    # --- the cycle -----------------------------------------------------------------------------

    def sense(self, tokens: Iterable[str]) -> Sensed:
        """Begin a cycle: take in `tokens`, learn from them, drop the goals they satisfy.

        Predictions due now strengthen or weaken their hypotheses. Every novel or unexpected Sign
        gets hypotheses that end in it, one from each Sign active at each lag within reach with
        the action performed then (source: seed; which candidates: project default).

        Raises:
            RuntimeError: if the last cycle was not ended by `perform`.
            TypeError: if `tokens` is a string.
        """
        if self._awaits_action:
            raise RuntimeError(
                "sense() twice in a cycle: end it with perform(action), or with perform(None) "
                "if nothing was done"
            )
        sensed = to_sign(tokens)
        self._active, novel = self._signs.sense(sensed)
        predicted, succeeded, failed = self._settle()
        unexpected = [s for s in self._active if s not in predicted and s not in novel]
        created = self._create(novel + unexpected)
        self._awaits_action = True
        return Sensed(
            tokens=sensed,
            active=self._named(self._active),
            novel=self._named(novel),
            unexpected=self._named(unexpected),
            succeeded=succeeded,
            failed=failed,
            created=created,
            reached=self._goals.take_satisfied(sensed),
        )

    def choose(self) -> Choice:
        """The action to take now; it is not yet performed.

        Goal-directed where the top-goal's DPM holds an active Sign: the best action of the one
        with the least policy value. Otherwise exploratory, any action with the same chance; also
        where the top-goal is active already, having been set since `sense`.

        Raises:
            RuntimeError: if nothing was sensed since the last `perform`.
        """
        self._expect_sensed("choose")
        policy, sign = self._plan()
        if policy is None or sign is None:
            return Choice(self._actions.names[self._rng.integers(len(self._actions))])
        return Choice(
            action=self._action_of(policy.best[sign]),
            goal=self._signs.names[policy.goal],
            sign=self._signs.names[sign],
            cost_to_go=policy.value[sign],
        )

    def perform(self, action: str | None) -> None:
        """End a cycle with the action really performed, `None` if there was none.

        Every hypothesis whose context and action are active makes its prediction. Standing still
        is not an action: nothing is predicted from it and nothing is learned of it.

        Raises:
            RuntimeError: if nothing was sensed since the last `perform`.
            ValueError: if there is no such action. The message names the known ones.
        """
        self._expect_sensed("perform")
        performed = None if action is None else self._actions.id_of(action)
        if performed is not None:
            for context in self._active:
                for hypothesis in self._hypotheses.of_cause(context, performed):
                    self._predictions.add(hypothesis, self._hypotheses.delay[hypothesis])
        self._traces.appendleft((self._active, performed))
        self._awaits_action = False

    def _expect_sensed(self, wanted: str) -> None:
        if not self._awaits_action:
            raise RuntimeError(
                f"{wanted}() before sense(): the order of a cycle is sense, choose if the model "
                "is to choose, perform"
            )

    def _settle(self) -> tuple[set[int], int, int]:
        """Judge P*: the Signs that it named, how many came true, how many did not."""
        due = self._predictions.take_due()
        predicted = set()
        succeeded = 0
        for hypothesis in due:
            outcome = self._hypotheses.outcome[hypothesis]
            predicted.add(outcome)
            success = outcome in self._active
            succeeded += success
            self._hypotheses.corroborate(hypothesis, success=success)
        return predicted, succeeded, len(due) - succeeded

    def _create(self, outcomes: list[int]) -> int:
        before = len(self._hypotheses)
        for outcome in outcomes:
            for delay, (contexts, action) in enumerate(self._traces, start=1):
                if action is not None:
                    for context in contexts:
                        self._consider(context, action, outcome, delay)
        return len(self._hypotheses) - before

    def _consider(self, context: int, action: int, outcome: int, delay: int) -> None:
        if self._hypotheses.holds(context, action, outcome, delay):
            return
        if self._rng.random() < self._learning_probability:
            self._hypotheses.add(context, action, outcome, delay)

    # --- goals and the policy ------------------------------------------------------------------

    def set_goal(self, tokens: Iterable[str], priority: float) -> None:
        """Put a Sign on the Goal List, or change its priority. Higher priorities come first.

        A Sign of several Tokens becomes known by this. One of a single Token that was never
        sensed is a goal that no map reaches until it is. A goal whose Sign is active already is
        satisfied at the next `sense`.

        Raises:
            ValueError: if there are no Tokens or `priority` is not finite.
            TypeError: if `tokens` is a string.
        """
        sign = to_sign(tokens)
        self._goals.set(sign, priority)
        if len(sign) > 1:
            self._signs.add_conjunction(sign)

    def withdraw_goal(self, tokens: Iterable[str]) -> bool:
        """Take a Sign off the Goal List. False if it was not there."""
        return self._goals.withdraw(to_sign(tokens))

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The Goal List: highest priority first, ties to the older. The first is the top-goal."""
        return self._goals.ordered

    def policy_map(self) -> tuple[PolicyValue, ...]:
        """The top-goal's DPM, ordered by value, then Sign. Empty without a known top-goal."""
        policy = self._policy()
        if policy is None:
            return ()
        rows = [
            PolicyValue(
                sign=name,
                value=policy.value[sign],
                action=None if sign == policy.goal else self._action_of(policy.best[sign]),
                depth=policy.depth[sign],
            )
            for sign, name in enumerate(self._signs.names)
            if policy.depth[sign] >= 0
        ]
        return tuple(sorted(rows, key=lambda row: (row.value, row.sign)))

    def policy_path(self) -> tuple[PathStep, ...]:
        """The best-estimate walk from what was last sensed to the top-goal.

        Empty where `choose` would explore. The goal itself is not a step.
        """
        policy, start = self._plan()
        if policy is None or start is None:
            return ()
        return tuple(
            PathStep(
                sign=self._signs.names[self._hypotheses.context[hypothesis]],
                action=self._action_of(hypothesis),
                cost_to_go=policy.value[self._hypotheses.context[hypothesis]],
                probability=self._hypotheses.cm[hypothesis],
            )
            for hypothesis in policy.walk(start)
        )

    def _plan(self) -> tuple[DynamicPolicyMap | None, int | None]:
        """The top-goal's DPM and the active Sign to act from, as far as there are such."""
        policy = self._policy()
        return policy, None if policy is None else policy.entry(self._active)

    def _policy(self) -> DynamicPolicyMap | None:
        """The DPM, made anew only if the top-goal or an arc of it has changed."""
        goals = self._goals.ordered
        goal = self._signs.find(goals[0].tokens) if goals else None
        key = (goal, len(self._signs), self._hypotheses.revision)
        if key != self._map_key:
            self._map_key = key
            self._map = None if goal is None else DynamicPolicyMap(goal, key[1], self._hypotheses)
        return self._map

    # --- looking at the lists ------------------------------------------------------------------

    @property
    def signs(self) -> tuple[Sign, ...]:
        """The Sign List, in order of age."""
        return tuple(self._signs.names)

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """The Hypothesis List, in order of age."""
        names, listed = self._signs.names, self._hypotheses
        return tuple(
            Hypothesis(
                context=names[listed.context[hypothesis]],
                action=self._action_of(hypothesis),
                outcome=names[listed.outcome[hypothesis]],
                delay=listed.delay[hypothesis],
                cm=listed.cm[hypothesis],
                predictions=listed.predictions[hypothesis],
                successes=listed.successes[hypothesis],
            )
            for hypothesis in range(len(listed))
        )

    @property
    def sign_count(self) -> int:
        """Length of the Sign List."""
        return len(self._signs)

    @property
    def hypothesis_count(self) -> int:
        """Length of the Hypothesis List."""
        return len(self._hypotheses)

    @property
    def mean_cm(self) -> float:
        """Mean C_m of all hypotheses, 0 without any."""
        return self._hypotheses.cm_sum / len(self._hypotheses) if len(self._hypotheses) else 0.0

    def _named(self, signs: Sequence[int]) -> tuple[Sign, ...]:
        return tuple([self._signs.names[sign] for sign in signs])

    def _action_of(self, hypothesis: int) -> str:
        return self._actions.names[self._hypotheses.action[hypothesis]]
