"""The learning rules as pure functions of numbers.

| symbol | here | meaning |
|---|---|---|
| C_m | `cm` | corroboration measure of a µ-hypothesis, 0 to 1 |
| α | `alpha` | how far a success takes C_m towards 1, 0 to 1 |
| β | `beta` | how far a failure takes C_m towards 0, 0 to 1 |
| C_e | result of `cost_estimate` | what a µ-hypothesis is expected to cost until it comes true |
"""

import math


def reinforced(cm: float, alpha: float) -> float:
    """C_m after a prediction came true.

    C_m ← C_m + α(1 − C_m), so C_m = 1 − (1 − c)(1 − α)ⁿ after n successes from c. The result
    stays in [0, 1] where `cm` and `alpha` are. Source: seed.
    """
    return cm + alpha * (1.0 - cm)


def weakened(cm: float, beta: float) -> float:
    """C_m after a prediction failed.

    C_m ← C_m − β·C_m, so C_m = c(1 − β)ⁿ after n failures from c. The result stays in [0, 1]
    where `cm` and `beta` are. Source: seed.
    """
    return cm - beta * cm


def cost_estimate(action_cost: float, cm: float) -> float:
    """Cost of an action that has to be repeated until its outcome comes about.

    C_e = action_cost / C_m, in the unit of `action_cost`. Infinite, which makes the hypothesis
    unusable, where C_m is 0 or so small that the quotient is. Source: seed, equation 4.
    """
    return action_cost / cm if cm else math.inf
