"""What the model on board would do, and what would come of it, by the lists of its shadow."""

from collections.abc import Callable, Iterable
from typing import NamedTuple

from farside.dem import Hypothesis, ShadowModel
from farside.messages import Tokens
from farside.places import ACTIONS, is_place_token

_PRIOR = 2.0
_PRIOR_TRUE, _PRIOR_CASES = 9, 10


class Outcome(NamedTuple):
    """A place that a move may lead to, and how probable that is."""

    place: str
    probability: float


class Intent(NamedTuple):
    """The action by which the model would pursue a goal, and whether it leads right to it."""

    action: str
    is_last: bool


class Foresight:
    """Asks the shadow's lists, and remembers what they said until they change.

    A probability is the share of cases in which the outcome followed, counted from when the
    hypothesis was created. The most credible outcome counts for two cases more, at the share in
    which most credible outcomes follow on all lists: so a move that was made once is held for as
    sure as such moves have turned out to be (empirical Bayes). That share begins as if nine of ten
    had followed (project defaults).

    Args:
        model: the shadow's lists.
        version: says when they are others than before.
    """

    def __init__(self, model: ShadowModel, version: Callable[[], object]) -> None:
        self._model, self._version = model, version
        self._of: object = None
        self._outcomes: dict[tuple[str, str], tuple[Outcome, ...]] = {}
        self._intents: dict[tuple[str, Tokens], Intent | None] = {}
        self._usual = _PRIOR_TRUE / _PRIOR_CASES

    def outcomes(self, place: str, action: str) -> tuple[Outcome, ...]:
        """The places that a move may lead to, the most probable first; the rest is not known."""
        self._refresh()
        key = place, action
        if key not in self._outcomes:
            self._outcomes[key] = self._ask(place, action)
        return self._outcomes[key]

    def intent(self, place: str, goal: Tokens) -> Intent | None:
        """How the model would pursue a goal from a place; `None` where it knows no way."""
        self._refresh()
        key = place, goal
        if key not in self._intents:
            why = self._model.why((place,), goal)
            self._intents[key] = (
                None if why is None else Intent(why.action, set(goal).issubset(why.outcome))
            )
        return self._intents[key]

    def _refresh(self) -> None:
        version = self._version()
        if version == self._of:
            return
        self._of = version
        self._outcomes.clear()
        self._intents.clear()
        came_true, fell_due = self._model.track_record()
        self._usual = (came_true + _PRIOR_TRUE) / (fell_due + _PRIOR_CASES)

    def _ask(self, place: str, action: str) -> tuple[Outcome, ...]:
        known = [
            one
            for one in expectations(self._model, (place,), action)
            if one.context == (place,) and len(one.outcome) == 1 and is_place_token(one.outcome[0])
        ]
        if not known:
            return ()
        best = max(known, key=lambda one: (one.successes, one.cm))
        # It was seen once before it was tested, as it was created for that.
        cases = 1 + max(one.predictions for one in known)
        cases = max(cases, sum(1 + one.successes for one in known))
        outcomes = (
            Outcome(
                one.outcome[0],
                (1 + one.successes + (_PRIOR * self._usual if one is best else 0))
                / (cases + _PRIOR),
            )
            for one in known
        )
        return tuple(sorted(outcomes, key=lambda outcome: (-outcome.probability, outcome.place)))


def expectations(model: ShadowModel, sign: Tokens, action: str) -> tuple[Hypothesis, ...]:
    """What the lists say of an action; nothing of one that there is not, whoever named it."""
    return model.expectations(sign, action) if action in ACTIONS else ()


def chance(foresight: Foresight, steps: Iterable[tuple[str, str, str]]) -> float:
    """The probability that moves lead on from place to place as planned.

    Args:
        foresight: what the lists say.
        steps: each move's place, action, and the place that it is to lead to.
    """
    product = 1.0
    for place, action, onward in steps:
        likely = {one.place: one.probability for one in foresight.outcomes(place, action)}
        product *= likely.get(onward, 0.0)
    return product
