"""Two runs side by side: the first record in which they part, what parts later, what came of it."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.control import Chooser, Mode, ModeCause
from farside.frames import Fate
from farside.logs import LogError, LogFile, Recorder
from farside.logs.diff.comparing import Difference, compare
from farside.logs.diff.parting import MISSING, different
from farside.logs.diff.threads import partings
from farside.node import Direction, Record
from farside.topics import ActionStarted, ModeEntry


def compared(first: Any, second: Any, folder: Path) -> Difference:
    """The difference of two handmade runs, through logs."""
    return compare(
        LogFile(first.log(folder / "first.mcap")), LogFile(second.log(folder / "second.mcap"))
    )


@pytest.fixture
def quiet(handmade: Callable[[], Any]) -> Callable[[], Any]:
    """Makes a run in which the rover is driven once."""

    def make() -> Any:
        run = handmade().start().frame(1.0, Direction.UP).frame(2.0, Direction.DOWN)
        return run.note(3.0, ActionStarted("N", Chooser.GUIDED, 1, None)).stand(5.0, "at:B")

    return make


def test_equal_runs(quiet: Callable[[], Any], tmp_path: Path) -> None:
    difference = compared(quiet(), quiet(), tmp_path)

    assert difference.equal
    assert difference.records == len(quiet().records)
    assert (difference.parting, difference.effect, difference.threads) == (None, None, ())
    assert difference.outcomes == ()


def test_a_frame_that_is_lost_in_one_of_them(
    quiet: Callable[[], Any], handmade: Callable[[], Any], tmp_path: Path
) -> None:
    """The frame parts first, then what was done, then where the rover is."""
    lossy = handmade().start().frame(1.0, Direction.UP, Fate.LOST).frame(2.0, Direction.DOWN)
    lossy.note(4.0, ActionStarted("E", Chooser.GUIDED, 2, None)).stand(5.0, "at:D")

    difference = compared(quiet(), lossy, tmp_path)

    parting = difference.parting
    assert parting is not None
    assert (parting.t_s, parting.topic, difference.records) == (1.0, "/link/frame", 4)
    assert {key: values for key, *values in parting.fields()} == {
        "arrival_ns": [2_250_000_000, None],
        "fate": ["delivered", "lost"],
    }
    assert [(thread.name, thread.parting.t_s) for thread in difference.threads] == [
        ("the fate of frames", 1.0),
        ("what was done", 3.0),
        ("where the rover was", 5.0),
    ]
    deed = difference.threads[1].parting
    assert deed.second is not None
    assert deed.second.t_s == 4.0  # not at 3 s, and then another one
    effect = difference.effect
    assert effect is not None
    assert effect.name == "what was done"
    assert "lost on the way" in effect.second[0].text
    assert [link.t_s for link in effect.second] == [1.0, 4.0]
    rows = {row.what: (row.first, row.second) for row in difference.outcomes}
    assert rows["frames up, lost"] == ("0", "1")


def test_what_the_other_has_as_well_is_not_what_differs(
    quiet: Callable[[], Any], tmp_path: Path
) -> None:
    """Two records of one moment in one of them, of which the other has the second."""
    more = quiet().note(3.0, ModeEntry(Mode.SHARED, ModeCause.OPERATOR))
    less = quiet()
    more._records.insert(4, more._records.pop())

    parting = compared(more, less, tmp_path).parting

    assert parting is not None
    assert parting.topic == "/rover/mode"
    assert parting.second is None


def test_one_that_ends_sooner(quiet: Callable[[], Any], tmp_path: Path) -> None:
    parting = compared(quiet(), quiet().stand(9.0, "at:A"), tmp_path).parting

    assert parting is not None
    assert (parting.t_s, parting.first) == (9.0, None)


def test_one_that_comes_later_is_shown_beside_as_it_comes_there(
    quiet: Callable[[], Any], tmp_path: Path
) -> None:
    shared = ModeEntry(Mode.SHARED, ModeCause.OPERATOR)
    sooner, later = quiet().note(7.0, shared), quiet().stand(7.5, "at:A").note(8.0, shared)

    parting = compared(sooner, later, tmp_path).parting

    assert parting is not None
    assert parting.second is not None
    assert (parting.topic, parting.second.topic) == ("/rover/mode",) * 2
    assert (parting.t_s, parting.second.t_s) == (7.0, 8.0)


@pytest.mark.parametrize("name", ["mission.json", "changes.json"])
@pytest.mark.parametrize("data", [b"{", b"7", b"\xff", b'[{"at_ns": -1, "mission": {}}]'])
def test_a_mission_that_cannot_be_read_is_refused(tmp_path: Path, name: str, data: bytes) -> None:
    path = tmp_path / "other.mcap"
    with Recorder(path) as recorder:
        recorder.attach(name, "application/json", data)

    with pytest.raises(LogError, match=rf"other\.mcap: expected JSON of a mission in {name}"):
        compare(LogFile(path), LogFile(path))


def test_missions_key_by_key_and_from_when(quiet: Callable[[], Any], tmp_path: Path) -> None:
    missions = [
        {"seed": 1, "link": {"up": {"loss": 0.0}, "blackouts": [1, 2]}},
        {"seed": 2, "link": {"up": {"loss": 0.0}, "blackouts": []}, "own": {"a": 1}},
    ]
    changed = {"seed": 1, "link": {"up": {"loss": 0.5}, "blackouts": [1, 2]}}
    paths = [tmp_path / "first.mcap", tmp_path / "second.mcap"]
    for number, (mission, path) in enumerate(zip(missions, paths, strict=True)):
        with Recorder(path) as recorder:
            recorder.attach("mission.json", "application/json", msgspec.json.encode(mission))
            recorder.write(quiet().records)
            if number == 0:
                changes = [{"at_ns": 7_000_000_000, "overrides": [], "mission": changed}]
                recorder.attach("changes.json", "", msgspec.json.encode(changes))

    difference = compare(*map(LogFile, paths))

    assert difference.equal
    assert [(key.key, key.first, key.second, key.from_s) for key in difference.missions] == [
        ("seed", 1, 2, 0.0),
        ("link.blackouts", [1, 2], [], 0.0),
        ("own", None, {"a": 1}, 0.0),
        ("link.up.loss", 0.5, 0.0, 7.0),
    ]


def test_arrays_of_one_length_differ_entry_by_entry() -> None:
    assert list(different({"a": [1, {"b": 2}]}, {"a": [1, {"b": 3, "c": 4}]})) == [
        ("a.1.b", 2, 3),
        ("a.1.c", MISSING, 4),
    ]


ROWS = st.lists(st.tuples(st.integers(0, 5), st.integers(0, 2), st.integers(0, 1)), max_size=12)


class _Log:
    """Records in memory, read as those of a log."""

    def __init__(self, rows: Sequence[tuple[int, int, int]]) -> None:
        topics = ["/link/frame", "/rover/mode", "/ground/command"]
        self.rows = [
            Record(topics[topic], t_ns, t_ns, str(value).encode())
            for t_ns, topic, value in sorted(rows, key=lambda row: row[0])
        ]

    def records(self, topics: object = None, start_ns: int = 0) -> Iterator[Record]:
        del topics
        return iter([record for record in self.rows if record.log_time_ns >= start_ns])


@given(ROWS, ROWS)
def test_the_parting_is_where_a_comparison_record_by_record_finds_it(
    first: list[tuple[int, int, int]], second: list[tuple[int, int, int]]
) -> None:
    one, other = _Log(first), _Log(second)

    found = partings(one, other)  # type: ignore[arg-type]

    equal = 0
    for ours, theirs in zip(one.rows, other.rows, strict=False):
        if ours != theirs:
            break
        equal += 1
    assert found.equal == equal
    if one.rows == other.rows:
        assert found.first is None
    else:
        assert found.first is not None
        ends = (one.rows[equal:], other.rows[equal:])
        assert found.first.at_ns == min(rows[0].log_time_ns for rows in ends if rows)
