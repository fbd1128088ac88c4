"""What a direction names as files, and plain tables in their place."""

from collections.abc import Callable, MutableMapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import msgspec

from farside.files import read_text
from farside.link.profile.config import AfterLast, LinkChange, OneWay
from farside.link.profile.impairments import Jitter, Slots
from farside.link.profile.layers import refused, text_at
from farside.link.profile.plans.delays import DelayFileError, parse_delays
from farside.link.profile.plans.dist import DistributionError, parse_distribution
from farside.link.profile.plans.traces import TraceError, parse_trace

if TYPE_CHECKING:
    from farside.link.profile.sky.positions import Orbit

Key = tuple[str, ...]

Kernels: TypeAlias = "MutableMapping[str, Sequence[Orbit]]"
"""The orbits of kernels by the names of their files."""


class Files(NamedTuple):
    """The files that a link names: what of them was read so far, and the folder of the rest."""

    folder: Path
    texts: MutableMapping[str, str]
    kernels: "Kernels"

    def orbits(self, name: str) -> "Sequence[Orbit]":
        """The orbits of a kernel.

        Raises:
            EphemerisError: if it is none.
        """
        from farside.link.profile.sky.kernels import kernel_orbits  # noqa: PLC0415

        if name not in self.kernels:
            self.kernels[name] = kernel_orbits(self.folder / name)
        return self.kernels[name]

    def text(self, name: str, key: Key, read: Callable[[Path], str] = read_text) -> str:
        """The text of the file that `key` names.

        Args:
            name: the file.
            key: what names it.
            read: reads it.

        Raises:
            LinkConfigError: if it cannot be read.
        """
        if name not in self.texts:
            self.texts[name] = text_at(self.folder / name, key, read)
        return self.texts[name]


def with_tables(one_way: OneWay, key: Key, files: Files) -> OneWay:
    """A direction that names no files; a measured delay that does not wrap is a `delay_table`.

    Args:
        one_way: the direction, unresolved.
        key: where it stands in the link's table.
        files: what it may name.

    Raises:
        LinkConfigError: if a file cannot be read, or is invalid.
    """
    one_way = _with_rates(one_way, key, files)
    one_way = _with_delays(one_way, key, files)
    return msgspec.structs.replace(one_way, **_random_tables(one_way, key, files))


def change_with_tables(change: LinkChange, key: Key, files: Files) -> LinkChange:
    """A change that names no files.

    Raises:
        LinkConfigError: if a file cannot be read, or is invalid.
    """
    return msgspec.structs.replace(change, **_random_tables(change, key, files))


def _with_rates(one_way: OneWay, key: Key, files: Files) -> OneWay:
    trace, key = one_way.rate_trace, (*key, "rate_trace")
    if trace is None:
        return one_way
    _expect_file_or(trace.file, "times_ms", bool(trace.times_ms), key)
    if trace.file is None:
        return one_way
    text = files.text(trace.file, (*key, "file"))
    try:
        times_ms = parse_trace(text, str(files.folder / trace.file))
    except TraceError as error:
        raise refused((*key, "file"), str(error)) from error
    trace = msgspec.structs.replace(trace, file=None, times_ms=times_ms)
    return msgspec.structs.replace(one_way, rate_trace=trace)


def _with_delays(one_way: OneWay, key: Key, files: Files) -> OneWay:
    trace, key = one_way.delay_trace, (*key, "delay_trace")
    if trace is None:
        return one_way
    _expect_file_or(trace.file, "points", bool(trace.points), key)
    points = trace.points
    if trace.file is not None:
        text, name = files.text(trace.file, (*key, "file")), str(files.folder / trace.file)
        try:
            points = parse_delays(text, name)
            trace = msgspec.structs.replace(trace, file=None, points=points)
        except DelayFileError as error:
            raise refused((*key, "file"), str(error)) from error
        except ValueError as error:  # a round without length
            raise refused((*key, "file"), f"{name}: {error}") from error
    if trace.at_end is AfterLast.HOLD:
        return msgspec.structs.replace(one_way, delay_table=points, delay_trace=None)
    return msgspec.structs.replace(one_way, delay_trace=trace)


def _random_tables(of: OneWay | LinkChange, key: Key, files: Files) -> dict[str, Jitter | Slots]:
    """Jitter and slots, as far as there are any, with the tables that they name as files."""
    found: dict[str, Jitter | Slots] = {}
    if of.jitter is not None:
        found["jitter"] = _with_distribution(of.jitter, (*key, "jitter"), files)
    if of.slots is not None and of.slots.wait is not None:
        wait = _with_distribution(of.slots.wait, (*key, "slots", "wait"), files)
        found["slots"] = msgspec.structs.replace(of.slots, wait=wait)
    return found


def _with_distribution(jitter: Jitter, key: Key, files: Files) -> Jitter:
    if jitter.file is None:
        return jitter
    key = (*key, "file")
    text = files.text(jitter.file, key)
    try:
        table = parse_distribution(text, str(files.folder / jitter.file))
    except DistributionError as error:
        raise refused(key, str(error)) from error
    return msgspec.structs.replace(jitter, file=None, table=table)


def _expect_file_or(file: str | None, other: str, given: bool, key: Key) -> None:  # noqa: FBT001
    if (file is None) == (not given):
        found = "both" if file is not None else "neither"
        raise refused(key, f"expected either file or {other}, found {found}")
