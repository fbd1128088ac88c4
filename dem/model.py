"""The cycle of the Dynamic Expectancy Model: sense and learn, choose, perform and predict."""

from collections.abc import Iterable, Mapping

from numpy.random import Generator

from farside.dem.cycle import Choice, Sensed
from farside.dem.feed import ChangeFeed, Delta
from farside.dem.learning.learner import Learner
from farside.dem.lists.actions import ActionList
from farside.dem.lists.check import lists_check
from farside.dem.lists.given import given
from farside.dem.lists.inherent import InherentGoal, restored, rules_given, saved
from farside.dem.lists.signs import to_sign
from farside.dem.memory import ModelState, random_state, read, restored_generator, written
from farside.dem.parameters import Exploration, Parameters, Values
from farside.dem.policy.curiosity import CuriousMap
from farside.dem.policy.pursuit import Pursuit
from farside.dem.wants import ModelWants

_DEFAULTS = Parameters()


class DynamicExpectancyModel(ModelWants):
    """Learns what follows from each action, and how to reach goals.

    A cycle is `sense`, then `choose` if the model is to choose, then `perform` with the action
    that was really performed. Learning depends on that action alone, not on who chose it. Goals
    may be set and withdrawn at any time.

    Args:
        action_costs: cost of each action that is known from the start, above 0, all in the same
            unit (s, J); there may be none.
        parameters: how to learn and act.
        rng: the only source of randomness: one draw for each opportunity to create a hypothesis,
            and one for each exploratory choice between equals.
        inherent: the robot's own goals.

    Raises:
        TypeError: if something is not of the type that it must have.
        ValueError: if a cost is not finite and above 0.
    """

    def __init__(
        self,
        action_costs: Mapping[str, float],
        parameters: Parameters = _DEFAULTS,
        *,
        rng: Generator,
        inherent: Iterable[InherentGoal] = (),
    ) -> None:
        self._rng = given(Generator, "rng, of numpy.random.default_rng(seed)", rng)
        self._parameters = given(Parameters, "parameters", parameters)
        self._actions = ActionList(action_costs)
        self._learner = Learner(self._actions, parameters, rng)
        self._signs = self._learner.signs
        self._hypotheses = self._learner.hypotheses
        self._inherent = rules_given(inherent)
        self._pursuit = Pursuit(self._learner, parameters, self._inherent)
        self._goals, self._planner = self._pursuit.goals, self._pursuit.planner
        self._active: list[int] = []
        self._awaits_action = self._on_course = False
        self._chosen: str | None = None
        self._feed: ChangeFeed | None = None

    # --- the cycle -----------------------------------------------------------------------------

    def sense(self, tokens: Iterable[str]) -> Sensed:
        """Begin a cycle: sense `tokens`, learn from them, drop the goals they satisfy.

        Predictions due now strengthen or weaken their hypotheses. Hypotheses are created for
        every novel or unexpected Sign as outcome, one from each Sign in the activation traces
        with the action performed then (source: seed; the choice of candidates: project default).

        Raises:
            RuntimeError: if `perform` has not ended the last cycle.
            TypeError: if `tokens` is a string, or no Tokens.
            TypeError, ValueError: if a rule gives its goal no finite priority. Nothing is sensed.
        """
        if self._awaits_action:
            raise RuntimeError(
                "sense() twice in one cycle: end the cycle with perform(action), or with "
                "perform(None) if nothing was done"
            )
        sensed = to_sign(tokens)
        by_rules = self._pursuit.wanted(sensed)
        learned = self._learner.sense(sensed, self._pursuit.needed())
        self._active = learned.active
        self._awaits_action = True
        if self._feed is not None:
            self._feed.trim()
        news = self._pursuit.sense(sensed, learned.active, by_rules, on_course=self._on_course)
        return Sensed(
            tokens=sensed,
            active=self._named(learned.active),
            novel=self._named(learned.novel),
            unexpected=self._named(learned.unexpected),
            succeeded=learned.succeeded,
            failed=learned.failed,
            created=learned.created,
            removed=learned.removed,
            reached=news.reached,
            suspended=news.suspended,
            recovered=news.recovered,
        )

    def choose(self, *, explore: bool = True) -> Choice | None:
        """The action to take now; `perform` is still to be called.

        Goal-directed if there is a top-goal: the best action of the active Sign with the least
        policy value. Otherwise exploratory, as `Parameters.exploration` says. `None` where there is
        nothing to do: no action is suggested by the map, and the model does not explore, or does
        not know any action.

        Args:
            explore: whether the model may explore. Without, a curious model chooses by the
                top-goal's DPM too, and nothing is drawn at random.

        Raises:
            RuntimeError: if `sense` was not called since the last `perform`.
            TypeError: if `explore` is neither true nor false.
        """
        self._expect_sensed("choose")
        explore = given(bool, "explore", explore)
        exploration = self._parameters.exploration if explore else Exploration.NONE
        curious = exploration is Exploration.CURIOUS
        choice = self._curious() if curious else self._goal_directed()
        if choice is None:
            if exploration is Exploration.NONE or not self._actions:
                return None
            choice = Choice(self._any_action())
        self._chosen = choice.action if choice.goal else None
        return choice

    def perform(self, action: str | None) -> None:
        """End a cycle with the action really performed, `None` if there was none.

        Every hypothesis whose context and action are active makes its prediction. Standing still
        is not an action: it leads to no predictions and no hypotheses. An action that is met for
        the first time is registered (source: seed), at the cost of the dearest known one, or 1 if
        it is the first (project default); see `set_cost`.

        Raises:
            RuntimeError: if `sense` was not called since the last `perform`.
            TypeError: if the action is no string.
        """
        self._expect_sensed("perform")
        performed = None if action is None else self._registered(action)
        self._learner.perform(self._active, performed, self._pursuit.needed())
        self._on_course = action is not None and action == self._chosen
        self._chosen = None
        self._awaits_action = False

    def _registered(self, action: str) -> int:
        known = self._actions.find(action)
        if known is None:
            known = self._learner.register(action, self._actions.default_cost)
        return known

    def set_cost(self, action: str, cost: float) -> None:
        """Have an action cost something else from now on: all policy values follow at once.

        Raises:
            TypeError: if the action is no string, or the cost no number.
            ValueError: if the action is unknown, or the cost is not finite and above 0.
        """
        self._hypotheses.set_cost(self._actions.id_of(action), cost)
        self._attend()

    def _expect_sensed(self, wanted: str) -> None:
        if not self._awaits_action:
            raise RuntimeError(
                f"{wanted}() before sense(): the order of a cycle is sense, choose (optional), "
                "perform"
            )

    def _goal_directed(self) -> Choice | None:
        self._pursuit.aim()
        sign = self._planner.entry(self._active)
        if sign is None:
            return None
        return Choice(
            action=self._planner.action(sign),
            goal=self._goals.sought,
            sign=self._signs.names[sign],
            cost_to_go=self._planner.value(sign),
        )

    def _any_action(self) -> str:
        """An action at random, of those that are known to risk least of what is to be avoided."""
        names, risks = self._actions.names, self._hypotheses.risks
        if risks:
            most = [
                max([risks.get((context, action), 0.0) for context in self._active], default=0.0)
                for action in range(len(names))
            ]
            names = [name for name, risk in zip(names, most, strict=True) if risk == min(most)]
        return names[self._rng.integers(len(names))]

    def _curious(self) -> Choice | None:
        if not self._actions:
            return None
        sought = self._goals.sought
        goal = None if sought is None else self._signs.find(sought)
        directed = None
        if self._parameters.values is Values.EXPECTED:
            # The curious map is one of best outcomes. So it leads to the frontier only.
            directed, goal = self._goal_directed(), None
        curious = CuriousMap(self._learner, self._parameters, goal, self._active)
        if directed is not None and (directed.cost_to_go or 0.0) <= curious.least:
            return directed
        lead = curious.lead(self._learner.last_action, self._rng)
        if lead is None:
            return None
        return Choice(
            action=self._actions.names[lead.action],
            goal=None if lead.tries or goal is None else sought,
            sign=self._signs.names[lead.sign],
            cost_to_go=lead.cost,
        )

    # --- saving and shadowing ------------------------------------------------------------------

    def save(self) -> bytes:
        """The whole state as bytes; see `farside.dem.memory` for the format.

        The model that `load` returns continues exactly as this one does. A model can be saved at
        any point of a cycle. Changes recorded for a shadow are not saved.

        Raises:
            TypeError: if the random generator is not one of numpy's own.
        """
        return written(
            ModelState(
                action_costs=self._actions.by_name,
                parameters=self._parameters,
                inherent=saved(self._inherent),
                random=random_state(self._rng),
                learner=self._learner.state(),
                goals=self._goals.state(),
                aversions=self._learner.aversions.ordered,
                active=tuple(self._active),
                awaits_action=self._awaits_action,
                chosen=self._chosen,
                on_course=self._on_course,
            )
        )

    @classmethod
    def load(
        cls, data: bytes, *, inherent: Iterable[InherentGoal] | None = None
    ) -> "DynamicExpectancyModel":
        """The model that was saved, with its own copy of the random generator.

        Args:
            data: what `save` returned.
            inherent: the rules of the model; needed only where a priority is a function, which
                cannot be saved.

        Raises:
            ValueError: if rules are needed, or are others than the model had.
            UnreadableMemoryError: if `data` is damaged, truncated, of another version, or not a
                saved model.
        """
        state = read(data)
        model = cls(
            {},
            state.parameters,
            rng=restored_generator(state.random),
            inherent=restored(state.inherent, inherent),
        )
        model._actions.restore(state.action_costs)
        model._learner.aversions.become(state.aversions)
        model._learner.restore(state.learner)
        model._goals.restore(state.goals)
        model._active = list(state.active)
        model._awaits_action = state.awaits_action
        model._chosen, model._on_course = state.chosen, state.on_course
        return model

    def change(self, parameters: Parameters) -> None:
        """Learn and act by these from now on, and keep what was learned: train, then judge.

        A shadow must `agree` to them. With `plain`, nothing that own rules made is taken back.

        Raises:
            TypeError: if these are no `Parameters`.
            ValueError: if `reach` is less than before.
        """
        self._learner.change(given(Parameters, "parameters", parameters))
        self._parameters = parameters
        self._pursuit.change(parameters)
        self._attend()
        if self._feed is not None:
            self._feed.change(parameters)

    def record_changes(self) -> None:
        """From now on, record the changes of the lists for a `ShadowModel`; see `take_delta`."""
        if self._feed is None:
            self._feed = ChangeFeed(
                self._actions,
                self._parameters,
                self._signs,
                self._hypotheses,
                self._learner.aversions,
            )

    def take_delta(self) -> Delta:
        """The changes of the lists since the last delta.

        A whole in the first delta, and wherever the changes have become longer than that.

        Raises:
            RuntimeError: if changes are not recorded.
        """
        return self._open_feed().delta(self._goals.ordered)

    def whole(self) -> Delta:
        """All lists as they are, in place of the next delta, for a shadow that missed one.

        Raises:
            RuntimeError: if changes are not recorded.
        """
        return self._open_feed().whole(self._goals.ordered)

    def lists_check(self) -> int:
        """CRC-32 of all lists, goals and aversions, to be compared with that of a `ShadowModel`."""
        return lists_check(
            self._actions,
            self._signs,
            self._hypotheses,
            self._goals.ordered,
            self._learner.aversions.ordered,
        )

    def _open_feed(self) -> ChangeFeed:
        if self._feed is None:
            raise RuntimeError("no changes are recorded: call record_changes() first")
        return self._feed
