"""Makes docs/policy-map.svg: the yard of figure 1, learned by random actions, on the way to B."""

import sys
from pathlib import Path

from farside.dem.lab import map_picture
from farside.missions.figure1.example import SEED, run_figure1

START, GOAL = "C", "B"


def main(target: Path) -> None:
    """Learn the yard, and draw the map."""
    figure = run_figure1(SEED)
    model, chart = figure.model, figure.chart
    model.sense([])  # it is carried to its start
    model.perform(None)
    model.sense([f"at:{START}"])
    model.set_goal([f"at:{GOAL}"])
    places = {token: (float(cell.east), float(cell.north)) for token, cell in chart.cells.items()}
    target.write_text(map_picture(model, places=places).svg, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if sys.argv[1:] else Path(__file__).with_name("policy-map.svg"))
