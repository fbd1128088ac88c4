"""The equations of the model as pure functions.

| symbol | here | meaning |
|---|---|---|
| C_m | `cm` | corroboration measure of a µ-hypothesis, 0 to 1 |
| α | `alpha` | gain of C_m on success, as a fraction of its distance to 1, 0 to 1 |
| β | `beta` | loss of C_m on failure, as a fraction of its value, 0 to 1 |
| n | `results` | number of results that C_m is the average of, the creation being the first |
| C_e | result of `cost_estimate` | expected cost until a µ-hypothesis comes true |
"""

import math

IMPROBABLE = 0.002
"""A run of equal results contradicts C_m if by C_m it had less than this probability (project
default). It happens by chance about once in a thousand results: little enough for equation 4."""

_LEAST = 1e-300  # so that the sign of a run is never lost


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


def averaged(
    results: int, run: float, probability: float, sign: float, improbable: float = IMPROBABLE
) -> tuple[int, float]:
    """Take a result into the average that C_m is; return the new `results` and `run`.

    The rate of the result, α or β, is the greater one of the parameter of that name and 1/n, see
    `averaging_rate`. So C_m is at first the mean of its initial value and of all results, failures
    as 0 and successes as 1. Later it follows slowly. If α = β, its mean over time is then the
    probability of success, and that of C_e the cost of an attempt times the mean number of
    attempts, as equation 4 has it.

    A run of equal results that is as good as impossible by C_m, below `improbable`, says that the
    world has changed. Then the average begins anew with the last of them, the first to have half
    the weight again: what worked sixty times and is blocked is given up after two failures, not
    after sixty. Source: project default; the probability of a run is that of a Pólya urn as long as
    1/n is the greater rate.

    Args:
        results: n before, 1 or more; 1 at creation.
        run: probability that the latest run of equal results had by C_m as it was at each of them,
            0 to 1, with a minus if they are failures; 1 at creation.
        probability: that of this result by C_m: C_m of a success, 1 − C_m of a failure.
        sign: 1 for a success, −1 for a failure.
        improbable: the probability; 0 for a world that does not change.
    """
    so_far = run * sign
    longer = probability or _LEAST
    if so_far > 0.0:
        longer *= so_far
        if longer < improbable:
            return 2, sign
    return results + 1, sign * max(longer, _LEAST)


def averaging_rate(constant: float, results: int) -> float:
    """The rate of the latest of n results: max(constant, 1/n).

    Args:
        constant: α or β, 0 to 1.
        results: n, that result included.
    """
    return max(constant, 1.0 / results)


def cost_estimate(action_cost: float, cm: float) -> float:
    """Expected cost of an action that is repeated until its outcome occurs.

    C_e = action_cost / C_m, in the unit of `action_cost`. Infinite, which makes the hypothesis
    unusable, if C_m is 0 or so small that the quotient overflows. Source: seed, equation 4.
    """
    return action_cost / cm if cm else math.inf
