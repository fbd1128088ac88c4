"""What the rover says is known again by who reads its log, however it is worded."""

import ast
import inspect
from collections.abc import Iterator
from itertools import chain, combinations
from pathlib import Path
from types import ModuleType

import pytest
from hypothesis import given
from hypothesis import strategies as st
from noting import log_of, records_of

from farside.control import Cause, CommandStage, Failsafe, Mode, ModeCause
from farside.logs import LogError, LogFile, Recorder
from farside.logs.story import causes
from farside.logs.story.causes import on_board
from farside.logs.story.causes.authority import rests_on
from farside.messages import Drive, SetMode
from farside.node import Record
from farside.rover import commands, pilot
from farside.rover.control import authority, orders, proposals
from farside.rover.failsafe import gate
from farside.rover.failsafe.table import Rule, rule_for
from farside.topics import (
    ROVER_COMMAND,
    CommandEntry,
    FailsafeEntry,
    ModeEntry,
    reasons,
)
from farside.topics.reasons import Reason

ROVER = (authority, commands, gate, orders, pilot, proposals)
ALL = {name: one for name, one in vars(reasons).items() if isinstance(one, Reason)}


def named(module: ModuleType) -> Iterator[str]:
    """The reasons that a module takes from `reasons`."""
    for node in ast.walk(ast.parse(inspect.getsource(module))):
        if isinstance(node, ast.Attribute) and getattr(node.value, "id", "") == "reasons":
            yield node.attr


def test_the_rover_says_every_reason_that_is_worded() -> None:
    assert set(chain.from_iterable(map(named, ROVER))) == set(ALL)


@given(st.sampled_from(sorted(ALL)), st.lists(st.text(), min_size=2, max_size=2))
def test_a_reason_is_known_again_whatever_words_are_in_it(name: str, words: list[str]) -> None:
    reason = ALL[name]
    said = reason.of(*words)
    assert reason.is_in(said)
    found = reason.words_in(said)
    assert found is not None
    assert reason.of(*found) == said


@pytest.mark.parametrize("name", sorted(ALL))
def test_no_reason_is_taken_for_another(name: str) -> None:
    said = ALL[name].of(7, 8)
    assert [other for other, reason in ALL.items() if reason.is_in(said)] == [name]


@pytest.mark.parametrize("text", [None, "", "command came in between", "command ٣ came in between"])
def test_what_is_no_number_is_none(text: str | None) -> None:
    assert reasons.CAME_BETWEEN.number_in(text) is None


def test_a_number_longer_than_any_is_none() -> None:
    """Such as a damaged or forged log may hold: Python refuses to read it."""
    assert reasons.CAME_BETWEEN.number_in(f"command {'9' * 5000} came in between") is None


# --- the failsafe -----------------------------------------------------------------------------


def entry(so: frozenset[Cause], rule: Rule) -> FailsafeEntry:
    return FailsafeEntry(rule.state, rule.why, tuple(so), 0.0, 0.0)


def test_what_a_state_rests_on_is_what_the_failsafes_table_decided_by() -> None:
    """Of all 2048 sets of causes: the same account for the same row, another for another row."""
    sets = chain.from_iterable(combinations(Cause, size) for size in range(len(Cause) + 1))
    accounts: dict[Rule, set[frozenset[Cause]]] = {}
    for so in map(frozenset, sets):
        if Cause.LOST in so and Cause.SILENCE not in so:
            continue  # a link is lost by silence
        rule = rule_for(so)
        rests = rests_on(entry(so, rule))
        assert rule.when <= rests <= so
        accounts.setdefault(rule, set()).add(rests)
    assert all(len(found) == 1 for found in accounts.values())
    assert len(set(chain.from_iterable(accounts.values()))) == len(accounts)


def test_a_state_that_its_causes_do_not_justify_rests_on_nothing() -> None:
    """As another version's failsafe may have it."""
    assert rests_on(FailsafeEntry(Failsafe.SAFE, "a reason", (), 0.0, 0.0)) == frozenset()


def _tilted(path: Path, mission: bytes) -> tuple[LogFile, Record]:
    """A log in which the rover tilts too much at 5 s, with this mission in it."""
    records = records_of(
        [(5.0, FailsafeEntry(Failsafe.SAFE, "the rover tilts too much", (Cause.TILT,), 0.0, 30.0))]
    )
    with Recorder(path / "run.mcap") as recorder:
        recorder.attach("mission.json", "application/json", mission)
        recorder.write(records)
    return LogFile(recorder.path), records[0]


@pytest.mark.parametrize("fault", ["3", '{"what": "tilt", "start_s": -1e300}', '{"what": "tilt"}'])
def test_a_mission_in_the_log_that_cannot_be_read_is_refused(tmp_path: Path, fault: str) -> None:
    log, tilted = _tilted(tmp_path, f'{{"rover": {{"faults": [{fault}]}}}}'.encode())
    with pytest.raises(LogError, match=r"run.mcap: the mission in it, mission.json, cannot be"):
        causes(log, tilted)


@pytest.mark.parametrize(
    ("start_s", "so"), [("4.5", True), ("5", True), ("6", False), ("1e300", False)]
)
def test_a_fault_of_the_mission_is_a_cause_from_its_start(
    tmp_path: Path, start_s: str, so: bool
) -> None:
    fault = f'{{"what": "tilt", "start_s": {start_s}}}'
    log, tilted = _tilted(tmp_path, f'{{"rover": {{"faults": [{fault}]}}}}'.encode())
    told = [one.sentence for one in causes(log, tilted) if "the mission's fault" in one.sentence]
    assert told == [f"the mission's fault of tilt begins at {float(start_s):.1f} s"] * so


# --- commands ---------------------------------------------------------------------------------


def test_a_command_that_a_waiting_one_superseded_names_that_one() -> None:
    """The mode was ordered long before, and changed when its time had come."""
    late = SetMode(Mode.SHARED)
    noted = [
        (0.0, FailsafeEntry(Failsafe.NOMINAL, "the link is up", (), 0.0, 30.0)),
        (0.0, ModeEntry(Mode.GUIDED, ModeCause.START)),
        (5.0, CommandEntry(6, CommandStage.TAKEN, Drive("N"))),
        (5.0, CommandEntry(6, CommandStage.WAITING, Drive("N"))),
        (6.0, CommandEntry(7, CommandStage.TAKEN, late)),
        (6.0, CommandEntry(7, CommandStage.WAITING, late)),
        (9.0, CommandEntry(6, CommandStage.SUPERSEDED, Drive("N"), reasons.MODE_CHANGED.of(7))),
    ]
    with log_of(records_of(noted)) as log:
        record = list(log.records([ROVER_COMMAND]))[-1]
        told = [cause.sentence for cause in causes(log, record) if cause.depth == 1]
    assert told == [
        "command 7 (mode shared) arrives on board",
        "command 6 (drive N) arrives on board",
    ]


@pytest.mark.parametrize(("entries", "is_cut"), [(40, False), (60, True)])
def test_a_long_chain_says_that_it_is_cut(entries: int, *, is_cut: bool) -> None:
    """Of states of the failsafe each of which has only the one before it to go back to."""
    noted = [
        (float(t_s), FailsafeEntry(Failsafe.NOMINAL, "the link is up", (), 0.0, 30.0))
        for t_s in range(entries)
    ]
    with log_of(records_of(noted)) as log:
        told = causes(log, list(log.records())[-1])
    cut = "more led to it: told are 200 causes at most, and 40 steps back"
    assert (told[-1].sentence == cut) is is_cut
    assert [cause.depth for cause in told if cause.topic] == list(range(1, min(entries, 41)))


def test_every_reason_of_a_refusal_that_has_a_cause_leads_to_it() -> None:
    """All but the sentences of a proposal's end, which have a finder of their own."""
    followed = {reasons.NEVER_AFTER, reasons.NOT_AFTER}
    superseding = {reasons.MODE_CHANGED, reasons.LINK_LOST}
    ends = {
        reasons.CAME_BETWEEN,
        reasons.VETOED,
        reasons.OTHER_SITUATION,
        reasons.ANSWER_TOO_LATE,
        reasons.NO_VETO,
    }
    assert on_board.REFUSALS.keys() | followed | superseding | ends == set(ALL.values())
