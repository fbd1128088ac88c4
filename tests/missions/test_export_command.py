"""`farside export`: which tables, where, and what is refused."""

import sys
from pathlib import Path
from typing import Any

import pytest
from noting import records_of

from farside.control import Mode, ModeCause
from farside.logs import Recorder
from farside.topics import ModeEntry, Silence


@pytest.fixture
def log(tmp_path: Path) -> Path:
    path = tmp_path / "logs/runs/flight.mcap"
    path.parent.mkdir(parents=True)
    with Recorder(path) as recorder:
        recorder.write(
            records_of(
                [
                    (0, ModeEntry(Mode.GUIDED, ModeCause.START)),
                    (5, Silence(silent=True)),
                    (9, Silence(silent=False)),
                ]
            )
        )
    return path


def test_every_topic_with_messages_becomes_a_table_beside_the_log(farside: Any, log: Path) -> None:
    status, out, _ = farside("export", str(log))

    folder = log.with_suffix("")
    assert status == 0
    assert out.splitlines() == [
        f"{folder}/rover_mode.parquet: 1 rows",
        f"{folder}/ground_silence.parquet: 2 rows",
    ]
    assert sorted(path.name for path in folder.iterdir()) == [
        "ground_silence.parquet",
        "rover_mode.parquet",
    ]


def test_one_topic_of_the_newest_log_as_csv_where_it_is_wanted(farside: Any, log: Path) -> None:
    status, out, err = farside(
        "export", "--format", "csv", "--topic", "/rover/mode", "--out", "tables"
    )

    assert (status, out) == (0, "tables/rover_mode.csv: 1 rows\n")
    assert "flight.mcap" in err, "which log it took"
    assert Path("tables/rover_mode.csv").read_text() == (
        '"time_s","so_s","mode","why"\n0,0,"guided","start"\n'
    )


def test_as_ground_at_a_time(farside: Any, log: Path) -> None:
    status, out, _ = farside("export", str(log), "--as", "ground", "--at", "6", "--out", "known")

    assert (status, out) == (0, "known/ground_silence.parquet: 1 rows\n")


def test_where_nothing_is_known_there_are_no_tables(farside: Any, log: Path) -> None:
    status, out, err = farside("export", str(log), "--as", "ground", "--at", "1", "--out", "known")

    assert (status, out) == (0, "")
    assert "no messages, and so no tables" in err


@pytest.mark.parametrize(
    ("given", "why"),
    [
        (["--topic", "/rover/mood"], "; did you mean /rover/mode?"),
        (["--topic", "/rover/mode", "--as", "ground"], "not known at the ground: /rover/mode"),
        (["--at", "5"], "expected it with --as ground"),
        (["--as", "ground", "--at", "-1"], "expected a time of 0 s or more, found -1.0 s"),
        (["--as", "rover"], "Invalid value for '--as'"),
    ],
)
def test_what_cannot_be_written_is_refused(
    farside: Any, log: Path, given: list[str], why: str
) -> None:
    status, out, err = farside("export", str(log), *given)

    assert (status, out) == (2, "")
    assert why in " ".join(err.split())
    assert not log.with_suffix("").exists()


def test_without_pyarrow_it_says_what_to_install(
    farside: Any, log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [name for name in sys.modules if name.startswith("farside.logs.tables.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "pyarrow", None)

    status, _, err = farside("export", str(log))

    assert status == 2
    assert "pip install 'farside[tables]'" in " ".join(err.split())
