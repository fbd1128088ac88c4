"""A whole run with a person at the ground: it succeeds, and its log verifies."""

from sitting import Sitting

from farside.missions.reliving.verifying import verify
from farside.missions.run import FinishedRun
from farside.node import to_ns


def test_a_person_who_sees_only_the_screen_meets_all_that_the_mission_expects(
    afternoon: tuple[FinishedRun, Sitting],
) -> None:
    run, sitting = afternoon

    assert run.result.outcome == "success", run.result.expectations
    assert not [line for line in sitting.replies if line.startswith("not ")]


def test_the_log_of_a_run_with_a_person_verifies(afternoon: tuple[FinishedRun, Sitting]) -> None:
    run, _ = afternoon

    assert verify(run.log).equal


def test_nobody_is_told_what_the_rover_did_in_the_silence_before_it_can_be_known(
    afternoon: tuple[FinishedRun, Sitting],
) -> None:
    run, sitting = afternoon
    assert run.mode_at(700) == "autonomous"

    in_silence = [one for one in sitting.screens if to_ns(660) < one.now_ns < to_ns(980)]
    back = sitting.screens[-1]

    assert len(in_silence) > 300
    assert {screen.mode.text for screen in in_silence} == {"SHARED"}
    assert not any("reached at:B" in str(screen.events) for screen in in_silence)
    assert any("meanwhile" in event.text for event in back.events)
