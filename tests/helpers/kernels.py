"""Writes SPICE kernels of positions (SPK), which are double precision arrays in a DAF file.

Source: NAIF, "DAF Required Reading" and "SPK Required Reading".
"""

import struct
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_RECORD = 1024
_FIRST_WORD = 3 * _RECORD // 8 + 1
_FTPSTR = b"FTPSTR:\r:\n:\r\n:\r\x00:\x81:\x10\xce:ENDFTP"
_DIRECTORY = 100


class Segment(NamedTuple):
    """A segment: the orbit of `target` about `center` from `first_s` to `last_s` (TDB, J2000)."""

    target: int
    center: int
    first_s: float
    last_s: float
    data_type: int
    data: Floats
    frame: int = 1


def write_kernel(path: Path, segments: Sequence[Segment]) -> Path:
    """Write a kernel with these segments, 25 at most."""
    words: list[Floats] = []
    summaries, at = b"", _FIRST_WORD
    for one in segments:
        ends = at, at + len(one.data) - 1
        whole = one.target, one.center, one.frame, one.data_type, *ends
        summaries += struct.pack("<2d6i", one.first_s, one.last_s, *whole)
        words.append(one.data)
        at = ends[1] + 1
    head = struct.pack("<8s2i60s3i8s", b"DAF/SPK ", 2, 6, b"test", 2, 2, at, b"LTL-IEEE")
    head = head.ljust(699, b"\0") + _FTPSTR
    listed = struct.pack("<3d", 0, 0, len(segments)) + summaries
    names = b"".join(b"segment".ljust(40) for _ in segments)
    records = (head.ljust(_RECORD, b"\0"), listed.ljust(_RECORD, b"\0"), names.ljust(_RECORD))
    data = np.concatenate(words).astype("<f8").tobytes()
    path.write_bytes(b"".join(records) + data.ljust(-(-len(data) // _RECORD) * _RECORD, b"\0"))
    return path


def hermite(
    target: int, center: int, epochs_s: Floats, states: Floats, *, window: int = 8, frame: int = 1
) -> Segment:
    """States in km and km/s at unequal steps, between which SPICE interpolates (type 13)."""
    directory = epochs_s[_DIRECTORY - 1 : -1 : _DIRECTORY]
    data = np.concatenate([states.ravel(), epochs_s, directory, [window - 1, len(epochs_s)]])
    return Segment(target, center, float(epochs_s[0]), float(epochs_s[-1]), 13, data, frame)


def chebyshev(target: int, center: int, first_s: float, last_s: float, path: Sequence) -> Segment:  # type: ignore[type-arg]
    """One record of Chebyshev coefficients in km for each axis (type 2)."""
    middle_s, radius_s = (first_s + last_s) / 2, (last_s - first_s) / 2
    record = np.concatenate([[middle_s, radius_s], *(np.asarray(axis, float) for axis in path)])
    data = np.concatenate([record, [first_s, 2 * radius_s, len(record), 1]])
    return Segment(target, center, first_s, last_s, 2, data)
