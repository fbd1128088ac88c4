"""What the rules of learning work on: the lists, and what is known of past cycles."""

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

from farside.dem.learning.differentiation import Differentiation
from farside.dem.learning.situations import Situations
from farside.dem.lists.actions import ActionList
from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.predictions import PredictionList
from farside.dem.lists.signs import Sign, SignList
from farside.dem.lists.trials import Trials
from farside.dem.parameters import Parameters
from farside.dem.policy.aversions import AversionList


class Trace(NamedTuple):
    """The activation trace of a past cycle.

    Attributes:
        active: its active Signs.
        action: the action performed, if any.
        situation: the situation it was in; see `farside.dem.learning.situations`.
    """

    active: list[int]
    action: int | None
    situation: Sign


class Workspace:
    """The lists of the model, and what else its rules of learning share.

    Attributes:
        signs, actions, hypotheses, trials, predictions, aversions: the lists.
        differentiation, situations: what is counted for those rules.
        parameters: those of the model.
        cycle: number of completed cycles.
        traces: the activation traces, the latest first.
        situation: the present situation; empty where nothing tells one.
        probation: conjunctions that were spawned and have not proved themselves yet.
        wholes: conjunctions that are known because a situation was needed.
    """

    def __init__(self, actions: ActionList, parameters: Parameters) -> None:
        self.signs = SignList()
        self.actions = actions
        self.aversions = AversionList(self.signs)
        self.hypotheses = HypothesisList(actions, parameters, self.aversions)
        self.trials = Trials()
        self.predictions = PredictionList(parameters.reach)
        self.differentiation = Differentiation(parameters.maturity)
        self.situations = Situations()
        self.parameters = parameters
        self.cycle = 0
        self.traces: deque[Trace] = deque(maxlen=parameters.reach)
        self.situation: Sign = ()
        self.probation: set[int] = set()
        self.wholes: set[int] = set()

    def tried(self, context: int, action: int) -> int:
        """The number of trials of an action in a context."""
        return self.trials.tried(self.hypotheses.cause(context, action))

    def last_trials(self) -> tuple[list[int], list[int], int | None]:
        """The contexts of the last cycle, the trials of its action in each of them, the action.

        No contexts where there was no action.
        """
        active, action, _ = self.traces[0] if self.traces else Trace([], None, ())
        if action is None:
            return [], [], None
        return active, [self.tried(context, action) for context in active], action

    def tokens_of(self, signs: Sequence[int]) -> list[int]:
        """Those of some Signs that are single Tokens."""
        names = self.signs.names
        return [sign for sign in signs if len(names[sign]) == 1]

    def is_random(self, sign: int) -> bool:
        """Whether a Sign has a random Token."""
        signs, random = self.signs, self.situations.is_random
        return any(random(token) for token in signs.tokens(sign))
