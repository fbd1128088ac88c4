"""The pictures in docs/console.md: they are all made, and show what a person sees by now."""

import re
import runpy
from pathlib import Path

import pytest
from sitting import Sitting

from farside.missions.run import FinishedRun

DOCS = Path(__file__).parents[2] / "docs"
MADE = runpy.run_path(str(DOCS / "console.py"))
MOMENTS = MADE["MOMENTS"]


@pytest.mark.parametrize("moment", MOMENTS, ids=[moment.name for moment in MOMENTS])
def test_a_picture_shows_what_a_person_sees_by_now(
    moment: tuple[str, object], afternoon: tuple[FinishedRun, Sitting]
) -> None:
    """Otherwise: `make picture`."""
    name, is_now, *_ = moment
    assert callable(is_now)
    screen = next(screen for screen in afternoon[1].screens if is_now(screen))

    assert MADE["texts"](screen) == (DOCS / f"console/{name}.txt").read_text()


def test_the_document_shows_every_picture_and_no_other() -> None:
    shown = re.findall(r"!\[[^]]+\]\(console/([\w.]+)\)", (DOCS / "console.md").read_text())
    made = {path.name for path in (DOCS / "console").iterdir() if path.suffix != ".txt"}

    assert set(shown) == made == {MADE["picture"](moment) for moment in MOMENTS}
    assert max(path.stat().st_size for path in (DOCS / "console").iterdir()) < 100_000
