"""The state of a run after each entry of its log."""

from typing import Any

from noting import command_sent, log_of, said_of

from farside.control import (
    Chooser,
    CommandStage,
    Mode,
    Verdict,
)
from farside.frames import Fate, LinkOutage, OutageReason
from farside.logs import LinkPicture, LogEntry, Picture, picture_at
from farside.messages import Drive, Proposal
from farside.node import Direction, to_ns
from farside.topics import (
    ActionEnded,
    ActionStarted,
    GoalChange,
    OperatorEntry,
    ProposalEnded,
    ShadowEntry,
    Silence,
)


def picture_of(run: Any) -> Picture:
    picture = Picture()
    for record in run.records:
        picture.apply(LogEntry.of(record))
    return picture


def test_the_places_where_the_rover_has_been_count_as_visited(run: Any) -> None:
    picture = picture_of(run.start("at:D").stand(1, "at:4,1").stand(2, "at:C"))

    assert list(picture.visited) == ["at:D", "at:4,1", "at:C"]
    assert picture.pose is not None
    assert picture.pose.place == "at:C"


def test_the_goal_list_keeps_its_top_goal_first(run: Any) -> None:
    run.start().goal(1, "at:A", priority=1.0).goal(2, "on_charge", priority=0.5)
    assert list(picture_of(run).goals) == [("at:A",), ("on_charge",)]

    run.goal(3, "on_charge", priority=1.5)
    assert list(picture_of(run).goals) == [("on_charge",), ("at:A",)]

    run.reach(4, "on_charge").goal(5, "at:A", change=GoalChange.WITHDRAWN)
    assert picture_of(run).goals == {}


def test_an_action_lasts_until_it_ends(run: Any) -> None:
    started = ActionStarted("N", Chooser.GUIDED, 1, None)

    assert picture_of(run.start().note(1, started)).action == started
    assert picture_of(run.note(3, ActionEnded("N", 2.0, blocked=False))).action is None


def test_a_proposal_lasts_as_long_as_its_goal(run: Any) -> None:
    proposal = Proposal(1, 0, ("at:A",), "N", ())
    run.start().goal(1, "at:A").goal(1, "at:B").note(2, proposal)

    assert picture_of(run.reach(3, "at:B")).proposal == proposal
    assert picture_of(run.reach(4, "at:A")).proposal is None


def test_a_proposal_lasts_until_it_ends_and_not_longer_than_the_next(run: Any) -> None:
    first, second = (Proposal(number, 0, ("at:A",), "N", ()) for number in (1, 2))
    run.start().goal(1, "at:A").note(2, first, second)

    assert picture_of(run.note(3, ProposalEnded(1, "it came late"))).proposal == second
    assert picture_of(run.note(4, ProposalEnded(2, "vetoed by the operator"))).proposal is None


def test_a_goal_put_aside_stays_on_the_list(run: Any) -> None:
    run.start().goal(1, "at:A").goal(2, "at:A", change=GoalChange.SUSPENDED)
    assert list(picture_of(run).goals) == [("at:A",)]

    run.goal(3, "at:A", change=GoalChange.RECOVERED)
    assert list(picture_of(run).goals) == [("at:A",)]


def test_each_direction_counts_its_own_frames(run: Any) -> None:
    run.start().frame(1, Direction.UP).frame(2, Direction.DOWN, Fate.LOST)
    run.frame(3, Direction.DOWN, Fate.OUTAGE).frame(4, Direction.DOWN)
    run.note(5, LinkOutage(Direction.UP, down=True, reason=OutageReason.BLACKOUT))

    assert picture_of(run).link == {
        Direction.UP: LinkPicture(down=True, delivered=1, lost=0),
        Direction.DOWN: LinkPicture(down=False, delivered=1, lost=2),
    }


def test_a_new_priority_for_a_goal_on_the_list_is_no_event(run: Any) -> None:
    run.goal(1, "on_charge", priority=0.1).goal(2, "on_charge", priority=0.2)
    run.reach(3, "on_charge").goal(4, "on_charge", priority=0.1)

    assert [line.text for line in picture_of(run).lines] == [
        "goal on_charge set (operator, priority 0.1)",
        "goal on_charge reached",
        "goal on_charge set (operator, priority 0.1)",
    ]


def test_the_shadow_is_told_of_when_it_falls_out_of_step_and_when_it_is_back(run: Any) -> None:
    def shadow(number: int, why: str | None) -> ShadowEntry:
        return ShadowEntry(number, 1, why is None, why, 5, 9, 1)

    run.note(1, shadow(1, None)).note(2, shadow(2, None), shadow(2, "update 3 is missing"))
    run.note(3, shadow(2, "update 4 is missing")).note(4, shadow(5, None), shadow(6, None))

    assert [line.text for line in picture_of(run).lines] == [
        "the shadow of the model is out of step: update 3 is missing",
        "the shadow of the model is in step",
    ]


def test_what_the_operator_gives_up_is_told_once(run: Any) -> None:
    first, second = "goal A: nothing was proposed", "goal B: no way there is known"
    run.note(1, OperatorEntry(1, 3, "goal A")).note(2, OperatorEntry(1, 3, "goal A", (first,)))
    run.note(3, OperatorEntry(2, 3, "goal B", (first,)))
    run.note(4, OperatorEntry(2, 3, "goal B", (first, second)))

    assert [line.text for line in picture_of(run).lines] == [
        f"gives up {first}",
        f"gives up {second}",
    ]


def test_stored_telemetry_that_comes_later_does_not_make_the_picture_older(run: Any) -> None:
    run.start().hear(50, "at:C", since_s=49).hear(51, "at:A", since_s=10)

    with log_of(run.records) as log:
        telemetry = picture_at(log, to_ns(60)).telemetry
    assert telemetry is not None
    assert telemetry.tokens == ("at:C",)


def test_what_adds_up_is_forgotten_after_ten_minutes(run: Any) -> None:
    run.start("at:C").frame(1, Direction.UP).frame(30, Direction.UP, Fate.LOST)
    run.note(30, Silence(silent=True)).stand(30, "at:A")
    run.note(2, command_sent(1, Drive("E"))).note(2, command_sent(2, Drive("N")))
    run.note(5, said_of(1, CommandStage.DONE, Verdict.ON_TIME, due_s=4.0, so_s=3.0))
    picture = picture_of(run)

    picture.settle(to_ns(629))

    assert list(picture.visited) == ["at:A"]
    assert picture.link[Direction.UP] == LinkPicture(delivered=0, lost=1)
    assert [line.t_ns for line in picture.lines] == [to_ns(30)]
    assert (list(picture.commands.open), list(picture.commands.ended)) == ([2], [])
    assert picture.mode is Mode.GUIDED

    picture.settle(to_ns(631))

    assert (picture.visited, list(picture.lines)) == ({}, [])
    assert picture.link[Direction.UP] == LinkPicture()
    assert picture.pose is not None
    assert picture.pose.place == "at:A"


def test_a_copy_does_not_change_with_the_picture(run: Any) -> None:
    run.start().goal(1, "at:B").frame(1, Direction.UP).note(2, command_sent(1, Drive("E")))
    picture = picture_of(run)
    copy, twin = picture.copy(), picture_of(run)
    twin.chart = picture.chart

    run.reach(3, "at:B").frame(3, Direction.UP).note(3, Silence(silent=True)).stand(3, "at:A")
    run.note(3, said_of(1, CommandStage.TAKEN, Verdict.ON_TIME, due_s=4.0, so_s=3.0))
    for record in run.records:
        picture.apply(LogEntry.of(record))
    picture.settle(to_ns(5000))

    assert copy == twin
