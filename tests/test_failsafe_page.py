"""The page about the failsafe: as its script makes it, with the lookup that the rover has."""

import json
import re
import runpy
import shutil
import subprocess
from html.parser import HTMLParser
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest

from farside.control import Cause, Failsafe
from farside.rover.failsafe.table import ORDERS, TABLE, orders_for, rule_for

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs/failsafe.html").read_text(encoding="utf-8")
DATA: dict[str, Any] = json.loads(
    re.search(r'<script type="application/json" id="data">(.*?)</script>', PAGE, re.DOTALL)[1]
)
SUBSETS = [
    frozenset(causes) for size in range(len(Cause) + 1) for causes in combinations(Cause, size)
]


class Parsed(HTMLParser):
    """What the tests ask of the page."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.text = ""
        self.feed(PAGE)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data: str) -> None:
        self.text += data

    def all(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


def test_the_page_is_up_to_date(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise: `make reference`."""
    monkeypatch.setattr("sys.argv", ["failsafe.py", str(tmp_path / "failsafe.html")])
    runpy.run_path(str(ROOT / "docs/failsafe.py"), run_name="__main__")
    assert (tmp_path / "failsafe.html").read_text(encoding="utf-8") == PAGE


def test_the_page_looks_up_what_the_rover_does_whatever_is_so() -> None:
    """By the lookup of the page's script, said in Python."""
    for causes in SUBSETS:
        row = next(
            row
            for row, rule in enumerate(DATA["rules"])
            if all(cause in causes for cause in rule["when"])
            and not any(cause in causes for cause in rule["unless"])
        )
        orders = next(
            row["then"] for row in DATA["orders"] if row["cause"] is None or row["cause"] in causes
        )
        rule = rule_for(causes)
        assert TABLE[row] is rule
        assert (DATA["rules"][row]["state"], DATA["rules"][row]["why"]) == (rule.state, rule.why)
        assert orders == orders_for(causes)


@pytest.mark.processes
@pytest.mark.skipif(shutil.which("node") is None, reason="there is no node to run the script")
def test_the_page_s_own_script_looks_it_up_too() -> None:
    lookup = re.search(r"// --- lookup.*?// --- end of lookup", PAGE, re.DOTALL)[0]
    asked = json.dumps({"data": DATA, "sets": [sorted(causes) for causes in SUBSETS]})
    run = f"""{lookup}
    const {{ data, sets }} = JSON.parse(require("fs").readFileSync(0));
    console.log(JSON.stringify(sets.map((set) => new Set(set)).map((causes) =>
      [ruleFor(data, causes), ordersFor(data, causes)])));"""
    done = subprocess.run(  # noqa: S603
        ["node", "-e", run],  # noqa: S607
        input=asked,
        capture_output=True,
        text=True,
        check=True,
    )
    assert json.loads(done.stdout) == [
        [TABLE.index(rule_for(causes)), orders_row(causes)] for causes in SUBSETS
    ]


def orders_row(causes: frozenset[Cause]) -> int:
    return next(row for row, (cause, _) in enumerate(ORDERS) if cause is None or cause in causes)


def test_every_cause_can_be_toggled_and_every_state_is_drawn() -> None:
    page = Parsed()
    assert [box["value"] for box in page.all("input")] == list(Cause)
    assert {box["type"] for box in page.all("input")} == {"checkbox"}
    assert {group["data-state"] for group in page.all("g")} == set(Failsafe)
    assert all(rule.why in page.text for rule in TABLE)


def test_the_page_needs_nothing_from_anywhere_else() -> None:
    page = Parsed()
    assert not {"img", "link", "iframe", "object", "embed"} & {tag for tag, _ in page.tags}
    assert not [
        name for _, attributes in page.tags for name in attributes if name in {"src", "href"}
    ]
    assert not re.search(r"@import|url\((?!#)|fetch\(|XMLHttpRequest|https?://", PAGE)


def test_text_stands_out_from_what_is_behind_it_in_light_and_dark() -> None:
    """By the contrast ratio of WCAG 2: 4.5 for text, 3 for the lines of controls."""
    light, dark = re.findall(r"(--page:.*?)\}", PAGE, re.DOTALL)
    for palette in (light, dark):
        colours = dict(re.findall(r"--([a-z-]+): (#[0-9a-f]+);", palette))
        for name in ("text", "soft"):
            assert contrast(colours[name], colours["page"]) >= 4.5
            assert contrast(colours[name], colours["panel"]) >= 4.5
            assert contrast(colours[name], colours["now"]) >= 4.5
        for name in ("line", "accent", "now-line"):
            assert contrast(colours[name], colours["page"]) >= 3


def contrast(one: str, other: str) -> float:
    lighter, darker = sorted((luminance(one), luminance(other)), reverse=True)
    return (lighter + 0.05) / (darker + 0.05)


def luminance(colour: str) -> float:
    digits = colour[1:] if len(colour) == 7 else "".join(digit * 2 for digit in colour[1:])
    shares = [int(digits[at : at + 2], 16) / 255 for at in (0, 2, 4)]
    red, green, blue = (
        share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares
    )
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
