"""Creation: which hypotheses explain a surprise.

The seed leaves the candidates open: here all Signs in the activation traces are contexts, each with
the action performed then. Where many Tokens are active at once, that is a flood. With `situations`,
few things explain a surprise (project defaults):

1. *Nothing is created that could not be believed.* A context with more than twice as many trials as
   the rarest one would have too little credit to make anything expected.
2. *The situation explains where its parts cannot.* It becomes a Sign, and the context of one
   hypothesis that ends in the next situation as a whole, where a credible prediction has failed,
   where the next situation is known and was not foreseen as a whole, or where it is a context
   already. Where that is one Token after another, nothing else explains it. Otherwise the parts go
   on explaining each other beside it: no way leads on from a Token to a whole.
"""

from collections.abc import Container, Sequence

from numpy.random import Generator

from farside.dem.learning.credit import initial_credit
from farside.dem.learning.workspace import Trace, Workspace
from farside.dem.lists.signs import Sign

_BELIEVABLE = 2  # times the trials of the rarest context


class Creation:
    """Creates hypotheses, each opportunity with the learning probability λ."""

    def __init__(self, work: Workspace, rng: Generator) -> None:
        self._work = work
        self._rng = rng
        # Outcomes and delays by cause, as far as they were asked for in the present call.
        self._held: dict[int, set[tuple[int, int]]] = {}

    def explain(
        self,
        surprises: Sequence[int],
        active: list[int],
        *,
        foreseen: Container[int],
        disproved: Container[int],
        needed: Container[int],
    ) -> None:
        """Create what explains the present cycle.

        Args:
            surprises: the novel and the unexpected Signs.
            active: the active Signs; the situation is added if it becomes known.
            foreseen: the Signs that a credible prediction named.
            disproved: delays with which a credible prediction failed.
            needed: goals.
        """
        work = self._work
        self._held.clear()
        outcomes = [sign for sign in surprises if sign not in work.probation]
        alone: set[int] = set()
        if work.parameters.situations:
            outcomes = [sign for sign in outcomes if sign not in work.wholes or sign in needed]
            alone = self._explain_as_a_whole(active, foreseen, disproved)
        for outcome in outcomes:
            for delay, trace in enumerate(work.traces, start=1):
                if trace.action is None:
                    continue
                if delay in alone and work.signs.names[outcome] == work.situation:
                    continue
                self._take_opportunities(trace, trace.action, outcome, delay)

    def _take_opportunities(self, trace: Trace, action: int, outcome: int, delay: int) -> None:
        work, parameters = self._work, self._work.parameters
        contexts = [context for context in trace.active if context not in work.probation]
        tries = [work.tried(context, action) for context in contexts]
        fewest = min(tries, default=0)
        for context, tried in zip(contexts, tries, strict=True):
            if tried <= _BELIEVABLE * fewest or not parameters.situations:
                credit = initial_credit(parameters.initial_cm, tried, fewest)
                self._take(context, action, outcome, delay, credit)

    def _take(self, context: int, action: int, outcome: int, delay: int, credit: float) -> None:
        hypotheses = self._work.hypotheses
        cause = hypotheses.cause(context, action)
        held = self._held.get(cause)
        if held is None:
            held = self._held[cause] = {
                (hypotheses.outcome[same], hypotheses.delay[same])
                for same in hypotheses.of_cause(context, action)
            }
        if (outcome, delay) in held:
            return
        if self._rng.random() < self._work.parameters.learning_probability:
            hypotheses.add(context, action, outcome, delay, credit)
            held.add((outcome, delay))

    # --- situations ----------------------------------------------------------------------------

    def _explain_as_a_whole(
        self, active: list[int], foreseen: Container[int], disproved: Container[int]
    ) -> set[int]:
        """Let past situations explain this one.

        Returns:
            the delays with which one Token alone now explains another.
        """
        work = self._work
        here = work.signs.find(work.situation)
        if not work.situation or here in foreseen:
            return set()
        alone = set()
        for delay, trace in enumerate(work.traces, start=1):
            if trace.action is None or not trace.situation:
                continue
            before = work.signs.find(trace.situation)
            is_context = before in work.wholes and work.hypotheses.is_context(before)
            if here is not None or delay in disproved or is_context:
                context = self._known(trace.situation)
                if context not in trace.active:
                    trace.active.append(context)
                    cause = work.hypotheses.cause(context, trace.action)
                    work.trials.count(cause, work.cycle - delay)
                outcome = self._known(work.situation)
                if outcome not in active:
                    active.append(outcome)
                initial_cm = work.parameters.initial_cm
                self._take(context, trace.action, outcome, delay, initial_cm)
                if len(trace.situation) == len(work.situation) == 1:
                    alone.add(delay)
        return alone

    def _known(self, situation: Sign) -> int:
        """A situation as a Sign, which was active when it was the situation."""
        work = self._work
        is_new = work.signs.find(situation) is None
        known = work.signs.activate(situation)
        if is_new:
            work.wholes.add(known)
        work.probation.discard(known)
        return known
