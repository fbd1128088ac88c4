"""What keeps a page small, however long the run: honest envelopes, and every n-th row."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Generic, TypeVar

from farside.logs.report.model import Series

CURVE = 4000
"""A curve with more points is drawn as least, mean and greatest of spans of time."""

BUCKETS = 1500
"""How many spans of time such a curve has (project default: more than a screen is wide)."""

_APART, _GAPS = 15_000, 8  # ms, and multiples of the usual distance: a line ends before such a gap

_Point = tuple[int, float, int]

T = TypeVar("T")


def ms(time_ns: int) -> int:
    """Nanoseconds as whole milliseconds, rounded down."""
    return time_ns // 1_000_000


def _rounded(value: float | None) -> float | None:
    return None if value is None else rounded(value)


def steps(times: Sequence[int]) -> list[int]:
    """Times as the page has them: the first, then each as its distance from the one before."""
    return [*times[:1], *(later - earlier for earlier, later in pairwise(times))]


def rounded(value: float) -> float:
    """A value to five significant digits, whole where it is."""
    short = float(f"{value:.5g}")
    return int(short) if short.is_integer() else short


class Rows(Generic[T]):
    """Keeps all rows; where there are more than `most`, every second, fourth, eighth... of them.

    Args:
        most: how many.

    Attributes:
        kept: the rows with their numbers, and whether each is one that is never left out.
        every: of how many rows one is kept.
    """

    def __init__(self, most: int) -> None:
        self.kept: list[tuple[int, T, bool]] = []
        self.every = 1
        self._most, self._seen, self._musts = most, 0, 0

    def add(self, row: T, *, must: bool = False) -> None:
        """Add a row; one that `must` stay is never left out."""
        if must or self._seen % self.every == 0:
            self.kept.append((self._seen, row, must))
            self._musts += must
        self._seen += 1
        while len(self.kept) - self._musts > self._most:
            self.every *= 2
            self.kept = [one for one in self.kept if one[2] or one[0] % self.every == 0]

    @property
    def rows(self) -> list[T]:
        """Those that are kept, in order."""
        return [row for _, row, _ in self.kept]


class Curve:
    """A curve that is thinned where it has too many points: nothing between lo and hi is lost.

    Args:
        until_ns: the end of the run.
        look: see `Series`; of steps, only changes count.

    Attributes:
        thinned: whether it was.
    """

    def __init__(self, until_ns: int, look: str = "line") -> None:
        self._width = max(1, -(-(ms(until_ns) + 1) // BUCKETS))
        self._look = look
        self._points: list[_Point] = []
        self._buckets: dict[int, _Bucket] = {}
        self.thinned = False

    def add(self, time_ns: int, value: float, known_ns: int = 0) -> None:
        """Add a point, in any order."""
        t, known = ms(time_ns), ms(known_ns)
        if self._look == "steps" and self._points and self._points[-1][1] == value:
            return
        if not self.thinned:
            self._points.append((t, value, known))
            if len(self._points) <= CURVE:
                return
            self.thinned = True
            points, self._points = self._points, []
            for point in points:
                self._count(*point)
        else:
            self._count(t, value, known)

    def _broken(self, points: list[_Point]) -> list[tuple[int, float | None, int]]:
        """The points, and a break wherever one is much farther from the next than usual."""
        if self._look != "line" or len(points) < 3:
            return list(points)
        times = [t for t, _, _ in points]
        apart = sorted(later - earlier for earlier, later in pairwise(times))
        widest = max(_APART, _GAPS * apart[len(apart) // 2])
        broken: list[tuple[int, float | None, int]] = [*points[:1]]
        for before, point in pairwise(points):
            if point[0] - before[0] > widest:
                broken.append((before[0] + 1, None, before[2]))
            broken.append(point)
        return broken

    def _count(self, t: int, value: float, known: int) -> None:
        number = t // self._width
        bucket = self._buckets.get(number)
        if bucket is None:
            bucket = self._buckets[number] = _Bucket(value)
        bucket.add(value, known)

    def series(self, name: str, *, asked: bool = False) -> Series:
        """The curve, in order of time."""
        if not self.thinned:
            points = self._broken(sorted(self._points))
            known = [point[2] for point in points]
            return Series(
                name,
                steps([t for t, _, _ in points]),
                [_rounded(value) for _, value, _ in points],
                known=steps(known) if any(known) else [],
                look=self._look,
                asked=asked,
            )
        buckets = sorted(self._buckets.items())
        middle = self._width // 2
        means = [
            (number * self._width + middle, bucket.total / bucket.count, bucket.known)
            for number, bucket in buckets
        ]
        points = self._broken(means)
        known = [point[2] for point in points]
        bounds = {point[0]: bucket for point, (_, bucket) in zip(means, buckets, strict=True)}
        least = [bounds[t].lo if t in bounds else None for t, _, _ in points]
        greatest = [bounds[t].hi if t in bounds else None for t, _, _ in points]
        return Series(
            name,
            steps([t for t, _, _ in points]),
            [_rounded(value) for _, value, _ in points],
            lo=[_rounded(value) for value in least],
            hi=[_rounded(value) for value in greatest],
            known=steps(known) if any(known) else [],
            asked=asked,
        )


class _Bucket:
    """The values in a span of time; `known` once all of them were."""

    __slots__ = ("count", "hi", "known", "lo", "total")

    def __init__(self, value: float) -> None:
        self.lo = self.hi = value
        self.total, self.count, self.known = 0.0, 0, 0

    def add(self, value: float, known: int) -> None:
        self.lo, self.hi = min(self.lo, value), max(self.hi, value)
        self.total += value
        self.count += 1
        self.known = max(self.known, known)


def thinning_note(what: str, curves: Iterable[Curve]) -> list[str]:
    """What the page says of curves that were thinned; nothing if none was."""
    if not any(curve.thinned for curve in curves):
        return []
    return [
        f"{what}: more than {CURVE} points, drawn as mean, least and greatest of {BUCKETS} equal "
        "spans of the run"
    ]
