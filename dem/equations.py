"""The equations of the model as pure functions.

| symbol | here | meaning |
|---|---|---|
| C_m | `cm` | corroboration measure of a µ-hypothesis, 0 to 1 |
| α | `alpha` | gain of C_m on success, as a fraction of its distance to 1, 0 to 1 |
| β | `beta` | loss of C_m on failure, as a fraction of its value, 0 to 1 |
| C_e | result of `cost_estimate` | expected cost until a µ-hypothesis comes true |
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
    """Expected cost of an action that is repeated until its outcome occurs.

    C_e = action_cost / C_m, in the unit of `action_cost`. Infinite, which makes the hypothesis
    unusable, if C_m is 0 or so small that the quotient overflows. Source: seed, equation 4.
    """
    return action_cost / cm if cm else math.inf
