"""The top-goal's map as a picture: an SVG that stands alone, to be read by day and at night."""

import math
from collections.abc import Mapping
from html import escape
from typing import NamedTuple

from farside.dem.lab.graph import Arc, Graph, Node, graph_of
from farside.dem.lab.layouts import Layout, Point, positions
from farside.dem.lists.signs import Sign
from farside.dem.model import DynamicExpectancyModel

MOST = 500
"""So many Signs are drawn if nothing else is asked for (project default)."""

_RAMP = ("#ffd27a", "#f79a5c", "#e2606c", "#a8458a", "#65398f", "#2b2a66")  # near the goal: first
_LABELLED = 60  # Signs; of more, only a few have room for a name
_STEP_PX = (18.0, 84.0)  # least and most pixels between neighbours
_WIDE_PX, _HIGH_PX = 1060.0, 860.0  # what all of them should fit into
_EDGE_PX, _HEAD_PX, _FOOT_PX = 44.0, 62.0, 62.0
_LEAST_WIDE_PX = 560.0
_LETTER_PX = 6.3  # width of a letter of a label

_STYLE = """
svg { color-scheme: light dark; background: var(--page);
  --page: #ffffff; --text: #1b2130; --soft: #566072; --line: #8a94a4; --accent: #1f5fbf;
  --goal: #2fae72; --rim: #4a5262; }
@media (prefers-color-scheme: dark) { svg {
  --page: #12161d; --text: #e8ebf0; --soft: #a5afbe; --line: #727d8d; --accent: #7db0ff;
  --goal: #39c283; --rim: #d3d9e2; } }
text { font: 12px system-ui, 'DejaVu Sans', sans-serif; fill: var(--text); }
.label { font-size: 11px; paint-order: stroke; stroke: var(--page); stroke-width: 3px; }
.action { font-size: 10px; fill: var(--soft); paint-order: stroke; stroke: var(--page);
  stroke-width: 3px; }
.title { font-size: 17px; font-weight: 650; }
.soft { fill: var(--soft); }
.arc { stroke: var(--line); fill: none; }
.arc.part { stroke-dasharray: 2 3; }
.arc.ahead { stroke: var(--accent); }
.tip { fill: var(--line); }
.tip.ahead { fill: var(--accent); }
circle { stroke: var(--rim); stroke-width: 1; }
circle.goal { fill: var(--goal); stroke: var(--text); stroke-width: 2; }
circle.off { fill: none; stroke-dasharray: 2 2; }
circle.here { fill: none; stroke: var(--accent); stroke-width: 2.5; }
"""


class Picture(NamedTuple):
    """A picture; a notebook shows it, and what `svg` holds can be written to a file.

    Attributes:
        svg: the whole file, as text. It needs nothing from elsewhere.
    """

    svg: str

    def _repr_svg_(self) -> str:
        return self.svg


def map_picture(
    model: DynamicExpectancyModel,
    *,
    layout: Layout | str = Layout.AUTO,
    places: Mapping[str, Point] | None = None,
    most: int = MOST,
) -> Picture:
    """Draw the top-goal's map: Signs as circles, the best action of each as an arc to its outcome.

    A colour is a policy value, light near the goal. The way from what was last sensed is
    emphasised. To reach a whole is to reach its parts: a dotted line leads to the part whose way a
    whole takes. A dashed circle is a Sign from which no way to the goal is known. Pointing at a
    Sign or an arc tells its numbers.

    Args:
        model: a model with a top-goal.
        layout: how to lay out the Signs; see `Layout`.
        places: where Tokens stand beside those such as `at:3,4`, as (across, up).
        most: at most so many Signs, those nearest to the goal. The picture says how many are left
            out.

    Raises:
        ValueError: if there is no top-goal, or its Sign is not known; if there is no such layout,
            or `most` is less than 1.
    """
    if most < 1:
        raise ValueError(f"most: expected 1 or more, found {most}")
    if layout not in list(Layout):
        raise ValueError(f"layout: expected one of {', '.join(Layout)}, found {layout!r}")
    graph = graph_of(model, most)
    points = positions(graph, Layout(layout), places or {})
    stretched = layout == Layout.VALUES  # across is cost, and up is nothing
    return Picture(_Drawing(graph, points, stretched=stretched).svg())


def ramp(share: float) -> str:
    """The colour of a value, given as a fraction of the greatest: light near the goal, dark far."""
    position = share * (len(_RAMP) - 1)
    lower = min(int(position), len(_RAMP) - 2)
    return mixed(_RAMP[lower], _RAMP[lower + 1], position - lower)


def mixed(colour: str, other: str, share: float) -> str:
    """The colour a fraction `share` of the way from `colour` to `other`, all as `#rrggbb`."""
    pairs = zip(bytes.fromhex(colour[1:]), bytes.fromhex(other[1:]), strict=True)
    return "#" + bytes(round(a + (b - a) * share) for a, b in pairs).hex()


class _Drawing:
    """A graph on a sheet."""

    def __init__(
        self, graph: Graph, points: Mapping[Sign, Point], *, stretched: bool = False
    ) -> None:
        self._graph = graph
        self._nodes = [node for node in graph.nodes if node.sign in points]
        across = [points[node.sign][0] for node in self._nodes]
        up = [points[node.sign][1] for node in self._nodes]
        wide, high = max(across) - min(across), max(up) - min(up)
        step, rise = _fitting(_WIDE_PX / max(wide, 1.0)), _fitting(_HIGH_PX / max(high, 1.0))
        if not stretched:
            step = rise = min(step, rise)
        self._is_labelled = len(self._nodes) <= _LABELLED
        self._step = step
        self._radius = min(11.0, step * 0.3, rise * 0.4)
        names = max(len(_named(node.sign)) for node in self._nodes)
        right = _EDGE_PX + (min(names, 30) * _LETTER_PX if self._is_labelled else 0.0)
        self._wide = max(wide * step + _EDGE_PX + right, _LEAST_WIDE_PX)
        self._high = high * rise + _HEAD_PX + _FOOT_PX + 2 * _EDGE_PX
        left = (self._wide - wide * step - right + _EDGE_PX) / 2
        self._at = {
            sign: (
                left + (x - min(across)) * step,
                _HEAD_PX + _EDGE_PX + (max(up) - y) * rise,
            )
            for sign, (x, y) in points.items()
        }
        self._greatest = max(node.value for node in self._nodes if node.value < math.inf)

    def svg(self) -> str:
        at, wide, high = self._at, f"{self._wide:.0f}", f"{self._high:.0f}"
        arcs = [arc for arc in self._graph.arcs if arc.source in at and arc.target in at]
        begin = (
            f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}" height="{high}" '
            f'viewBox="0 0 {wide} {high}" role="img" '
            f'aria-label="Policy map towards {_text(self._graph.goal)}">'
        )
        parts = [
            begin,
            f"<style>{_STYLE}</style>",
            *self._head(),
            *(self._arc(arc) for arc in sorted(arcs, key=lambda arc: arc.is_ahead)),
            *(self._node(node) for node in reversed(self._nodes)),
            *self._labels(arcs),
            *self._legend(),
            "</svg>\n",
        ]
        return "\n".join(parts)

    def _head(self) -> list[str]:
        graph = self._graph
        off = sum(node.value == math.inf for node in graph.nodes)
        on = len(graph.nodes) - off
        words = [f"{on} Signs with a way"]
        if off:
            words.append(f"{off} without one")
        hidden = len(graph.nodes) - len(self._nodes)
        if hidden:
            words.append(f"not drawn for want of a place: {hidden}")
        if graph.left_out:
            words.append(f"{graph.left_out} more are left out")
        title = _short(_named(graph.goal), int(self._wide / 13))
        return [
            f'<text class="title" x="24" y="36">Policy map towards {title}</text>',
            f'<text class="soft" x="24" y="56">{"; ".join(words)}</text>',
        ]

    def _arc(self, arc: Arc) -> str:
        (x, y), (to_x, to_y) = self._at[arc.source], self._at[arc.target]
        long = math.hypot(to_x - x, to_y - y)
        if long < 2 * self._radius:
            return ""
        kind = " ahead" if arc.is_ahead else " part" if arc.action is None else ""
        wide = (2.6 if arc.is_ahead else 0.8 + arc.cm) * min(1.0, self._step / 40 + 0.4)
        tip = min(7.0, 3.0 + 1.6 * wide, long - 2 * self._radius)
        across, down = (to_x - x) / long, (to_y - y) / long
        begin = x + across * self._radius, y + down * self._radius
        end = to_x - across * (self._radius + 1.5), to_y - down * (self._radius + 1.5)
        neck = end[0] - across * tip, end[1] - down * tip
        sides = [
            (neck[0] - side * down * tip * 0.55, neck[1] + side * across * tip * 0.55)
            for side in (1, -1)
        ]
        words = f"{_text(arc.source)}\n"
        words += (
            f"is on the way of its part {_text(arc.target)}"
            if arc.action is None
            else f"{escape(arc.action)} leads to {_text(arc.target)}\nC_m {arc.cm:.2f}"
        )
        return (
            f'<g><path class="arc{kind}" stroke-width="{wide:.1f}" '
            f'd="M{_xy(begin)}L{_xy(neck)}"/><path class="tip{kind}" '
            f'd="M{_xy(end)}L{_xy(sides[0])}L{_xy(sides[1])}Z"/><title>{words}</title></g>'
        )

    def _node(self, node: Node) -> str:
        x, y = self._at[node.sign]
        words, kind, fill = _text(node.sign), "", ""
        if node.sign == self._graph.goal:
            words, kind = f"{words}\nthe goal", ' class="goal"'
        elif node.value == math.inf:
            words, kind = f"{words}\nno way to the goal is known", ' class="off"'
        else:
            fill = f' fill="{ramp(node.value / self._greatest if self._greatest else 0.0)}"'
            words += f"\npolicy value {node.value:.2f}\nvalence depth {node.depth}"
            words += f"\nbest action {escape(node.action)}" if node.action else ""
        circle = f'<circle{kind}{fill} cx="{x:.1f}" cy="{y:.1f}" r="{self._radius:.1f}"/>'
        ring = ""
        if node.sign == self._graph.here:
            ring = f'<circle class="here" cx="{x:.1f}" cy="{y:.1f}" r="{self._radius + 4:.1f}"/>'
        return f"<g>{ring}{circle}<title>{words}</title></g>"

    def _labels(self, arcs: list[Arc]) -> list[str]:
        """Names of Signs and actions where there is room; else of goal and start alone."""
        graph = self._graph
        room = int(self._step * 1.5 / _LETTER_PX)
        labels = []
        for node in self._nodes:
            is_end = node.sign in {graph.goal, graph.here}
            if self._is_labelled or is_end:
                x, y = self._at[node.sign]
                text = _short(_named(node.sign), 30 if is_end else max(room, 5))
                # Beside what comes from the left, right, above and below.
                off = self._radius * 0.7 + (4 if node.sign == graph.here else 1)
                labels.append(
                    f'<text class="label" x="{x + off:.1f}" y="{y + off + 9:.1f}">{text}</text>'
                )
        if self._is_labelled:
            for arc in arcs:
                if arc.action is not None:
                    (x, y), (to_x, to_y) = self._at[arc.source], self._at[arc.target]
                    text = _short(arc.action, max(room // 2, 3))
                    labels.append(
                        f'<text class="action" text-anchor="middle" x="{(x + to_x) / 2:.1f}" '
                        f'y="{(y + to_y) / 2 + 3.5:.1f}">{text}</text>'
                    )
        return labels

    def _legend(self) -> list[str]:
        y, right = self._high - 30, 204
        stops = "".join(
            f'<stop offset="{share / 10:.1f}" stop-color="{ramp(share / 10)}"/>'
            for share in range(11)
        )

        def text(x: int, below: float, words: str, anchor: str = "start") -> str:
            at = f'x="{x}" y="{y + below:.0f}"'
            return f'<text class="soft" text-anchor="{anchor}" {at}>{words}</text>'

        def circle(x: int, kind: str) -> str:
            return f'<circle class="{kind}" cx="{x}" cy="{y + 4:.0f}" r="7"/>'

        return [
            f'<defs><linearGradient id="ramp">{stops}</linearGradient></defs>',
            f'<rect x="24" y="{y:.0f}" width="{right - 24}" height="9" rx="4" fill="url(#ramp)"/>',
            text(24, -8, "policy value: least cost to the goal"),
            text(24, 22, "0"),
            text(right, 22, f"{self._greatest:.4g}", "end"),
            circle(244, "goal"),
            text(256, 8, "goal"),
            circle(312, "here"),
            text(325, 8, "here, and the way ahead"),
            circle(500, "off"),
            text(512, 8, "no way"),
        ]


def _xy(point: Point) -> str:
    return f"{point[0]:.1f} {point[1]:.1f}"


def _fitting(step_px: float) -> float:
    return min(max(step_px, _STEP_PX[0]), _STEP_PX[1])


def _named(sign: Sign) -> str:
    return " + ".join(sign)


def _text(sign: Sign) -> str:
    return escape(_named(sign))


def _short(text: str, letters: int) -> str:
    """A text for the picture, with as many letters as there is room for."""
    return escape(text if len(text) <= letters else f"{text[: max(letters - 1, 1)]}…")
