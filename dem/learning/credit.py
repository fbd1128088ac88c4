"""Credit: what a hypothesis foretells that no better one does.

A Sign that is active nearly everywhere, such as `battery:ok`, comes to stand in the context of
hypotheses to every place. Each succeeds now and then, and C_m forgets failures quickly, so
`cost / C_m` over one such arc undercuts a long honest path: a phantom shortcut. The seed has no
answer to this. Three rules, all project defaults, keep a second measure beside C_m, the credit,
which the Dynamic Policy Map then reckons costs with:

1. *A rare cause explains more.* When an outcome first follows several contexts and one action,
   the context that has met that action least often gets the full first credit, and each other
   one the less, the more often it has met the action without this outcome.
2. *A success that was foretold better is no credit.* Credit moves as C_m does, except that a
   success does not raise it where a hypothesis of more credit foretold the same outcome.
3. *What nobody can believe was not expected.* A Sign counts as predicted only if a hypothesis with
   at least half of the first C_m as credit named it; else phantoms, which name every outcome, would
   keep the honest hypotheses from being made (`farside.dem.learning.learner`).

An outcome seen once from a context never tried before still has the full first credit, so one
trial remains enough. Where no two contexts compete, credit and C_m are the same number.
"""

from collections.abc import Iterable, Sequence

from farside.dem.lists.hypotheses import HypothesisList


def first_credit(initial_cm: float, tries: int, fewest: int) -> float:
    """Credit of a new hypothesis: c·n₀/n.

    Args:
        initial_cm: c, the first C_m.
        tries: n, how often its context has met its action, this time included; 1 or more.
        fewest: n₀, the same for the context that met the action least often; 1 to `tries`.
    """
    return initial_cm * fewest / tries


def standing_alone(succeeded: Iterable[int], hypotheses: HypothesisList) -> Sequence[bool]:
    """For hypotheses whose predictions came true together: whether none did so with more credit.

    Those that share the most credit for an outcome all stand alone.
    """
    succeeded = list(succeeded)
    outcome, credit = hypotheses.outcome, hypotheses.credit
    most: dict[int, float] = {}
    for hypothesis in succeeded:
        of = outcome[hypothesis]
        most[of] = max(credit[hypothesis], most.get(of, 0.0))
    return [credit[hypothesis] >= most[outcome[hypothesis]] for hypothesis in succeeded]
