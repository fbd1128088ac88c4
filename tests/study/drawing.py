"""A small SVG writer for the pictures of the studies: axes, lines with bands, dots with intervals.

Pictures bring a neutral ground of their own, so that they can be read on light and dark pages.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple
from xml.sax.saxutils import escape

GROUND, INK, FAINT = "#f6f5f1", "#2b2b2b", "#d4d2ca"
COLOURS = {"blue": "#1f5fa8", "orange": "#c05a00", "green": "#2c7a3f", "grey": "#6b6b6b"}
FONT = "font-family='DejaVu Sans, Verdana, Helvetica, Arial, sans-serif'"

Point = tuple[float, float]


class Estimate(NamedTuple):
    """A mean and its 95 % interval."""

    mean: float
    low: float
    high: float


class Axis(NamedTuple):
    """An axis: from and to which value, where it has ticks, and what stands on it."""

    low: float
    high: float
    ticks: Sequence[float]
    label: str
    log: bool = False

    def share(self, value: float) -> float:
        """How far along a value lies, 0 to 1."""
        if self.log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)


class Picture:
    """A picture with an axis at the bottom and, if it is given, one at the left.

    Args:
        title: what it shows, for those who cannot see it.
        x, y: the axes.
        height: in pixels; the width is 720.
        left, right: room beside the axes, for labels.
    """

    def __init__(
        self,
        title: str,
        x: Axis,
        y: Axis | None,
        *,
        height: int = 420,
        left: int = 70,
        right: int = 170,
    ) -> None:
        self._title, self._x_axis, self._y_axis = title, x, y
        self._height, self._width = height, 720
        self._left, self._right, self._top = left, self._width - right, 24
        self._bottom = height - 58
        self._parts: list[str] = []
        self._draw_axes()

    # --- where things are ----------------------------------------------------------------------

    def x(self, value: float) -> float:
        """The pixel of a value."""
        return self._left + self._x_axis.share(value) * (self._right - self._left)

    def y(self, value: float) -> float:
        """The pixel of a value, or of a row of the picture where there is no axis."""
        if self._y_axis is None:
            return value
        return self._bottom - self._y_axis.share(value) * (self._bottom - self._top)

    # --- what is drawn -------------------------------------------------------------------------

    def _draw_axes(self) -> None:
        x, y = self._x_axis, self._y_axis
        for tick in x.ticks:
            at = self.x(tick)
            self._line((at, self._top), (at, self._bottom), FAINT, 1)
            self.text((at, self._bottom + 18), f"{tick:,g}", anchor="middle")
        middle = (self._left + self._right) / 2
        self.text((middle, self._height - 14), x.label, anchor="middle")
        if y is None:
            return
        for tick in y.ticks:
            at = self.y(tick)
            self._line((self._left, at), (self._right, at), FAINT, 1)
            self.text((self._left - 8, at + 4), f"{tick:,g}", anchor="end")
        up = (self._top + self._bottom) / 2
        turn = f"transform='rotate(-90 20 {up:.1f})'"
        self.text((20, up), y.label, anchor="middle", more=turn)

    def text(
        self,
        at: Point,
        words: str,
        *,
        colour: str = INK,
        anchor: str = "start",
        weight: str = "normal",
        more: str = "",
    ) -> None:
        """Words at a pixel."""
        self._parts.append(
            f"<text x='{at[0]:.1f}' y='{at[1]:.1f}' fill='{colour}' font-size='13' {FONT} "
            f"font-weight='{weight}' text-anchor='{anchor}' {more}>{escape(words)}</text>"
        )

    def _line(self, a: Point, b: Point, colour: str, width: float) -> None:
        self._parts.append(
            f"<line x1='{a[0]:.1f}' y1='{a[1]:.1f}' x2='{b[0]:.1f}' y2='{b[1]:.1f}' "
            f"stroke='{colour}' stroke-width='{width:g}'/>"
        )

    def curve(
        self, points: Sequence[tuple[float, Estimate]], colour: str, *, dashed: bool = False
    ) -> None:
        """A line through the means, in a band of the intervals."""
        high = [(self.x(at), self.y(value.high)) for at, value in points]
        low = [(self.x(at), self.y(value.low)) for at, value in reversed(points)]
        self._parts.append(
            f"<polygon points='{_pairs(high + low)}' fill='{colour}' fill-opacity='0.18'/>"
        )
        mean = [(self.x(at), self.y(value.mean)) for at, value in points]
        dash = "stroke-dasharray='6 4'" if dashed else ""
        self._parts.append(
            f"<polyline points='{_pairs(mean)}' fill='none' stroke='{colour}' stroke-width='2.2' "
            f"{dash}/>"
        )

    def bars(
        self, points: Sequence[tuple[float, Estimate]], colour: str, *, aside: float = 0.0
    ) -> None:
        """A dot at each mean, on a bar of the interval; `aside` pixels to the right."""
        for at, value in points:
            x = self.x(at) + aside
            self._line((x, self.y(value.low)), (x, self.y(value.high)), colour, 2)
            self._dot((x, self.y(value.mean)), colour)

    def row(self, y: float, value: Estimate, colour: str, words: str) -> None:
        """A dot on a horizontal bar, with its name at the left and its numbers at the right."""
        self._line((self.x(value.low), y), (self.x(value.high), y), colour, 3)
        self._dot((self.x(value.mean), y), colour)
        self.text((self._left - 10, y + 4), words, anchor="end")

    def _dot(self, at: Point, colour: str) -> None:
        self._parts.append(f"<circle cx='{at[0]:.1f}' cy='{at[1]:.1f}' r='4' fill='{colour}'/>")

    def svg(self) -> str:
        """The picture as the text of a file."""
        size = f"width='{self._width}' height='{self._height}'"
        box = f"viewBox='0 0 {self._width} {self._height}'"
        ground = f"<rect {size} rx='6' fill='{GROUND}'/>"
        head = f"<svg xmlns='http://www.w3.org/2000/svg' {size} {box} role='img'>"
        title = f"<title>{escape(self._title)}</title>"
        return "\n".join([head, title, ground, *self._parts, "</svg>", ""])


def apart(labels: Sequence[tuple[float, str, str]], least: float = 17) -> list[float]:
    """Heights for labels beside lines, moved up and down until none covers another."""
    order = sorted(range(len(labels)), key=lambda n: labels[n][0])
    heights = [labels[n][0] for n in order]
    for _ in range(200):
        for upper in range(len(heights) - 1):
            lack = least - (heights[upper + 1] - heights[upper])
            if lack > 0:
                heights[upper] -= lack / 2
                heights[upper + 1] += lack / 2
    placed = dict(zip(order, heights, strict=True))
    return [placed[n] for n in range(len(labels))]


def _pairs(points: Sequence[Point]) -> str:
    return " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
