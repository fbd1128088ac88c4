"""Consent by veto: silence is consent only where the operator is known to have been asked."""

from collections.abc import Callable

from farside.control import Chooser, CommandStage, Mode
from farside.messages import Approve, Drive, Override, SetGoal, SetMode, Veto
from farside.node import to_ns
from farside.rover.config import ConsentConfig
from farside.topics import ROVER_ACTION_ENDED, ROVER_ACTION_STARTED, ROVER_PROPOSAL_ENDED
from tests.rover.conftest import Bench

ROUND = "NNEEEEESSNNWWWWWSS"  # from the dock to C and back: everything there is to know
VETO = {"by": "veto", "veto_window_s": 10.0}


def asked(bench: Callable[..., Bench], **consent: object) -> Bench:
    """A rover in shared mode that has made its first proposal, on its way to C."""
    rover = bench(consent={**VETO, **consent})
    rover.do(ROUND)
    rover.order(SetMode(Mode.SHARED))
    rover.order(SetGoal(("at:C",), 1.0))
    rover.until(lambda: rover.proposals)
    return rover


def moves(rover: Bench) -> int:
    return len(rover.of(ROVER_ACTION_STARTED)) - len(ROUND)


def test_the_window_does_not_run_before_the_operator_was_shown_the_proposal(
    bench: Callable[..., Bench],
) -> None:
    rover = asked(bench)
    assert rover.proposals[0].veto_window_s == 10.0
    rover.run_s(60)
    assert moves(rover) == 0
    assert len(rover.proposals) == 1, "it stands"
    rover.show(1)
    rover.run_s(9)
    assert moves(rover) == 0
    rover.run_s(5)
    assert moves(rover) == 1
    assert rover.of(ROVER_ACTION_STARTED)[-1].chooser is Chooser.GOAL_DIRECTED


def test_it_is_a_round_trip_and_a_margin_long_at_least(bench: Callable[..., Bench]) -> None:
    rover = asked(bench, veto_window_s=0.1)
    assert rover.proposals[0].veto_window_s == 4.0
    assert ConsentConfig().by.value == "approval", "which is what missions have by default"


def test_a_veto_in_time_is_the_end_of_it_and_nothing_is_proposed_again_there(
    bench: Callable[..., Bench],
) -> None:
    rover = asked(bench)
    rover.show(1)
    rover.run_s(8)
    rover.order(Veto(1))
    rover.run_s(60)
    assert moves(rover) == 0
    assert len(rover.proposals) == 1
    assert rover.of(ROVER_PROPOSAL_ENDED)[-1].why == "vetoed by the operator"
    rover.do("N")
    rover.until(lambda: rover.proposals[-1].number == 2)


def test_the_window_stops_when_the_link_does(bench: Callable[..., Bench]) -> None:
    rover = asked(bench)
    rover.show(1)
    rover.run_s(6)
    rover.link_up = False
    rover.run_s(20)
    assert moves(rover) == 0
    rover.link_up = True
    rover.run_s(3)
    assert moves(rover) == 0, "silence is not consent"


def test_the_window_does_not_end_while_a_command_is_missing(bench: Callable[..., Bench]) -> None:
    """Heartbeats say that a command is under way: it may be the veto."""
    rover = asked(bench)
    rover.show(1)
    rover.run_s(1)
    rover.given_but_not_arrived = 1
    rover.run_s(60)
    assert moves(rover) == 0
    rover.given_but_not_arrived = 0
    rover.order(Veto(1))
    rover.run_s(20)
    assert moves(rover) == 0


def test_approval_and_another_action_need_no_window(bench: Callable[..., Bench]) -> None:
    rover = asked(bench)
    rover.order(Approve(1))
    rover.until(lambda: len(rover.proposals) == 2)
    rover.order(Override(2, "S"))
    rover.until(lambda: len(rover.proposals) == 3)
    started = rover.of(ROVER_ACTION_STARTED)[-2:]
    assert [(one.action, one.chooser) for one in started] == [
        ("N", Chooser.GOAL_DIRECTED),
        ("S", Chooser.GUIDED),
    ]


def test_a_proposal_dies_with_the_situation_it_was_made_for(bench: Callable[..., Bench]) -> None:
    rover = asked(bench)
    rover.show(1)
    rover.run_s(5)
    rover.order(Drive("N"))
    rover.run_s(20)
    assert moves(rover) == 1, "the operator's own"
    assert rover.of(ROVER_PROPOSAL_ENDED)[0].why.endswith("came in between")


def test_an_answer_that_came_too_late_does_not_leave_it_standing_for_ever(
    bench: Callable[..., Bench],
) -> None:
    rover = asked(bench, by="approval")
    rover.order(Approve(1), expires_s=1.0)
    rover.until(lambda: len(rover.proposals) == 2)
    assert rover.of(ROVER_PROPOSAL_ENDED)[0].why == "the answer came too late"
    rover.order(Approve(2))
    rover.until(lambda: moves(rover) == 1)


def test_the_model_may_propose_again_what_was_just_given_up_and_the_word_counts(
    bench: Callable[..., Bench],
) -> None:
    """It has learned from the failure: a gate that refused would refuse for ever."""
    rover = bench(faults=[{"what": "tilt", "start_s": 100.0, "end_s": 110.0}])
    rover.do(ROUND)
    rover.order(SetMode(Mode.SHARED))
    rover.order(SetGoal(("at:C",), 1.0))
    rover.until(lambda: rover.now_ns > to_ns(99))
    rover.order(Approve(rover.proposals[-1].number))
    rover.until(lambda: rover.now_ns > to_ns(105))
    assert rover.telemetry.tilt_rad == 0.8
    rover.until(lambda: rover.now_ns > to_ns(115))
    ended = rover.of(ROVER_ACTION_ENDED)[-1]
    assert (ended.action, ended.blocked) == ("N", True), "given up, as it tilted"
    assert rover.telemetry.tilt_rad is None, "it stands level again"
    again = rover.proposals[-1]
    assert again.action == "N"
    number = rover.order(Approve(again.number))
    rover.until(lambda: rover.telemetry.commands_done >= number)
    assert rover.end_of(number).stage is CommandStage.DONE


def test_with_a_reserve_left_it_proposes_the_way_it_came(bench: Callable[..., Bench]) -> None:
    """The model knows no way home, since it was never driven there; the track is known."""
    rover = bench(battery={"capacity_j": 4_000.0, "idle_w": 5.0, "low": 0.05})
    rover.do("NNEEE")
    rover.order(SetMode(Mode.SHARED))
    rover.until(lambda: rover.proposals, within_s=600)
    proposal = rover.proposals[-1]
    assert (proposal.goal, proposal.action, proposal.path) == (("on_charge",), "W", ())
    rover.order(Approve(proposal.number))
    rover.run_s(10)
    assert rover.of(ROVER_ACTION_STARTED)[-1].chooser is Chooser.RETURNING
