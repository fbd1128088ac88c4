"""Light times and solar conjunctions from an ephemeris: the built-in one of astropy.

Needs Farside's extra `astropy`, which is imported when something is computed and not before. What
it computes are positions of centres: of the Earth and of the other body. Nothing is downloaded.

The light time of Mars is good to 0.03 s, that of the Moon to 0.2 ms, that of a planet farther out
to no more than 2 s: so well are the orbits modelled. What the Sun's gravity adds, less than half a
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
from numpy.typing import NDArray

from farside.link.profile.config import DelayPoint, Ephemeris

BODIES = ("jupiter", "mars", "mercury", "moon", "neptune", "saturn", "sun", "uranus", "venus")
"""What can be at the other end, by astropy's names."""

# UTC begins in 1960; the model of the Earth's orbit ends with 2099.
_FIRST, _LAST = datetime(1960, 1, 1, tzinfo=UTC), datetime(2100, 1, 1, tzinfo=UTC)
_LIGHT_KM_S = 299_792.458
_HOME = "earth"

# Each round leaves v/c of the error of the one before, and v/c is below 2e-4: three leave less
# than a microsecond, even of the four hours to Neptune.
_ROUNDS = 3

# Within an hour a straight line is off by 0.35 ms at most, for Mercury at perihelion.
_TABLE_STEP_S = 3600.0

_SCAN_STEP_S = 6 * 3600.0
_HALVINGS = 10  # of the scan's step: leaves 21 s

_Floats = NDArray[np.float64]


class EphemerisError(ValueError):
    """No light time can be told: the body or the epoch is none, or astropy is not installed."""


class LightTime(msgspec.Struct, frozen=True):
    """How far a body is from the Earth, centre to centre.

    Attributes:
        uplink_s: light time of what leaves the Earth at the epoch.
        downlink_s: light time of what arrives at the Earth at the epoch.
        sun_earth_target_deg: angle between Sun and body, seen from the Earth.
    """

    uplink_s: float
    downlink_s: float
    sun_earth_target_deg: float


class DelayTables(NamedTuple):
    """The delay of what is sent at a time, for both directions."""

    up: tuple[DelayPoint, ...]
    down: tuple[DelayPoint, ...]


def light_time(body: str, epoch: str) -> LightTime:
    """Light times between the Earth and `body` at an epoch.

    Args:
        body: one of `BODIES`.
        epoch: ISO 8601 with `Z` or an offset, or a date alone for 00:00 UTC.

    Raises:
        EphemerisError: if either is something else, or astropy is not installed.
    """
    sky = _Sky(body, epoch)
    now_s = np.zeros(1)
    (uplink_s,) = sky.light_s(_HOME, sky.body, now_s).tolist()
    (downlink_s,) = sky.light_s(_HOME, sky.body, now_s, backwards=True).tolist()
    (angle_deg,) = sky.angle_deg(now_s).tolist()
    return LightTime(uplink_s, downlink_s, angle_deg)


def delay_tables(ephemeris: Ephemeris, duration_s: float) -> DelayTables:
    """The delays of a run, a point an hour from its begin to its end or a little after.

    Interpolated they are within a millisecond of the light time.

    Raises:
        EphemerisError: if body or epoch are none, the run is over too late, or astropy is missing.
    """
    sky = _Sky(ephemeris.body, ephemeris.epoch, duration_s)
    sent_s = _steps_s(0, math.ceil(duration_s / _TABLE_STEP_S), _TABLE_STEP_S)
    return DelayTables(
        up=_points(sent_s, sky.light_s(_HOME, sky.body, sent_s)),
        down=_points(sent_s, sky.light_s(sky.body, _HOME, sent_s)),
    )


def conjunctions(ephemeris: Ephemeris, duration_s: float) -> list[tuple[float, float]]:
    """When, in a run, the body is nearer to the Sun in the sky than `conjunction_deg`.

    Returns:
        Begin and end of each such time, to half a minute, in seconds of simulated time and in
        order; cut where the run begins and ends.

    Raises:
        EphemerisError: if body or epoch are none, the run is over too late, or astropy is missing.
    """
    sky = _Sky(ephemeris.body, ephemeris.epoch, duration_s)
    limit_deg = ephemeris.conjunction_deg
    if not limit_deg:
        return []
    # A step more on either side, so that a minimum near an end of the run has two neighbours.
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


def _steps_s(first: int, last: int, step_s: float) -> _Floats:
    return np.arange(first, last + 1, dtype=np.float64) * np.float64(step_s)


def _points(times_s: _Floats, delays_s: _Floats) -> tuple[DelayPoint, ...]:
    return tuple(map(DelayPoint, times_s.tolist(), delays_s.tolist()))


def _minima_s(times_s: _Floats, angles_deg: _Floats) -> _Floats:
    """When the angle is smallest, wherever it has a minimum: a body may graze the limit.

    About a minimum the square of the angle is a parabola, as for anything that passes by.
    """
    before, here, after = (angles_deg[i : len(angles_deg) - 2 + i] ** 2 for i in range(3))
    (least,) = np.nonzero((here < before) & (here <= after))
    before, here, after = before[least], here[least], after[least]
    shift = (before - after) / (before - 2 * here + after) / 2
    minima: _Floats = times_s[least + 1] + shift * _SCAN_STEP_S
    return minima


class _Sky:
    """Where the Earth, the Sun and one body are, at times that count from an epoch."""

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

            # Simulated time has no leap seconds, nor has TDB.
            self._begin = Time(begin, scale="utc").tdb

    def light_s(
        self, fixed: str, moving: str, times_s: _Floats, *, backwards: bool = False
    ) -> _Floats:
        """Light time from where `fixed` is at a time to where `moving` is when it arrives there.

        Args:
            fixed: the end at which the times are told.
            moving: the other end.
            times_s: when the light is at `fixed`.
            backwards: the light comes from `moving` instead, so it was there before.
        """
        here, light_s = self._at(fixed, times_s), np.zeros_like(times_s)
        for _ in range(_ROUNDS):
            there = self._at(moving, times_s - light_s if backwards else times_s + light_s)
            light_s = np.linalg.norm(there - here, axis=0)
        return light_s

    def angle_deg(self, times_s: _Floats) -> _Floats:
        """Angle between Sun and body from the Earth, as they stand at the same moment."""
        home = self._at(_HOME, times_s)
        sun, target = self._at("sun", times_s) - home, self._at(self.body, times_s) - home
        across = np.linalg.norm(np.cross(sun, target, axis=0), axis=0)
        angles: _Floats = np.degrees(np.arctan2(across, (sun * target).sum(axis=0)))
        return angles

    def _at(self, body: str, times_s: _Floats) -> _Floats:
        """Places in the barycentric frame, in light seconds, one axis a row."""
        with _astropy():
            from astropy.coordinates import get_body_barycentric  # type: ignore[import-untyped]  # noqa: PLC0415
            from astropy.time import TimeDelta  # noqa: PLC0415

            times = self._begin + TimeDelta(times_s, format="sec", scale="tdb")
            place = get_body_barycentric(body, times, ephemeris="builtin")
        kilometres: _Floats = place.xyz.to_value("km")
        return kilometres / _LIGHT_KM_S


@contextmanager
def _astropy() -> Iterator[None]:
    """Let astropy work without downloads, and without warnings of leap seconds yet unknown."""
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
