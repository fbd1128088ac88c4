"""What a model is told to want and to avoid."""

from collections.abc import Iterable

from farside.dem.lists.goals import OPERATOR, Goal
from farside.dem.lists.signs import to_sign
from farside.dem.views import ModelViews


class ModelWants(ModelViews):
    """The goals and aversions of a model, set and taken back by source."""

    _awaits_action: bool

    def set_goal(
        self, tokens: Iterable[str], priority: float = 1.0, source: str = OPERATOR
    ) -> Goal | None:
        """Put a Sign on the Goal List, or change the priority that `source` gives it.

        Several sources may want the same Sign; the highest of their priorities counts. A Sign of
        several Tokens becomes known by being set. A single Token that was never sensed can be a
        goal too, but is put aside until it is sensed.

        Within a cycle, between `sense` and `perform`, a goal that is active is satisfied at once:
        it never comes on the list, and nothing is done for it. It is returned, and told once more
        in `Sensed.reached` of the next cycle, for those who wait there. To pursue a goal again that
        was just reached, set it after `perform`.

        Returns:
            the goal, if it is satisfied at once.

        Raises:
            ValueError: if there are no Tokens, `priority` is not finite, or `source` is `"rule"`,
                which stands for the robot's own rules.
            TypeError: if `tokens` is a string or no Tokens, `priority` no number, or `source` no
                name.
        """
        sign = to_sign(tokens)
        is_active = self._awaits_action and self._pursuit.is_active(sign, self._active)
        satisfied = self._goals.set(sign, priority, source, is_active=is_active)
        if satisfied is None:
            self._pursuit.know_goals()
            self._attend()
        return satisfied

    def withdraw_goal(self, tokens: Iterable[str], source: str = OPERATOR) -> bool:
        """Take back what `source` set; False if it set no such goal.

        The goal stays as long as another source, or a rule of the robot's own, wants it. With
        removal on, a Sign of several Tokens that nothing refers to any more is removed.
        """
        sign = to_sign(tokens)
        withdrawn, known = self._goals.withdraw(sign, source), self._signs.find(sign)
        if withdrawn and known is not None:
            self._learner.forget(known, [*self._pursuit.needed(), *self._active])
        self._attend()
        return withdrawn

    def avert(self, tokens: Iterable[str], cost: float, source: str = OPERATOR) -> None:
        """Avoid a Sign: whatever makes it active costs so much more, each time that it does.

        Several sources may avoid the same Sign; the highest of their costs counts. It counts in
        every map and on every path, for the goals of all sources; and whoever explores at random
        takes one of the actions that are known to risk least. A Sign of several Tokens becomes
        known by being averted, and stays so while it is.

        Args:
            tokens: the Sign.
            cost: in the unit of the action costs, finite and 0 or more.
            source: who avoids it.

        Raises:
            ValueError: if there are no Tokens, or the cost is not finite and 0 or more.
            TypeError: if `tokens` is a string, or the cost no number.
        """
        sign = to_sign(tokens)
        self._learner.aversions.avert(sign, cost, source)
        if len(sign) > 1:
            self._learner.know(sign)
        self._hypotheses.follow_aversions()
        self._attend()

    def accept(self, tokens: Iterable[str], source: str = OPERATOR) -> bool:
        """Take back what `source` averted; False if it averted no such Sign.

        The Sign is avoided as long as another source avoids it. With removal on, one of several
        Tokens that nothing refers to any more is removed.

        Raises:
            TypeError: if `tokens` is a string.
        """
        sign = to_sign(tokens)
        accepted, known = self._learner.aversions.accept(sign, source), self._signs.find(sign)
        if accepted:
            self._hypotheses.follow_aversions()
            if known is not None:
                self._learner.forget(known, [*self._pursuit.needed(), *self._active])
            self._attend()
        return accepted

    def _attend(self) -> None:
        # Before the first `sense`, no Sign is active and nothing can be said of any goal.
        if self._awaits_action or self._learner.cycle:
            self._pursuit.attend(self._active)
