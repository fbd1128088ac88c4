"""A run lived again: every record comes out as in the log, or the first that does not is named."""

import os
import shutil
import signal
from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest
from hazards import Hazard, Wild, hazards, orders
from hypothesis import given, settings
from hypothesis import strategies as st
from short_life import ORDERS, QUEUED, SHORT, Failing, damaged, forged

from farside.acts import Act
from farside.control import Mode, ModeCause
from farside.ground import Situation
from farside.logs import LogError, LogFile
from farside.messages import Order
from farside.missions import FinishedRun, Rehearsal, TimedOrders, load_mission, run_mission
from farside.missions.conductor import Watcher
from farside.missions.reliving.past import RelivingError
from farside.missions.reliving.rerunning import rerun
from farside.missions.reliving.verifying import verify
from farside.node import Record, Role, to_ns
from farside.topics import GROUND_ORDER, ROVER_MODE, ModeEntry


def test_every_record_comes_out_again(flown: FinishedRun) -> None:
    told: list[float] = []
    verdict = verify(flown.log, told.append)

    assert verdict.equal
    assert verdict.parting is None
    assert verdict.digest == verdict.recorded == flown.digest
    assert verdict.records == sum(1 for _ in LogFile(flown.log).records(pictures=True))
    assert told[-1] == verdict.sim_seconds == 75.0
    assert verdict.other_versions == ()


@settings(max_examples=2)
@given(hazards())
def test_any_mission_over_a_bad_link_comes_out_again(runs: Path, hazard: Hazard) -> None:
    operator = type("Hazardous", (Wild,), {"hazard": hazard})
    values = {**hazard.values, "duration_s": 90.0}
    run = Rehearsal("blackout", runs, values).operator(operator).run()

    assert verify(run.log, operator=operator).equal


@settings(max_examples=4)
@given(
    st.lists(st.tuples(st.floats(0, 22), orders(["A", "B", "C", "D"])), max_size=12),
    st.sampled_from([None, 0.1, 0.3, 0.64]),
)
def test_orders_at_any_time_in_windows_of_any_length_come_again(
    runs: Path, given_: Sequence[tuple[float, Order]], window_s: float | None
) -> None:
    run = run_mission(
        load_mission("blackout", {**QUEUED, "duration_s": 25.0}),
        in_process=True,
        out=runs,
        watcher=TimedOrders(given_),
        window_ns=None if window_s is None else to_ns(window_s),
    )
    assert len(run.entries(GROUND_ORDER)) == len(given_)
    assert verify(run.log).equal


@pytest.mark.processes
def test_a_run_of_four_processes_comes_out_again_in_this_one(tmp_path: Path) -> None:
    loaded = load_mission("blackout", {**QUEUED, "duration_s": 20.0})
    run = run_mission(loaded, out=tmp_path, watcher=TimedOrders(ORDERS))

    assert verify(run.log).equal


def test_a_log_that_nobody_finished_is_compared_as_far_as_it_goes(tmp_path: Path) -> None:
    """As the disk holds it at 20 s; and the same with its end missing."""
    copy, cut = tmp_path / "copy.mcap", tmp_path / "cut.mcap"

    class Copying(Watcher):
        def watch(self, now_s: float, records: Sequence[Record]) -> None:
            del records
            if now_s >= 20 and not copy.exists():
                (log,) = tmp_path.glob("blackout-*.mcap")
                shutil.copy(log, copy)

        def wait(self, roles: Sequence[Role], waited_s: float) -> None:
            pass

    loaded = load_mission("blackout", {**SHORT, "duration_s": 30.0})
    run_mission(loaded, in_process=True, out=tmp_path, watcher=Copying())
    cut.write_bytes(copy.read_bytes()[:-100])

    whole = verify(copy)
    assert (whole.equal, whole.whole, whole.recorded) == (True, False, None)
    assert 20 <= whole.sim_seconds <= 22
    less = verify(cut)
    assert less.equal
    assert 0 < less.records < whole.records
    assert less.damage


def test_an_interrupted_run_comes_out_again_up_to_its_end(tmp_path: Path) -> None:
    class Impatient(Watcher):
        def watch(self, now_s: float, records: Sequence[Record]) -> None:
            del records
            if 10 <= now_s < 12:
                os.kill(os.getpid(), signal.SIGINT)

        def wait(self, roles: Sequence[Role], waited_s: float) -> None:
            pass

    loaded = load_mission("blackout", {**SHORT, "duration_s": 30.0})
    run = run_mission(loaded, in_process=True, out=tmp_path, watcher=Impatient())

    assert run.interrupted
    verdict = verify(run.log)
    assert (verdict.equal, verdict.whole, verdict.digest) == (True, True, run.digest)
    assert verdict.sim_seconds == run.result.sim_seconds < 30.0


def test_the_first_record_that_differs_is_named(flown: FinishedRun, tmp_path: Path) -> None:
    records = list(LogFile(flown.log).records())
    number = max(n for n, record in enumerate(records) if record.topic == ROVER_MODE.name)
    forgery = msgspec.json.encode(ModeEntry(Mode.AUTONOMOUS, ModeCause.START))
    records[number] = msgspec.structs.replace(records[number], payload=forgery)

    log = forged(flown.log, tmp_path / "forged.mcap", records)
    verdict = verify(log)

    assert not verdict.equal
    assert list(LogFile(log).records(pictures=True))[verdict.records] == records[number]
    parting = verdict.parting
    assert parting is not None
    assert parting.topic == ROVER_MODE.name
    assert to_ns(parting.t_s) == records[number].log_time_ns
    assert {key: logged for key, logged, _ in parting.fields()}["why"] == "start"


@pytest.mark.parametrize("number", [1000, -1])
def test_a_record_that_is_missing(flown: FinishedRun, tmp_path: Path, number: int) -> None:
    """In the middle; and at the end, where the run has one more than the log."""
    records = list(LogFile(flown.log).records())
    del records[number]

    verdict = verify(forged(flown.log, tmp_path / "forged.mcap", records))

    assert not verdict.equal
    assert verdict.parting is not None
    assert (verdict.parting.first is None) is (number == -1)


def test_a_record_too_many(flown: FinishedRun, tmp_path: Path) -> None:
    records = list(LogFile(flown.log).records())

    verdict = verify(forged(flown.log, tmp_path / "forged.mcap", [*records, records[-1]]))

    assert verdict.parting is not None
    assert (verdict.equal, verdict.parting.second) == (False, None)


def test_a_log_that_states_another_digest_than_its_records_have(
    flown: FinishedRun, tmp_path: Path
) -> None:
    stated = {"farside.result": {"outcome": "success", "digest": "0" * 64}}

    verdict = verify(forged(flown.log, tmp_path / "forged.mcap", metadata=stated))

    assert (verdict.equal, verdict.parting, verdict.recorded) == (False, None, "0" * 64)


def test_another_version_is_told_of(flown: FinishedRun, tmp_path: Path) -> None:
    written = {"farside.run": {"mission": "m", "seed": "1", "numpy": "0.1", "gone": "2"}}

    others = verify(forged(flown.log, tmp_path / "old.mcap", metadata=written)).other_versions

    assert [(one.name, one.then) for one in others] == [("numpy", "0.1"), ("gone", "2")]
    assert others[1].now == "none"


def test_after_the_loss_of_a_process_it_is_refused(tmp_path: Path) -> None:
    values = {"duration_s": 40.0, "expect": [], "ground.script": []}
    run = Rehearsal("blackout", tmp_path, values).operator(Failing).run()

    with pytest.raises(RelivingError, match=r"its ground failed at 19\.\d+ s"):
        verify(run.log, operator=Failing)


def test_what_fails_now_and_did_not_fail_then_is_no_verdict(tmp_path: Path) -> None:
    class Calm(Failing):
        def act(self, situation: Situation) -> Sequence[Act]:
            return super().act(situation) if situation.now_ns == 0 else ()

    values = {"duration_s": 40.0, "expect": [], "ground.script": []}
    run = Rehearsal("blackout", tmp_path, values).operator(Calm).run()

    assert verify(run.log, operator=Calm).equal
    with pytest.raises(RelivingError, match=r"it failed now and not then: the ground node .*ideas"):
        verify(run.log, operator=Failing)


def test_what_is_damaged_of_a_log_is_told_once_it_is_reached(
    flown: FinishedRun, tmp_path: Path
) -> None:
    verdict = verify(damaged(flown.log, tmp_path / "damaged.mcap"))

    assert not verdict.equal
    assert verdict.parting is not None
    assert len(verdict.damage) == 1


def test_without_all_orders_no_run_is_lived_again(ordered: FinishedRun, tmp_path: Path) -> None:
    """Not even its beginning: nobody knows when the orders were that are missing."""
    log = damaged(ordered.log, tmp_path / "damaged.mcap", GROUND_ORDER)
    again = tmp_path / "again"

    with pytest.raises(RelivingError, match=r"expected a whole log, .* damaged: bytes"):
        verify(log)
    with pytest.raises(RelivingError, match="expected a whole log"):
        rerun(log, {"link.up.loss": 0.1}, out=again)
    assert not again.exists()
    assert verify(rerun(log, {"ground.operator": "absent"}, out=again).log).equal


def test_orders_that_cannot_be_read_are_refused(ordered: FinishedRun, tmp_path: Path) -> None:
    records = [
        msgspec.structs.replace(record, payload=b"{}")
        if record.topic == GROUND_ORDER.name
        else record
        for record in LogFile(ordered.log).records()
    ]
    with pytest.raises(LogError, match="/ground/order"):
        verify(forged(ordered.log, tmp_path / "forged.mcap", records))


@pytest.mark.parametrize(
    ("name", "data"),
    [
        ("mission.toml", b"\xff"),
        ("mission.json", b"\xff"),
        ("changes.json", b"{}"),
        ("result.json", b'{"sim_seconds": 1e300}'),
        ("result.json", b'{"sim_seconds": -1}'),
    ],
)
def test_what_a_log_says_of_its_run_is_read_with_care(
    runs: Path, tmp_path: Path, name: str, data: bytes
) -> None:
    values = {**SHORT, "duration_s": 1.0, "expect": []}
    run = rerun(
        run_mission(load_mission("blackout", values), in_process=True, out=runs).log,
        from_s=0.5,
        out=runs,
    )
    log = forged(run.log, tmp_path / "forged.mcap", attachments={name: data})

    with pytest.raises(RelivingError, match=rf"forged\.mcap: expected .* in {name}, found"):
        verify(log)
