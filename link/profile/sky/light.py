"""Light times and solar conjunctions from astropy's built-in ephemeris.

Needs Farside's extra `astropy`, which is imported only when something is computed. Distances are
those between the centres of the Earth and the other body. Nothing is downloaded.

Light times are accurate to 0.03 s for Mars, 0.2 ms for the Moon and 2 s for the planets farther
out, the limit being the orbit models. The delay by the Sun's gravity, less than half a
millisecond, is left out.
"""

import difflib
import math
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from datetime import UTC, date, datetime
from typing import NamedTuple

import msgspec
import numpy as np

from farside.link.profile.config import DelayPoint, Ephemeris
from farside.link.profile.statistics import Floats

BODIES = ("jupiter", "mars", "mercury", "moon", "neptune", "saturn", "sun", "uranus", "venus")
"""Bodies that can be at the other end, by their names in astropy."""

# UTC begins in 1960; the model of the Earth's orbit ends after 2099.
_FIRST, _LAST = datetime(1960, 1, 1, tzinfo=UTC), datetime(2100, 1, 1, tzinfo=UTC)
_LIGHT_KM_S = 299_792.458
_HOME = "earth"

# Each iteration multiplies the error by v/c, which is below 2e-4: after three, less than a
# microsecond is left even of the four hours to Neptune.
_ITERATIONS = 3

# Linear interpolation over an hour is off by 0.35 ms at most, for Mercury at perihelion.
_TABLE_STEP_S = 3600.0

_SCAN_STEP_S = 6 * 3600.0
_HALVINGS = 10  # of the scan's step: leaves 21 s


class EphemerisError(ValueError):
    """No light time can be computed: invalid body or epoch, or astropy is not installed."""


class LightTime(msgspec.Struct, frozen=True):
    """Light times between the centres of the Earth and a body.

    Attributes:
        uplink_s: of what leaves the Earth at the epoch.
        downlink_s: of what arrives at the Earth at the epoch.
        sun_earth_target_deg: angle between Sun and body, seen from the Earth, in degrees.
    """

    uplink_s: float
    downlink_s: float
    sun_earth_target_deg: float


class DelayTables(NamedTuple):
    """Delay tables of both directions, by the time of sending."""

    up: tuple[DelayPoint, ...]
    down: tuple[DelayPoint, ...]


def light_time(body: str, epoch: str) -> LightTime:
    """Light times between the Earth and `body` at an epoch.

    Args:
        body: one of `BODIES`.
        epoch: ISO 8601 with `Z` or an offset, or a date alone for 00:00 UTC.

    Raises:
        EphemerisError: if either is invalid, or astropy is not installed.
    """
    sky = _Sky(body, epoch)
    now_s = np.zeros(1)
    (uplink_s,) = sky.light_s(_HOME, sky.body, now_s).tolist()
    (downlink_s,) = sky.light_s(_HOME, sky.body, now_s, backwards=True).tolist()
    (angle_deg,) = sky.angle_deg(now_s).tolist()
    return LightTime(uplink_s, downlink_s, angle_deg)


def delay_tables(ephemeris: Ephemeris, duration_s: float) -> DelayTables:
    """The delays of a run, one point per hour from its beginning to its end or just after it.

    Linear interpolation is within a millisecond of the light time.

    Raises:
        EphemerisError: if body or epoch is invalid, the run outlasts the ephemeris, or astropy is
            not installed.
    """
    sky = _Sky(ephemeris.body, ephemeris.epoch, duration_s)
    sent_s = _steps_s(0, math.ceil(duration_s / _TABLE_STEP_S), _TABLE_STEP_S)
    return DelayTables(
        up=_points(sent_s, sky.light_s(_HOME, sky.body, sent_s)),
        down=_points(sent_s, sky.light_s(sky.body, _HOME, sent_s)),
    )


def conjunctions(ephemeris: Ephemeris, duration_s: float) -> list[tuple[float, float]]:
    """When, during a run, the body is closer to the Sun in the sky than `conjunction_deg`.

    Returns:
        beginning and end of each conjunction in order, accurate to half a minute, in seconds of
        simulated time; clipped to the run.

    Raises:
        EphemerisError: if body or epoch is invalid, the run outlasts the ephemeris, or astropy is
            not installed.
    """
    sky = _Sky(ephemeris.body, ephemeris.epoch, duration_s)
    limit_deg = ephemeris.conjunction_deg
    if not limit_deg:
        return []
    # One more step on either side, so that a minimum near an end of the run has two neighbours.
    scan_s = _steps_s(-1, math.ceil(duration_s / _SCAN_STEP_S) + 1, _SCAN_STEP_S)
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
    clipped_s = np.clip(edges_s, 0.0, duration_s).reshape(-1, 2).tolist()
    return [(start_s, end_s) for start_s, end_s in clipped_s if start_s < end_s]


def _steps_s(first: int, last: int, step_s: float) -> Floats:
    return np.arange(first, last + 1, dtype=np.float64) * np.float64(step_s)


def _points(times_s: Floats, delays_s: Floats) -> tuple[DelayPoint, ...]:
    return tuple(map(DelayPoint, times_s.tolist(), delays_s.tolist()))


def _minima_s(times_s: Floats, angles_deg: Floats) -> Floats:
    """Times of the minima of the angle, which may only just fall below the limit.

    Near a minimum the square of the angle is a parabola, as for any straight passage.
    """
    before, here, after = (angles_deg[i : len(angles_deg) - 2 + i] ** 2 for i in range(3))
    (least,) = np.nonzero((here < before) & (here <= after))
    before, here, after = before[least], here[least], after[least]
    shift = (before - after) / (before - 2 * here + after) / 2
    minima: Floats = times_s[least + 1] + shift * _SCAN_STEP_S
    return minima


class _Sky:
    """Positions of the Earth, the Sun and one body, at times counted from an epoch."""

    def __init__(self, body: str, epoch: str, duration_s: float = 0.0) -> None:
        self.body = _known(body)
        begin = _parsed(epoch)
        if begin < _FIRST or (_LAST - begin).total_seconds() < duration_s:
            raise EphemerisError(
                f"epoch: expected times from {_FIRST:%Y-%m-%d} to {_LAST:%Y-%m-%d}, found {epoch!r}"
                + (f" and {duration_s:g} s from there" if duration_s else "")
            )
        with _astropy():
            from astropy.time import Time  # type: ignore[import-untyped]  # noqa: PLC0415

            # Like simulated time, TDB has no leap seconds.
            self._begin = Time(begin, scale="utc").tdb

    def light_s(
        self, fixed: str, moving: str, times_s: Floats, *, backwards: bool = False
    ) -> Floats:
        """Light time from `fixed` at a given time to `moving` at the time of arrival.

        Args:
            fixed: the end at which the times are given.
            moving: the other end.
            times_s: when the light is at `fixed`.
            backwards: whether the light comes from `moving` and arrives at `fixed` instead.
        """
        here, light_s = self._at(fixed, times_s), np.zeros_like(times_s)
        for _ in range(_ITERATIONS):
            there = self._at(moving, times_s - light_s if backwards else times_s + light_s)
            light_s = np.linalg.norm(there - here, axis=0)
        return light_s

    def angle_deg(self, times_s: Floats) -> Floats:
        """Angle between Sun and body seen from the Earth, from positions at the same moment."""
        home = self._at(_HOME, times_s)
        sun, target = self._at("sun", times_s) - home, self._at(self.body, times_s) - home
        across = np.linalg.norm(np.cross(sun, target, axis=0), axis=0)
        angles: Floats = np.degrees(np.arctan2(across, (sun * target).sum(axis=0)))
        return angles

    def _at(self, body: str, times_s: Floats) -> Floats:
        """Positions in the barycentric frame in light seconds, shape (3, times)."""
        with _astropy():
            from astropy.coordinates import get_body_barycentric  # type: ignore[import-untyped]  # noqa: PLC0415
            from astropy.time import TimeDelta  # noqa: PLC0415

            times = self._begin + TimeDelta(times_s, format="sec", scale="tdb")
            position = get_body_barycentric(body, times, ephemeris="builtin")
        kilometres: Floats = position.xyz.to_value("km")
        return kilometres / _LIGHT_KM_S


@contextmanager
def _astropy() -> Iterator[None]:
    """Let astropy work without downloads, and without warnings about future leap seconds."""
    try:
        from astropy.utils import iers  # type: ignore[import-untyped]  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise EphemerisError(
            f"expected astropy for light times, found no {error.name}: "
            "pip install 'farside[astropy]'"
        ) from error
    with iers.conf.set_temp("auto_download", False), warnings.catch_warnings():  # noqa: FBT003
        warnings.simplefilter("ignore")
        yield


def _known(body: str) -> str:
    name = body.casefold()
    if name in BODIES:
        return name
    near = difflib.get_close_matches(name, BODIES, n=1)
    raise EphemerisError(
        f"body: expected one of {', '.join(BODIES)}, found {body!r}"
        + (f"; did you mean {near[0]}?" if near else "")
    )


def _parsed(epoch: str) -> datetime:
    expected = (
        "epoch: expected a date and time in ISO 8601 with Z or an offset, "
        f"such as 2021-02-18T00:00:00Z, found {epoch!r}"
    )
    try:
        moment = datetime.fromisoformat(epoch)
    except ValueError as error:
        raise EphemerisError(expected) from error
    if moment.tzinfo is not None:
        return moment
    try:
        date.fromisoformat(epoch)
    except ValueError:
        raise EphemerisError(f"{expected}; did you mean {epoch}Z?") from None
    return moment.replace(tzinfo=UTC)
