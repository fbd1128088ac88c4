"""The documents state every limit on input as the code has it."""

import re
from pathlib import Path

import pytest

from farside.dem.memory import MAX_RATIO, MAX_UNPACKED
from farside.files import MAX_FILE_BYTE, MAX_KEY_PARTS
from farside.link.profile.resolve import MAX_PASSES, MAX_PLAN_BYTE
from farside.logs.file.mcap_bytes import GREATEST_RECORD_BYTE
from farside.missions.commands.dem_stream import MAX_LINE_BYTE
from farside.missions.schema import MAX_TICKS
from farside.places import MAX_CELLS
from farside.validation import MAX_ENTRIES, MAX_POINTS, MAX_PROBLEMS

DOCS = Path(__file__).parents[1] / "docs"
MIB = 2**20


@pytest.mark.parametrize(
    ("page", "statement"),
    [
        (
            "mission.md",
            f"trace, table of a distribution or of Horizons | {MAX_FILE_BYTE // MIB} MiB,",
        ),
        ("mission.md", f"contact plan | {MAX_PLAN_BYTE // MIB} MiB,"),
        ("mission.md", f"dotted key | {MAX_KEY_PARTS} |"),
        ("mission.md", f"steps of a script | {MAX_ENTRIES:,} |"),
        ("mission.md", f"`rate_trace.times_ms` | {MAX_POINTS:,} |"),
        ("mission.md", f"cells of a map | {MAX_CELLS:,} |"),
        ("mission.md", f"`[link.passes]` | {MAX_PASSES:,} |"),
        ("mission.md", f"`duration_s / tick_s` | {MAX_TICKS:,} |"),
        ("mission.md", f"listed at once | {MAX_PROBLEMS} |"),
        ("dem.md", f"at most {MAX_LINE_BYTE // MIB} MiB long"),
        ("dem.md", f"more than {MAX_UNPACKED // MIB} MiB, or, beyond the first MiB,"),
        ("dem.md", f"to more than {MAX_RATIO} times"),
        ("design.md", f"of more than {GREATEST_RECORD_BYTE // MIB} MiB is damage"),
    ],
)
def test_a_limit_is_stated(page: str, statement: str) -> None:
    text = re.sub(r"\s+", " ", (DOCS / page).read_text())
    assert statement in text
