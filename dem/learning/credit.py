"""Credit: how well a hypothesis predicts what no better hypothesis predicts.

A Sign that is active almost everywhere, such as `battery:ok`, becomes the context of hypotheses
for every place. Each of them succeeds now and then, and C_m recovers quickly from failures, so
`cost / C_m` of a single such arc undercuts a long valid path: a phantom shortcut. The seed has no
answer to this. Three rules, all project defaults, define a second measure beside C_m, the credit,
on which the cost estimates of the Dynamic Policy Map are based:

1. *A rare cause explains more.* When an outcome first follows several contexts and one action,
   the context with the fewest trials of that action gets the full initial credit. Each other
   context gets the less, the more trials it has had without this outcome.
2. *Credit goes to the best predictor.* Credit changes as C_m does, except that a success does not
   raise it if a hypothesis with more credit predicted the same outcome.
3. *Only a credible prediction makes a Sign expected.* A Sign counts as predicted only if a
   hypothesis with at least half the initial C_m as credit named it. Otherwise the phantoms, which
   name every outcome, would keep valid hypotheses from being created; see
   `farside.dem.learning.learner`.

An outcome seen once after a context never tried before has the full initial credit, so one trial
is still enough. Where no two contexts compete, credit and C_m are equal.
"""

from collections.abc import Iterable, Mapping, Sequence

from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.signs import Sign


def initial_credit(initial_cm: float, tries: int, fewest: int) -> float:
    """Credit of a new hypothesis: c·n₀/n.

    Args:
        initial_cm: c, the initial C_m.
        tries: n, number of trials of its action in its context, the latest included; 1 or more.
        fewest: n₀, the same for the context with the fewest trials; 1 to `tries`.
    """
    return initial_cm * fewest / tries


def standing_alone(
    succeeded: Iterable[int], hypotheses: HypothesisList, names: Sequence[Sign] | None = None
) -> Sequence[bool]:
    """For each hypothesis that succeeded: whether none with more credit had the same outcome.

    If several hypotheses share the most credit for an outcome, all of them stand alone.

    Args:
        succeeded: hypotheses whose predictions came true in the same cycle.
        hypotheses: the Hypothesis List.
        names: the Signs by id, where who predicts a whole has predicted its parts too.
    """
    succeeded = list(succeeded)
    outcome, credit = hypotheses.outcome, hypotheses.credit
    most: dict[int, float] = {}
    for hypothesis in succeeded:
        sign = outcome[hypothesis]
        most[sign] = max(credit[hypothesis], most.get(sign, 0.0))
    if names is not None:
        for whole, much in [*most.items()]:
            if len(names[whole]) > 1:
                most.update(_shared_with_parts(names, whole, much, most))
    return [credit[hypothesis] >= most[outcome[hypothesis]] for hypothesis in succeeded]


def _shared_with_parts(
    names: Sequence[Sign], whole: int, credit: float, most: Mapping[int, float]
) -> dict[int, float]:
    """The parts of a whole that were predicted with less credit, with its credit."""
    tokens = set(names[whole])
    return {
        sign: credit
        for sign, much in most.items()
        if much < credit and tokens.issuperset(names[sign])
    }
