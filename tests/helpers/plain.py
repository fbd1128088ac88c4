"""A reference implementation of the learning cycle, as plain as possible.

Written from the rules and not from the code: lists of small records, searched from end to end. Any
disagreement with the model is a fault in one of them.
"""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from math import log, prod

import numpy as np
from plain_situations import Reproducible

from farside.dem import Parameters


@dataclass(eq=False)
class KnownSign:
    """A Sign, whether it was ever active, and the number of trials of each action in it."""

    tokens: tuple[str, ...]
    met: bool = False
    on_probation: bool = False
    is_situation: bool = False
    tries: dict[str | None, int] = field(default_factory=dict)


@dataclass
class Past:
    """A cycle: the Signs that were active, what was done, and the situation it was in."""

    active: list[KnownSign]
    action: str | None
    situation: tuple[str, ...]


@dataclass(eq=False)
class MuHypothesis:
    """A µ-hypothesis. `watch` holds a case for each prediction settled while it is watched."""

    context: KnownSign
    action: str
    outcome: KnownSign
    delay: int
    cm: float
    credit: float
    predictions: int = 0
    successes: int = 0
    averaged: int = 1  # results in the average that C_m is, the creation being the first
    # Equal results and the odds of each; the creation is a success.
    run: list[tuple[bool, float]] = field(default_factory=lambda: [(True, 1.0)])
    watches: int = 0
    watch: list[tuple[list[str], bool]] | None = None

    def ends(self) -> tuple[KnownSign, str, KnownSign, int]:
        """What distinguishes it from any other hypothesis."""
        return self.context, self.action, self.outcome, self.delay


class PlainModel:
    """Signs, hypotheses and predictions, each a list in order of age."""

    def __init__(self, parameters: Parameters, rng: np.random.Generator) -> None:
        self.parameters = parameters
        self.rng = rng
        self.signs: list[KnownSign] = []
        self.hypotheses: list[MuHypothesis] = []
        self.predictions: list[tuple[int, MuHypothesis]] = []  # (cycle it is due, hypothesis)
        self.past: list[Past] = []  # one cycle ago first
        self.cycle = 0
        self.situation: tuple[str, ...] = ()
        self.tokens = Reproducible()

    def change(self, parameters: Parameters) -> None:
        """Go by others from now on; a watch that is too long by them is void."""
        self.parameters = parameters
        for h in self.hypotheses:
            if h.watch is not None and len(h.watch) >= parameters.maturity:
                h.watch = None

    def know(self, tokens: tuple[str, ...]) -> KnownSign:
        """The Sign of these Tokens, added if it is not known."""
        for sign in self.signs:
            if sign.tokens == tokens:
                return sign
        self.signs.append(KnownSign(tokens))
        return self.signs[-1]

    def sense(self, tokens: set[str], goals: Sequence[tuple[str, ...]] = ()) -> None:
        """Settle predictions, then differentiate, remove and create hypotheses."""
        for token in sorted(set(tokens)):
            self.know((token,))
        self.active = [sign for sign in self.signs if set(sign.tokens) <= set(tokens)]
        novel = [sign for sign in self.active if not sign.met]
        due = [hypothesis for cycle, hypothesis in self.predictions if cycle == self.cycle]
        credible = [h for h in due if self.is_credible(h)]
        unexpected = [
            sign
            for sign in self.active
            if sign.met and not any(self.names(h.outcome, sign) for h in credible)
        ]
        for sign in novel:
            sign.met = True
        turned_random: list[str] = []
        self.situation = ()
        if self.parameters.situations:
            turned_random = self.tokens.note(tokens, self.last_trials())
            self.situation = self.tokens.situation(tokens)
        surprising = [h for h in credible if h.outcome not in self.active]
        disproved = {h.delay for h in surprising if not self.tokens.random & {*h.outcome.tokens}}
        self.settle(due)
        for hypothesis in due if self.parameters.differentiation else []:
            self.differentiate(hypothesis)
        for hypothesis in due if self.parameters.removal else []:
            self.remove_if_useless(hypothesis, goals)
        for token in turned_random if self.parameters.removal else []:
            self.drop_situations_with(token, goals)
        for hypothesis in due:
            self.end_probation(hypothesis)
        self.explain_all(novel + unexpected, credible, disproved, goals)

    def explain_all(
        self,
        surprises: Sequence[KnownSign],
        credible: Sequence[MuHypothesis],
        disproved: set[int],
        goals: Sequence[tuple[str, ...]],
    ) -> None:
        """Create hypotheses, for the situation as a whole first."""
        outcomes = [sign for sign in surprises if not sign.on_probation]
        alone: set[int] = set()
        if self.parameters.situations:
            outcomes = [s for s in outcomes if not s.is_situation or s.tokens in goals]
            if not any(h.outcome.tokens == self.situation for h in credible):
                alone = self.explain_as_a_whole(disproved)
        for sign in outcomes:
            self.explain(sign, alone)

    def perform(self, action: str | None, goals: Sequence[tuple[str, ...]] = ()) -> None:
        """Every hypothesis whose context and action are active predicts."""
        for sign in self.active if action is not None else []:
            sign.tries[action] = sign.tries.get(action, 0) + 1
            for hypothesis in self.hypotheses:
                if hypothesis.context == sign and hypothesis.action == action:
                    self.predictions.append((self.cycle + hypothesis.delay, hypothesis))
        self.past = [Past(self.active, action, self.situation), *self.past]
        expired = [sign for then in self.past[self.parameters.reach :] for sign in then.active]
        self.past = self.past[: self.parameters.reach]
        self.forget(expired if self.parameters.removal else [], goals)
        self.cycle += 1

    def last_trials(self) -> dict[tuple[Hashable, str], int]:
        """How often the last action was tried in each Sign that was active then."""
        if not self.past or self.past[0].action is None:
            return {}
        action = self.past[0].action
        return {(sign, action): sign.tries[action] for sign in self.past[0].active}

    def is_credible(self, hypothesis: MuHypothesis) -> bool:
        """Whether it has at least half the initial C_m as credit."""
        return not self.parameters.own_credit or (
            hypothesis.credit >= self.parameters.initial_cm / 2
        )

    def settle(self, due: Sequence[MuHypothesis]) -> None:
        """Update C_m and credit; a success that a better hypothesis predicted gives no credit."""
        predicted = [(h.outcome, h.credit) for h in due if h.outcome in self.active]
        for h in due:
            h.predictions += 1
            success = h.outcome in self.active
            rate = self.rate(h, success=success)
            if success:
                h.successes += 1
                h.cm += rate * (1.0 - h.cm)
                if not any(self.names(s, h.outcome) and much > h.credit for s, much in predicted):
                    h.credit += rate * (1.0 - h.credit)
            else:
                h.cm -= rate * h.cm
                h.credit -= rate * h.credit

    def rate(self, h: MuHypothesis, *, success: bool) -> float:
        """α or β; with averaging one over the number of results, as long as that is more."""
        constant = self.parameters.alpha if success else self.parameters.beta
        if not self.parameters.averaging:
            return constant
        if h.run and h.run[-1][0] is not success:
            h.run = []
        h.run.append((success, (h.cm if success else 1.0 - h.cm) or 1e-300))
        if len(h.run) >= 2 and prod(odds for _, odds in h.run) < 0.002:
            h.run = [(success, 1.0)]
            h.averaged = 1
        h.averaged += 1
        return max(constant, 1.0 / h.averaged)

    def names(self, outcome: KnownSign, sign: KnownSign) -> bool:
        """Whether who predicts `outcome` has predicted `sign`: a part too, with situations."""
        part = self.parameters.situations and {*sign.tokens} < {*outcome.tokens}
        return sign == outcome or part

    def explain(self, outcome: KnownSign, alone: set[int]) -> None:
        """Create hypotheses for `outcome` from all Signs that were active within reach.

        With situations, not where it is one Token that another alone explains, and not from Signs
        with more than twice as many trials as the rarest.
        """
        for delay, then in enumerate(self.past, start=1):
            contexts = [context for context in then.active if not context.on_probation]
            action = then.action
            if action is None or (delay in alone and outcome.tokens == self.situation):
                continue
            for context in contexts:
                rarest = min(other.tries[action] for other in contexts)
                if self.parameters.situations and context.tries[action] > 2 * rarest:
                    continue
                credit = self.parameters.initial_cm * rarest / context.tries[action]
                self.take(context, action, outcome, delay, credit)

    def take(
        self, context: KnownSign, action: str, outcome: KnownSign, delay: int, credit: float
    ) -> None:
        """Take the opportunity to create a hypothesis, unless it exists."""
        held = self.holds(context, action, outcome, delay)
        if not held and self.rng.random() < self.parameters.learning_probability:
            self.create(context, action, outcome, delay, credit)

    def explain_as_a_whole(self, disproved: set[int]) -> set[int]:
        """Let past situations explain this one; the delays with which a Token explains another."""
        alone: set[int] = set()
        if not self.situation:
            return alone
        is_known = any(sign.tokens == self.situation for sign in self.signs)
        for delay, then in enumerate(self.past, start=1):
            if then.action is None or not then.situation:
                continue
            left = [
                h
                for h in self.hypotheses
                if h.context.tokens == then.situation and h.context.is_situation
            ]
            if is_known or delay in disproved or left:
                context = self.know_situation(then.situation)
                if context not in then.active:
                    then.active.append(context)
                    context.tries[then.action] = context.tries.get(then.action, 0) + 1
                outcome = self.know_situation(self.situation)
                if outcome not in self.active:
                    self.active.append(outcome)
                self.take(context, then.action, outcome, delay, self.parameters.initial_cm)
                if len(then.situation) == len(self.situation) == 1:
                    alone.add(delay)
        return alone

    def know_situation(self, tokens: tuple[str, ...]) -> KnownSign:
        """The Sign of a situation."""
        known = any(sign.tokens == tokens for sign in self.signs)
        sign = self.know(tokens)
        sign.is_situation |= not known
        sign.met, sign.on_probation = True, False
        return sign

    def drop_situations_with(self, token: str, goals: Sequence[tuple[str, ...]]) -> None:
        """Remove all hypotheses from or to situations with a Token that turned out to be random."""
        needed = [*goals, *(sign.tokens for sign in self.active)]
        for sign in [sign for sign in self.signs if sign.is_situation and token in sign.tokens]:
            for h in self.hypotheses:
                if sign in (h.context, h.outcome):
                    self.drop(h, needed)

    def differentiate(self, h: MuHypothesis) -> None:
        """Watch a mature, middling hypothesis; at the end it may spawn a copy.

        Not where a whole situation is the context of something: that tells more.
        """
        maturity = self.parameters.maturity
        situation = self.past[h.delay - 1].situation
        is_context = any(other.context.tokens == situation for other in self.hypotheses)
        if is_context and h.context.tokens != situation:
            return
        if h.watch is None:
            middling = 0.08 < h.successes / h.predictions < 0.92
            if middling and h.predictions % maturity == 0 and h.watches < 4:
                h.watch, h.watches = [], h.watches + 1
            return
        active_then = self.past[h.delay - 1].active
        tokens = [sign.tokens[0] for sign in active_then if len(sign.tokens) == 1]
        beside = [token for token in tokens if token not in h.context.tokens]
        h.watch.append((beside, h.outcome in self.active))
        if len(h.watch) == maturity:
            token, margin = separating_token(h.watch)
            h.watch = None
            if token is not None and margin > 0.5 and not self.predicts_alone(token, h):
                known = len(self.signs)
                context = self.know(tuple(sorted({*h.context.tokens, token})))
                context.on_probation |= len(self.signs) > known
                if not self.holds(context, h.action, h.outcome, h.delay):
                    credit = self.parameters.initial_cm
                    self.create(context, h.action, h.outcome, h.delay, credit)

    def end_probation(self, h: MuHypothesis) -> None:
        """End probation after enough successes without a failure, or at maturity."""
        proved = h.predictions == h.successes and h.predictions >= self.parameters.maturity // 4
        if h in self.hypotheses and (proved or h.predictions >= self.parameters.maturity):
            h.context.on_probation = False

    def predicts_alone(self, token: str, h: MuHypothesis) -> bool:
        """Whether the Token by itself predicts the outcome almost with certainty."""
        return any(
            other.context.tokens == (token,) and other.ends()[1:] == h.ends()[1:] and other.cm > 0.9
            for other in self.hypotheses
        )

    def remove_if_useless(self, h: MuHypothesis, goals: Sequence[tuple[str, ...]]) -> None:
        """Remove an ineffective hypothesis, or a conjunction no better than a part of it."""
        needed = [*goals, *(sign.tokens for sign in self.active)]
        alone = sum(other.outcome == h.outcome for other in self.hypotheses) == 1
        if h not in self.hypotheses or h.predictions < self.parameters.maturity:
            return
        if alone and h.outcome.tokens in needed:
            return
        if h.cm < self.parameters.ineffective or self.is_redundant(h):
            self.drop(h, needed)

    def is_redundant(self, h: MuHypothesis) -> bool:
        """Whether the context avoids less than a quarter of the failures of a part of it."""
        maturity = self.parameters.maturity
        if h.predictions % maturity:
            return False
        rates = [
            other.successes / other.predictions
            for other in self.hypotheses
            if set(other.context.tokens) < set(h.context.tokens)
            and other.ends()[1:] == h.ends()[1:]
            and other.predictions >= maturity
        ]
        own = h.successes / h.predictions
        return any(own <= rate + 0.25 * (1.0 - rate) for rate in rates)

    def drop(self, h: MuHypothesis, needed: Sequence[tuple[str, ...]]) -> None:
        """Remove a hypothesis, and its context if that is a conjunction used by nothing else."""
        self.hypotheses = [other for other in self.hypotheses if other != h]
        self.predictions = [(cycle, other) for cycle, other in self.predictions if other != h]
        self.forget([h.context], needed)
        self.forget([h.outcome] if h.outcome.is_situation else [], needed)

    def forget(self, signs: Sequence[KnownSign], needed: Sequence[tuple[str, ...]]) -> None:
        """Remove conjunctions that are no longer contexts, and the hypotheses for them."""
        for sign in signs:
            kept = [other for then in self.past for other in then.active]
            kept += [other.context for other in self.hypotheses]
            kept += [h.outcome for h in self.hypotheses if h.outcome.is_situation]
            if len(sign.tokens) > 1 and sign not in kept and sign.tokens not in needed:
                for h in [other for other in self.hypotheses if other.outcome == sign]:
                    if h in self.hypotheses:
                        self.drop(h, needed)
                self.signs = [other for other in self.signs if other != sign]

    def holds(self, *ends: KnownSign | str | int) -> bool:
        """Whether this very hypothesis exists."""
        return any(hypothesis.ends() == ends for hypothesis in self.hypotheses)

    def create(
        self, context: KnownSign, action: str, outcome: KnownSign, delay: int, credit: float
    ) -> None:
        """Add a hypothesis with the initial C_m."""
        cm = self.parameters.initial_cm
        self.hypotheses.append(MuHypothesis(context, action, outcome, delay, cm, credit))


def separating_token(watch: Sequence[tuple[Sequence[str], bool]]) -> tuple[str | None, float]:
    """The Token with the greatest P(success | Token) − P(success | no Token), and that margin.

    Considers only Tokens for which the two differ significantly: G over 10.83.
    """
    best, best_margin = None, 0.0
    for token in dict.fromkeys(token for beside, _ in watch for token in beside):
        with_it = [success for beside, success in watch if token in beside]
        without = [success for beside, success in watch if token not in beside]
        if without and g_statistic(with_it, without) > 10.83:
            margin = sum(with_it) / len(with_it) - sum(without) / len(without)
            if margin > best_margin:
                best, best_margin = token, margin
    return best, best_margin


def g_statistic(*columns: Sequence[bool]) -> float:
    """2 Σ O ln(O/E) over the cells of a table whose columns are lists of truth values."""
    total = sum(len(column) for column in columns)
    statistic = 0.0
    for column in columns:
        for truth in (True, False):
            observed = column.count(truth)
            expected = len(column) * sum(other.count(truth) for other in columns) / total
            statistic += 2 * observed * log(observed / expected) if observed else 0.0
    return statistic
