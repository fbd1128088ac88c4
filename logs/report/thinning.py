"""What keeps a page small, however long the run: honest envelopes, and every n-th row."""

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, Generic, TypeVar

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

    def skip(self) -> bool:
        """Whether the next row is left out anyway; if so it counts as added."""
        skipped = self._seen % self.every != 0
        self._seen += skipped
        return skipped

    def add(self, row: T, *, must: bool = False) -> None:
        """Add a row; one that `must` stay is never left out."""
        is_kept = must or self._seen % self.every == 0
        if is_kept:
            self.kept.append((self._seen, row, must))
            self._musts += must
        self._seen += 1
        while is_kept and len(self.kept) - self._musts > self._most:
            self.every *= 2
            self.kept = [one for one in self.kept if one[2] or one[0] % self.every == 0]

    @property
    def rows(self) -> list[T]:
        """Those that are kept, in order."""
        return [row for _, row, _ in self.kept]


_LEAST_CM = 4.0

R = TypeVar("R", bound=tuple[Any, ...])


class Waypoints(Generic[R]):
    """Rows of a way, thinned where there are too many: those stay at which it turns.

    A row is left out if it lies near where the way between its neighbours has it at its time.

    Args:
        most: how many rows.
        t: the number of the column with the time, in ms; those of x and y follow, in cm.
        same: columns in which neighbours must be alike.

    Attributes:
        rows: the rows.
        off_cm: how far what is left out may lie from the way; 0 while nothing is.
        apart_ms: how far neighbours may be apart after that.
    """

    def __init__(self, most: int, t: int = 0, same: tuple[int, ...] = ()) -> None:
        self.rows: list[R] = []
        self.off_cm, self.apart_ms = 0.0, 0
        self._most, self._t, self._same = most, t, same

    def add(self, row: R) -> None:
        """Add a row."""
        self.rows.append(row)
        while len(self.rows) > self._most:
            self.off_cm = max(_LEAST_CM, 1.25 * self.off_cm)
            self.apart_ms = max(15_000, 2 * self.apart_ms)
            self._thin()

    def _thin(self) -> None:
        kept, between = self.rows[:1], []
        for row, following in pairwise(self.rows[1:]):
            between.append(row)
            if self._lie_on_the_way(kept[-1], between, following):
                continue
            kept.append(row)
            between = []
        self.rows = [*kept, self.rows[-1]]

    def _lie_on_the_way(self, start: R, between: list[R], end: R) -> bool:
        t, x, y = self._t, self._t + 1, self._t + 2
        took = end[t] - start[t]
        if not 0 < took <= self.apart_ms:
            return False
        for row in between:
            if any(row[column] != start[column] for column in self._same):
                return False
            share = (row[t] - start[t]) / took
            east = start[x] + share * (end[x] - start[x]) - row[x]
            north = start[y] + share * (end[y] - start[y]) - row[y]
            if abs(east) > self.off_cm or abs(north) > self.off_cm:
                return False
        return all(end[column] == start[column] for column in self._same)

    def note(self, what: str) -> list[str]:
        """What the page says of it; nothing if nothing was left out."""
        if not self.off_cm:
            return []
        off = f"{self.off_cm:.0f} cm"
        return [f"{what}: points less than {off} from the way between others are left out"]


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
    spans = f"mean, least and greatest of {BUCKETS} equal spans of the run"
    return [f"{what}: more than {CURVE} points, drawn as {spans}"]
