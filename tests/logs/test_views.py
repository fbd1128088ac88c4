"""Queries on small handmade runs."""

import math
from pathlib import Path
from typing import Any

import pytest
from noting import command_sent, failsafe_entry, view_of

from farside.control import CommandStage, Failsafe, Mode, ModeCause
from farside.frames import Fate, LinkOutage, OutageReason
from farside.logs import GoalSpan, LogError, LogFile, ModeSpan, OutageSpan, Recorder, RunView
from farside.logs import open as open_log
from farside.messages import Drive
from farside.node import Direction, Topic
from farside.topics import (
    GROUND_COMMAND,
    GROUND_SILENCE,
    ROVER_COMMAND,
    TRUTH_POSE,
    CommandEntry,
    Cycle,
    GoalChange,
    GoalSource,
    ModeEntry,
    Silence,
)

UP, DOWN = Direction.UP, Direction.DOWN


def test_mode_and_failsafe_over_a_loss_of_the_link(run: Any) -> None:
    run.start()
    run.note(100, failsafe_entry(Failsafe.HOLD, 10.0))
    run.note(
        120, failsafe_entry(Failsafe.ALONE, 30.0), ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST)
    )
    run.note(300, failsafe_entry(), ModeEntry(Mode.GUIDED, ModeCause.OPERATOR))

    view = view_of(run.records)

    assert view.modes == (
        ModeSpan(0.0, Mode.GUIDED, ModeCause.START),
        ModeSpan(120.0, Mode.AUTONOMOUS, ModeCause.LINK_LOST),
        ModeSpan(300.0, Mode.GUIDED, ModeCause.OPERATOR),
    )
    assert [view.mode_at(t_s) for t_s in (0, 119.999999999, 120, 299, 300)] == [
        Mode.GUIDED, Mode.GUIDED, Mode.AUTONOMOUS, Mode.AUTONOMOUS, Mode.GUIDED,
    ]  # fmt: skip
    assert [view.failsafe_at(t_s) for t_s in (99, 100, 120, 300)] == [
        Failsafe.NOMINAL, Failsafe.HOLD, Failsafe.ALONE, Failsafe.NOMINAL,
    ]  # fmt: skip
    assert view.duration_s == 300.0


@pytest.mark.parametrize("t_s", [-0.1, 10.1, math.nan])
def test_a_time_outside_the_run_is_refused(run: Any, t_s: float) -> None:
    view = view_of(run.start().note(10, Silence(silent=True)).records)

    with pytest.raises(ValueError, match=r"expected a time within the run, 0 to 10\.0 s"):
        view.mode_at(t_s)


def test_a_run_without_a_pose_has_no_place(run: Any) -> None:
    with pytest.raises(ValueError, match=r"expected a /truth/pose message at 0 s or before"):
        view_of(run.note(0, Silence(silent=True)).records).place_at(0)


def test_the_place_is_the_true_one(run: Any) -> None:
    view = view_of(run.start("at:D").stand(5, "at:4,3").stand(10, "at:B").records)

    assert [view.place_at(t_s) for t_s in (4.9, 5, 10)] == ["at:D", "at:4,3", "at:B"]


# --- goals -------------------------------------------------------------------------------------


def test_a_goal_counts_as_reached_when_the_truth_agrees(run: Any) -> None:
    run.start().goal(1, "at:B").stand(8, "at:B").reach(9, "at:B")

    assert view_of(run.records).reached("at:B") == 9.0


def test_a_goal_reached_by_the_estimate_alone_does_not_count(run: Any) -> None:
    run.start().goal(1, "at:B").stand(8, "at:5,2").reach(9, "at:B").stand(10, "at:B")

    view = view_of(run.records)

    assert view.reached("at:B") is None
    assert view.goals == (GoalSpan(("at:B",), GoalSource.OPERATOR, 1.0),)


def test_the_first_true_arrival_counts_when_a_goal_is_set_again(run: Any) -> None:
    run.start().goal(1, "at:B").reach(9, "at:B")
    run.goal(10, "at:B").stand(19, "at:B").reach(20, "at:B").goal(21, "at:B").reach(22, "at:B")

    assert view_of(run.records).reached("at:B") == 20.0


def test_being_at_a_place_that_is_no_goal_is_not_reaching_it(run: Any) -> None:
    assert view_of(run.start().stand(8, "at:B").records).reached("at:B") is None


def test_the_tokens_of_a_sign_are_given_in_any_order(run: Any) -> None:
    run.start().goal(1, "at:D", "on_charge").reach(9, "at:D", "on_charge")

    view = view_of(run.records)

    assert view.reached(["on_charge", "at:D"]) == 9.0
    assert view.reached(["on_charge"]) is None


@pytest.mark.parametrize("name", ["at:B", "B", ["B"], ("at:B", "B")])
def test_a_place_can_be_asked_for_by_its_name_or_its_token(run: Any, name: Any) -> None:
    run.start().goal(2, "at:B").stand(9, "at:B").reach(9, "at:B")
    assert view_of(run.records).reached(name) == 9.0


def test_a_token_that_the_rover_senses_can_be_asked_for_though_it_was_no_goal(run: Any) -> None:
    assert view_of(run.start().records).reached("battery:low") is None


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("at:Z", r'expected a place of the map \(A, B, C, D or EAST,NORTH\) .* found "at:Z"$'),
        ("b", r'found "b"; did you mean B\?$'),
        ("at:3,9", r'found "at:3,9"; did you mean 2,3\?$'),
        ("batery:low", r'found "batery:low"; did you mean battery:low\?$'),
        (["at:A", "oncharge"], r'found "oncharge"; did you mean on_charge\?$'),
        ([], "expected one Token at least, found none"),
    ],
)
def test_a_name_that_means_nothing_is_refused_with_the_nearest_that_does(
    run: Any, name: Any, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        view_of(run.start().records).reached(name)


def test_a_misspelt_direction_fate_or_topic_is_refused_with_the_nearest(run: Any) -> None:
    view = view_of(run.start().records)
    with pytest.raises(ValueError, match=r'one of up, down, found "dwn"; did you mean down\?'):
        view.frames("dwn")
    with pytest.raises(ValueError, match=r'found "delievered"; did you mean delivered\?'):
        view.frames(fate="delievered")
    with pytest.raises(ValueError, match=r'found "/rover/modes"; did you mean /rover/mode\?'):
        view.entries(Topic("/rover/modes", ModeEntry))


def test_a_goal_ends_reached_or_withdrawn_and_a_new_priority_is_no_new_goal(run: Any) -> None:
    run.start().goal(1, "at:A").goal(2, "on_charge", source=GoalSource.INHERENT)
    run.goal(3, "on_charge", source=GoalSource.INHERENT, priority=2.0)
    run.goal(4, "at:A", change=GoalChange.WITHDRAWN)
    run.reach(5, "on_charge", source=GoalSource.INHERENT).goal(6, "at:A")

    assert view_of(run.records).goals == (
        GoalSpan(("at:A",), GoalSource.OPERATOR, 1.0, withdrawn_s=4.0),
        GoalSpan(("on_charge",), GoalSource.INHERENT, 2.0, reached_s=5.0),
        GoalSpan(("at:A",), GoalSource.OPERATOR, 6.0),
    )


def test_a_goal_set_by_operator_and_mission_has_a_span_for_each(run: Any) -> None:
    run.start().goal(1, "at:A").goal(2, "at:A", source=GoalSource.MISSION).stand(9, "at:A")
    run.reach(9, "at:A").reach(9, "at:A", source=GoalSource.MISSION)

    assert view_of(run.records).goals == (
        GoalSpan(("at:A",), GoalSource.OPERATOR, 1.0, reached_s=9.0),
        GoalSpan(("at:A",), GoalSource.MISSION, 2.0, reached_s=9.0),
    )


def test_a_goal_put_aside_and_taken_up_again_is_one_goal_all_along(run: Any) -> None:
    run.start().goal(1, "at:A").goal(2, "at:A", change=GoalChange.SUSPENDED)
    run.goal(4, "at:A", change=GoalChange.RECOVERED).stand(9, "at:A").reach(9, "at:A")

    assert view_of(run.records).goals == (
        GoalSpan(("at:A",), GoalSource.OPERATOR, 1.0, reached_s=9.0),
    )


def test_a_mission_goal_withdrawn_before_it_was_on_the_list_was_never_a_goal(run: Any) -> None:
    run.start().goal(1, "at:A", change=GoalChange.WITHDRAWN, source=GoalSource.MISSION)

    assert view_of(run.records).goals == ()


# --- commands and the DEM ----------------------------------------------------------------------


def test_commands_are_listed_as_sent_as_received_and_stage_by_stage(run: Any) -> None:
    order = Drive("N")
    sent = command_sent(1, order)
    taken, waiting = (
        CommandEntry(1, stage, order) for stage in (CommandStage.TAKEN, CommandStage.WAITING)
    )
    expired = CommandEntry(1, CommandStage.EXPIRED, order, "it came too late to begin")
    view = view_of(run.start().note(1, sent).note(5.25, taken, waiting).note(9, expired).records)

    assert view.commands_sent == ((1.0, sent),)
    assert view.commands_taken == ((5.25, taken),)
    assert view.command_stages == ((5.25, taken), (5.25, waiting), (9.0, expired))


def test_topics_are_read_together_in_the_order_of_the_log(run: Any) -> None:
    sent = command_sent(1, Drive("N"))
    taken = CommandEntry(1, CommandStage.TAKEN, sent.order)
    silence = Silence(silent=True)
    view = view_of(run.start().note(2, sent, silence).note(3, taken).note(4, silence).records)

    assert list(view.together(ROVER_COMMAND, GROUND_SILENCE, GROUND_COMMAND)) == [
        (2.0, sent),
        (2.0, silence),
        (3.0, taken),
        (4.0, silence),
    ]


def test_the_state_of_the_dem_is_its_last_cycle(run: Any) -> None:
    last = Cycle(("at:A",), (), (), 2, 1, 0, 74, 212, 0.5)

    assert view_of(run.start().records).dem is None
    assert (
        view_of(run.note(1, Cycle((), (), (), 0, 0, 0, 1, 0, 0.0)).note(2, last).records).dem
        == last
    )


def test_messages_of_a_topic_come_with_their_times(run: Any) -> None:
    view = view_of(run.start("at:D").stand(5, "at:B").records)

    assert [(t_s, pose.place) for t_s, pose in view.entries(TRUTH_POSE)] == [
        (0.0, "at:D"),
        (5.0, "at:B"),
    ]


# --- the link ----------------------------------------------------------------------------------


def test_frames_are_found_by_direction_fate_and_arrival(run: Any) -> None:
    run.start().frame(1, UP).frame(2, UP, Fate.LOST).frame(3, DOWN).frame(4, UP)

    view = view_of(run.records)

    def found(*args: Any, **kwargs: Any) -> list[tuple[Direction, int]]:
        return [(frame.direction, frame.sequence) for frame in view.frames(*args, **kwargs)]

    assert found() == [(UP, 0), (UP, 1), (DOWN, 0), (UP, 2)]
    assert found(UP) == [(UP, 0), (UP, 1), (UP, 2)]
    assert found(fate=Fate.LOST) == [(UP, 1)]
    assert found(DOWN, Fate.LOST) == []
    # Arrivals are at 2.25 s, 4.25 s and 5.25 s.
    assert found(delivered_between=(0, math.inf)) == [(UP, 0), (DOWN, 0), (UP, 2)]
    assert found(delivered_between=(2.25, 4.25)) == [(UP, 0)]
    assert found(UP, delivered_between=(2.5, 5.5)) == [(UP, 2)]


def test_an_interval_that_ends_before_it_starts_is_refused(run: Any) -> None:
    with pytest.raises(
        ValueError, match=r"expected delivered_between to end after it starts, found 2 s to 1 s"
    ):
        view_of(run.start().records).frames(delivered_between=(2, 1))


def test_counters_count_the_fates_of_one_direction(run: Any) -> None:
    run.start().frame(1, UP, size_byte=10).frame(2, UP, size_byte=30).frame(2, DOWN)
    for t_s, fate in ((3, Fate.LOST), (4, Fate.OUTAGE), (5, Fate.QUEUE_FULL), (6, Fate.OUTAGE)):
        run.frame(t_s, UP, fate, size_byte=1)

    counters = view_of(run.records).link_counters(UP)

    assert counters.sent == 6
    assert (counters.delivered, counters.lost, counters.outage, counters.queue_full) == (2, 1, 2, 1)
    assert counters.bytes == 44
    assert counters.delay_s == 1.25


def test_a_direction_in_which_nothing_arrived_has_no_delay(run: Any) -> None:
    assert view_of(run.start().frame(1, UP, Fate.LOST).records).link_counters(UP).delay_s is None


def test_an_outage_lasts_until_its_end_or_the_end_of_the_run(run: Any) -> None:
    def outage(t_s: float, direction: Direction, *, down: bool) -> None:
        run.note(t_s, LinkOutage(direction, down, OutageReason.BLACKOUT))

    run.start()
    outage(10, DOWN, down=True)
    outage(10, UP, down=True)
    outage(20, DOWN, down=False)
    outage(30, UP, down=False)
    outage(40, DOWN, down=True)
    run.note(60, Silence(silent=True))

    assert view_of(run.records).outages == (
        OutageSpan(UP, 10.0, 30.0),
        OutageSpan(DOWN, 10.0, 20.0),
        OutageSpan(DOWN, 40.0, 60.0),
    )


# --- from a file -------------------------------------------------------------------------------


def test_an_unfinished_log_gives_the_same_answers_as_a_finished_one(
    run: Any, path: Path, tmp_path: Path
) -> None:
    run.start().goal(1, "at:B").frame(2, UP).stand(8, "at:B").reach(9, "at:B")
    run.note(10, LinkOutage(UP, down=True, reason=OutageReason.BLACKOUT), Silence(silent=True))
    unfinished = Recorder(tmp_path / "unfinished.mcap")
    unfinished.write(run.records)
    unfinished.close(packed=False)

    def answers(view: RunView) -> list[Any]:
        return [
            view.modes, view.goals, view.outages, view.frames(), view.link_counters(UP),
            view.place_at(5), view.reached("at:B"), view.duration_s, view.entries(GROUND_SILENCE),
        ]  # fmt: skip

    assert not LogFile(unfinished.path).complete
    assert answers(open_log(unfinished.path)) == answers(open_log(run.log(path)))


def test_a_view_of_a_missing_log_is_refused(path: Path) -> None:
    with pytest.raises(LogError):
        open_log(path)
