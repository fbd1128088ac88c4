"""What can be read off a model and its shadow: the lists, the goals and the policy."""

from collections.abc import Iterable, Mapping, Sequence

from farside.dem.cycle import Prediction, Trace
from farside.dem.learning.learner import Learner
from farside.dem.lists.actions import ActionList
from farside.dem.lists.goals import Goal, GoalList
from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.hypothesis import Hypothesis
from farside.dem.lists.signs import Sign, SignList, to_sign
from farside.dem.parameters import Parameters, others_than_default
from farside.dem.policy.aversions import Aversion
from farside.dem.policy.planning import Planner, PolicyStep, PolicyValue, Why
from farside.dem.policy.pursuit import Pursuit


class ListViews:
    """The lists that a model and its shadow both have."""

    _actions: ActionList
    _signs: SignList
    _hypotheses: HypothesisList

    @property
    def actions(self) -> dict[str, float]:
        """The Action List with the cost of each: those known from the start by name, then others.

        The others follow in the order in which they were first performed.
        """
        return self._actions.by_name

    @property
    def signs(self) -> tuple[Sign, ...]:
        """The Sign List, oldest first."""
        return self._named(self._signs.by_age())

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """The Hypothesis List, oldest first."""
        return self._hypotheses.named(self._signs.names)

    @property
    def sign_count(self) -> int:
        """Length of the Sign List."""
        return len(self._signs)

    @property
    def hypothesis_count(self) -> int:
        """Length of the Hypothesis List."""
        return self._hypotheses.count

    @property
    def mean_cm(self) -> float:
        """Mean C_m of all hypotheses, 0 if there are none."""
        return self._hypotheses.cm_sum / self._hypotheses.count if self._hypotheses.count else 0.0

    def _named(self, signs: Sequence[int]) -> tuple[Sign, ...]:
        return tuple([self._signs.names[sign] for sign in signs])


class ModelViews(ListViews):
    """What a model wants and what it knows of the way; nothing here changes what it learned."""

    _parameters: Parameters
    _learner: Learner
    _goals: GoalList
    _planner: Planner
    _pursuit: Pursuit
    _active: list[int]

    def __repr__(self) -> str:
        lists = (
            _counted(len(self._actions), "action", "actions"),
            _counted(self.sign_count, "Sign", "Signs"),
            _counted(self.hypothesis_count, "hypothesis", "hypotheses"),
            _counted(len(self.goals), "goal", "goals"),
            f"cycle {self._learner.cycle}",
            *others_than_default(self._parameters),
        )
        return f"<{type(self).__name__}: {', '.join(lists)}>"

    @property
    def parameters(self) -> Parameters:
        """How it learns and acts; see `DynamicExpectancyModel.change`."""
        return self._parameters

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The Goal List, the top-goal first, ties to the older; goals put aside come last.

        Before the first `sense`, no goal is put aside.
        """
        return self._goals.ordered

    @property
    def predictions(self) -> tuple[Prediction, ...]:
        """P, the open predictions: those due first come first, then in the order they were made."""
        hypotheses, names = self._hypotheses, self._signs.names
        return tuple(
            Prediction(names[hypotheses.outcome[one]], due_in, hypotheses.one_named(one, names))
            for due_in, ids in enumerate(self._learner.open_predictions, start=1)
            for one in ids
        )

    @property
    def due(self) -> tuple[Prediction, ...]:
        """P*, the predictions that fall due when Tokens are sensed next, and are settled then."""
        return tuple(one for one in self.predictions if one.due_in == 1)

    @property
    def traces(self) -> tuple[Trace, ...]:
        """The activation traces, the latest first: at most `Parameters.reach` past cycles."""
        names = self._actions.names
        return tuple(
            Trace(self._named(active), None if action is None else names[action])
            for active, action in self._learner.traces
        )

    def goal_priorities(self, tokens: Iterable[str]) -> Mapping[str, float]:
        """The priority that each source gives a Sign; empty if it is not on the Goal List.

        Raises:
            TypeError: if `tokens` is a string.
        """
        return self._goals.priorities(to_sign(tokens))

    @property
    def aversions(self) -> tuple[Aversion, ...]:
        """The Signs to be avoided, the oldest aversion first."""
        return self._learner.aversions.ordered

    def policy_map(self) -> tuple[PolicyValue, ...]:
        """The top-goal's DPM, ordered by value, then Sign.

        Where all goals are aside, that of the highest that is not blocked. Empty if there is none,
        or its Sign is not known.
        """
        self._pursuit.aim()
        return self._planner.table()

    def policy_path(self) -> tuple[PolicyStep, ...]:
        """The best-estimate walk from what was last sensed to the top-goal.

        Empty if no known path leads there. The goal itself is not a step.
        """
        self._pursuit.aim()
        return self._planner.path(self._active)

    def why(self) -> Why | None:
        """The hypothesis behind the goal-directed choice now, and the runner-up.

        `None` if `choose` would explore.
        """
        self._pursuit.aim()
        return self._planner.why(self._active)

    def cost_to(self, goal: Iterable[str], start: Iterable[str] | None = None) -> float:
        """P_v towards any Sign, of the best active Sign, now or where the Sign `start` is active.

        0.0 if the Sign is active, or `start` implies it; infinite where no way is known, or a Sign
        is unknown. The maps of the last few Signs asked for are kept up to date like that of the
        top-goal (`farside.dem.policy.planning.WATCHED`), so this may be asked before every action.

        Raises:
            ValueError: if `goal` has no Tokens.
            TypeError: if `goal` or `start` is a string.
        """
        begin = None if start is None else to_sign(start)
        return self._pursuit.cost_to(to_sign(goal), begin, self._active)

    def expected(self, action: str) -> Hypothesis | None:
        """The most credible hypothesis of what `action` leads to now; `None` if nothing is known.

        Of those whose context is active, the one with the highest C_m, then the one with the most
        Tokens in its context, then the oldest.

        Raises:
            ValueError: if the action is unknown. The message names the known ones.
        """
        asked = self._actions.id_of(action)
        return self._hypotheses.most_credible(self._active, asked, self._signs.names)


def _counted(count: int, one: str, many: str) -> str:
    return f"{count} {one if count == 1 else many}"
