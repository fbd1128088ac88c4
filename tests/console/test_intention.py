"""What pushing a stick means: what it orders, and above all what it does not."""

from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.console.screen.screen import OptionRow
from farside.console.stick.cues import TABLE
from farside.console.stick.intention import (
    Approve,
    Button,
    Choose,
    Felt,
    Intention,
    Order,
    Reading,
    Situation,
    Veto,
)
from farside.ground.view.view import OptionKind

POLL_NS = 8_000_000
QUIET_NS = 500_000_000


def situation(proposal: int | None = None, **kinds: str) -> Situation:
    """The four actions, free but for those named."""
    return Situation(
        tuple(
            OptionRow(action, OptionKind(kinds.get(action, "free")), 0.5, "does", "a wall")
            for action in "NESW"
        ),
        proposal,
    )


CALM = situation()


class Hand:
    """A hand on a stick, polled as a device polls."""

    def __init__(self, shown: Situation = CALM) -> None:
        self.shown = shown
        self.now_ns = 0
        self.intention = Intention()
        self.orders: list[Order] = []
        self.notes: list[str] = []
        self.hold(0, 0, QUIET_NS)

    def hold(self, x: float, y: float, for_ns: int = POLL_NS) -> Felt:
        """Hold the stick there; what is felt in the end."""
        for _ in range(-(-for_ns // POLL_NS)):
            self.now_ns += POLL_NS
            reading = self.intention.move(self.now_ns, x, y, self.shown)
            self._take(reading)
        return reading.felt

    def press(self, button: Button) -> None:
        self._take(self.intention.press(self.now_ns, button, self.shown))

    def _take(self, reading: Reading) -> None:
        self.orders += [reading.order] if reading.order else []
        self.notes += [reading.note] if reading.note else []


@pytest.mark.parametrize(
    ("x", "y", "action"), [(0, 1, "N"), (1, 0, "E"), (0, -1, "S"), (-1, 0, "W")]
)
def test_a_push_chooses_the_action_in_its_direction_once(x: int, y: int, action: str) -> None:
    hand = Hand()

    hand.hold(0.79 * x, 0.79 * y)
    assert not hand.orders
    hand.hold(0.81 * x, 0.81 * y, 10 * QUIET_NS)
    assert hand.orders == [Choose(action, insist=False)]


def test_a_second_choice_needs_the_stick_to_come_back() -> None:
    hand = Hand()
    for back, orders in ((0.41, 1), (0.39, 2)):
        hand.hold(0, 1)
        hand.hold(0, back)
        hand.hold(1, 0)
        assert len(hand.orders) == orders


def test_a_push_between_two_actions_chooses_neither() -> None:
    hand = Hand()

    hand.hold(1, 1, QUIET_NS)
    hand.hold(-0.9, 0.6, QUIET_NS)

    assert not hand.orders


def test_a_stick_that_stands_out_when_it_is_plugged_in_orders_nothing() -> None:
    hand = Hand()
    hand.intention = Intention()

    hand.hold(0, 0.7, 10 * QUIET_NS)
    hand.hold(0, 1, 10 * QUIET_NS)

    assert not hand.orders


def test_an_invalid_action_takes_full_force_for_a_second() -> None:
    hand = Hand(situation(E="invalid"))

    hand.hold(0.9, 0, 10 * QUIET_NS)
    hand.hold(1, 0, 2 * QUIET_NS - POLL_NS)
    hand.hold(0.9, 0)
    hand.hold(1, 0, 2 * QUIET_NS)
    assert not hand.orders
    assert hand.notes == [
        "not ordered: E is resisted: a wall; full deflection for 1 s insists",
    ]
    hand.hold(1, 0)
    assert hand.orders == [Choose("E", insist=True)]
    hand.hold(0, 0)
    hand.hold(1, 0)
    assert len(hand.notes) == 2


def test_force_against_one_action_is_none_against_the_next() -> None:
    hand = Hand(situation(N="invalid", E="invalid"))

    hand.hold(1, 0, 2 * QUIET_NS)
    hand.hold(0, 1)

    assert not hand.orders


def test_the_proposed_action_is_approved_by_holding_it_and_not_by_passing_by() -> None:
    hand = Hand(situation(14, E="proposed"))

    hand.hold(1, 0, QUIET_NS - POLL_NS)
    hand.hold(0.7, 0)
    hand.hold(1, 0, QUIET_NS)
    assert not hand.orders
    hand.hold(1, 0)
    assert hand.orders == [Approve(14)]


def test_another_action_overrides_at_once() -> None:
    hand = Hand(situation(14, E="proposed"))

    hand.hold(0, 0.85)

    assert hand.orders == [Choose("N", insist=False)]


def test_the_pull_with_no_hand_on_the_stick_is_no_consent() -> None:
    """The motors draw the stick as far as they can, and it stays there for a minute."""
    hand = Hand(situation(14, E="proposed"))
    pull = TABLE.forms[OptionKind.PROPOSED].force.centre

    hand.hold(pull, 0, 60 * QUIET_NS)
    assert not hand.orders
    hand.hold(1, 0, QUIET_NS + POLL_NS)
    assert hand.orders == [Approve(14)]


def test_a_push_for_one_proposal_never_answers_the_next() -> None:
    hand = Hand(situation(14, E="proposed"))

    hand.hold(1, 0, QUIET_NS - POLL_NS)
    hand.shown = situation(15, E="proposed")
    hand.hold(1, 0, 10 * QUIET_NS)

    assert not hand.orders


def test_the_buttons_answer_the_proposal_that_has_stood_for_half_a_second() -> None:
    hand = Hand()
    hand.press(Button.APPROVE)
    hand.shown = situation(14, E="proposed")
    hand.press(Button.APPROVE)
    hand.hold(0, 0, QUIET_NS)
    hand.press(Button.APPROVE)
    hand.press(Button.VETO)

    assert hand.orders == [Approve(14), Veto(14)]
    assert hand.notes == [
        "not ordered: no proposal waits for an answer",
        "not ordered: the options changed just now; look, and press again",
    ]


def test_what_is_felt_is_the_nearest_option_and_else_the_pull_of_the_proposal() -> None:
    hand = Hand(situation(14, N="invalid", E="proposed", S="problematic"))

    pull = hand.hold(0, 0)
    assert (pull.action, pull.cue.kind, pull.near) == ("E", OptionKind.PROPOSED, 0.0)
    assert hand.hold(0, 0.5).action == "N"
    assert hand.hold(0, -0.3).near < hand.hold(0, -0.6).near < hand.hold(0, -0.75).near < 1.0
    assert hand.hold(-1, 0) == pull
    assert not Hand().hold(0, 1).action


def test_a_new_proposal_is_felt_anew_although_nobody_touches_the_stick() -> None:
    hand = Hand(situation(14, E="proposed"))

    assert hand.hold(0, 0, QUIET_NS).since_ns < hand.now_ns - QUIET_NS
    hand.shown = situation(15, E="proposed")
    assert hand.hold(0, 0).since_ns == hand.now_ns


def test_a_cue_begins_when_the_stick_enters_it_and_does_not_flutter_on_a_diagonal() -> None:
    hand = Hand(situation(N="invalid", E="problematic"))

    entered = hand.hold(0, 0.5).since_ns
    assert entered == hand.now_ns
    assert {hand.hold(0.5 + 0.01 * wobble, 0.5).since_ns for wobble in (1, -1, 2, -2)} == {entered}
    assert hand.hold(0.5, 0.2).action == "E"


unit = st.floats(-1, 1)
situations = st.builds(
    lambda proposal, kinds: situation(proposal, **dict(zip("NESW", kinds, strict=True))),
    st.none() | st.integers(1, 3),
    st.lists(
        st.sampled_from(["free", "free", "problematic", "proposed", "invalid"]),
        min_size=4,
        max_size=4,
    ),
)
steps = st.lists(
    st.tuples(
        st.one_of(unit, st.sampled_from([-1.0, 0.0, 1.0])),
        st.one_of(unit, st.sampled_from([0.0, 0.0, 1.0])),
        st.sampled_from([POLL_NS, QUIET_NS - POLL_NS, QUIET_NS, 2 * QUIET_NS]),
        st.none() | situations,
    ),
    max_size=8,
)


def played(
    moves: Iterable[tuple[float, float, int, Situation | None]],
) -> list[tuple[int, float, Situation, Order | None]]:
    """What every poll led to: the time, how far out the stick was, the situation, the order."""
    intention, shown, now_ns = Intention(), CALM, 0
    polls = []
    for x, y, for_ns, news in [(0.0, 0.0, QUIET_NS, CALM), *moves]:
        shown = news or shown
        for _ in range(4):
            now_ns += for_ns // 4
            order = intention.move(now_ns, x, y, shown).order
            polls.append((now_ns, max(abs(x), abs(y)), shown, order))
    return polls


@given(steps)
def test_no_order_breaks_a_law(moves: list[tuple[float, float, int, Situation | None]]) -> None:
    """One a deflection, none within half a second of a change, and only of what is shown."""
    spent, changed_ns, before = False, 0, CALM
    for now_ns, out, shown, order in played(moves):
        spent = spent and out >= TABLE.thresholds.back_below
        changed_ns = now_ns if shown.meaning != before.meaning else changed_ns
        before = shown
        if order is None:
            continue
        assert not spent
        assert now_ns - changed_ns >= QUIET_NS
        kinds = {option.action: option.kind for option in shown.options}
        match order:
            case Approve(number):
                assert number == shown.proposal
            case Choose(action, insist):
                assert insist == (kinds[action] is OptionKind.INVALID)
        spent = True


@given(steps)
def test_a_stick_that_is_silent_consents_to_nothing(
    moves: list[tuple[float, float, int, Situation | None]],
) -> None:
    """However long, whatever is proposed: short of choosing there is no order at all."""
    reach = TABLE.thresholds.choose_at - 0.001
    polls = played([(x * reach, y * reach, for_ns, news) for x, y, for_ns, news in moves])

    assert not [order for _, _, _, order in polls if order]
