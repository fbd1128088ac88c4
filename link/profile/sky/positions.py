"""Positions of bodies and spacecraft, put together from orbits of one about another.

Bodies go by their NAIF numbers, as in SPICE: 0 is the barycentre of the Solar System, 399 the
Earth, negative numbers are spacecraft. Times are TDB, axes those of the ICRF.
"""

import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from datetime import UTC, datetime
from functools import cache
from typing import Any, NamedTuple, Protocol

import numpy as np

from farside.link.profile.statistics import Floats

ORIGIN = 0
"""The barycentre of the Solar System."""

J2000_DAY = 2_451_545.0
"""The Julian date from which times are counted."""

DAY_S = 86_400.0

FIRST, LAST = datetime(1960, 1, 1, tzinfo=UTC), datetime(2100, 1, 1, tzinfo=UTC)
"""What astropy's ephemeris covers: UTC begins in 1960; the model of the Earth's orbit ends 2099."""

BUILT_IN = {
    "sun": (10,),
    "mercury": (199, 1),
    "venus": (299, 2),
    "earth": (399,),
    "earth-moon-barycenter": (3,),
    "moon": (301,),
    "mars": (499, 4),
    "jupiter": (599, 5),
    "saturn": (699, 6),
    "uranus": (799, 7),
    "neptune": (899, 8),
}
"""Bodies of astropy's ephemeris, and their numbers; a planet and the barycentre of its system are
taken as one."""

Span = tuple[float, float]
"""First and last moment, in seconds of TDB since J2000."""


class EphemerisError(ValueError):
    """No light time can be computed: a body, a date or a file is invalid, or astropy is missing."""


class Moments:
    """Times counted from a date.

    Args:
        begin: the date.
        times_s: seconds since then; TDB, which like simulated time has no leap seconds.
    """

    def __init__(self, begin: datetime, times_s: Floats) -> None:
        with astropy_at_hand():
            from astropy.time import Time  # type: ignore[import-untyped]  # noqa: PLC0415

            self._begin = Time(begin, scale="utc").tdb
        self._set(times_s)

    def _set(self, times_s: Floats) -> None:
        begin = self._begin
        self.times_s = times_s
        self.et_s: Floats = ((begin.jd1 - J2000_DAY) + begin.jd2) * DAY_S + times_s

    def at(self, times_s: Floats) -> "Moments":
        """Other times counted from the same date."""
        other = object.__new__(Moments)
        other._begin = self._begin
        other._set(times_s)
        return other

    def astropy(self) -> Any:
        """The same as a `Time` of astropy."""
        from astropy.time import TimeDelta  # noqa: PLC0415

        return self._begin + TimeDelta(self.times_s, format="sec", scale="tdb")


class Orbit(Protocol):
    """Where one body is as seen from another, over a span of time."""

    @property
    def target(self) -> int:
        """The body."""
        ...

    @property
    def center(self) -> int:
        """The other one."""
        ...

    @property
    def span(self) -> Span:
        """When it is known."""
        ...

    def position_km(self, moments: Moments) -> Floats:
        """Of `target` as seen from `center`, shape (3, times)."""
        ...


class BuiltIn(NamedTuple):
    """A body of astropy's built-in ephemeris, about the barycentre of the Solar System."""

    name: str
    target: int

    @property
    def center(self) -> int:
        """See `Orbit`."""
        return ORIGIN

    @property
    def span(self) -> Span:
        """See `Orbit`."""
        # What is sent on the last day arrives on the next one.
        return et_s(FIRST) - DAY_S, et_s(LAST) + DAY_S

    def position_km(self, moments: Moments) -> Floats:
        """See `Orbit`."""
        with astropy_at_hand():
            from astropy.coordinates import get_body_barycentric  # type: ignore[import-untyped]  # noqa: PLC0415

            position = get_body_barycentric(self.name, moments.astropy(), ephemeris="builtin")
        kilometres: Floats = position.xyz.to_value("km")
        return kilometres


class Positions:
    """Positions of bodies that chains of orbits connect with the barycentre of the Solar System.

    Args:
        orbits: what is known; where two give the same body at the same time, the later one counts.
            A body of which they give nothing is taken from astropy's ephemeris.
    """

    def __init__(self, orbits: Sequence[Orbit]) -> None:
        given = {orbit.target for orbit in orbits}
        built_in = [
            BuiltIn(name, number)
            for name, numbers in BUILT_IN.items()
            for number in numbers
            if number not in given
        ]
        left: list[Orbit] = [*built_in, *orbits]
        self._orbits: dict[int, list[Orbit]] = {ORIGIN: []}
        while found := [one for one in left if one.center in self._orbits]:
            left = [one for one in left if one.center not in self._orbits]
            for orbit in found:
                self._orbits.setdefault(orbit.target, []).append(orbit)
        order = {id(one): number for number, one in enumerate((*built_in, *orbits))}
        for some in self._orbits.values():
            some.sort(key=lambda one: order[id(one)])

    def __contains__(self, body: int) -> bool:
        return body in self._orbits

    def spans(self, body: int, below: frozenset[int] = frozenset()) -> list[Span]:
        """When the position of `body` is known, in order and apart.

        Args:
            body: its number.
            below: bodies that are not to be on the way to the barycentre: it would close.
        """
        if body == ORIGIN:
            return [(-np.inf, np.inf)]
        below |= {body}
        known = sorted(
            span
            for orbit in self._orbits[body]
            if orbit.center not in below
            for span in common([orbit.span], self.spans(orbit.center, below))
        )
        spans: list[Span] = []
        for first_s, last_s in known:
            if spans and first_s <= spans[-1][1]:
                spans[-1] = spans[-1][0], max(last_s, spans[-1][1])
            else:
                spans.append((first_s, last_s))
        return spans

    def at(self, body: int, moments: Moments, below: frozenset[int] = frozenset()) -> Floats:
        """Positions of `body` in km about the barycentre of the Solar System, shape (3, times).

        Args:
            body: its number.
            moments: the times.
            below: as of `spans`.

        Raises:
            EphemerisError: if it is not known at one of these times.
        """
        positions: Floats = np.zeros((3, len(moments.times_s)))
        if body == ORIGIN:
            return positions
        left = np.ones(len(moments.times_s), dtype=np.bool_)
        below |= {body}
        for orbit in reversed(self._orbits[body]):
            if orbit.center in below:
                continue
            first_s, last_s = orbit.span
            inside = left & (first_s <= moments.et_s) & (moments.et_s <= last_s)
            if inside.any():
                part = moments if inside.all() else moments.at(moments.times_s[inside])
                positions[:, inside] = orbit.position_km(part) + self.at(orbit.center, part, below)
                left &= ~inside
        if left.any():
            missing = date_of(float(moments.et_s[left][0]))
            raise EphemerisError(f"expected a position of {body} at {missing}, found none")
        return positions


def common(some: Sequence[Span], others: Sequence[Span]) -> list[Span]:
    """The spans that belong to both."""
    both = ((max(a[0], b[0]), min(a[1], b[1])) for a in some for b in others)
    return sorted((first_s, last_s) for first_s, last_s in both if first_s < last_s)


@cache
def et_s(date: datetime) -> float:
    """A date as seconds of TDB since J2000."""
    return float(Moments(date, np.zeros(1)).et_s[0])


def date_of(et: float) -> str:
    """Seconds of TDB since J2000 as a date in UTC, such as `2026-11-28T00:00:00Z`."""
    with astropy_at_hand():
        from astropy.time import Time  # noqa: PLC0415

        return f"{Time(J2000_DAY, et / DAY_S, format='jd', scale='tdb').utc.isot[:19]}Z"


@contextmanager
def astropy_at_hand() -> Iterator[None]:
    """Let astropy work without downloads, and without warnings about future leap seconds.

    Raises:
        EphemerisError: if it is not installed.
    """
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
