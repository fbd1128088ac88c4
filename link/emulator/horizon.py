"""How far ahead the tables of a link are known, on a clock that has no end.

Passes go on for ever and light times for decades, so their tables cover a window of days, and the
next window is computed while the present one lasts. Windows agree where they overlap: what was
known of the future stays so.
"""

from typing import NamedTuple

from farside.link.profile.config import LinkConfig, OneWay
from farside.link.profile.jitter import sampler
from farside.link.profile.plans.times import Window
from farside.link.profile.profile import Profile
from farside.link.profile.resolve import LightEnd
from farside.node import NEVER_NS, Direction, to_ns, to_s

LENGTH_S = 7 * 24 * 3600.0
"""How much of the future a window covers (project default)."""

_PASSES = 500  # shorter windows where there are more passes: many are taken over in milliseconds
_FLIGHTS = 4  # but as long as a message may be under way so many times
_SCORE = 6.5  # a normal score that one message in 10^10 exceeds


class Ahead(NamedTuple):
    """A link, and what is known of its future.

    Attributes:
        profile: as it is described.
        config: its tables.
        renew_ns: when to compute the next ones, at leisure; `NEVER_NS` if they have no end.
        latest_ns: when the next ones must be there, for messages then sent to arrive within these.
        light_end: where its light times end, if it has an ephemeris.
    """

    profile: Profile
    config: LinkConfig
    renew_ns: int = NEVER_NS
    latest_ns: int = NEVER_NS
    light_end: LightEnd | None = None


def look_ahead(profile: Profile, now_ns: int = 0) -> Ahead:
    """A link in the tables of the next days.

    Args:
        profile: as it is described.
        now_ns: since when they are wanted.

    Raises:
        LinkConfigError: if something is invalid, or a file cannot be read.
    """
    now_s = to_s(now_ns)
    described = profile.checked()
    passes = described.passes
    length_s = LENGTH_S if passes is None else min(LENGTH_S, _PASSES * passes.period_s)
    config = profile.resolved(Window(now_s, now_s + length_s))
    flight_s = max(_flight_s(config.way(direction)) for direction in Direction)
    if length_s < _FLIGHTS * flight_s:
        length_s = _FLIGHTS * flight_s
        config = profile.resolved(Window(now_s, now_s + length_s))
    if passes is None and described.ephemeris is None:
        return Ahead(profile, config)
    renew_ns, latest_ns = to_ns(now_s + length_s / 2), to_ns(now_s + length_s - flight_s)
    return Ahead(profile, config, renew_ns, latest_ns, profile.light_end())


def _flight_s(one_way: OneWay) -> float:
    """For how long a message can be under way, once it has left."""
    jitter_ns = max(sampler(one_way.jitter)([_SCORE])) if one_way.jitter else 0
    hold_s = one_way.reorder.hold_s if one_way.reorder else 0.0
    return to_s(one_way.greatest_delay_ns + jitter_ns) + hold_s
