"""Surprises found in the logs of small handmade runs, and runs that hold none."""

from collections.abc import Sequence

import msgspec
import pytest
from noting import command_sent, failsafe_entry, records_of, view_of

from farside.control import Chooser, CommandStage, Failsafe, Mode, ModeCause
from farside.messages import (
    Approve,
    Drive,
    Order,
    Override,
    Proposal,
    SetMode,
    TakeBack,
    Tokens,
    Veto,
)
from farside.missions.surprises import Surprise, surprises
from farside.topics import (
    ActionStarted,
    CommandEntry,
    CommandSent,
    GoalChange,
    GoalEntry,
    GoalSource,
    ModeEntry,
    ProposalEnded,
    Silence,
)

Entry = tuple[float, msgspec.Struct]

TAKEN, WAITING, BEGUN, DONE, FAILED, REFUSED, EXPIRED, WITHDRAWN, SUPERSEDED = CommandStage

NORTH = Drive("N")
LAMP = ("at:B",)


def found(*entries: Entry) -> list[Surprise]:
    """The surprises of a run of 100 s that holds these messages, each with its log time."""
    start = [(0.0, ModeEntry(Mode.GUIDED, ModeCause.START)), (0.0, failsafe_entry())]
    end = (100.0, Silence(silent=False))
    messages = [*start, *entries, end]
    return list(surprises(view_of(records_of(sorted(messages, key=lambda entry: entry[0])))))


def given(
    t_s: float, number: int = 1, order: Order = NORTH, *, expires_s: float = 1000.0
) -> tuple[float, CommandSent]:
    """The ground gives a command."""
    return (t_s, command_sent(number, order, expires_s=expires_s))


def on_board(
    t_s: float, *stages: CommandStage, number: int = 1, order: Order = NORTH
) -> list[Entry]:
    """A command goes through these stages, all at the same time."""
    return [(t_s, CommandEntry(number, stage, order)) for stage in stages]


def driven(t_s: float, action: str = "N", number: int = 1) -> Entry:
    """The rover begins an action for a command."""
    return (t_s, ActionStarted(action, Chooser.GUIDED, number, None))


def own(
    t_s: float, goal: Tokens | None = LAMP, *, chooser: Chooser = Chooser.GOAL_DIRECTED
) -> Entry:
    """The rover begins a move of its own."""
    return (t_s, ActionStarted("N", chooser, None, goal))


def goal(t_s: float, change: GoalChange = GoalChange.SET, *tokens: str) -> Entry:
    return (t_s, GoalEntry(tokens or LAMP, change, 1.0, GoalSource.OPERATOR))


def mode(t_s: float, to: Mode, why: ModeCause = ModeCause.OPERATOR) -> Entry:
    return (t_s, ModeEntry(to, why))


def failsafe(t_s: float, state: Failsafe, silence_s: float = 0.0) -> Entry:
    return (t_s, failsafe_entry(state, silence_s))


def proposed(t_s: float, number: int = 1, *, veto_window_s: float | None = None) -> Entry:
    """The rover proposes to drive north to the lamp."""
    return (t_s, Proposal(number, 0, LAMP, "N", (), veto_window_s))


def proposal_ended(t_s: float, why: str, number: int = 1) -> Entry:
    return (t_s, ProposalEnded(number, why))


# --- nothing to be surprised at ----------------------------------------------------------------


@pytest.mark.parametrize(
    "entries",
    [
        [],
        [
            given(1),
            *on_board(3, TAKEN, WAITING),
            *on_board(5, BEGUN),
            driven(5),
            *on_board(9, DONE),
        ],
        [given(1), *on_board(3, TAKEN, WAITING, BEGUN), driven(3), *on_board(9, FAILED)],
        [given(1), *on_board(3, TAKEN, WAITING, BEGUN), driven(3)],
        [given(1), *on_board(3, TAKEN, WAITING)],
        [given(1), *on_board(3, TAKEN, REFUSED)],
        [given(1), *on_board(3, TAKEN, WAITING, REFUSED)],
        [given(1, expires_s=2), *on_board(3, TAKEN, EXPIRED)],
        [given(1, expires_s=4), *on_board(3, TAKEN, WAITING), *on_board(4.1, EXPIRED)],
        [
            given(1),
            given(2, 2, TakeBack(1)),
            *on_board(3, TAKEN, WAITING),
            *on_board(4, TAKEN, number=2, order=TakeBack(1)),
            *on_board(4, WITHDRAWN),
            *on_board(4, DONE, number=2, order=TakeBack(1)),
        ],
        [given(1), *on_board(3, TAKEN, WAITING), *on_board(33, SUPERSEDED)],
        [given(1, expires_s=5), *on_board(3, TAKEN, WAITING), *on_board(5, BEGUN), driven(5)],
        [given(1, expires_s=99.5), *on_board(3, TAKEN, WAITING)],
        [given(1)],
    ],
    ids=[
        "a quiet run",
        "a command done",
        "a command that failed",
        "a command under way",
        "a command that waits",
        "a command refused at once",
        "a command refused as it was to begin",
        "a command that came too late",
        "a command that waited for too long",
        "a command taken back",
        "a command superseded",
        "a command begun at the last moment",
        "a command that has just expired",
        "a command that never arrived",
    ],
)
def test_no_life_of_a_command_surprises_that_goes_from_taken_to_its_end(
    entries: Sequence[Entry],
) -> None:
    assert found(*entries) == []


LOST = [
    goal(1),
    failsafe(40, Failsafe.HOLD, 10),
    failsafe(60, Failsafe.ALONE, 30),
    mode(60, Mode.AUTONOMOUS, ModeCause.LINK_LOST),
]
"""The link is lost, and the rover takes over with a goal."""


def test_what_the_rover_does_alone_for_a_goal_does_not_surprise() -> None:
    assert found(*LOST, own(60), own(64, chooser=Chooser.EXPLORATORY)) == []
    way_back = goal(60, GoalChange.SET, "link:up")
    assert found(*LOST, way_back, own(60, ("link:up",), chooser=Chooser.RETURNING)) == []


def test_nor_what_it_does_in_autonomous_mode_that_the_operator_ordered() -> None:
    order = SetMode(Mode.AUTONOMOUS)
    ordered = [given(1, order=order), *on_board(3, TAKEN, DONE, order=order)]
    assert found(*ordered, mode(3, Mode.AUTONOMOUS), goal(4), own(4)) == []


def test_nor_what_the_operator_confirms_when_the_link_is_back() -> None:
    back = [failsafe(70, Failsafe.HOLD), mode(80, Mode.AUTONOMOUS), failsafe(80, Failsafe.NOMINAL)]
    assert found(*LOST, own(60), *back, own(80)) == []


def test_nor_what_it_does_for_a_goal_given_as_tokens_in_any_order() -> None:
    charge = goal(1, GoalChange.SET, "on_charge", "at:D")
    assert found(charge, mode(2, Mode.AUTONOMOUS), own(3, ("at:D", "on_charge"))) == []


def test_nor_a_goal_put_aside_while_it_explores_for_it() -> None:
    aside = [goal(1), goal(2, GoalChange.SUSPENDED), mode(2, Mode.AUTONOMOUS)]
    assert found(*aside, own(3, chooser=Chooser.EXPLORATORY)) == []


SHARED = [goal(1), mode(1, Mode.SHARED)]


def test_nor_what_the_operator_approves_or_orders_in_place_of_it() -> None:
    orders = Approve(1), Override(2, "E")
    approved = [
        proposed(2),
        given(4, 1, orders[0]),
        *on_board(6, TAKEN, WAITING, order=orders[0]),
        proposal_ended(6, "command 1 came in between"),
        *on_board(6, BEGUN, order=orders[0]),
        driven(6),
        *on_board(10, DONE, order=orders[0]),
    ]
    overridden = [
        proposed(10, 2),
        given(12, 2, orders[1]),
        *on_board(14, TAKEN, WAITING, BEGUN, number=2, order=orders[1]),
        driven(14, "E", 2),
    ]
    assert found(*SHARED, *approved, *overridden) == []


def test_nor_a_proposal_carried_out_when_its_veto_window_is_over() -> None:
    consented = [*SHARED, proposed(2, 2, veto_window_s=10.1)]
    assert found(*consented, proposal_ended(12.1, "no veto came", 2), own(12.1)) == []
    assert found(*consented, proposal_ended(5, "the answer came too late", 1), own(12.1)) == []


# --- commands ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("entries", "surprise"),
    [
        (
            [given(1), *on_board(3, WAITING)],
            (3.0, "command 1 waiting without being taken"),
        ),
        (
            [given(1), *on_board(3, TAKEN), *on_board(4, TAKEN), *on_board(4, REFUSED)],
            (4.0, "command 1 taken twice"),
        ),
        (
            [given(1), *on_board(3, TAKEN), *on_board(4, BEGUN)],
            (4.0, "command 1 went from taken to begun"),
        ),
        (
            [given(1), *on_board(3, TAKEN, REFUSED), *on_board(4, BEGUN)],
            (4.0, "command 1 went from refused to begun"),
        ),
        (
            [given(1), *on_board(3, TAKEN, WAITING, BEGUN), driven(3), *on_board(4, SUPERSEDED)],
            (4.0, "command 1 went from begun to superseded"),
        ),
        (
            [given(1, expires_s=4), *on_board(3, TAKEN, WAITING), *on_board(5, BEGUN), driven(5)],
            (5.0, "command 1 begun after it expired at 4.0 s"),
        ),
        (
            [given(1), *on_board(3, TAKEN)],
            (100.0, "command 1 taken, and nothing became of it"),
        ),
        (
            [given(1, expires_s=60), *on_board(3, TAKEN, WAITING)],
            (100.0, "command 1 waits though it expired at 60.0 s"),
        ),
        (
            [given(1), *on_board(3, TAKEN, WAITING), driven(3)],
            (3.0, "action N for command 1, which did not begin"),
        ),
        (
            [driven(3)],
            (3.0, "action N for command 1, which did not begin"),
        ),
        (
            [given(1), *on_board(3, TAKEN, WAITING, BEGUN), driven(3), driven(7)],
            (7.0, "action N for command 1, which had its action before"),
        ),
        (
            [given(1), *on_board(3, TAKEN, WAITING, BEGUN), driven(3, "E")],
            (3.0, "action E for command 1, which orders N"),
        ),
        (
            [
                given(1, order=Approve(7)),
                *on_board(3, TAKEN, WAITING, BEGUN, order=Approve(7)),
                driven(3),
            ],
            (3.0, "action N for command 1, which orders none"),
        ),
    ],
    ids=lambda value: value[1] if isinstance(value, tuple) else "",
)
def test_a_command_surprises(entries: Sequence[Entry], surprise: tuple[float, str]) -> None:
    assert found(*entries) == [Surprise(*surprise)]


@pytest.mark.parametrize("before", [[], [given(50)], [given(1, order=Drive("S"))]])
def test_a_command_surprises_that_nobody_gave(before: Sequence[Entry]) -> None:
    assert found(*before, *on_board(3, TAKEN), *on_board(4, REFUSED)) == [
        Surprise(3.0, "command 1 taken, though nobody gave it"),
        Surprise(4.0, "command 1 refused, though nobody gave it"),
    ]


def test_what_is_approved_is_the_action_that_was_proposed() -> None:
    approved = [proposed(2), given(4, order=Approve(1))]
    begun = on_board(6, TAKEN, WAITING, BEGUN, order=Approve(1))
    assert found(*SHARED, *approved, *begun, driven(6, "S")) == [
        Surprise(6.0, "action S for command 1, which orders N")
    ]


# --- actions of the rover's own ----------------------------------------------------------------


@pytest.mark.parametrize(
    ("entries", "what"),
    [
        ([own(50, None)], "action N without an order or a goal"),
        ([goal(1), own(50, chooser=Chooser.GUIDED)], "action N without an order or a goal"),
        ([own(50)], "action N for at:B, which is no goal"),
        (
            [mode(1, Mode.AUTONOMOUS), own(50, ("at:D", "on_charge"))],
            "action N for at:D + on_charge, which is no goal",
        ),
        (
            [mode(1, Mode.AUTONOMOUS), goal(1), goal(49, GoalChange.REACHED), own(50)],
            "action N for at:B, which is no goal",
        ),
        (
            [mode(1, Mode.AUTONOMOUS), goal(1), goal(49, GoalChange.WITHDRAWN), own(50)],
            "action N for at:B, which is no goal",
        ),
        ([goal(1), own(50)], "action N of the rover's own in mode guided, failsafe nominal"),
        (
            [goal(1), mode(1, Mode.AUTONOMOUS), failsafe(40, Failsafe.HOLD, 10), own(50)],
            "action N of the rover's own in mode autonomous, failsafe hold",
        ),
        (
            [goal(1), mode(1, Mode.AUTONOMOUS), failsafe(40, Failsafe.SAFE), own(50)],
            "action N of the rover's own in mode autonomous, failsafe safe",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_an_action_of_the_rovers_own_surprises(entries: Sequence[Entry], what: str) -> None:
    assert found(*entries) == [Surprise(50.0, what)]


def test_going_on_alone_when_the_link_is_back_surprises() -> None:
    assert found(*LOST, own(60), failsafe(70, Failsafe.HOLD), own(70)) == [
        Surprise(70.0, "action N of the rover's own in mode autonomous, failsafe hold")
    ]


@pytest.mark.parametrize(
    "entries",
    [
        [own(50)],
        [proposed(2), own(50)],
        [proposed(45, veto_window_s=10), own(50)],
        [(2.0, Proposal(1, 0, LAMP, "S", (), 10.0)), own(50)],
        [goal(1, GoalChange.SET, "at:A"), proposed(2, veto_window_s=10), own(50, ("at:A",))],
        [
            proposed(2, veto_window_s=10),
            given(30, order=Veto(1)),
            *on_board(50, TAKEN, order=Veto(1)),
            proposal_ended(50, "vetoed by the operator"),
            *on_board(50, DONE, order=Veto(1)),
            own(50),
        ],
        [proposed(2, veto_window_s=10), proposal_ended(20, "late"), own(50)],
    ],
    ids=[
        "no proposal",
        "a proposal that wants approval",
        "a window that is still open",
        "another action than proposed",
        "another goal than proposed",
        "a veto in the last moment",
        "a proposal that stands no more",
    ],
)
def test_in_shared_mode_an_action_surprises_without_consent(entries: Sequence[Entry]) -> None:
    assert found(*SHARED, *entries) == [
        Surprise(50.0, "action N of the rover's own in mode shared without the operator's consent")
    ]


def test_consent_is_good_for_one_action_in_shared_mode_and_not_in_silence() -> None:
    consented = [*SHARED, proposed(2, veto_window_s=10), own(20)]
    without = "action N of the rover's own in mode shared without the operator's consent"
    assert found(*consented, own(24)) == [Surprise(24.0, without)]
    assert found(*consented[:-1], failsafe(19, Failsafe.HOLD, 10), own(20)) == [
        Surprise(20.0, "action N of the rover's own in mode shared, failsafe hold")
    ]
    assert found(*consented[:-1], mode(19, Mode.GUIDED), own(20)) == [
        Surprise(20.0, "action N of the rover's own in mode guided, failsafe nominal")
    ]


def test_surprises_come_in_order_and_what_is_left_comes_last() -> None:
    waits = [given(1, expires_s=60), *on_board(3, TAKEN, WAITING)]
    assert found(*waits, own(9), own(5, None)) == [
        Surprise(5.0, "action N without an order or a goal"),
        Surprise(9.0, "action N for at:B, which is no goal"),
        Surprise(100.0, "command 1 waits though it expired at 60.0 s"),
    ]
