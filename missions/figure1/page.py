"""Figure 1 as one self-contained page: three yards of columns to rotate and to point at."""

import html
from pathlib import Path
from string import Template

from plotly import graph_objects  # type: ignore[import-untyped]
from plotly.io import to_html  # type: ignore[import-untyped]

from farside.dem.lab.picture import mixed, ramp
from farside.missions.figure1.example import (
    ACTION_COST,
    CYCLES,
    TALLEST,
    VISITED_TWICE,
    Block,
    Figure1,
    Panel,
    blocks,
    greatest_value,
)

_CORNERS = tuple((east, north, up) for up in (0, 1) for north in (0, 1) for east in (0, 1))
# Two triangles for each face, with corners anticlockwise from outside, and how much darker it is
# than the top; no bottom. The library's own lighting fails with orthographic projection.
_FACES = (
    ((4, 5, 7), (4, 7, 6), 0.0),
    ((0, 1, 5), (0, 5, 4), 0.16),
    ((1, 3, 7), (1, 7, 5), 0.32),
    ((3, 2, 6), (3, 6, 7), 0.16),
    ((2, 0, 4), (2, 4, 6), 0.32),
)
_GAP = 0.04  # in cells
_CAMERA = {
    "projection": {"type": "orthographic"},
    "eye": {"x": 0.5, "y": -1.4, "z": 1.6},
    "center": {"x": 0, "y": 0, "z": 0.01},
}
_ZOOM = 6.3  # cells per unit of the scene

_PAGE = Template("""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Figure 1: three goals, three policy maps</title>
<style>
  body { margin: 0 auto; max-width: 120rem; padding: 1.5rem 2rem; color: #1f2430;
         background: #fff; font: 16px/1.5 system-ui, sans-serif; }
  h1 { font-size: 1.5rem; margin: 0; }
  p { color: #4b5563; max-width: 60rem; margin: .4rem 0 1rem; }
  main { display: grid; gap: 1rem;
         grid-template-columns: repeat(auto-fit, minmax(min(26rem, 100%), 1fr)); }
  section { border: 1px solid #e5e7eb; border-radius: .75rem; overflow: hidden; }
  h2 { font-size: 1.1rem; text-align: center; margin: .75rem 0 0; }
  .yard { aspect-ratio: 6 / 5; }
  footer { display: flex; gap: .75rem; justify-content: center; align-items: center;
           margin-top: 1rem; color: #4b5563; }
  .ramp { width: min(30rem, 40vw); height: .8rem; border-radius: .4rem;
          background: linear-gradient(to right, $stops); }
</style>
</head>
<body>
<h1>Three goals, three policy maps</h1>
<p>A yard of $places places, learned by $cycles random actions at a cost of $cost each. They sensed
$twice of the places at least twice, and sense all of them so often with $share of seeds. The height
of a column is the policy value of its place: the least estimated cost from there to the goal, the
green place under the pin. Drag to rotate, scroll to zoom; all three rotate together. Point at a
column for its values.</p>
<main>
$yards
</main>
<footer><span>policy value 0</span><span class="ramp"></span><span>$greatest</span></footer>
<script>
// The first yard was drawn while it was alone on the page. Rotating one yard rotates all.
const yards = [...document.querySelectorAll(".plotly-graph-div")];
for (const yard of yards) {
  Plotly.Plots.resize(yard);
  yard.on("plotly_relayout", (change) => {
    const camera = change["scene.camera"];
    if (camera === undefined) return;
    for (const other of yards) {
      if (other !== yard) Plotly.update(other, {}, {scene: {...other.layout.scene, camera}});
    }
  });
}
</script>
</body>
</html>
""")


def write_page(figure: Figure1, path: Path) -> None:
    """Write the page, including the drawing library.

    Raises:
        OSError: if the file cannot be written.
    """
    stops = ", ".join(ramp(step / 20) for step in range(21))
    page = _PAGE.substitute(
        stops=stops,
        places=len(figure.chart.tokens),
        cycles=CYCLES,
        cost=ACTION_COST,
        twice=figure.twice,
        share=f"{VISITED_TWICE:.0%}",
        greatest=f"{greatest_value(figure):.0f}",
        yards="\n".join(_yard(figure, panel) for panel in figure.panels),
    )
    path.write_text(page, encoding="utf-8")


def _yard(figure: Figure1, panel: Panel) -> str:
    drawing = to_html(
        _scene(figure, panel),
        config={"responsive": True, "displayModeBar": False},
        include_plotlyjs=panel is figure.panels[0],
        full_html=False,
        default_height="100%",
        div_id=f"goal-{panel.goal}",
    )
    name = html.escape(panel.goal)
    return f'<section><h2>Goal {name}</h2><div class="yard">{drawing}</div></section>'


def _scene(figure: Figure1, panel: Panel) -> graph_objects.Figure:
    goal = figure.chart.cells[f"at:{panel.goal}"]
    x, y = goal.east + 0.5, goal.north + 0.5
    pin = graph_objects.Scatter3d(
        x=[x, x], y=[y, y], z=[0, 4], text=["", panel.goal], mode="lines+markers+text",
        textposition="top center", textfont={"size": 22, "color": "#1f2430"},
        line={"color": "#1f2430", "width": 4}, marker={"size": [0, 5], "color": "#1f2430"},
        hoverinfo="skip", showlegend=False,
    )  # fmt: skip
    extent = {"x": len(figure.chart.rows[0]), "y": len(figure.chart.rows), "z": TALLEST}
    layout = {
        "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
        "scene": {
            "camera": _CAMERA,
            "aspectmode": "manual",
            "aspectratio": {axis: cells / _ZOOM for axis, cells in extent.items()},
            **{
                f"{axis}axis": {"range": [0, cells], "visible": False, "showspikes": False}
                for axis, cells in extent.items()
            },
        },
        "hoverlabel": {"font": {"size": 15}, "align": "left"},
    }  # fmt: skip
    return graph_objects.Figure([_mesh(list(blocks(figure, panel))), pin], layout)


def _mesh(boxes: list[Block]) -> graph_objects.Mesh3d:
    corners = [_corner(box, offset) for box in boxes for offset in _CORNERS]
    x, y, z = zip(*corners, strict=True)
    triangles, colours = [], []
    for number, box in enumerate(boxes):
        for *halves, shade in _FACES:
            triangles += [[number * len(_CORNERS) + corner for corner in half] for half in halves]
            colours += [mixed(box.colour, "#000000", shade)] * 2
    i, j, k = zip(*triangles, strict=True)
    return graph_objects.Mesh3d(
        x=x, y=y, z=z, i=i, j=j, k=k,
        facecolor=colours,
        text=["<br>".join(map(html.escape, box.words)) for box in boxes for _ in _CORNERS],
        hovertemplate="%{text}<extra></extra>",
        lighting={"ambient": 1, "diffuse": 0, "specular": 0, "fresnel": 0},
    )  # fmt: skip


def _corner(box: Block, offset: tuple[int, int, int]) -> tuple[float, float, float]:
    """A corner of a box, which leaves a small gap to its neighbours so that columns stand apart."""
    east, north = (
        edge + (1 - _GAP if side else _GAP) for edge, side in zip(box.cell, offset, strict=False)
    )
    return east, north, box.height * offset[2]
