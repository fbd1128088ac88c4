"""Light times and solar conjunctions of bodies and spacecraft.

Positions are those of astropy's built-in ephemeris (Farside's extra `astropy`), of SPICE kernels
(`spice`) or of a table of JPL Horizons. Nothing is downloaded, and what is needed is imported only
when something is computed. Distances are those between the centres of the bodies.

With the built-in ephemeris light times are accurate to 0.03 s for Mars, 0.2 ms for the Moon and 2 s
for the planets farther out, the limit being the orbit models. The delay by the Sun's gravity, less
than half a millisecond, is left out.
"""

import math
from typing import NamedTuple

import msgspec
import numpy as np

from farside.link.profile.config import DelayPoint
from farside.link.profile.sky.sky import Sky
from farside.link.profile.statistics import Floats

# Linear interpolation over an hour is off by 0.35 ms at most, for Mercury at perihelion. Where a
# spacecraft turns faster, an hour is divided until the error is below the tolerance.
_STEP_S = 3600.0
_QUARTERS = 4
_TOLERANCE_S = 2.5e-4
_MOST_HALVINGS = 6  # of a quarter of an hour: leaves 14 s

_SCAN_STEP_S = 6 * 3600.0
_HALVINGS = 10  # of the scan's step: leaves 21 s
_FURTHER_S = 60 * 86_400.0
_FURTHEST_S = 800 * 86_400.0


class LightTime(msgspec.Struct, frozen=True):
    """Light times between the ground's body and the other end.

    Attributes:
        uplink_s: of what leaves the ground's body at the epoch.
        downlink_s: of what arrives there at the epoch.
        sun_earth_target_deg: angle between Sun and the other end, seen from there, in degrees; none
            if only distances are known.
    """

    uplink_s: float
    downlink_s: float
    sun_earth_target_deg: float | None


class DelayTables(NamedTuple):
    """Delay tables of both directions, by the time of sending."""

    up: tuple[DelayPoint, ...]
    down: tuple[DelayPoint, ...]


def light_time(sky: Sky) -> LightTime:
    """Light times at the beginning of `sky`.

    Raises:
        EphemerisError: if a position is not known then.
    """
    now_s = np.zeros(1)
    (uplink_s,) = sky.light_s(sky.home, sky.body, now_s).tolist()
    (downlink_s,) = sky.light_s(sky.home, sky.body, now_s, backwards=True).tolist()
    angle_deg = float(sky.angle_deg(now_s)[0]) if sky.has_directions else None
    return LightTime(uplink_s, downlink_s, angle_deg)


def delay_tables(sky: Sky, begin_s: float, end_s: float) -> DelayTables:
    """The delays of what is sent between two times, or until the ephemeris ends.

    The points are those of a fixed grid, so that tables of times that overlap agree. It starts and
    ends at these times or just outside. Linear interpolation is within a millisecond of the light
    time.
    """
    ends = (sky.home, sky.body), (sky.body, sky.home)
    up, down = (_table(sky, fixed, moving, begin_s, end_s) for fixed, moving in ends)
    return DelayTables(up, down)


def _table(
    sky: Sky, fixed: int, moving: int, begin_s: float, end_s: float
) -> tuple[DelayPoint, ...]:
    step_s = _STEP_S if sky.is_built_in else _STEP_S / _QUARTERS
    sent_s = sky.clipped(_grid_s(begin_s, end_s, step_s))
    light_s = sky.light_s(fixed, moving, sent_s)
    if not sky.is_built_in and len(sent_s) > 1:
        middle_s = (sent_s[1:] + sent_s[:-1]) / 2
        error_s = np.abs(sky.light_s(fixed, moving, middle_s) - (light_s[1:] + light_s[:-1]) / 2)
        # Half the step has a quarter of the error.
        halvings = np.ceil(np.log2(np.maximum(error_s / _TOLERANCE_S, 1.0)) / 2)
        counts = 2 ** np.minimum(halvings, _MOST_HALVINGS).astype(int)
        within = [
            np.linspace(first, last, count, endpoint=False)
            for first, last, count in zip(sent_s[:-1], sent_s[1:], counts, strict=True)
        ]
        sent_s = np.concatenate([*within, sent_s[-1:]])
        light_s = sky.light_s(fixed, moving, sent_s)
    return tuple(map(DelayPoint, sent_s.tolist(), light_s.tolist()))


def conjunctions(
    sky: Sky, begin_s: float, end_s: float, limit_deg: float
) -> list[tuple[float, float]]:
    """When, between two times, the body is closer to the Sun in the sky than `limit_deg`.

    Returns:
        beginning and end of each conjunction in order, accurate to half a minute, in seconds since
        the beginning of `sky`. The first begins at `begin_s` at the earliest; one that is under way
        at `end_s` has its own end.

    Raises:
        EphemerisError: if directions are not known.
    """
    if not limit_deg:
        return []
    found = _conjunctions(sky, begin_s, end_s, limit_deg)
    edge_s, furthest_s = end_s, min(sky.last_s, end_s + _FURTHEST_S)
    while found and found[-1][1] >= edge_s and edge_s < furthest_s:
        more = _conjunctions(sky, edge_s, edge_s + _FURTHER_S, limit_deg)
        if not more or more[0][0] > edge_s:
            break
        found[-1] = found[-1][0], more[0][1]
        edge_s += _FURTHER_S
    return found


def _conjunctions(
    sky: Sky, begin_s: float, end_s: float, limit_deg: float
) -> list[tuple[float, float]]:
    # One more step on either side, so that a minimum near an end has two neighbours.
    scan_s = sky.clipped(_grid_s(begin_s, end_s, _SCAN_STEP_S, around=1))
    times_s = np.sort(np.concatenate([scan_s, _minima_s(scan_s, sky.angle_deg(scan_s))]))
    near = sky.angle_deg(times_s) < limit_deg
    (turns,) = np.nonzero(near[1:] != near[:-1])
    before_s, after_s = times_s[turns], times_s[turns + 1]
    for _ in range(_HALVINGS):
        middle_s = (before_s + after_s) / 2
        turned = (sky.angle_deg(middle_s) < limit_deg) != near[turns]
        before_s = np.where(turned, before_s, middle_s)
        after_s = np.where(turned, middle_s, after_s)
    edges_s = [*times_s[:1][near[:1]], *after_s, *times_s[-1:][near[-1:]]]
    clipped_s = np.clip(edges_s, begin_s, end_s).reshape(-1, 2).tolist()
    return [(start_s, stop_s) for start_s, stop_s in clipped_s if start_s < stop_s]


def _grid_s(begin_s: float, end_s: float, step_s: float, around: int = 0) -> Floats:
    first, last = math.floor(begin_s / step_s) - around, math.ceil(end_s / step_s) + around
    return np.arange(first, last + 1, dtype=np.float64) * np.float64(step_s)


def _minima_s(times_s: Floats, angles_deg: Floats) -> Floats:
    """Times of the minima of the angle, which may only just fall below the limit.

    Near a minimum the square of the angle is a parabola, as for any straight passage.
    """
    if len(times_s) < 3:
        return np.zeros(0)
    before, here, after = (angles_deg[i : len(angles_deg) - 2 + i] ** 2 for i in range(3))
    evenly = np.isclose(np.diff(times_s)[1:], np.diff(times_s)[:-1])
    (least,) = np.nonzero((here < before) & (here <= after) & evenly)
    before, here, after = before[least], here[least], after[least]
    shift = (before - after) / (before - 2 * here + after) / 2
    minima: Floats = times_s[least + 1] + shift * _SCAN_STEP_S
    return minima
