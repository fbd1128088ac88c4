"""The studies: their page says what their results say, and their results are what a run gives."""

import json
import runpy
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from delays import delayed
from exploring import explored
from ground_page import Delays, ground_words
from numbers_told import estimate
from page import Exploring, Shadowed, Surprises, Working, written
from shadow_price import priced
from supervising import supervised
from surprises import surprised
from working import BEGIN_S, LENGTHS_S, WORK_S, outages, shadowed, worked
from yards import arcs_of, circuit, mission_with, random_stream

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
RESULTS: dict[str, Any] = json.loads((DOCS / "study/results.json").read_text())
PICTURES = ("exploring", "working", "shadow", "delays", "predicting", "price")


def test_the_page_and_its_pictures_are_what_the_results_give(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise: `make study`, or with `--render` where only words have changed."""
    monkeypatch.setattr("sys.argv", ["study.py", "--render", str(tmp_path)])
    runpy.run_path(str(ROOT / "tests/study/study.py"), run_name="__main__")
    made = [Path("study.md"), *(Path(f"study/{name}.svg") for name in PICTURES)]
    assert [(tmp_path / path).read_text() for path in made] == [
        (DOCS / path).read_text() for path in made
    ]


def test_no_number_of_a_result_stands_on_the_page_by_itself(tmp_path: Path) -> None:
    changed = json.loads(json.dumps(RESULTS))
    for run in changed["exploring"]:
        run["all_arcs"] += 1000
    for run in changed["working"] + changed["shadowed"]:
        run["goals"] += 1
    for run in changed["delays"] + changed["lessons"]:
        run["goals"] = 0.9 * run["goals"]
        run["right"] = [0.9 * count for count in run["right"]]
    for run in changed["price"]:
        run["bits_per_cycle"] += 100
    written(changed, tmp_path)
    before = (DOCS / "study.md").read_text().splitlines()
    after = (tmp_path / "study.md").read_text().splitlines()
    told = [line for line in before if "(" in line and " to " in line and "|" in line]
    assert len(told) >= 12
    assert not set(told) & set(after)


def test_nothing_on_the_page_was_left_to_fill_in() -> None:
    page = (DOCS / "study.md").read_text()
    assert "{" not in page
    assert "nan" not in page


def test_in_a_thousand_random_runs_nothing_surprised() -> None:
    surprises = Surprises(RESULTS)
    assert surprises.counts["runs"] >= 1_000
    assert surprises.found == []
    assert surprised(77, runs=10)["found"] == []


@pytest.mark.parametrize(
    "study", ["exploring", "working", "shadowed", "delays", "lessons", "price"]
)
def test_every_study_has_all_seeds(study: str) -> None:
    seeds = {run["seed"] for run in RESULTS[study]}
    assert seeds == set(range(1, RESULTS["seeds"] + 1))
    assert len(seeds) >= 30


def test_what_the_page_says_in_words_is_so() -> None:
    known = Exploring(RESULTS).arcs
    assert known["guided"].high < known["curious"].low < known["random"].low
    assert 4000 < known["random"].low < 5000 < known["random"].mean
    work = Working(RESULTS)
    for share in work.shares[1:]:
        assert work.gain("long", share).low > 0
        assert work.gain("short", share).low > 0
    least, most = work.shares[1], work.shares[-1]
    assert work.gain("short", least).mean < work.gain("long", least).mean
    assert work.estimate("autonomy", "long", most).low > work.estimate("autonomy", "long", 0).high
    assert work.words()["trend"] == "more"
    shadow = Shadowed(RESULTS).words()
    assert shadow["signal_verdict"] == "no more than chance"
    assert int(shadow["return_times"]) >= 5


def test_what_the_page_says_of_the_ground_is_so() -> None:
    delays, words = Delays(RESULTS), ground_words(RESULTS)
    for trip in delays.round_trips:
        assert delays.rate("goals", trip).low > delays.rate("wait", trip).high
        assert abs(delays.rate("consent", trip).mean / delays.rate("wait", trip).mean - 1) < 0.15
    assert delays.rate("trust", delays.round_trips[-1]).high < delays.rate("goals", 2400.0).low
    assert words["as_good_to"] == "60 s"
    assert float(words["pace_10"].split()[0]) > 4
    assert float(words["upper_share"].split()[0]) > 98
    assert int(words["worst_upper"]) < 10 < int(words["worst_lower"])
    found, runs = words["equal_runs"].split(" of ")
    assert found == runs


def test_a_run_gives_again_what_stands_in_the_results() -> None:
    found = explored("guided", 1)
    assert found in RESULTS["exploring"]
    assert worked("hold", "short", 90, 1) in RESULTS["working"]
    assert worked("autonomy", "long", 60, 2) in RESULTS["working"]
    assert shadowed("track", 3) in RESULTS["shadowed"]
    assert delayed("goals", 10.0, 1) in RESULTS["delays"]
    assert delayed("trust", 60.0, 2) in RESULTS["delays"]
    assert delayed("wait", 2.56, 3, 0.25) in RESULTS["lessons"]
    assert supervised("shadow", 1, 2) in RESULTS["supervised"]
    # As the file has it: there are no tuples in JSON.
    assert json.loads(json.dumps(priced("shadow", 4))) in RESULTS["price"]


def test_a_circuit_goes_over_every_arc_once_and_home() -> None:
    chart = mission_with(0).world.chart()
    walk = circuit(chart, chart.places["D"], random_stream(5))
    assert walk[0] == walk[-1] == chart.places["D"]
    arcs = list(pairwise(walk))
    assert len(arcs) == len(set(arcs)) == len(arcs_of(chart)) == 186


@pytest.mark.parametrize("mean_s", LENGTHS_S.values())
@pytest.mark.parametrize("share", [0.15, 0.45, 0.9])
def test_outages_take_their_share_of_the_time(share: float, mean_s: float) -> None:
    shares = []
    for seed in range(400):
        spans = outages(share, mean_s, seed)
        assert all(span["start_s"] >= BEGIN_S for span in spans)
        end_s = BEGIN_S + WORK_S
        out_s = sum(min(span["end_s"], end_s) - span["start_s"] for span in spans)
        shares.append(out_s / WORK_S)
    low, high = estimate(shares)[1:]
    assert low - 0.02 < share < high + 0.02


def test_an_interval_holds_the_mean_and_shrinks_with_the_number_of_runs() -> None:
    rng = random_stream(9)
    few, many = (estimate(rng.normal(10, 2, size=n).tolist()) for n in (10, 1000))
    assert many.low < many.mean < many.high
    assert many.high - many.low < few.high - few.low
