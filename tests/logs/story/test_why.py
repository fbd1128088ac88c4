"""Why something was so at a moment."""

import msgspec
import numpy as np
import pytest
from noting import failsafe_entry, log_of, records_of

from farside.control import (
    BatteryState,
    CommandStage,
    Failsafe,
    Mode,
    ModeCause,
)
from farside.frames import FrameEvent, FrameStage, LinkOutage, OutageReason
from farside.logs import LogFile
from farside.logs.story import Aspect, Reasons, SubjectError, story, subject_of, why
from farside.messages import Drive, Proposal, SetMode
from farside.node import Direction, Journal, to_ns
from farside.topics import (
    ROVER_FRAME,
    BatteryEntry,
    BeliefEntry,
    CommandEntry,
    GoalChange,
    GoalEntry,
    GoalSource,
    Known,
    LearnedBy,
    ModeEntry,
    ProposalEnded,
    reasons,
)


def asked(log: LogFile, t_s: float, aspect: Aspect = Aspect.ACTION) -> dict[str, list[str]]:
    """The answer: its lines by heading."""
    reasons = why(log, to_ns(t_s), aspect)
    return {section.heading: list(section.lines) for section in reasons.sections}


def test_an_action_that_the_rover_chose_alone(flown: LogFile) -> None:
    found = asked(flown, 658)
    assert found["the rover performs E"] == ["E begins, goal-directed, towards at:B, at 657.5 s"]
    assert found["the decision behind it"] == [
        "chooser goal-directed; active Signs: at:3,4",
        "because at:3,4 ∧ E → at:4,4 (C_m 0.75, cost to go 107.8 s)",
        "the runner-up is at:3,4 ∧ W → at:2,4 (C_m 0.75, cost to go 114.9 s), 7.1 s dearer",
        (
            "on the policy map of at:B, as it was at 601.8 s: at:3,4 has P_v 107.8 s, "
            "best action E, depth 21"
        ),
    ]
    assert found["who drives"][0] == "mode autonomous: link lost, since 650.0 s, for 8.00 s"
    assert found["what led to it"][-1] == "    620.0 s  uplink: blackout begins"
    assert found["what the ground thought then"] == [
        (
            "it believes the rover at 2,7, performing S, in mode shared, with failsafe nominal, "
            "with goal at:B"
        ),
        "its newest telemetry is of 619.8 s, 38.16 s old",
        "something newer was due, so this is stale: all of that",
        "at 658.0 s it predicted at:2,4 with 71%, else at:2,5 with 22%, from telemetry of 619.8 s",
        "the rover has counted as silent since 629.2 s, unexpectedly",
        "its shadow of the model is in step, after update 92 of 615.8 s",
    ]


def test_an_action_by_command_names_the_command(flown: LogFile) -> None:
    assert asked(flown, 620)["the command behind it"] == [
        "command 93: approve proposal 14 - done at 621.6 s, known at the ground at 985.5 s"
    ]


def test_the_mode(flown: LogFile) -> None:
    found = asked(flown, 700, Aspect.MODE)
    assert found["mode autonomous"] == ["mode autonomous: link lost, since 650.0 s, for 50.00 s"]
    assert [line.split("  ")[-1] for line in found["what led to it"]] == [
        "failsafe alone: the link is lost, after 30.0 s of silence",
        "failsafe hold: nothing is heard, after 10.0 s of silence",
        "uplink: blackout begins",
    ]
    assert found["when the ground learned of it"] == ["at 985.5 s, 335.5 s later (event 190)"]


def test_the_failsafe_tells_its_condition_and_the_countdown(flown: LogFile) -> None:
    assert asked(flown, 640, Aspect.FAILSAFE)["failsafe hold"] == [
        "failsafe hold: nothing is heard, after 10.0 s of silence, since 630.0 s, for 10.00 s",
        "what was so when that began: silence",
        "silence by then that the contact plan did not explain: 10.02 s",
        "another 19.98 s of such silence would have counted as the loss of the link",
    ]


def test_a_silence_on_both_sides(flown: LogFile) -> None:
    found = asked(flown, 700, Aspect.SILENCE)
    assert found["on board"][:4] == [
        "the rover last heard frame up:1076 at 620.0 s, 80.0 s before",
        "why: the uplink is out, blackout since 620.0 s; 46 frames lost to the blackout",
        "the blackout of 620.0 s stands in no plan: neither side can expect it",
        "the next that it hears is frame up:1263 at 981.6 s, after 361.6 s in all",
    ]
    assert found["at the ground"][-2:] == [
        "629.2 s: hears nothing from the rover",
        "981.8 s: hears the rover",
    ]


def test_between_two_frames_there_is_no_silence(flown: LogFile) -> None:
    found = asked(flown, 100, Aspect.SILENCE)
    assert found["on board"][1] == "that is no silence: the rover does not count it as one"
    assert found["at the ground"][1] == "that is no silence: the ground does not count it as one"


def test_what_a_side_counts_as_silence_is_silence_however_short() -> None:
    """In a mission whose failsafe holds after two seconds."""
    heard = FrameEvent(Direction.UP, 1, FrameStage.USED, 40, "Heartbeat")
    noted = records_of(
        [
            (0.0, failsafe_entry()),
            (12.0, failsafe_entry(Failsafe.HOLD, 2.0)),
            (13.0, ModeEntry(Mode.SHARED, ModeCause.OPERATOR)),
        ]
    )
    journal = Journal()
    journal.note(ROVER_FRAME, heard, log_time_ns=to_ns(10))
    with log_of(sorted([*noted, *journal.take()], key=lambda one: one.log_time_ns)) as log:
        assert "does not count it" in asked(log, 11, Aspect.SILENCE)["on board"][1]
        assert asked(log, 13, Aspect.SILENCE)["on board"][1].startswith("why: ")
        now = asked(log, 10, Aspect.SILENCE)["on board"][0]
    assert now == "the rover last heard frame up:1 at 10.0 s, at this moment"


def test_an_outage_that_the_plan_knows_is_told_as_such() -> None:
    noted = [
        (0.0, ModeEntry(Mode.GUIDED, ModeCause.START)),
        (10.0, LinkOutage(Direction.UP, down=True, reason=OutageReason.PASS)),
        (99.0, ModeEntry(Mode.SHARED, ModeCause.OPERATOR)),
    ]
    with log_of(records_of(noted)) as log:
        found = asked(log, 50, Aspect.SILENCE)["on board"]
    planned = "the gap between passes of 10.0 s stands in the contact plan: both sides expect it"
    assert planned in found
    assert found[0] == "the rover has heard nothing by 50.0 s"


def test_what_the_ground_thought_before_it_knew_where_the_rover_is() -> None:
    """It may have heard of something else first, such as by an event."""
    charge = Known(0.4, to_ns(3), to_ns(10), LearnedBy.EVENT)
    with log_of(records_of([GUIDED, (10.0, BeliefEntry((), battery=charge))])) as log:
        thought = [asked(log, t_s, Aspect.MODE)["what the ground thought then"] for t_s in (9, 10)]
    assert thought == [
        ["it has heard nothing of the rover yet"],
        ["it does not know yet where the rover is or what it does"],
    ]


# --- standing still ---------------------------------------------------------------------------

GUIDED = (0.0, ModeEntry(Mode.GUIDED, ModeCause.START))
SHARED = (0.0, ModeEntry(Mode.SHARED, ModeCause.OPERATOR))
ALONE = (0.0, ModeEntry(Mode.AUTONOMOUS, ModeCause.OPERATOR))
GOAL = (1.0, GoalEntry(("at:B",), GoalChange.SET, 1.0, GoalSource.OPERATOR))
GONE = (2.0, GoalEntry(("at:B",), GoalChange.WITHDRAWN, 1.0, GoalSource.OPERATOR))
PROPOSED = (2.0, Proposal(4, to_ns(2), ("at:B",), "E", ()))
VETOED = ProposalEnded(4, reasons.VETOED.of())
BY_ITSELF = (Mode.AUTONOMOUS, ModeCause.OPERATOR)
OPERATOR = GoalSource.OPERATOR
NOMINAL = (0.0, failsafe_entry())


@pytest.mark.parametrize(
    ("noted", "reason"),
    [
        ([GUIDED], "mode guided: it does what the operator commands, and no command waits"),
        ([SHARED], "no goal is on the Goal List: without one it never acts by itself"),
        ([SHARED, GOAL, GONE], "no goal is on the Goal List"),
        ([SHARED, GOAL, PROPOSED], "proposal 4 (E) waits for the operator's word since 2.0 s"),
        (
            [SHARED, GOAL, PROPOSED, (3.0, VETOED)],
            "it has goals (at:B), and the operator vetoed what it proposed",
        ),
        ([ALONE, GOAL], "it has goals (at:B), and knows no way to them from here"),
        (
            [SHARED, GOAL, PROPOSED, (3.0, VETOED), (4.0, ModeEntry(*BY_ITSELF))],
            "it has goals (at:B), and knows no way to them from here",
        ),
        (
            [ALONE, GOAL, (2.0, GoalEntry(("at:B",), GoalChange.SUSPENDED, 1.0, OPERATOR, "far"))],
            "it has goals (at:B, put aside: far), and knows no way to them from here",
        ),
        (
            [ALONE, GOAL, (3.0, failsafe_entry(Failsafe.HOLD, 12))],
            "failsafe hold: nothing is heard, after 12.0 s of silence, so it begins nothing",
        ),
        (
            [ALONE, GOAL, (3.0, BatteryEntry(BatteryState.FLAT, 0))],
            "battery flat: the rover cannot move",
        ),
        (
            [GUIDED, (3.0, CommandEntry(5, CommandStage.WAITING, Drive("E")))],
            "command 5 (drive E) waits on board since 3.0 s",
        ),
        (
            [
                GUIDED,
                (3.0, CommandEntry(5, CommandStage.WAITING, Drive("E"))),
                (3.5, CommandEntry(6, CommandStage.WAITING, Drive("W"))),
                (4.0, CommandEntry(7, CommandStage.TAKEN, SetMode(Mode.GUIDED))),
                (4.0, CommandEntry(7, CommandStage.DONE, SetMode(Mode.GUIDED))),
            ],
            "command 5 (drive E) waits on board since 3.0 s, and 1 more",
        ),
    ],
)
def test_why_it_stands_still(noted: list[tuple[float, msgspec.Struct]], reason: str) -> None:
    noted = [NOMINAL, *noted, (9.0, BatteryEntry(BatteryState.NOMINAL, 1))]
    with log_of(records_of(sorted(noted, key=lambda one: one[0]))) as log:
        first = asked(log, 5)["the rover stands still"][0]
    assert first.startswith(reason)


def test_the_model_is_asked_only_where_the_rover_stands_still(flown: LogFile) -> None:
    """Where it acts, the recorded decision is enough."""
    heading = "the model on board at that moment, re-lived"
    for t_s, is_asked in ((658.0, False), (640.0, True)):
        reasons = why(flown, to_ns(t_s), mind=lambda: ["it holds this"])
        assert (heading in [section.heading for section in reasons.sections]) is is_asked


def test_an_empty_log_has_no_reasons_but_does_not_fail() -> None:
    with log_of(()) as log:
        for aspect in Aspect:
            assert why(log, 0, aspect).t_ns == 0


# --- as the ground ----------------------------------------------------------------------------


def test_what_the_ground_could_not_know_changes_nothing_of_its_answers(flown: LogFile) -> None:
    """A log without all that it had not learned by then gives the same answers, to the letter."""
    for t_s in np.random.default_rng(14).uniform(0, 1199, size=2):
        t_ns = to_ns(t_s)
        known = [
            record for record in flown.records(end_ns=t_ns) if record.topic.startswith("/ground/")
        ]
        with log_of(known) as log:
            for aspect in Aspect:
                whole: Reasons = why(flown.as_ground(t_ns), t_ns, aspect)
                assert why(log.as_ground(t_ns), t_ns, aspect) == whole
            for subject in ("command:93", "goal:B", "proposal:3", "event:5", "frame:down:9"):
                assert _answer(log.as_ground(t_ns), subject) == _answer(
                    flown.as_ground(t_ns), subject
                )


def _answer(log: LogFile, subject: str) -> object:
    try:
        return story(log, subject_of(subject))
    except SubjectError as error:
        return str(error)
