"""`farside info`: what a log says at a glance, and what the ground knew."""

import json
from collections.abc import Callable, Iterable
from pathlib import Path

import pytest
from mcap.reader import make_reader

from farside.logs import LogFile, Recorder
from farside.missions import load_mission, run_mission
from farside.node import Record

Farside = Callable[..., tuple[int, str, str]]


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The log of twenty seconds of the blackout mission."""
    loaded = load_mission("blackout", {"duration_s": 20.0})
    return run_mission(loaded, in_process=True, out=tmp_path_factory.mktemp("runs")).log


def copied(source: Path, target: Path, records: Iterable[Record]) -> Path:
    """Write a log with these records, and the metadata of another, that nobody finished."""
    with Recorder(target) as recorder:
        for name, values in LogFile(source).metadata.items():
            recorder.metadata(name, dict(values))
        recorder.write(records)
        recorder.close(packed=False)
    return target


def test_info_tells_how_the_run_ended_what_it_was_and_what_the_log_holds(
    farside: Farside, finished: Path
) -> None:
    log = LogFile(finished)
    result = json.loads(log.attachments["result.json"].data)

    status, out, err = farside("info", str(finished), "--json")

    told = json.loads(out)
    assert (status, err) == (0, "")
    for key in ("mission", "seed", "outcome", "expectations", "modes", "goals", "link", "digest"):
        assert told[key] == result[key]
    assert (told["sim_seconds"], told["complete"], told["damage"]) == (20.0, True, [])
    assert told["bytes"] == finished.stat().st_size
    assert told["versions"]["farside"]
    records = list(log.records(pictures=True))
    assert told["topics"] == {
        topic: {
            "messages": sum(record.topic == topic for record in records),
            "bytes": sum(len(record.payload) for record in records if record.topic == topic),
        }
        for topic in {record.topic for record in records}
    }


def test_info_is_a_page_of_plain_text(farside: Farside, finished: Path) -> None:
    status, out, _ = farside("info", str(finished))

    assert status == 0
    assert out.startswith("blackout: failure   seed 1, 20.0 s simulated\n")
    lines = [line.split() for line in out.splitlines()]
    assert ["0.0", "s", "guided", "start"] in lines
    assert any(line[:1] == ["/truth/pose"] for line in lines)
    assert f"log      {finished}, {finished.stat().st_size:,} bytes, finished" in out


def test_of_a_finished_log_no_message_is_read(
    farside: Farside, finished: Path, tmp_path: Path
) -> None:
    """So it takes as long for a thousand messages as for a thousand million."""
    content = bytearray(finished.read_bytes())
    with finished.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    for chunk in summary.chunk_indexes:
        size = chunk.chunk_length + chunk.message_index_length
        start = chunk.chunk_start_offset
        content[start : start + size] = bytes(size)
    emptied = tmp_path / finished.name
    emptied.write_bytes(content)

    whole, gone = (
        json.loads(farside("info", str(log), "--json")[1]) for log in (finished, emptied)
    )

    assert {**gone, "log": None} == {**whole, "log": None}


def test_of_a_log_that_nobody_finished_what_happened_so_far_is_told(
    farside: Farside, finished: Path, tmp_path: Path
) -> None:
    early = [record for record in LogFile(finished).records() if record.log_time_ns < 10e9]
    log = copied(finished, tmp_path / "log.mcap", early)
    log.write_bytes(log.read_bytes()[:-30])

    status, out, err = farside("info", str(log))
    told = json.loads(farside("info", str(log), "--json")[1])

    assert status == 0
    assert out.startswith("blackout: no result yet   seed 1, 9.")
    assert "not finished; farside recover makes it whole" in out
    assert err.startswith(f"farside: {log}: bytes ")
    assert told["damage"]
    assert (told["outcome"], told["digest"], told["expectations"]) == (None, None, [])
    assert told["modes"] == [{"t_s": 0.0, "mode": "guided", "why": "start"}]
    assert told["link"]["uplink"]["sent"] > 0


@pytest.mark.parametrize("at_s", [0.0, 7.3, 14.0])
def test_as_ground_nothing_is_told_that_the_ground_had_not_learned(
    farside: Farside, finished: Path, tmp_path: Path, at_s: float
) -> None:
    """The same log without it, under the same name, gives the same text, to the byte."""
    at = ("--as", "ground", "--at", f"{at_s}")
    log = tmp_path / "log.mcap"
    log.write_bytes(finished.read_bytes())
    forms = ((), ("--json",))
    whole = [farside("info", str(log), *at, *form) for form in forms]
    log.unlink()
    known = [
        record
        for record in LogFile(finished).records()
        if record.topic.startswith("/ground/") and record.log_time_ns <= at_s * 1e9
    ]
    copied(finished, log, known)

    assert [farside("info", str(log), *at, *form) for form in forms] == whole
    assert whole[0][0] == 0


def test_as_ground_it_tells_what_was_believed_commanded_and_heard(
    farside: Farside, finished: Path
) -> None:
    _, out, _ = farside("info", str(finished), "--as", "ground", "--at", "14")
    told = json.loads(farside("info", str(finished), "--as", "ground", "--at", "14", "--json")[1])

    assert out.startswith(
        "blackout, as the ground had it at 14.0 s   seed 1\nlast heard: as it was"
    )
    assert told["believed"]["mode"]["value"] == "guided"
    assert told["believed"]["mode"]["so_s"] <= told["believed"]["mode"]["learned_s"] <= 14
    assert told["heard_s"] < 14
    assert told["commands"][0]["sent_s"] <= 14
    assert told["events"]


def test_what_a_log_says_cannot_steer_the_terminal(farside: Farside, tmp_path: Path) -> None:
    log = tmp_path / "log.mcap"
    with Recorder(log) as recorder:
        recorder.metadata("farside.run", {"mission": "\x1b[2J", "seed": "one", "numpy": "\x07"})

    _, out, _ = farside("info", str(log))

    assert "\x1b" not in out
    assert "\x07" not in out
    assert "seed unknown" in out
