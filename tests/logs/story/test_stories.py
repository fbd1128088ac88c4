"""The life of one thing, told line by line."""

import msgspec
import pytest
from noting import command_sent, log_of, records_of

from farside.acts import Planned
from farside.control import CommandStage, Failsafe, Mode, OnLoss
from farside.frames import Carried, FrameEvent, FrameStage
from farside.logs import LogFile
from farside.logs.story import Kind, Story, Subject, SubjectError, story, story_lines, subject_of
from farside.messages import Drive, Event, GoalReached, SetOnLoss, Telemetry
from farside.node import Direction, Journal, Role, to_ns
from farside.topics import (
    ROVER_FRAME,
    CommandEntry,
    EventLearned,
    GoalChange,
    GoalEntry,
    GoalSource,
    HeldEntry,
    HeldFate,
    OrderGiven,
)


def told(log: LogFile, subject: str) -> Story:
    return story(log, subject_of(subject))


def lines(found: Story) -> list[str]:
    """The rows as they are printed, but for the column of waits."""
    return [f"{when} {side}: {text}" for when, _, side, text in story_lines(found)]


def test_a_command_caught_in_the_blackout(flown: LogFile) -> None:
    """It is done as the link fails; the ground learns so six minutes later."""
    found = told(flown, "command:93")
    assert found.title == (
        "command 93: approve proposal 14 - done at 621.6 s, known at the ground at 985.5 s"
    )
    assert lines(found) == [
        "617.36 s ground: the operator approves proposal 14 (S)",
        (
            "617.36 s ground: command 93 is given, to arrive at 619.4 s and be done at 621.6 s "
            "by plan; it may begin until 642.0 s"
        ),
        (
            "617.36 s ground: command 93 leaves in frame up:1074 "
            "(0.24 s in the transmit queue, 0.49 s to send)"
        ),
        "619.36 s rover: frame up:1074 arrives after 1.28 s of light time",
        "619.40 s rover: command 93 is taken",
        "619.40 s rover: command 93 begins",
        "619.40 s rover: event 186 (it is begun) leaves in frame down:1244 (13 ms to send)",
        "620.69 s ground: frame down:1244 arrives after 1.28 s of light time",
        "620.72 s ground: the ground learns that it began at 619.4 s, 1.32 s later",
        "621.64 s rover: command 93 is done: S took 2.24 s",
        "621.84 s rover: event 187 (it is done) leaves in frame down:1253 (13 ms to send)",
        "621.85 s link: frame down:1253 is lost to the blackout",
        "629.08 s ground: command 93 overdue: should have been done by 622.6 s, no word",
        (
            "981.44 s rover: event 186 (it is begun) is sent 89 times more, up to frame down:1825, "
            "though it had arrived"
        ),
        (
            "981.64 s rover: event 187 (it is done) leaves in frame down:1827, sent for the 2nd "
            "time as its arrival was not reported (13 ms to send)"
        ),
        "982.93 s ground: frame down:1827 arrives after 1.28 s of light time",
        "985.52 s ground: the ground learns that it was done at 621.6 s, 363.9 s later",
        "985.52 s ground: command 93 done on time after all",
    ]


def test_as_the_ground_only_what_it_could_know_is_told(flown: LogFile) -> None:
    found = told(flown.as_ground(), "command:93")
    assert {line.side for line in found.lines} == {Role.GROUND}
    assert "617.36 s ground: command 93 leaves in frame up:1074" in lines(found)
    assert not any("lost" in line.text or "light time" in line.text for line in found.lines)


def test_before_the_word_came_the_ground_knows_less(flown: LogFile) -> None:
    found = told(flown.as_ground(700_000_000_000), "command:93")
    assert found.title == "command 93: approve proposal 14 - not known to be over"
    assert lines(found)[-1] == (
        "629.08 s ground: command 93 overdue: should have been done by 622.6 s, no word"
    )


def test_an_event_that_waits_for_those_before_it(flown: LogFile) -> None:
    assert lines(told(flown, "event:187")) == [
        "621.64 s rover: command 93 (approve proposal 14) is done",
        "621.84 s rover: event 187 leaves in frame down:1253 (13 ms to send)",
        "621.85 s link: frame down:1253 is lost to the blackout",
        (
            "981.64 s rover: event 187 leaves in frame down:1827, sent for the 2nd time as its "
            "arrival was not reported (13 ms to send)"
        ),
        "982.93 s ground: frame down:1827 arrives after 1.28 s of light time",
        (
            "985.52 s ground: the ground learns of event 187, which was so at 621.6 s, 363.9 s "
            "later, 2.59 s after it arrived: it is delivered after those before it"
        ),
    ]


def test_a_proposal_with_its_grounds_and_what_the_operator_made_of_it(flown: LogFile) -> None:
    found = told(flown, "proposal:3")
    assert found.title == (
        "proposal 3: W, towards at:A - ended at 481.6 s: overridden by command 81"
    )
    told_lines = lines(found)
    assert told_lines[:5] == [
        (
            "478.44 s rover: decides on W, goal-directed, towards at:A, and puts it before the "
            "operator as proposal 3"
        ),
        "478.44 s rover: because at:4,4 ∧ W → at:3,4 (C_m 0.75, cost to go 35.5 s)",
        (
            "478.44 s rover: the runner-up is at:4,4 ∧ E → at:5,4 (C_m 0.75, cost to go 42.2 s), "
            "6.7 s dearer"
        ),
        "478.44 s rover: proposal 3 leaves in frame down:1005 (54 ms to send)",
        "479.77 s ground: frame down:1005 arrives after 1.28 s of light time",
    ]
    assert "479.80 s ground: the operator overrides proposal 3 (W)" in told_lines
    assert "485.48 s rover: command 81 is done: E took 3.80 s" in told_lines


def test_a_proposal_that_the_blackout_kept_from_the_operator(flown: LogFile) -> None:
    """It ended on board before it could be shown; its frames are counted, not listed."""
    found = lines(told(flown, "proposal:15"))
    assert "630.00 s rover: proposal 15 ends: the situation is another one" in found
    again = [line for line in found if "times more" in line]
    assert len(again) == 2, "a row for each of its two parts"
    assert len(found) < 20


def test_a_goal_from_the_order_to_the_ground_knowing_that_it_is_reached(flown: LogFile) -> None:
    found = told(flown, "goal:B")
    assert found.title == "goal at:B - reached at 713.2 s"
    told_lines = lines(found)
    for line in (
        "600.00 s ground: the operator orders: goal at:B, priority 2",
        "601.84 s rover: goal at:B set (operator, priority 2)",
        "601.84 s rover: at:B is the top-goal; 48 Signs can reach it",
        "603.40 s ground: telemetry of 602.0 s tells the ground that it is a goal",
        (
            "605.40 s rover: 3 actions towards it, goal-directed, with the operator's consent: "
            "E S S; cost to go 139.7 s at first; the last begins at 619.4 s"
        ),
        (
            "650.00 s rover: 24 actions towards it, goal-directed, on its own: "
            "S S E E E E N N N E S E and 12 more; cost to go 123.8 s at first; "
            "the last begins at 710.0 s"
        ),
        "713.20 s rover: goal at:B reached",
        (
            "985.52 s ground: the ground learns that it was reached at 713.2 s, 272.3 s later "
            "(event 191)"
        ),
    ):
        assert line in told_lines


def test_a_mission_goal_says_why_it_came_on_the_list(flown: LogFile) -> None:
    assert lines(told(flown, "goal:C"))[0] == (
        "650.00 s rover: goal at:C set (mission, priority 1), since failsafe alone: "
        "the link is lost, after 30.0 s of silence"
    )


def test_a_frame_and_the_other_attempts_at_the_same(flown: LogFile) -> None:
    found = told(flown, "frame:down:1300")
    assert found.title == "frame down:1300: event 186, sent 8 × - lost to the blackout"
    assert lines(found) == [
        "619.40 s rover: command 93 (approve proposal 14) begins",
        "619.40 s rover: event 186 leaves in frame down:1244 (13 ms to send)",
        "620.69 s ground: frame down:1244 arrives after 1.28 s of light time",
        (
            "652.00 s rover: event 186 leaves in frame down:1300, sent for the 8th time as its "
            "arrival was not reported (13 ms to send)"
        ),
        "652.01 s link: frame down:1300 is lost to the blackout",
    ]


def test_a_story_for_programs(flown: LogFile) -> None:
    found = msgspec.json.decode(msgspec.json.encode(told(flown, "frame:up:1102").as_json))
    assert found["subject"] == "frame:up:1102"
    assert found["lines"][0] == {
        "t_s": 658.0,
        "side": "ground",
        "text": "heartbeat leaves in frame up:1102 (0.46 s to send)",
    }


def test_an_order_that_was_held_until_the_link_was_up() -> None:
    """It waits at the ground, then on board for its turn, and is refused."""
    order, drive = SetOnLoss(OnLoss.HOLD), Drive("E")
    noted = [
        (10.0, OrderGiven(Planned(order, link_up=True))),
        (10.0, HeldEntry(1, (order,), HeldFate.HELD)),
        (11.0, OrderGiven(Planned(drive, follows=True))),
        (11.0, HeldEntry(1, (order, drive), HeldFate.HELD)),
        (22.5, HeldEntry(1, (order, drive), HeldFate.RELEASED, (1, 2))),
        (22.5, command_sent(1, order)),
        (22.5, command_sent(2, drive, due_s={CommandStage.TAKEN: 24, CommandStage.DONE: 27})),
        (24.0, CommandEntry(2, CommandStage.TAKEN, drive)),
        (24.0, CommandEntry(2, CommandStage.WAITING, drive)),
        (25.0, CommandEntry(2, CommandStage.REFUSED, drive, "the battery is flat")),
    ]
    with log_of(records_of(noted)) as log:
        assert lines(told(log, "command:2")) == [
            "11.00 s ground: the operator orders: drive E, after the order before it",
            "22.50 s ground: the link is up: it is sent after 11.50 s of waiting at the ground",
            (
                "22.50 s ground: command 2 is given, to arrive at 24.0 s and be done at 27.0 s by "
                "plan; it may begin until 1000.0 s"
            ),
            "24.00 s rover: command 2 is taken",
            "25.00 s rover: command 2 (drive E) refused: the battery is flat",
        ]
        assert told(log, "command:1").title.endswith(" - never arrived")


# --- what is asked for ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "subject"),
    [
        ("command:12", Subject(Kind.COMMAND, 12)),
        ("frame:down:7", Subject(Kind.FRAME, 7, Direction.DOWN)),
        ("goal:B", Subject(Kind.GOAL, tokens=("B",))),
        ("goal:on_charge+at:D", Subject(Kind.GOAL, tokens=("at:D", "on_charge"))),
    ],
)
def test_how_a_subject_is_written(text: str, subject: Subject) -> None:
    assert subject_of(text) == subject
    assert subject_of(str(subject)) == subject


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("comand:1", "did you mean command"),
        ("command", "expected a whole number after command:"),
        ("command:-1", "expected a whole number after command:"),
        ("command:²", "expected a whole number after command:"),
        ("command:" + "9" * 5000, "expected a whole number after command:"),
        ("frame:17", "expected a frame such as frame:up:17"),
        ("frame:dawn:17", "did you mean down"),
        ("goal:", "expected a goal such as goal:B"),
        ("goal:A+", "expected a goal such as goal:B"),
        ("", "expected command:NUMBER"),
    ],
)
def test_what_is_no_subject(text: str, message: str) -> None:
    with pytest.raises(SubjectError) as refusal:
        subject_of(text)
    assert message in str(refusal.value)


@pytest.mark.parametrize(
    ("changes", "ending"),
    [
        ([("set", "operator")], " - still a goal at the end of the log"),
        ([("set", "operator"), ("reached", "operator")], " - reached at 1.0 s"),
        (
            [("set", "operator"), ("reached", "operator"), ("set", "operator")],
            " - still a goal at the end of the log",
        ),
        (
            [("set", "operator"), ("set", "mission"), ("withdrawn", "operator")],
            " - still a goal at the end of the log",
        ),
        ([("withdrawn", "mission")], " - withdrawn at 0.0 s"),
    ],
)
def test_how_a_goal_ended(changes: list[tuple[str, str]], ending: str) -> None:
    """It is over once nobody wants it, and not over if it was set again."""
    noted = [
        (float(t_s), GoalEntry(("at:B",), GoalChange(change), 1.0, GoalSource(source)))
        for t_s, (change, source) in enumerate(changes)
    ]
    with log_of(records_of(noted)) as log:
        assert told(log, "goal:B").title == f"goal at:B{ending}"


def test_the_title_of_a_goal_tells_what_the_ground_knows(flown: LogFile) -> None:
    titles = {t_s: told(flown.as_ground(to_ns(t_s)), "goal:B").title for t_s in (602, 900, 990)}
    assert titles == {
        602: "goal at:B - not known to be reached",
        900: "goal at:B - a goal by the newest telemetry, of 619.8 s",
        990: "goal at:B - reached at 713.2 s, known at the ground at 985.5 s",
    }


@pytest.mark.parametrize(
    ("reached_s", "ending"),
    [
        (3, "a goal by the newest telemetry, of 4.0 s"),
        (5, "reached at 5.0 s, known at the ground at 9.0 s"),
    ],
)
def test_the_newest_word_of_a_goal_counts(reached_s: int, ending: str) -> None:
    """It was reached after the newest telemetry, or set again before that."""
    reached = Event(1, to_ns(reached_s), GoalReached(("at:B",)))
    heard = Telemetry(
        to_ns(4), ("at:A",), 1.5, 2.5, 0.0, 1.0, Mode.GUIDED, Failsafe.NOMINAL, None, (("at:B",),),
        0,
    )  # fmt: skip
    with log_of(records_of([(8, heard), (9, EventLearned(reached))])) as log:
        assert told(log.as_ground(to_ns(9)), "goal:B").title == f"goal at:B - {ending}"


def test_a_frame_that_is_lost_at_once_leaves_before_it_is_lost() -> None:
    def frame(stage: FrameStage) -> FrameEvent:
        return FrameEvent(
            Direction.DOWN, 3, stage, 40, "Telemetry", carries=(Carried("telemetry"),)
        )

    journal = Journal()
    for stage in (FrameStage.MADE, FrameStage.SHADOWED):
        journal.note(ROVER_FRAME, frame(stage), log_time_ns=to_ns(5))
    with log_of(journal.take()) as log:
        assert lines(told(log, "frame:down:3")) == [
            "5.00 s rover: telemetry leaves in frame down:3",
            "5.00 s link: frame down:3 is lost in terrain shadow",
        ]


@pytest.mark.parametrize(
    ("subject", "message"),
    [
        ("command:95", "there is no command 95: the ground gave commands 1 to 94"),
        ("proposal:16", "there is no proposal 16: the rover made proposals up to 15"),
        ("event:1000", "there is no event 1000: the ground learned of events up to 198"),
        ("goal:BB", "the goals are at:A, at:B, at:C; did you mean at:B?"),
        ("frame:up:5000", "those of the log are up to up:1501"),
    ],
)
def test_what_there_is_instead_of_what_there_is_not(
    flown: LogFile, subject: str, message: str
) -> None:
    with pytest.raises(SubjectError) as refusal:
        told(flown, subject)
    assert message in str(refusal.value)


@pytest.mark.parametrize(
    ("t_s", "subject", "message"),
    [
        (0, "frame:down:1", "the ground knows of no frame down:1: it knows of none"),
        (500, "frame:down:5000", "the ground knows of no frame down:5000: those that it knows of"),
    ],
)
def test_a_frame_that_the_ground_knows_nothing_of_may_exist(
    flown: LogFile, t_s: int, subject: str, message: str
) -> None:
    with pytest.raises(SubjectError, match=message):
        told(flown.as_ground(to_ns(t_s)), subject)


def test_an_empty_log_has_nothing_to_tell_of() -> None:
    with log_of(()) as log:
        for subject in ("command:1", "proposal:1", "event:1", "goal:B", "frame:up:1"):
            with pytest.raises(SubjectError):
                told(log, subject)
