"""What the page of a run is made from: all of a short run, and of a long one honest envelopes."""

import json
import re
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from noting import command_sent, failsafe_entry, said_of
from typer.testing import CliRunner

from farside.control import CommandStage, Failsafe, Mode, Verdict
from farside.frames import Fate, FrameEvent, FrameStage, LinkOutage, OutageReason
from farside.logs import LogFile, Recorder
from farside.logs.report import report_page
from farside.logs.report.gather import views_of
from farside.logs.report.thinning import BUCKETS, CURVE, Curve, Rows, Waypoints
from farside.messages import Drive
from farside.missions.commands.main import app
from farside.node import Direction, to_ns
from farside.topics import CommandEntry, StuckEntry
from tests.logs.conftest import Handmade


def test_the_same_log_gives_the_same_page_in_less_than_a_megabyte(flown: LogFile) -> None:
    page = report_page(flown)

    assert report_page(LogFile(flown.path)) == page
    assert len(page.encode()) < 1_000_000


def test_a_page_as_the_ground_had_it_holds_nothing_else(flown: LogFile) -> None:
    page = report_page(flown.as_ground(to_ns(700)))

    assert list(data_of(page)) == ["ground"]
    assert "success" not in page.partition("<script")[0]
    assert "hears nothing from the rover" in page
    assert "goal at:B reached" not in page


def data_of(page: str) -> Any:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    return json.loads(found[1])


def test_a_curve_tells_every_point_until_there_are_too_many() -> None:
    """Then it tells the least and the greatest of each span: no peak is lost."""
    curve = Curve(to_ns(10_000))
    for t_s in range(CURVE):
        curve.add(to_ns(t_s), 0.5)
    assert not curve.thinned
    assert len(curve.series("c").t) == CURVE

    curve.add(to_ns(7000.25), 9.5)
    curve.add(to_ns(7000.5), -3.5)
    thinned = curve.series("c")
    assert curve.thinned
    assert len(thinned.t) <= BUCKETS + 2
    assert max(hi for hi in thinned.hi if hi is not None) == 9.5
    assert min(lo for lo in thinned.lo if lo is not None) == -3.5


@settings(max_examples=15)
@given(some=st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=60))
def test_a_thinned_curve_lies_between_its_least_and_its_greatest(some: list[float]) -> None:
    values = (some * (CURVE + 1))[: CURVE + 1]
    curve = Curve(to_ns(len(values)))
    for t_s, value in enumerate(values):
        curve.add(to_ns(t_s), value)
    series = curve.series("c")

    rows = zip(series.v, series.lo, series.hi, strict=True)
    told = [(v, lo, hi) for v, lo, hi in rows if v is not None]
    assert all(lo - 1e-3 * abs(lo) <= v <= hi + 1e-3 * abs(hi) for v, lo, hi in told)
    assert max(hi for *_, hi in told) == pytest.approx(max(values), rel=1e-4, abs=1e-9)


def test_a_line_ends_where_nothing_was_measured() -> None:
    curve = Curve(to_ns(1000))
    for t_s in [*range(10), *range(500, 510)]:
        curve.add(to_ns(t_s), 1.0)

    assert curve.series("c").v.count(None) == 1
    assert curve.series("c").v[10] is None


@given(count=st.integers(0, 3000), musts=st.sets(st.integers(0, 3000), max_size=9))
def test_rows_are_thinned_evenly_and_what_must_stay_stays(count: int, musts: set[int]) -> None:
    rows: Rows[int] = Rows(100)
    for number in range(count):
        rows.add(number, must=number in musts)

    assert len(rows.rows) <= 100 + len(musts)
    assert {number for number in musts if number < count} <= set(rows.rows)
    assert set(rows.rows) - musts == set(range(0, count, rows.every)) - musts
    assert rows.every == 1 or count > 100


@given(moves=st.lists(st.sampled_from([(100, 0), (0, 100), (0, 0), (3, 2)]), max_size=900))
def test_a_thinned_way_stays_near_all_that_is_left_out(moves: list[tuple[int, int]]) -> None:
    way: Waypoints[tuple[int, int, int]] = Waypoints(200)
    walked, x, y = [], 0, 0
    for second, (east, north) in enumerate(moves):
        x, y = x + east, y + north
        walked.append((1000 * second, x, y))
        way.add(walked[-1])

    assert len(way.rows) <= 200
    # Thinned more than once, it may be off by the sum of what it was off by each time.
    allowed = 5 * way.off_cm + 1e-6
    for (t, x, y), (t2, x2, y2) in zip(way.rows, way.rows[1:], strict=False):
        for at, east, north in walked[t // 1000 : t2 // 1000]:
            share = (at - t) / (t2 - t)
            assert abs(x + share * (x2 - x) - east) <= allowed
            assert abs(y + share * (y2 - y) - north) <= allowed


def test_words_are_told_with_their_losses_and_what_was_sent_again(flown: LogFile) -> None:
    words = views_of(flown)["so"].words

    named = iter(words.named)
    rows = [
        (next(named) if kind % 100 < 5 else "", words.losses[lost])
        for kind, lost in zip(words.kind, words.lost, strict=True)
    ]
    first, again = (row for row, (name, _) in enumerate(rows) if name.startswith("command 85"))
    assert rows[first] == ("command 85", "lost on the way")
    assert rows[again] == ("command 85, sent 2 ×", "")
    assert again in words.again
    assert first not in words.again
    assert 1_280_000 < words.flight[again] < 2_500_000


def test_commands_are_told_from_both_ends(run: Handmade, path: Path) -> None:
    drive = Drive("N")
    run.start()
    for number, stage in ((1, CommandStage.DONE), (2, CommandStage.REFUSED)):
        run.note(number, command_sent(number, drive))
        run.note(number + 1.5, CommandEntry(number, CommandStage.TAKEN, drive))
        why = "a wall" if stage is CommandStage.REFUSED else None
        run.note(number + 4, CommandEntry(number, stage, drive, why))
        run.note(number + 6, said_of(number, stage, Verdict.ON_TIME, so_s=number + 4, why=why))
    views = views_of(LogFile(run.log(path)))

    done, refused = views["so"].commands
    assert (done.sent, done.taken, done.ended, done.end) == (1000, 2500, 5000, "done")
    assert (refused.end, refused.why, refused.told_ended) == ("refused", "a wall", 8000)
    assert views["so"].command_counts == {"done": 1, "refused": 1}
    done, refused = views["ground"].commands
    assert (done.taken, done.ended, done.told_ended) == (None, 5000, 7000)


def test_alarms_stand_out_of_what_is_routine(run: Handmade, path: Path) -> None:
    run.start().note(1, LinkOutage(Direction.UP, True, OutageReason.BLACKOUT))
    run.note(2, LinkOutage(Direction.DOWN, True, OutageReason.PASS))
    run.note(3, failsafe_entry(Failsafe.SAFE), StuckEntry(True, 8), command_sent(1, Drive("N")))
    events = views_of(LogFile(run.log(path)))["so"].events

    assert [(event.text, event.level) for event in events if event.t > 0] == [
        ("uplink: blackout begins", "warning"),
        ("downlink: gap between passes begins", ""),
        ("failsafe safe: the rover is stuck", "alarm"),
        ("stuck: the last 8 moves were blocked", "alarm"),
        ("command 1: drive N", "routine"),
    ]


LINK = {
    "up": {"delay_s": 1.5, "rate_bit_s": 2000, "loss": 0.25},
    "down": {
        "delay_table": [{"t_s": 0, "delay_s": 1}, {"t_s": 20, "delay_s": 3}],
        "rate_table": [{"t_s": 0, "rate_bit_s": 8000}, {"t_s": 5, "rate_bit_s": 0}],
        "loss": {"model": "gilbert-elliott", "p": 0.1, "r": 0.4},
    },
    "changes": [{"at_s": 4, "direction": "up", "loss": 0.5, "rate_bit_s": 500}],
}


def link_panels(path: Path) -> dict[tuple[str, bool], dict[str, list[tuple[int, float | None]]]]:
    """The curves of the link, by what they are of and whether of the uplink, then by name."""
    return {
        (panel.title.partition(",")[0], "uplink" in panel.title): {
            series.name: list(zip(series.t, series.v, strict=True)) for series in panel.series
        }
        for panel in views_of(LogFile(path))["so"].panels
        if "link" in panel.title
    }


def test_what_was_asked_of_the_link_stands_beside_what_was_delivered(
    run: Handmade, path: Path
) -> None:
    run.start().frame(1, Direction.UP).frame(2, Direction.UP, Fate.LOST)
    run.frame(3, Direction.DOWN, Fate.OUTAGE).stand(10, "at:D")
    with Recorder(path) as recorder:
        recorder.attach("mission.json", "application/json", json.dumps({"link": LINK}).encode())
        recorder.write(run.records)
    panels = link_panels(path)

    assert panels["Delay", True] == {
        "delivered": [(1000, 1.25)],
        "light time": [(0, 1.5), (10_000, 1.5)],
    }
    assert panels["Delay", False]["light time"] == [(0, 1), (10_000, 2)]
    assert panels["Loss outside outages", True]["asked"] == [(0, 0.25), (4000, 0.5)]
    assert panels["Loss outside outages", True]["lost"][1:4] == [(1000, 0), (1000, 1), (1000, None)]
    assert panels["Loss outside outages", False]["asked"] == [(0, 0.2)]
    assert all(lost is None for _, lost in panels["Loss outside outages", False]["lost"])
    assert panels["Rate", True]["allowed"] == [(0, 2000), (4000, 500)]
    assert panels["Rate", True]["delivered"][2] == (1000, 80)
    assert panels["Rate", False]["allowed"] == [(0, 8000), (5000, 0)]


def test_what_is_asked_of_a_run_that_went_otherwise_from_a_time_on_changes_then(
    run: Handmade, path: Path
) -> None:
    """As `farside rerun --from 6` writes it: changes that were due before hold from then on."""
    later = {
        "up": {"delay_s": 2.5, "rate_bit_s": 800, "overhead_byte": 20},
        "down": {
            "delay_s": 1,
            "rate_trace": {"times_ms": [500, 1000, 7500], "at_end": "end"},
            "bit_error_rate": 0.01,
            "overhead_byte": 30,
        },
        "changes": [
            {"at_s": 4, "direction": "up", "rate_bit_s": 600},
            {"at_s": 8, "direction": "up", "rate_bit_s": 700},
        ],
    }
    run.start().frame(1, Direction.UP).frame(7, Direction.UP).frame(7, Direction.DOWN)
    run.stand(10, "at:D")
    with Recorder(path) as recorder:
        recorder.attach("mission.json", "application/json", json.dumps({"link": LINK}).encode())
        changes = [{"at_ns": to_ns(6), "overrides": [], "mission": {"link": later}}]
        recorder.attach("changes.json", "application/json", json.dumps(changes).encode())
        recorder.write(run.records)
    panels = link_panels(path)

    light = panels["Delay", True]["light time"]
    assert light == [(0, 1.5), (6000, 1.5), (0, 2.5), (4000, 2.5)]
    assert panels["Loss outside outages", True]["asked"] == [
        (0, 0.25),
        (4000, 0.5),
        (2000, 0),
        (2000, 0),
    ]
    assert panels["Rate", True]["allowed"] == [(0, 2000), (4000, 500), (2000, 600), (2000, 700)]
    assert panels["Rate", True]["delivered"][2] == (1000, 80)
    assert panels["Rate", True]["delivered"][8] == (1000, 240)
    lost = panels["Loss outside outages", False]["asked"]
    assert lost == [(0, 0.2), (6000, pytest.approx(1 - 0.99 ** (8 * 40), abs=1e-5))]
    allowed = panels["Rate", False]["allowed, of a trace the mean"]
    assert allowed == [(0, 8000), (5000, 0), (1000, 4800), (1500, 0)]


@pytest.mark.parametrize("name", ["mission.json", "changes.json"])
@pytest.mark.parametrize("data", [b"[" * 100_000, b"\xff", b'{"link": {"up": 7}}', b"", b"[{}]"])
def test_attachments_that_cannot_be_read_are_told_of(
    name: str, data: bytes, run: Handmade, path: Path
) -> None:
    run.start().stand(5, "at:C")
    with Recorder(path) as recorder:
        if name != "mission.json":
            recorder.attach("mission.json", "application/json", json.dumps({"link": LINK}).encode())
        recorder.attach(name, "application/json", data)
        recorder.attach("result.json", "application/json", data)
        recorder.write(run.records)
    page = report_page(LogFile(path))

    assert f"cannot be read from {name}" in page
    assert "The outcome cannot be read from result.json" in page


def test_the_frames_are_counted_at_both_ends_and_between(run: Handmade, path: Path) -> None:
    run.start().frame(1, Direction.UP).frame(2, Direction.UP, Fate.LOST)
    run.note(3, FrameEvent(Direction.UP, 2, FrameStage.SHADOWED, 40, "Heartbeat"))
    up, down = views_of(LogFile(run.log(path)))["so"].link

    assert (up.counters.sent, up.counters.lost, up.counters.shadowed) == (2, 1, 1)
    assert down.counters.sent == 0


def test_a_page_says_what_the_log_lacks(run: Handmade, path: Path) -> None:
    run.start().stand(5, "at:C").stand(9, "at:B")
    with Recorder(path) as recorder:
        recorder.attach("mission.json", "application/json", b'{"link": {"up": 7}}')
        recorder.attach("result.json", "application/json", b"{}")
        recorder.write(run.records)
    page = report_page(LogFile(path))
    assert "The outcome cannot be read from result.json" in page
    assert "cannot be read from mission.json" in page

    path.write_bytes(path.read_bytes()[:-400])
    cut = report_page(LogFile(path))
    assert "The log is not whole." in cut
    assert "Nobody finished this log" in cut


# --- farside report ----------------------------------------------------------------------------


def test_the_command_writes_a_page_beside_the_log(run: Handmade, path: Path) -> None:
    run.start().hear(4, "at:A", since_s=2).log(path)
    done = CliRunner().invoke(app, ["report", str(path)])

    assert done.exit_code == 0, done.output
    assert done.stdout == f"{path.with_suffix('.html')}\n"
    assert "<title>a run" in path.with_suffix(".html").read_text(encoding="utf-8")


def test_the_command_writes_what_the_ground_knew(run: Handmade, path: Path) -> None:
    run.start().hear(4, "at:A", since_s=2).hear(9, "at:B", since_s=7).log(path)
    out = path.parent / "pages" / "ground.html"
    done = CliRunner().invoke(
        app, ["report", str(path), "--as", "ground", "--at", "5", "--out", str(out)]
    )

    assert done.exit_code == 0, done.output
    heard = data_of(out.read_text(encoding="utf-8"))["ground"]["heard"]
    assert heard["so"] == [2000]
    assert heard["words"][0] == Mode.GUIDED


def test_the_command_does_not_write_the_page_over_the_log(run: Handmade, path: Path) -> None:
    held = run.start().log(path).read_bytes()
    (path.parent / "link.html").symlink_to(path)
    for out in (path, path.parent / "link.html"):
        done = CliRunner().invoke(app, ["report", str(path), "--out", str(out)])

        assert done.exit_code == 2
        assert "another file than the log" in done.output
        assert path.read_bytes() == held
