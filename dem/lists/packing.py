"""Columns of numbers, and as bytes that compress well and are the same on every machine."""

import sys
import zlib
from array import array
from collections.abc import Iterable

import numpy as np


def packed(column: "array[int] | array[float]") -> bytes:
    """The numbers of a column, transposed by byte, least significant byte first.

    The first bytes of all numbers come first, then all second bytes, and so on: in most columns
    the higher bytes hardly differ.
    """
    numbers = np.asarray(column)
    little = numbers.astype(numbers.dtype.newbyteorder("<"))
    return little.view(np.uint8).reshape(-1, little.itemsize).T.tobytes()


def unpack_into(column: "array[int] | array[float]", data: bytes) -> None:
    """Append the numbers that were `packed` from a column of the same type.

    Raises:
        ValueError: if the length of `data` is not a multiple of the item size.
    """
    if len(data) % column.itemsize:
        raise ValueError(f"expected numbers of {column.itemsize} bytes, found {len(data)} bytes")
    planes = np.frombuffer(data, dtype=np.uint8).reshape(column.itemsize, -1)
    little = np.ascontiguousarray(planes.T).view(np.dtype(column.typecode).newbyteorder("<"))
    column.frombytes(little.astype(column.typecode).tobytes())


def widen(column: "array[int] | array[float]", before: int, after: int, filler: int) -> None:
    """Lay a column of rows of `before` numbers out in rows of `after`, each filled up at its end.

    A row that is not complete is filled up as well.
    """
    numbers = np.array(column)
    rows = -(-len(numbers) // before) if before else 0
    table = np.full((rows, after), filler, dtype=numbers.dtype)
    whole = np.full(rows * before, filler, dtype=numbers.dtype)
    whole[: len(numbers)] = numbers
    table[:, :before] = whole.reshape(rows, before)
    del column[:]
    column.frombytes(table.tobytes())


def crc_of(columns: "Iterable[array[int] | array[float]]", crc: int = 0) -> int:
    """CRC-32 of the bits of all numbers, the same on every machine, continued from `crc`."""
    for column in columns:
        if sys.byteorder == "big":
            column = column[:]  # noqa: PLW2901 - a copy to turn around
            column.byteswap()
        crc = zlib.crc32(column, crc)
    return crc
