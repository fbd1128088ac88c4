"""A log opened for questions: as the run was, and as the ground had it."""

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from noting import command_sent, failsafe_entry, log_of, records_of, said_of, view_of

import farside.logs
from farside.control import (
    BatteryState,
    Cause,
    Chooser,
    CommandStage,
    Failsafe,
    Mode,
    ModeCause,
    Verdict,
)
from farside.logs import CommandVerdict, FailsafeSpan, LogError, LogFile, Recorder, RunView
from farside.logs.result import DemResult, Judgement, RoverResult, StoreResult
from farside.logs.spans import LinkTally
from farside.messages import (
    BatteryChanged,
    Drive,
    Event,
    FailsafeChanged,
    GoalReached,
    Happening,
    ModeChanged,
)
from farside.node import Journal, to_ns
from farside.topics import (
    GROUND_BELIEF,
    GROUND_CHART,
    GROUND_EVENT,
    GROUND_TELEMETRY,
    TOPICS,
    BeliefEntry,
    CommandEntry,
    Decision,
    Estimate,
    EventLearned,
    Likely,
    Prediction,
    Silence,
    Yard,
)
from tests.ground.conftest import make_belief, telemetry

ROWS = ("#####", "#A.B#", "#####")


def test_charge_pose_and_estimate_at_a_time(run: Any) -> None:
    run.start("at:D").stand(5, "at:B").note(4, Estimate(1.0, 2.0, 3.0))

    view = view_of(run.records)

    assert view.pose_at(5).place == "at:B"
    assert view.pose_at(4.9).place == "at:D"
    assert view.battery_at(5) == 0.75
    assert view.estimate_at(4.5) == Estimate(1.0, 2.0, 3.0)


def test_the_states_of_the_failsafe_with_their_reasons(run: Any) -> None:
    run.start().note(100, failsafe_entry(Failsafe.HOLD, 10.0))

    assert view_of(run.records).failsafes == (
        FailsafeSpan(0.0, Failsafe.NOMINAL, "the link is up", ()),
        FailsafeSpan(100.0, Failsafe.HOLD, "nothing is heard", (Cause.SILENCE,)),
    )


def test_decisions_are_told_with_their_times(run: Any) -> None:
    decided = Decision(Chooser.GUIDED, "E", None, (), None, None, None, command=1)

    assert view_of(run.start().note(3, decided).records).decisions == ((3.0, decided),)


# --- commands ----------------------------------------------------------------------------------


def lived(run: Any) -> Any:
    """A command that is done, of which the ground hears late; and one that is lost."""
    drive = Drive("E")
    run.start().note(1, command_sent(1, drive), command_sent(2, drive))
    for t_s, stage in ((3, CommandStage.TAKEN), (4, CommandStage.BEGUN), (6, CommandStage.DONE)):
        run.note(t_s, CommandEntry(1, stage, drive))
    run.note(5, said_of(1, CommandStage.TAKEN, Verdict.OVERDUE, due_s=2.5))
    run.note(7, said_of(1, CommandStage.TAKEN, Verdict.LATE, due_s=2.5, so_s=3.0))
    return run.note(9, said_of(1, CommandStage.DONE, Verdict.ON_TIME, due_s=7.0, so_s=6.0))


def test_a_command_has_its_whole_life_on_both_sides(run: Any) -> None:
    one, two = view_of(lived(run).records).commands

    assert (one.number, one.order, one.sent_s, one.expires_s) == (1, Drive("E"), 1.0, 1000.0)
    assert (one.arrived_s, one.begun_s, one.ended_s) == (3.0, 4.0, 6.0)
    assert (one.how, one.why, one.learned_s) == (CommandStage.DONE, None, 9.0)
    assert one.verdicts == (
        CommandVerdict(5.0, CommandStage.TAKEN, Verdict.OVERDUE, 2.5, None),
        CommandVerdict(7.0, CommandStage.TAKEN, Verdict.LATE, 2.5, 3.0),
        CommandVerdict(9.0, CommandStage.DONE, Verdict.ON_TIME, 7.0, 6.0),
    )
    assert (two.arrived_s, two.how, two.learned_s, two.verdicts) == (None, None, None, ())


@pytest.mark.parametrize(
    ("until_s", "known"), [(6.5, (None, None, 1)), (8, (3.0, None, 2)), (9, (3.0, 6.0, 3))]
)
def test_as_ground_a_command_has_the_life_that_was_heard_of(
    run: Any, path: Path, until_s: float, known: Any
) -> None:
    one, _ = farside.logs.open(lived(run).log(path), as_ground=True, until_s=until_s).commands

    assert one.begun_s is None, "nobody told"
    assert (one.arrived_s, one.ended_s, len(one.verdicts)) == known


def test_a_refused_command_says_why_on_both_sides(run: Any, path: Path) -> None:
    run.start().note(1, command_sent(1, Drive("E")))
    run.note(3, CommandEntry(1, CommandStage.REFUSED, Drive("E"), "a wall is there"))
    refused = CommandStage.REFUSED
    run.note(5, said_of(1, refused, Verdict.ON_TIME, so_s=3.0, why="a wall is there")).log(path)

    for as_ground in (False, True):
        (one,) = farside.logs.open(path, as_ground=as_ground).commands
        assert (one.how, one.why, one.ended_s) == (refused, "a wall is there", 3.0)


# --- what the ground believed ------------------------------------------------------------------

HAPPENINGS: st.SearchStrategy[Happening] = st.one_of(
    st.builds(ModeChanged, st.sampled_from(Mode), st.sampled_from(ModeCause)),
    st.builds(FailsafeChanged, st.sampled_from(Failsafe), st.just("so"), st.just(0)),
    st.builds(BatteryChanged, st.sampled_from(BatteryState), st.floats(0, 1)),
    st.just(GoalReached(("at:B",))),
)
WORDS = st.lists(
    st.tuples(
        st.integers(0, 2),  # since the last word
        st.integers(0, 4),  # on the way
        st.one_of(st.tuples(st.sampled_from([Mode.GUIDED, Mode.SHARED])), HAPPENINGS),
    ),
    min_size=5,
    max_size=8,
)


@settings(max_examples=60)
@given(words=WORDS)
def test_what_was_believed_is_what_the_ground_itself_believed(words: Any) -> None:
    """Whatever is heard, in whatever order: word may be overtaken by later word."""
    belief = make_belief()
    journal = Journal()
    belief._journal = journal
    so_s, heard = 0, []
    for number, (since_s, delay_s, word) in enumerate(words):
        so_s += since_s
        heard.append((so_s + delay_s, so_s, number, word))
    believed: dict[int, BeliefEntry] = {}
    for second in range(25):
        journal.now_ns = now_ns = to_ns(second)
        for at_s, since_s, number, word in sorted(heard, key=lambda one: one[0]):
            if at_s != second:
                continue
            if isinstance(word, tuple):
                told = telemetry(since_s, mode=word[0], x_m=float(number))
                journal.note(GROUND_TELEMETRY, told, publish_time_ns=told.time_ns)
                belief.learn(told, now_ns)
            else:
                event = Event(number, to_ns(since_s), word)
                journal.note(GROUND_EVENT, EventLearned(event), publish_time_ns=event.time_ns)
                belief.tell(event, now_ns)
        belief.look(now_ns)
        believed[second] = belief.now
    journal.note(GROUND_BELIEF, belief.now)

    asked = {24, *(at_s for at_s, *_ in heard)}
    with log_of(journal.take()) as log:
        view = RunView(log)
        found = {second: view.believed_at(second).belief for second in asked}

    assert found == {second: believed[second] for second in asked}


def test_before_anything_is_heard_nothing_is_believed(run: Any) -> None:
    believed = view_of(run.start().note(9, Silence(silent=True)).records).believed_at(5)

    assert believed == (5, BeliefEntry(()), None, None, False, None)


def test_what_was_believed_comes_with_its_age(run: Any) -> None:
    run.start().hear(4, "at:A", since_s=2.75).note(8, Silence(silent=True))
    run.note(6, predicted := Prediction(to_ns(6), to_ns(2.75), (Likely(("at:A",), 1.0),), 0.0))

    believed = view_of(run.records).believed_at(8)

    assert believed.age_s == 5.25
    assert believed.telemetry.tokens == ("at:A",)
    assert (believed.silent, believed.prediction) == (True, predicted)


# --- as ground ---------------------------------------------------------------------------------


@pytest.fixture
def as_ground(run: Any, path: Path) -> RunView:
    records = run.start().hear(4, "at:A", since_s=2.75).note(9, Silence(silent=True)).records
    journal = Journal()
    journal.note(GROUND_CHART, Yard(ROWS, 2.0))
    with Recorder(path) as recorder:
        recorder.metadata("farside.run", {"mission": "handmade", "seed": "7"})
        recorder.write([*journal.take(), *records])
        recorder.attach("result.json", "application/json", b"{}")
        recorder.metadata("farside.result", {"digest": "0" * 64})
    return farside.logs.open(path, as_ground=True, until_s=5)


RESULT = {
    "mission": "handmade",
    "seed": 7,
    "outcome": "failure",
    "log": "run.mcap",
    "digest": "0" * 64,
    "sim_seconds": 6.0,
    "wall_seconds": 1.0,
    "speedup": 6.0,
    "goals": (),
    "modes": (),
    "link": {"uplink": LinkTally().counters(), "downlink": LinkTally().counters()},
    "store": StoreResult(0, 0, 0, 0),
    "dem": DemResult(0, 0, 0.0),
    "rover": RoverResult(None, None, None, None),
    "operator": None,
}
"""What `result.json` holds but for the expectations."""

QUERIES: dict[str, Callable[[RunView], object]] = {
    "modes": lambda view: view.modes,
    "mode": lambda view: view.mode_at(1),
    "pose": lambda view: view.pose_at(1),
    "charge": lambda view: view.battery_at(1),
    "estimate": lambda view: view.estimate_at(1),
    "decisions": lambda view: view.decisions,
    "failsafe": lambda view: view.failsafes,
    "goals": lambda view: view.goals,
    "reached": lambda view: view.reached("A"),
    "commands taken": lambda view: view.commands_taken,
    "frames": lambda view: view.frames(),
    "outages": lambda view: view.outages,
    "store": lambda view: view.store,
    "shadow": lambda view: view.shadow,
    "least charge": lambda view: view.least_charge,
    "flat": lambda view: view.flat_since_s,
    "dem": lambda view: view.dem,
    "result": lambda view: view.result,
    "digest": lambda view: view.digest,
    **{
        name: partial(RunView.entries, topic=topic)
        for name, topic in TOPICS.items()
        if not name.startswith("/ground/")
    },
}


@pytest.mark.parametrize("query", QUERIES)
def test_what_the_ground_does_not_know_is_refused(as_ground: RunView, query: str) -> None:
    with pytest.raises(ValueError, match=r"^not known at the ground: "):
        QUERIES[query](as_ground)


def test_what_the_ground_knows_is_told(as_ground: RunView) -> None:
    assert as_ground.is_as_ground
    assert as_ground.duration_s == 5.0
    assert (as_ground.mission_name, as_ground.seed) == ("handmade", 7)
    assert as_ground.chart.cell_m == 2.0, "its own map, not the true one"
    assert len(as_ground.telemetry) == 1
    assert as_ground.believed_at(5).age_s == 2.25
    assert as_ground.operator is None
    with pytest.raises(ValueError, match=r"expected a time within the run, 0 to 5\.0 s"):
        as_ground.believed_at(6)


@pytest.mark.parametrize(
    ("how", "why"),
    [
        ({"until_s": 3}, "until_s together with as_ground"),
        ({"as_ground": True, "until_s": -1}, "a time of 0 s or more"),
        ({"as_ground": True, "until_s": math.nan}, "a time of 0 s or more"),
        ({"as_ground": True, "until_s": math.inf}, "a time of 0 s or more"),
        ({"as_ground": True, "until_s": 1e300}, r"less than 4\.61e\+09 s, found 1e\+300 s"),
    ],
)
def test_a_time_that_is_none_is_refused(run: Any, path: Path, how: Any, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        farside.logs.open(run.start().log(path), **how)


# --- what the log says of itself ---------------------------------------------------------------


def test_an_unfinished_log_has_a_digest_and_no_result(run: Any, path: Path) -> None:
    view = farside.logs.open(str(run.start().log(path)))

    assert view.digest == LogFile(path).digest()
    assert view.result is None
    assert view.path == path
    with pytest.raises(LogError, match=r"expected mission in the metadata farside\.run"):
        assert view.mission_name


def test_what_a_log_says_wrongly_is_refused_by_name(path: Path) -> None:
    with Recorder(path) as recorder:
        recorder.metadata("farside.run", {"mission": "handmade", "seed": "many"})
        recorder.attach("result.json", "application/json", b'{"mission": 1}')
    view = farside.logs.open(path)

    with pytest.raises(LogError, match="expected a whole number as seed"):
        assert view.seed
    with pytest.raises(LogError, match=r"expected a result\.json of this version"):
        assert view.result


# --- in two lines ------------------------------------------------------------------------------


@pytest.fixture
def tells(path: Path) -> Path:
    """The log of a run that is over, with all that it says of itself."""
    judged = (Judgement("goal at:B reached", met=False, detail="never \x1b[31m reached"),)
    with Recorder(path) as recorder:
        recorder.metadata("farside.run", {"mission": "handmade", "seed": "7"})
        recorder.write(records_of([(4, telemetry(2.0, "A")), (6, Silence(silent=False))]))
        result = {**RESULT, "expectations": judged}
        recorder.attach("result.json", "application/json", msgspec.json.encode(result))
    return path


def test_a_run_tells_how_it_ended_in_two_lines(tells: Path) -> None:
    assert repr(farside.logs.open(tells)) == (
        "<handmade, seed 7: failure after 6.0 s, 0 of 1 expectations met; "
        "goal at:B reached: never \\x1b[31m reached\n"
        f" farside replay {tells}>"
    )


def test_as_ground_it_tells_what_was_heard_last(tells: Path) -> None:
    known = repr(farside.logs.open(tells, as_ground=True, until_s=5)).splitlines()[0]
    before = repr(farside.logs.open(tells, as_ground=True, until_s=1)).splitlines()[0]

    assert known == (
        "<handmade, seed 7, as the ground had it at 5.0 s: heard 3.0 s ago, at:A, guided"
    )
    assert before == "<handmade, seed 7, as the ground had it at 1.0 s: nothing heard yet"


def test_an_unfinished_run_tells_how_far_it_came(run: Any, path: Path) -> None:
    told = repr(farside.logs.open(run.start().stand(9, "at:B").log(path)))

    assert told.startswith("<a run, seed unknown: unfinished, 9.0 s so far\n")


def test_the_time_that_was_asked_about_last_is_kept(tells: Path) -> None:
    run = farside.logs.open(tells)
    assert run.asked_s is None
    run.believed_at(3)
    assert run.asked_s == 3
