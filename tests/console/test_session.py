"""A person at the ground station: what each key orders, and when it orders nothing."""

import math

import msgspec
import pytest
from ground_stories import noted, seen, way
from msgspec.structs import replace
from noting import command_sent, records_of, said_of

from farside.acts import Act, Discard, Planned
from farside.console.pacing import Until
from farside.console.screen.screen import Screen, Tone
from farside.console.session import Session
from farside.control import CommandStage, Failsafe, Mode, ModeCause, OnLoss, TakeBackChance, Verdict
from farside.ground.view.view import GroundView, Option, OptionKind, Way
from farside.messages import (
    Approve,
    Drive,
    Override,
    Proposal,
    SetGoal,
    SetMode,
    TakeBack,
    Telemetry,
    Veto,
    WithdrawGoal,
)
from farside.node import to_ns
from farside.topics import (
    BeliefEntry,
    HeldEntry,
    HeldFate,
    Known,
    LearnedBy,
    Likely,
    ModeEntry,
    PathReview,
    Pose,
    Yard,
)

YARD = Yard(("#####", "#A.B#", "#####"), 1.0)
OPTIONS = (
    Option("N", OptionKind.INVALID, 1.0, ("a wall is there on the chart",)),
    Option("E", OptionKind.PROPOSED, 0.0, ("proposed",), (Likely(("at:2,1",), 0.9),), 0.1),
    Option("S", OptionKind.INVALID, 1.0, ("a wall is there on the chart",)),
    Option("W", OptionKind.FREE),
)


def believed(mode: Mode, proposal: int | None) -> BeliefEntry:
    by = LearnedBy.TELEMETRY
    return BeliefEntry((), mode=Known(mode, 0, 0, by), proposal=Known(proposal, 0, 0, by))


def heard(proposal: int | None = None) -> Telemetry:
    return Telemetry(
        to_ns(9), ("at:A",), 1.5, 1.5, 0.0, 0.92, Mode.SHARED, Failsafe.NOMINAL, None, (), 0,
        proposal=proposal,
    )  # fmt: skip


def offered(number: int) -> Proposal:
    return Proposal(number, to_ns(8), ("at:B",), "E", ())


def reviewed(number: int) -> PathReview:
    return PathReview(("at:B",), "E", (), 2.0, 24.1, 0.7, 0.83, proposal=number, in_step=True)


class AtTheGround:
    """A session ten seconds into a run, that has heard the rover."""

    def __init__(self, mode: Mode = Mode.GUIDED, proposal: int | None = None) -> None:
        self.session = Session("crossing", to_ns(100))
        messages: list[msgspec.Struct] = [YARD, heard(proposal), believed(mode, proposal)]
        if proposal is not None:
            messages.append(offered(proposal))
        self.note(*messages)
        review = None if proposal is None else reviewed(proposal)
        self.see(replace(seen(10), options=OPTIONS, review=review))

    def note(self, *messages: msgspec.Struct, t_s: float = 10) -> None:
        self.session.take(to_ns(t_s), noted(t_s, *messages))

    def see(self, view: GroundView) -> None:
        self.view = view
        self.session.see(view)

    @property
    def screen(self) -> Screen:
        return self.session.screen()

    def ordered(self) -> list[Act]:
        return self.session.orders()


def test_an_arrow_drives_where_nothing_is_proposed() -> None:
    ground = AtTheGround()

    assert ground.session.choose("W") == "drives W"
    assert ground.ordered() == [Drive("W")]


def test_what_was_ordered_goes_out_once() -> None:
    ground = AtTheGround()
    ground.session.choose("W")
    ground.ordered()

    assert ground.ordered() == []


def test_an_arrow_into_a_wall_orders_nothing_and_says_why() -> None:
    ground = AtTheGround()

    said = ground.session.choose("N")

    assert said.startswith("not ordered: N: a wall is there on the chart")
    assert ground.ordered() == []


def test_who_insists_drives_into_it_and_the_rover_is_told_so() -> None:
    ground = AtTheGround()
    ground.session.choose("N", insist=True)

    assert ground.ordered() == [Drive("N", force=True)]


def test_another_arrow_overrides_the_proposal_and_its_own_approves_it() -> None:
    ground = AtTheGround(Mode.SHARED, proposal=14)
    assert ground.session.choose("W") == "overrides proposal 14 with W"
    assert ground.ordered() == [Override(14, "W")]

    ground = AtTheGround(Mode.SHARED, proposal=14)
    assert ground.session.choose("E") == "approves proposal 14: E"
    assert ground.ordered() == [Approve(14)]


def test_an_answer_goes_to_the_proposal_that_was_seen_or_to_none() -> None:
    ground = AtTheGround(Mode.SHARED, proposal=14)

    assert ground.session.approve(13) == "not approved: proposal 14 stands now, not 13"
    assert ground.session.veto(15) == "not vetoed: proposal 14 stands now, not 15"
    assert ground.ordered() == []
    ground.session.veto(14)
    assert ground.ordered() == [Veto(14)]


def test_a_proposal_is_answered_once() -> None:
    ground = AtTheGround(Mode.SHARED, proposal=14)
    ground.session.approve(14)

    assert ground.session.veto(14).startswith("not vetoed: proposal 14 is approved")
    assert ground.screen.proposal.answered == "approved, goes out when time goes on"

    assert ground.ordered() == [Approve(14)]
    ground.note(command_sent(92, Approve(14), due_s={CommandStage.BEGUN: 12}), t_s=11)
    assert ground.screen.proposal.answered == "approved by command 92, begins in 1.0 s"
    assert not ground.screen.proposal.can_answer


def test_an_answer_that_came_to_nothing_can_be_given_again() -> None:
    ground = AtTheGround(Mode.SHARED, proposal=14)
    ground.note(command_sent(92, Approve(14)), t_s=11)
    refused = said_of(92, CommandStage.EXPIRED, Verdict.LATE, due_s=12, so_s=13, why="too late")
    ground.note(refused, t_s=15)

    assert ground.screen.proposal.can_answer


def test_without_a_proposal_there_is_nothing_to_answer() -> None:
    assert AtTheGround().session.approve(1) == "not approved: no proposal stands"


def test_a_goal_is_set_by_the_name_of_its_place() -> None:
    ground = AtTheGround()
    assert ground.session.set_goal("B") == "sets goal B, priority 2"
    ground.session.withdraw_goal(("at:B",))

    assert ground.ordered() == [SetGoal(("at:B",), 2.0), WithdrawGoal(("at:B",))]


def test_a_place_that_is_not_on_the_map_is_no_goal() -> None:
    ground = AtTheGround()

    assert ground.session.set_goal("Q").startswith("not ordered: expected a place of the map")
    assert ground.ordered() == []


def test_what_waits_while_time_stands_can_be_given_up() -> None:
    ground = AtTheGround()
    ground.session.pause()
    ground.session.set_mode(Mode.SHARED)
    ground.session.choose("W")
    assert [(row.text, row.words) for row in ground.screen.commands] == [
        ("drive W", ("goes out when time goes on",)),
        ("mode shared", ("goes out when time goes on",)),
    ]
    assert (ground.screen.on_the_way, ground.screen.waiting) == (0, 2)
    assert "2 orders go out when time goes on" in ground.screen.if_nothing

    assert ground.session.take_back() == "given up here: drive W"
    assert ground.session.discard(-1) == "given up here: mode shared"
    assert ground.session.discard(-1) == "not given up: it has gone out"
    assert ground.ordered() == []


def test_who_gives_up_what_has_gone_out_meanwhile_hits_nothing_else() -> None:
    ground = AtTheGround()
    ground.session.set_mode(Mode.SHARED)
    seen_as = ground.screen.commands[0].held
    ground.ordered()
    ground.session.set_goal("B")

    assert ground.session.discard(seen_as) == "not given up: it has gone out"
    assert ground.ordered() == [SetGoal(("at:B",), 2.0)]


def test_escape_takes_back_the_newest_that_can_be_and_no_command_twice() -> None:
    ground = AtTheGround()
    ground.note(command_sent(1, Drive("E")), command_sent(2, Drive("E")))
    ground.note(
        said_of(1, take_back=TakeBackChance.TOO_LATE),
        said_of(2, take_back=TakeBackChance.SURE, until_s=12),
    )

    assert ground.session.take_back() == "takes back command 2: in time, if nothing is lost"
    assert ground.ordered() == [TakeBack(2)]
    ground.note(command_sent(3, TakeBack(2)))
    assert ground.session.take_back() == "not taken back: nothing is on its way that can be"
    assert ground.session.take_back(1).startswith("not taken back: command 1 has begun")
    assert not any(row.can_take_back for row in ground.screen.commands)
    assert ground.ordered() == []


def test_into_silence_a_move_is_not_ordered_and_a_setting_waits_for_the_link() -> None:
    ground = AtTheGround()
    ground.see(replace(ground.view, silent_since_ns=to_ns(5)))

    assert ground.session.choose("W").startswith("not ordered: the rover is silent")
    ground.session.set_on_loss(OnLoss.HOLD)
    ground.session.set_mode(Mode.GUIDED)
    assert [act.link_up for act in ground.ordered() if isinstance(act, Planned)] == [True, True]
    ground.session.choose("W", insist=True)
    assert ground.ordered() == [Drive("W")]


def test_into_silence_no_proposal_is_answered_and_who_insists_drives() -> None:
    ground = AtTheGround(Mode.SHARED, proposal=14)
    ground.see(replace(ground.view, silent_since_ns=to_ns(5)))
    assert not ground.screen.proposal.can_answer

    assert ground.session.approve(14) == "not ordered: the rover is silent"
    assert ground.session.veto(14) == "not ordered: the rover is silent"
    assert ground.session.choose("E").startswith("not ordered: the rover is silent. Shift")
    assert ground.ordered() == []
    ground.session.choose("E", insist=True)
    assert ground.ordered() == [Drive("E")]


def test_what_is_held_at_the_ground_can_be_given_up() -> None:
    ground = AtTheGround()
    ground.note(HeldEntry(1, (SetMode(Mode.GUIDED),), HeldFate.HELD))
    assert ground.screen.commands[0].held == 1

    ground.session.discard(1)

    assert ground.ordered() == [Discard(1)]
    ground.note(HeldEntry(2, (SetGoal(("at:B",), 2.0),), HeldFate.HELD))
    assert ground.session.withdraw_goal(("at:B",)) == "withdraws goal B"
    assert ground.session.withdraw_goal(("at:A",)).startswith("not withdrawn")


def test_in_autonomous_mode_an_arrow_says_that_it_takes_over() -> None:
    ground = AtTheGround(Mode.AUTONOMOUS)

    does = {option.action: option.does for option in ground.screen.options}
    assert does["W"] == "takes over from the model: drives W"


def test_a_move_behind_another_says_so() -> None:
    ground = AtTheGround()
    ground.note(command_sent(1, Drive("E")))

    assert ground.session.choose("W") == "drives W after command 1"


def test_when_the_run_is_over_nothing_is_ordered() -> None:
    ground = AtTheGround()
    assert ground.screen.if_nothing.startswith("If you do nothing: ")
    ground.session.choose("W")
    ground.session.finish("The run is over: success.")

    assert ground.session.set_mode(Mode.SHARED) == "not ordered: the run is over"
    assert ground.ordered() == []
    assert ground.screen.if_nothing == "The run is over: success."


def test_once_the_ground_is_lost_it_says_so_and_orders_nothing() -> None:
    ground = AtTheGround()
    ground.session.choose("W")
    ground.session.see(None)
    ground.note(t_s=50)

    assert ground.session.set_mode(Mode.SHARED) == "not ordered: the ground's process is lost"
    assert ground.ordered() == []
    assert ground.screen.if_nothing.startswith("The ground's process is lost")
    assert ground.screen.standing == ground.screen.if_nothing
    assert ground.screen.map.heard_label == "as of 41.0 s ago"


def test_what_is_no_priority_no_speed_and_no_goal_is_refused() -> None:
    ground = AtTheGround()

    assert ground.session.set_goal("B", math.inf).startswith("not ordered: expected a priority")
    assert ground.session.set_speed(math.nan).startswith("not set: expected a speed from 0.1 to")
    assert ground.session.withdraw_goal(("x" * 1000,)).startswith("not withdrawn")
    assert ground.ordered() == []
    assert ground.session.pacing.speed == 1


def test_the_end_of_the_mission_is_no_contact() -> None:
    ground = AtTheGround()
    ground.see(replace(ground.view, up=way(is_open=False, changes_s=99, light_s=1)))

    assert ("up", "closed by plan") in [(said.name, said.text) for said in ground.screen.link]
    assert ground.session.warp(Until.CONTACT).startswith("not warped")


def test_a_warp_to_a_contact_needs_a_plan_with_one() -> None:
    ground = AtTheGround()

    assert ground.session.warp(Until.CONTACT).startswith("not warped")
    assert ground.session.pacing.until is None


def test_time_is_not_warped_to_an_arrival_when_the_rover_waits_for_orders() -> None:
    """It would pass up to an alarm, or to the end of the mission."""
    ground = AtTheGround()
    assert ground.session.warp(Until.ARRIVAL).startswith("not warped: nothing is on its way")

    ground.session.choose("W")
    assert ground.session.warp(Until.ARRIVAL) == "time passes until something arrives"


def test_time_stands_until_somebody_is_here_and_nobody_else_sets_it_going() -> None:
    ground = AtTheGround()
    ground.session.pacing.stand_by()
    assert ground.screen.paused
    ground.session.greet()
    assert not ground.screen.paused

    ground.session.pause()
    ground.session.greet()
    assert ground.screen.paused


def test_nothing_but_what_the_ground_noted_is_read() -> None:
    ground, other = AtTheGround(), AtTheGround()
    truth = [Pose(3.5, 1.5, 0, 0, "at:B", 0.1), ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST)]
    ground.session.take(to_ns(10), records_of((10, message) for message in truth))

    assert ground.screen == other.screen


@pytest.mark.parametrize("action", ["", "X", "north"])
def test_an_action_that_there_is_not_orders_nothing(action: str) -> None:
    ground = AtTheGround()

    assert ground.session.choose(action).startswith("not ordered")
    assert ground.ordered() == []


@pytest.mark.parametrize(
    ("rest_s", "up", "text", "tone"),
    [
        (None, way(), "92 %", Tone.PLAIN),
        (20_000.0, way(), "92 %", Tone.PLAIN),
        (6_300.0, way(), "92 %, 1:45:00 at rest", Tone.PLAIN),
        (500.0, way(), "92 %, 8:20 at rest", Tone.CAUTION),
        (6_300.0, way(is_open=False, changes_s=7_000.0), "92 %, 1:45:00 at rest", Tone.CAUTION),
    ],
    ids=["on the dock", "for long", "for a while", "not for long", "not until the next contact"],
)
def test_a_battery_that_will_not_last_is_told_before_it_is_low(
    rest_s: float | None, up: Way, text: str, tone: Tone
) -> None:
    ground = AtTheGround()
    ground.see(replace(ground.view, rest_s=rest_s, up=up))

    said = next(said for said in ground.screen.rover if said.name == "battery")
    assert (said.text, said.tone) == (text, tone)


def test_a_screen_crosses_to_a_page_whole() -> None:
    screen = AtTheGround(Mode.SHARED, proposal=14).screen

    assert msgspec.json.decode(msgspec.json.encode(screen), type=Screen) == screen
