"""Vector tables of JPL Horizons, given as the text that Horizons prints.

Source: JPL Horizons manual, "Vector table". What stands between $$SOE and $$EOE is read, as CSV or
plain, with or without labels; the columns, units, axes and the centre are those of the header.
"""

import json
import re
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from farside.link.profile.sky.axes import ECLIPTIC, EQUATOR
from farside.link.profile.sky.positions import (
    DAY_S,
    J2000_DAY,
    ORIGIN,
    EphemerisError,
    Moments,
    Span,
    astropy_at_hand,
)
from farside.link.profile.statistics import Floats
from farside.validation import one_line

LIGHT_KM_S = 299_792.458
AU_KM = 149_597_870.7

_BODY = re.compile(r"\(\s*(-?[0-9]{1,9})\s*\)")
_LABEL = re.compile(r"\b[A-Z]{1,2}\s*=")
_NUMBER = r"[-+]?[0-9]+(?:\.[0-9]*)?(?:[ED][-+]?[0-9]+)?"
_DATED = re.compile(rf"\s*({_NUMBER})\s*=\s*(?:A\.D\.|B\.C\.|[0-9])")
_UNITS = {"KM": 1.0, "AU": AU_KM}
_PERIODS = {"S": 1.0, "D": DAY_S}
_POSITION, _VELOCITY = ("X", "Y", "Z"), ("VX", "VY", "VZ")
_UNNUMBERED = -999_999_999  # a body without a number of its own, such as a comet by its name

# Between its lines a table may be off by so much, which is a millisecond of light time.
_TOLERANCE_KM = LIGHT_KM_S * 1e-3


class Table(NamedTuple):
    """A vector table; see `farside.link.profile.sky.positions.Orbit`.

    Attributes:
        target, center: the bodies. A table of light times alone says nothing of directions, and
            counts as if the center rested at the origin.
        span: first and last line.
        has_directions: whether it holds positions.
        interpolate: position in km by TDB since J2000, shape (times, 3).
    """

    target: int
    center: int
    span: Span
    has_directions: bool
    interpolate: Callable[[Floats], Floats]

    def position_km(self, moments: Moments) -> Floats:
        """See `Orbit`."""
        return self.interpolate(moments.et_s).T


class _Header(NamedTuple):
    fields: dict[str, str]
    columns: list[str]


def horizons_table(text: str, name: str) -> Table:
    """Read a vector table.

    Args:
        text: the file: what Horizons prints, or the JSON in which its interface wraps that.
        name: what to call it in errors.

    Raises:
        EphemerisError: if it is no such table; says in which line.
    """
    lines = _unwrapped(text, name).splitlines()
    marks = [number for number, line in enumerate(lines) if line.strip() in {"$$SOE", "$$EOE"}]
    if len(marks) != 2:
        raise EphemerisError(
            f"{name}: expected a vector table of Horizons, between one $$SOE and one $$EOE, "
            f"found {len(marks)} of these lines"
        )
    begin, end = marks
    header = _header(lines[:begin], name)
    is_csv = any("," in line for line in lines[begin + 1 : begin + 2])
    rows = list((_csv_rows if is_csv else _plain_rows)(lines, begin + 1, end))
    return _table(header, rows, name)


def _unwrapped(text: str, name: str) -> str:
    if not text.lstrip().startswith("{"):
        return text
    try:
        result = json.loads(text)["result"]
    except (ValueError, LookupError, RecursionError) as error:
        raise EphemerisError(
            f"{name}: expected Horizons' JSON with a result, found none"
        ) from error
    return result if isinstance(result, str) else ""


def _header(lines: Sequence[str], name: str) -> _Header:
    fields: dict[str, str] = {}
    for line in lines:
        key, colon, value = line.partition(":")
        if colon:
            fields.setdefault(" ".join(key.lower().split()), value.strip())
    # The names of the columns stand in the last block between two rows of asterisks.
    block: list[str] = []
    for line in reversed(lines):
        if line.lstrip().startswith("***"):
            if block:
                break
            continue
        block[:0] = [line]
    words = (word.strip() for line in block for word in re.split(r",|\s{2,}|\s(?=[A-Z])", line))
    columns = [word for word in words if word and not word.startswith(("Date", "("))]
    columns = [word for word in columns if word != "Calendar"]
    if not columns or not columns[0].startswith("JD"):
        raise EphemerisError(
            f"{name}: expected a header that ends with the names of the columns, JDTDB or JDUT "
            f"first, found {one_line(' '.join(columns)) or 'none'}"
        )
    return _Header(fields, columns)


def _csv_rows(lines: Sequence[str], begin: int, end: int) -> Iterator[tuple[int, str, list[str]]]:
    for number in range(begin, end):
        day, _, *values = [field.strip() for field in lines[number].split(",")] + [""]
        if lines[number].strip():
            yield number + 1, day, [value for value in values if value]


def _plain_rows(lines: Sequence[str], begin: int, end: int) -> Iterator[tuple[int, str, list[str]]]:
    found: tuple[int, str, list[str]] | None = None
    for number in range(begin, end):
        line = lines[number]
        if dated := _DATED.match(line):
            if found:
                yield found
            found = number + 1, dated[1], []
        elif line.strip():
            values = _LABEL.sub(" ", line).split()
            found = found or (number + 1, "", [])
            found[2].extend(values)
    if found:
        yield found


def _table(header: _Header, rows: Sequence[tuple[int, str, list[str]]], name: str) -> Table:
    columns = [column for column in header.columns[1:] if column]
    numbers: list[list[float]] = []
    days: list[tuple[float, float]] = []
    for line, day, texts in rows:
        where = f"{name}, line {line}"
        try:
            whole, _, fraction = day.partition(".")
            days.append((float(int(whole)), float(f"0.{fraction or 0}")))
            numbers.append([float(text.replace("D", "E")) for text in texts])
        except ValueError:
            found = one_line(", ".join([day, *texts]))
            raise EphemerisError(f"{where}: expected a date and numbers, found {found}") from None
        if len(texts) != len(columns):
            names = ", ".join(columns)
            raise EphemerisError(
                f"{where}: expected {len(columns)} numbers ({names}), found {len(texts)}"
            )
        if not np.isfinite(numbers[-1]).all():
            raise EphemerisError(f"{where}: expected finite numbers, found {one_line(str(texts))}")
        if len(days) > 1 and sum(days[-1]) <= sum(days[-2]):
            raise EphemerisError(f"{where}: expected a date after that of the line before")
    if len(rows) < 2:
        raise EphemerisError(f"{name}: expected two lines or more, found {len(rows)}")
    values = dict(zip(columns, np.array(numbers).T, strict=True))
    et_s = _et_s(np.array(days), header, name)
    length_km, period_s = _units(header, name)
    span = float(et_s[0]), float(et_s[-1])
    target = _number(header, "target body name")
    if all(column in values for column in _POSITION):
        axes = _axes(header, name)
        positions = np.stack([values[column] for column in _POSITION], axis=1) * length_km
        speeds = None
        if all(column in values for column in _VELOCITY):
            speeds = np.stack([values[column] for column in _VELOCITY], axis=1)
            speeds = (speeds * length_km / period_s) @ axes.T
        positions = positions @ axes.T
        center = _number(header, "center body name")
        return Table(target, center, span, True, _curve(et_s, positions, speeds, name))  # noqa: FBT003
    if "LT" in values:
        # The light time counts in the unit of time of the table.
        distance_km = values["LT"] * period_s * LIGHT_KM_S
        positions = np.stack([distance_km, 0 * distance_km, 0 * distance_km], axis=1)
        return Table(target, ORIGIN, span, False, _curve(et_s, positions, None, name))  # noqa: FBT003
    raise EphemerisError(
        f"{name}: expected the columns X, Y and Z, or LT, found {', '.join(columns)}"
    )


def _et_s(days: Floats, header: _Header, name: str) -> Floats:
    scale = {"JDTDB": "tdb", "JDCT": "tdb", "JDUT": "utc", "JDUTC": "utc", "JDTT": "tt"}.get(
        header.columns[0]
    )
    if scale is None:
        raise EphemerisError(f"{name}: expected JDTDB or JDUT, found {header.columns[0]}")
    whole, fraction = days.T
    if scale != "tdb":
        with astropy_at_hand():
            from astropy.time import Time  # type: ignore[import-untyped]  # noqa: PLC0415

            times = Time(whole, fraction, format="jd", scale=scale).tdb
        whole, fraction = times.jd1, times.jd2
    et: Floats = ((whole - J2000_DAY) + fraction) * DAY_S
    return et


def _units(header: _Header, name: str) -> tuple[float, float]:
    units = header.fields.get("output units", "none").upper()
    length, _, period = units.partition(",")[0].partition("-")
    if length.strip() not in _UNITS or period.strip()[:1] not in _PERIODS:
        raise EphemerisError(
            f"{name}: expected output units KM-S, KM-D or AU-D in the header, found "
            f"{one_line(units)}"
        )
    return _UNITS[length.strip()], _PERIODS[period.strip()[:1]]


def _axes(header: _Header, name: str) -> Floats:
    corrected = header.fields.get("output type", "GEOMETRIC")
    if "GEOMETRIC" not in corrected.upper():
        raise EphemerisError(
            f"{name}: expected geometric states (no aberrations), found {one_line(corrected)}"
        )
    told = [header.fields.get(key, "") for key in ("reference frame", "coordinate systm")]
    axes = " ".join(told).lower()
    is_known = any(epoch in axes for epoch in ("icrf", "j2000")) and "1950" not in axes
    if "body" in axes or not is_known:
        raise EphemerisError(
            f"{name}: expected the axes of the ICRF or the ecliptic of J2000 in the header, "
            f"found {one_line(axes.strip()) or 'none'}"
        )
    return ECLIPTIC if "ecliptic" in axes else EQUATOR


def _number(header: _Header, key: str) -> int:
    found = _BODY.findall(header.fields.get(key, ""))
    return int(found[-1]) if found else _UNNUMBERED


def _curve(
    et_s: Floats, positions: Floats, speeds: Floats | None, name: str
) -> Callable[[Floats], Floats]:
    """The curve through the lines of a table.

    Raises:
        EphemerisError: if they are too far apart to tell what is between them.
    """
    from scipy.interpolate import (  # type: ignore[import-untyped]  # noqa: PLC0415 - takes long
        CubicHermiteSpline,
        CubicSpline,
    )

    def through(every: int) -> Callable[[Floats], Floats]:
        if speeds is not None:
            curve = CubicHermiteSpline(et_s[::every], positions[::every], speeds[::every])
        else:
            curve = CubicSpline(et_s[::every], positions[::every])
        return curve  # type: ignore[no-any-return]

    # With every other line left out, a cubic is off 16 times as far as with all of them.
    whole = len(et_s) - 1 + len(et_s) % 2
    if whole >= 5:
        apart = through(2)(et_s[1:whole:2]) - positions[1:whole:2]
        error_km = float(np.linalg.norm(apart, axis=1).max()) / 16
        if error_km > _TOLERANCE_KM:
            raise EphemerisError(
                f"{name}: expected lines so close that the position between them is known to "
                f"{_TOLERANCE_KM:.0f} km (1 ms of light time), found about {error_km:,.0f} km; "
                "ask Horizons for a shorter step"
            )
    return through(1)
