"""SPICE kernels of positions (SPK): the orbits in them, by jplephem.

jplephem reads the file and evaluates Chebyshev polynomials (data types 2 and 3). The types in which
spacecraft are published are evaluated here: Lagrange and Hermite interpolation between states, at
equal (8, 12) or unequal steps (9, 13). Source: NAIF, "SPK Required Reading".
"""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from farside.files import open_regular
from farside.link.profile.sky.axes import FRAMES
from farside.link.profile.sky.differences import modified_differences
from farside.link.profile.sky.positions import DAY_S, J2000_DAY, EphemerisError, Moments, Span
from farside.link.profile.statistics import Floats
from farside.validation import one_line, shown_path

_STATE = 6
_DAMAGE = (ArithmeticError, LookupError, TypeError, ValueError, struct.error)
"""What jplephem and numpy raise at a file that is not as it says."""


class Segment(NamedTuple):
    """One segment of a kernel; see `farside.link.profile.sky.positions.Orbit`."""

    target: int
    center: int
    span: Span
    frame: int
    evaluate: Callable[[Floats], Floats]

    def position_km(self, moments: Moments) -> Floats:
        """See `Orbit`."""
        turned: Floats = FRAMES[self.frame] @ self.evaluate(moments.et_s)
        return turned


def kernel_orbits(path: Path) -> list[Segment]:
    """The orbits of a kernel, in its order.

    Raises:
        EphemerisError: if it is no SPK kernel, or holds what cannot be evaluated.
    """
    try:
        from jplephem.daf import DAF  # type: ignore[import-untyped]  # noqa: PLC0415
        from jplephem.spk import SPK  # type: ignore[import-untyped]  # noqa: PLC0415
    except ModuleNotFoundError as error:
        raise EphemerisError(
            f"expected jplephem for kernels, found no {error.name}: pip install 'farside[spice]'"
        ) from error
    name = shown_path(str(path))
    try:
        file = open_regular(path)
    except OSError as error:
        raise EphemerisError(f"expected a kernel, found: {name}: {error.strerror}") from error
    except ValueError as error:
        raise EphemerisError(f"{error}: {name}") from error
    try:
        with file:
            _expect_content(file, name)
            kernel = SPK(DAF(file))
            kernel.daf.map_array(1, 1)  # all of it, which stays when the file is closed
            segments = [_segment(one, name) for one in kernel.segments]
    except EphemerisError:
        raise
    except OSError as error:
        raise EphemerisError(f"expected a kernel, found: {name}: {error.strerror}") from error
    except _DAMAGE as error:
        found = one_line(str(error))
        raise EphemerisError(f"{name}: expected a binary SPK kernel, found: {found}") from error
    if not segments:
        raise EphemerisError(f"{name}: expected a segment at least, found none")
    return segments


def _expect_content(file: BinaryIO, name: str) -> None:
    if not file.read(1):  # None, too, from some of /proc
        raise EphemerisError(f"{name}: expected a binary SPK kernel, found an empty file")


def _segment(read: Any, name: str) -> Segment:
    where = f"{name}: segment of {read.target} about {read.center}"
    if read.frame not in FRAMES:
        raise EphemerisError(
            f"{where}: expected the axes of J2000 (1) or its ecliptic (17), found {read.frame}"
        )
    make = _TYPES.get(read.data_type)
    if make is None:
        known = ", ".join(map(str, sorted(_TYPES)))
        raise EphemerisError(f"{where}: expected data type {known}, found {read.data_type}")
    span = read.start_second, read.end_second
    try:
        return Segment(read.target, read.center, span, read.frame, make(read))
    except _DAMAGE as error:
        raise EphemerisError(f"{where}: expected what it says it holds, found less") from error


def _polynomials(read: Any) -> Callable[[Floats], Floats]:
    read.load_array()  # while the file is open

    def evaluate(et_s: Floats) -> Floats:
        position: Floats = read.compute(J2000_DAY, et_s / DAY_S)[:3]
        return position

    return evaluate


def _states(read: Any, count: int) -> Floats:
    end = read.start_i + _STATE * count - 1
    states: Floats = read.daf.map_array(read.start_i, end).reshape(count, _STATE)
    return states


def _equal_steps(*, hermite: bool) -> Callable[[Any], Callable[[Floats], Floats]]:
    def make(read: Any) -> Callable[[Floats], Floats]:
        first_s, step_s, size, count = read.daf.read_array(read.end_i - 3, read.end_i)
        epochs_s = first_s + step_s * np.arange(int(count))
        return _Interpolation(epochs_s, _states(read, int(count)), int(size) + 1, hermite).at

    return make


def _unequal_steps(*, hermite: bool) -> Callable[[Any], Callable[[Floats], Floats]]:
    def make(read: Any) -> Callable[[Floats], Floats]:
        size, counted = read.daf.read_array(read.end_i - 1, read.end_i)
        count, begin = int(counted), read.start_i + _STATE * int(counted)
        epochs_s = read.daf.map_array(begin, begin + count - 1)
        return _Interpolation(epochs_s, _states(read, count), int(size) + 1, hermite).at

    return make


class _Interpolation:
    """Polynomials through the states of a window around each moment, by divided differences."""

    def __init__(self, epochs_s: Floats, states: Floats, window: int, hermite: bool) -> None:  # noqa: FBT001
        self._epochs_s, self._states = epochs_s, states
        self._window, self._hermite = min(window, len(epochs_s)), hermite

    def at(self, et_s: Floats) -> Floats:
        epochs_s, size = self._epochs_s, self._window
        after = np.searchsorted(epochs_s, et_s, side="right")
        if size % 2:  # the nearest epoch is in the middle of the window
            last = len(epochs_s) - 1
            before = np.clip(after - 1, 0, last)
            later_is_near = epochs_s[np.clip(after, 0, last)] - et_s < et_s - epochs_s[before]
            first = before + later_is_near - size // 2
        else:
            first = after - size // 2
        first = np.clip(first, 0, len(epochs_s) - size)
        chosen = first[:, np.newaxis] + np.arange(size)
        # Counted from the moment asked for, so that the polynomial is wanted at 0.
        times_s = epochs_s[chosen] - et_s[:, np.newaxis]
        states = self._states[chosen]
        return _at_zero(times_s, states[..., :3], states[..., 3:] if self._hermite else None)


def _at_zero(times_s: Floats, positions: Floats, velocities: Floats | None) -> Floats:
    """Newton's polynomial at time 0 through points, and velocities there if given.

    Args:
        times_s: shape (polynomials, points).
        positions: shape (polynomials, points, 3).
        velocities: likewise.

    Returns:
        shape (3, polynomials).
    """
    slopes = np.diff(positions, axis=1) / np.diff(times_s, axis=1)[..., np.newaxis]
    if velocities is None:
        nodes_s, differences = times_s, slopes
    else:
        nodes_s = np.repeat(times_s, 2, axis=1)
        differences = np.empty((len(times_s), nodes_s.shape[1] - 1, 3))
        differences[:, 0::2], differences[:, 1::2] = velocities, slopes
    coefficients = [positions[:, 0]]
    order = 1
    while differences.shape[1]:
        coefficients.append(differences[:, 0])
        order += 1
        apart_s = nodes_s[:, order:] - nodes_s[:, :-order]
        differences = np.diff(differences, axis=1) / apart_s[..., np.newaxis]
    found = coefficients.pop()
    for number in reversed(range(len(coefficients))):
        found = coefficients[number] - nodes_s[:, number, np.newaxis] * found
    result: Floats = found.T
    return result


def _difference_arrays(*, sized: bool) -> Callable[[Any], Callable[[Floats], Floats]]:
    """Data types 1 and 21, which JPL integrates spacecraft and small bodies in."""

    def make(read: Any) -> Callable[[Floats], Floats]:
        if sized:
            size, counted = read.daf.read_array(read.end_i - 1, read.end_i)
            terms = int(size)
        else:
            (counted,) = read.daf.read_array(read.end_i, read.end_i)
            terms = 15
        count, length = int(counted), 4 * terms + 11
        begin = read.start_i + count * length
        records: Floats = read.daf.map_array(read.start_i, begin - 1).reshape(count, length)
        epochs_s: Floats = read.daf.map_array(begin, begin + count - 1)

        def evaluate(et_s: Floats) -> Floats:
            chosen: NDArray[np.intp] = np.minimum(np.searchsorted(epochs_s, et_s), count - 1)
            positions = [
                modified_differences(records[number], terms, moment_s)
                for number, moment_s in zip(chosen.tolist(), et_s.tolist(), strict=True)
            ]
            return np.array(positions, dtype=np.float64).reshape(-1, 3).T

        return evaluate

    return make


_TYPES: dict[int, Callable[[Any], Callable[[Floats], Floats]]] = {
    1: _difference_arrays(sized=False),
    2: _polynomials,
    3: _polynomials,
    8: _equal_steps(hermite=False),
    9: _unequal_steps(hermite=False),
    12: _equal_steps(hermite=True),
    13: _unequal_steps(hermite=True),
    21: _difference_arrays(sized=True),
}
