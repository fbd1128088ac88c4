"""What holds for the check of any link at all."""

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from link_profiles import profiles

from farside.link import LinkConfig
from farside.link.check import CheckVerdict, check_link

FRAMES = 60


def found(link: LinkConfig, seed: int) -> set[tuple[str, str]]:
    """What is outside; each line that was not measured has its reason."""
    measurements = check_link(link, frames=FRAMES, seed=seed).measurements
    for one in measurements:
        assert bool(one.why) is (one.verdict is CheckVerdict.UNKNOWN)
    outside = (one for one in measurements if one.verdict is CheckVerdict.OUTSIDE)
    return {(one.direction.value, one.impairment) for one in outside}


@settings(max_examples=15, suppress_health_check=[HealthCheck.too_slow])
@given(profiles(), st.integers(0, 2**32))
def test_no_right_link_is_refused(link: LinkConfig, seed: int) -> None:
    """By chance one in ten thousand is, so only what is found again with another seed counts."""
    outside = found(link, seed)
    assert not (outside and outside & found(link, seed + 1)), outside
