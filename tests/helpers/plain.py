"""A reference implementation of the learning cycle, as plain as possible.

Written from the rules and not from the code: lists of small records, searched from end to end. Any
disagreement with the model is a fault in one of them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import log, prod

import numpy as np

from farside.dem import Parameters


@dataclass(eq=False)
class KnownSign:
    """A Sign, whether it was ever active, and the number of trials of each action in it."""

    tokens: tuple[str, ...]
    met: bool = False
    on_probation: bool = False
    tries: dict[str | None, int] = field(default_factory=dict)


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
        self.past: list[
            tuple[list[KnownSign], str | None]
        ] = []  # (active Signs, action), one cycle ago first
        self.cycle = 0

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
        unexpected = [
            sign
            for sign in self.active
            if sign.met and not any(h.outcome == sign and self.is_credible(h) for h in due)
        ]
        for sign in novel:
            sign.met = True
        self.settle(due)
        for hypothesis in due if self.parameters.differentiation else []:
            self.differentiate(hypothesis)
        for hypothesis in due if self.parameters.removal else []:
            self.remove_if_useless(hypothesis, goals)
        for hypothesis in due:
            self.end_probation(hypothesis)
        for sign in novel + unexpected:
            if not sign.on_probation:
                self.explain(sign)

    def perform(self, action: str | None, goals: Sequence[tuple[str, ...]] = ()) -> None:
        """Every hypothesis whose context and action are active predicts."""
        for sign in self.active if action is not None else []:
            sign.tries[action] = sign.tries.get(action, 0) + 1
            for hypothesis in self.hypotheses:
                if hypothesis.context == sign and hypothesis.action == action:
                    self.predictions.append((self.cycle + hypothesis.delay, hypothesis))
        self.past = [(self.active, action), *self.past]
        expired = [sign for active, _ in self.past[self.parameters.reach :] for sign in active]
        self.past = self.past[: self.parameters.reach]
        self.forget(expired if self.parameters.removal else [], goals)
        self.cycle += 1

    def is_credible(self, hypothesis: MuHypothesis) -> bool:
        """Whether it has at least half the initial C_m as credit."""
        return not self.parameters.own_credit or (
            hypothesis.credit >= self.parameters.initial_cm / 2
        )

    def settle(self, due: Sequence[MuHypothesis]) -> None:
        """Update C_m and credit; a success that a better hypothesis predicted gives no credit."""
        predicted = [(h.outcome, h.credit) for h in due]
        for h in due:
            h.predictions += 1
            success = h.outcome in self.active
            rate = self.rate(h, success=success)
            if success:
                h.successes += 1
                h.cm += rate * (1.0 - h.cm)
                if not any(sign == h.outcome and credit > h.credit for sign, credit in predicted):
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

    def explain(self, outcome: KnownSign) -> None:
        """Create hypotheses for `outcome` from all Signs that were active within reach."""
        for delay, (then, action) in enumerate(self.past, start=1):
            contexts = [context for context in then if not context.on_probation]
            if action is None:
                continue
            for context in contexts:
                if self.holds(context, action, outcome, delay):
                    continue
                if self.rng.random() < self.parameters.learning_probability:
                    rarest = min(other.tries[action] for other in contexts)
                    credit = self.parameters.initial_cm * rarest / context.tries[action]
                    self.create(context, action, outcome, delay, credit)

    def differentiate(self, h: MuHypothesis) -> None:
        """Watch a mature, middling hypothesis; at the end it may spawn a copy."""
        maturity = self.parameters.maturity
        if h.watch is None:
            middling = 0.08 < h.successes / h.predictions < 0.92
            if middling and h.predictions % maturity == 0 and h.watches < 4:
                h.watch, h.watches = [], h.watches + 1
            return
        active_then = self.past[h.delay - 1][0]
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

    def forget(self, signs: Sequence[KnownSign], needed: Sequence[tuple[str, ...]]) -> None:
        """Remove conjunctions that are no longer contexts, and the hypotheses for them."""
        for sign in signs:
            kept = [other for active, _ in self.past for other in active]
            kept += [other.context for other in self.hypotheses]
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
