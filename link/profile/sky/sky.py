"""The two ends of the link and the Sun, at times counted from a date."""

from collections.abc import Callable, Sequence
from datetime import datetime

import numpy as np

from farside.link.profile.ephemeris import Ephemeris
from farside.link.profile.sky.horizons import LIGHT_KM_S, Table, horizons_table
from farside.link.profile.sky.names import name_of, number_of
from farside.link.profile.sky.positions import (
    BUILT_IN,
    FIRST,
    LAST,
    ORIGIN,
    EphemerisError,
    Moments,
    Orbit,
    Positions,
    Span,
    common,
    date_of,
    et_s,
)
from farside.link.profile.statistics import Floats
from farside.validation import did_you_mean, one_line, shown

BODIES = tuple(sorted(BUILT_IN.keys() - {"earth", "earth-moon-barycenter"}))
"""Bodies that can be at the other end without a file, by their names in astropy."""

_SUN = 10
_NAMED = 20
_SYSTEMS = {199: 1, 299: 2, 499: 4, 599: 5, 699: 6, 799: 7, 899: 8, 999: 9}

# Each iteration multiplies the error by v/c, which is below 2e-4: after three, less than a
# microsecond is left even of the four hours to Neptune.
_ITERATIONS = 3


class Sky:
    """Light times and angles.

    Args:
        begin: the date from which times are counted.
        body, home: NAIF numbers of the other end and of the ground's body.
        orbits: what is known beside astropy's ephemeris.
        has_directions: whether more than distances are known.

    Attributes:
        body, home, has_directions: as given.
        is_built_in: whether nothing is known beside astropy's ephemeris.
        first_s, last_s: between which times light times of what is sent are known.

    Raises:
        EphemerisError: if `begin` is not between them.
    """

    def __init__(
        self,
        begin: datetime,
        body: int,
        home: int,
        orbits: Sequence[Orbit] = (),
        *,
        has_directions: bool = True,
    ) -> None:
        self.body, self.home, self.has_directions = body, home, has_directions
        self.is_built_in = not orbits
        if not FIRST <= begin <= LAST:
            raise EphemerisError(
                f"expected a date from {FIRST:%Y-%m-%d} to {LAST:%Y-%m-%d}, "
                f"found {begin.isoformat()}"
            )
        if body == home:
            raise EphemerisError(f"expected two bodies, found {name_of(body)} at both ends")
        self._positions = Positions(orbits)
        self._zero = Moments(begin, np.zeros(1))
        begin_s = float(self._zero.et_s[0])
        first_s, last_s = self._span(begin_s)
        self.first_s, self.last_s = first_s - begin_s, last_s - begin_s
        if not self.is_built_in:
            # What is sent last arrives while its destination is known.
            at_last = np.array([self.last_s])
            distance_km = np.linalg.norm(self._at(body, at_last) - self._at(home, at_last))
            self.last_s -= float(distance_km) * 1.001 + 1e-3

    def _span(self, begin_s: float) -> Span:
        known = [(et_s(FIRST), et_s(LAST))]
        for body in {self.body, self.home} | ({_SUN} if self.has_directions else set()):
            if body not in self._positions:
                raise EphemerisError(
                    f"expected {name_of(body)}, or a chain of orbits from there to a planet, "
                    "in the kernels, found none"
                )
            known = common(known, self._positions.spans(body))
        for first_s, last_s in known:
            if first_s <= begin_s <= last_s:
                return first_s, last_s
        spans = ", ".join(f"{date_of(first_s)} to {date_of(last_s)}" for first_s, last_s in known)
        raise EphemerisError(
            f"expected a date in what the files cover, {spans or 'which is nothing'}, "
            f"found {date_of(begin_s)}"
        )

    @property
    def last_date(self) -> str:
        """Until when light times are known, in UTC."""
        return date_of(float(self._zero.et_s[0]) + self.last_s)

    def clipped(self, times_s: Floats) -> Floats:
        """The times at which something is known: those outside are replaced by the nearest."""
        return np.unique(np.clip(times_s, self.first_s, self.last_s))

    def light_s(
        self, fixed: int, moving: int, times_s: Floats, *, backwards: bool = False
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
        """Angle between Sun and body seen from home, from positions at the same moment.

        Raises:
            EphemerisError: if only distances are known.
        """
        if not self.has_directions:
            raise EphemerisError(
                "expected positions (X, Y and Z) for the angle between Sun and body, "
                "found a table of light times alone"
            )
        home = self._at(self.home, times_s)
        sun, target = self._at(_SUN, times_s) - home, self._at(self.body, times_s) - home
        across = np.linalg.norm(np.cross(sun, target, axis=0), axis=0)
        angles: Floats = np.degrees(np.arctan2(across, (sun * target).sum(axis=0)))
        return angles

    def _at(self, body: int, times_s: Floats) -> Floats:
        """Positions in light seconds, shape (3, times)."""
        return self._positions.at(body, self._zero.at(times_s)) / LIGHT_KM_S


def sky_of(
    ephemeris: Ephemeris,
    begin: datetime,
    text_of: Callable[[str], str],
    orbits_of: Callable[[str], Sequence[Orbit]],
) -> Sky:
    """The sky that the table of an ephemeris describes.

    Args:
        ephemeris: the table.
        begin: the date of simulated time 0.
        text_of: the text of a file by its name.
        orbits_of: the orbits in a kernel by its name.

    Raises:
        EphemerisError: if a body or a file is invalid, or `begin` not covered.
    """
    home = number_of(ephemeris.center)
    if ephemeris.horizons is not None:
        table = horizons_table(text_of(ephemeris.horizons), one_line(ephemeris.horizons))
        if ephemeris.body is not None and number_of(ephemeris.body) != table.target:
            raise EphemerisError(
                f"expected a table of {name_of(number_of(ephemeris.body))} as in body, "
                f"found one of {name_of(table.target)}"
            )
        return _sky_of_table(table, begin, home)
    kernels = (ephemeris.kernel,) if isinstance(ephemeris.kernel, str) else ephemeris.kernel
    if not kernels:
        return Sky(begin, _built_in(ephemeris.body), home)
    orbits = [orbit for name in kernels for orbit in orbits_of(name)]
    held = {orbit.target for orbit in orbits}
    if ephemeris.body is None:
        raise EphemerisError(f"expected a body of the kernels ({_named(held)}), found none")
    return Sky(begin, _held(number_of(ephemeris.body), held), home, orbits)


def _sky_of_table(table: Table, begin: datetime, home: int) -> Sky:
    if table.has_directions:
        return Sky(begin, table.target, home, [table])
    return Sky(begin, table.target, ORIGIN, [table], has_directions=False)


def _held(body: int, held: set[int]) -> int:
    """`body`, or the barycentre of its system where the kernels hold only that."""
    found = body if body in held else _SYSTEMS.get(body, body)
    if found in held:
        return found
    raise EphemerisError(f"expected a body of the kernels ({_named(held)}), found {name_of(body)}")


def _named(held: set[int]) -> str:
    names = [name_of(each) for each in sorted(held)[:_NAMED]]
    return ", ".join([*names, *([f"{len(held) - _NAMED} more"] if len(held) > _NAMED else [])])


def _built_in(body: int | str | None) -> int:
    numbers = {number: number for name in BODIES for number in BUILT_IN[name]}
    known = numbers | {f"{number}": number for number in numbers}
    known |= {name: BUILT_IN[name][0] for name in BODIES}
    wanted = body.casefold() if isinstance(body, str) else body
    if wanted in known:
        return known[wanted]
    found = "none" if body is None else shown(body)
    hint = did_you_mean(wanted, BODIES) if isinstance(wanted, str) else ""
    raise EphemerisError(
        f"expected one of {', '.join(BODIES)}, found {found}{hint}; "
        "others need a kernel or a table of Horizons"
    )
