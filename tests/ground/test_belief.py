"""What the ground believes: item by item, as of when, and how stale."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.control import BatteryState, Failsafe, Mode, ModeCause
from farside.frames import OutageReason
from farside.ground.belief import HISTORY, Belief
from farside.ground.downlink import DownlinkPlan
from farside.link import Blackout, LinkConfig, LinkTerms, OneWay
from farside.messages import BatteryChanged, Event, GoalReached, Happening, ModeChanged
from farside.node import Journal, to_ns
from farside.topics import GROUND_BELIEF, BeliefItem, LearnedBy
from tests.ground.conftest import make_belief, telemetry

GAP = Blackout(start_s=100.0, end_s=200.0, reason=OutageReason.PASS)


def link(*gaps: Blackout, delay_s: float = 1.0, rate_bit_s: int | None = None) -> LinkConfig:
    way = OneWay(delay_s=delay_s, rate_bit_s=rate_bit_s)
    return LinkConfig(up=way, down=way, blackouts=gaps)


def event(number: int, t_s: float, what: Happening) -> Event:
    return Event(number, to_ns(t_s), what)


def test_an_item_says_when_it_was_so_when_it_was_learned_and_by_what() -> None:
    belief = make_belief()
    belief.learn(telemetry(5.0, "B"), to_ns(6.2))

    place = belief.now.place
    assert (place.value, place.so_ns, place.learned_ns) == ("at:B", to_ns(5.0), to_ns(6.2))
    assert place.by is LearnedBy.TELEMETRY


def test_older_telemetry_does_not_overwrite_newer() -> None:
    belief = make_belief()
    belief.learn(telemetry(5.0, "B"), to_ns(6.0))
    belief.learn(telemetry(4.0, "A"), to_ns(6.1))

    assert belief.telemetry.tokens == ("at:B",)
    assert belief.now.place.value == "at:B"


def test_what_was_stored_fills_the_history_and_never_the_present() -> None:
    belief = make_belief()
    belief.learn(telemetry(5.0, "A"), to_ns(6.0))
    belief.learn(telemetry(60.0, "B"), to_ns(300.0), stored=True)

    assert belief.now.place.value == "at:A"
    assert belief.telemetry.time_ns == to_ns(5.0)
    assert belief.was(to_ns(59.0)).tokens == ("at:A",)
    assert belief.was(to_ns(61.0)).tokens == ("at:B",)
    assert belief.was(to_ns(4.0)) is None


def test_an_event_tells_what_telemetry_had_not_yet() -> None:
    belief = make_belief()
    belief.learn(telemetry(5.0), to_ns(6.0))
    belief.tell(event(1, 5.5, ModeChanged(Mode.AUTONOMOUS, ModeCause.LINK_LOST)), to_ns(6.5))
    belief.learn(telemetry(5.2), to_ns(6.6))

    mode = belief.now.mode
    assert (mode.value, mode.so_ns, mode.by) == (Mode.AUTONOMOUS, to_ns(5.5), LearnedBy.EVENT)
    assert belief.now.place.so_ns == to_ns(5.2)


def test_an_event_that_comes_late_does_not_overwrite_newer_telemetry() -> None:
    belief = make_belief()
    belief.learn(telemetry(50.0, battery=0.8), to_ns(51.0))
    belief.tell(event(1, 9.0, BatteryChanged(BatteryState.LOW, 0.2)), to_ns(52.0))

    assert belief.now.battery.value == 0.8


def test_an_item_is_stale_once_something_newer_was_due() -> None:
    belief = make_belief()
    belief.learn(telemetry(5.0), to_ns(6.0))
    belief.look(to_ns(6.0))
    assert not belief.now.stale

    belief.look(to_ns(8.0))  # the next report, a second later, a light time, and a second to spare
    assert not belief.now.stale
    belief.look(to_ns(8.0) + 1)
    assert set(belief.now.stale) == set(BeliefItem)

    belief.learn(telemetry(9.0), to_ns(10.0))
    belief.look(to_ns(10.0))
    assert not belief.now.stale


def test_each_item_grows_stale_by_itself() -> None:
    belief = make_belief()
    belief.learn(telemetry(5.0), to_ns(6.0))
    belief.tell(event(1, 7.0, ModeChanged(Mode.SHARED, ModeCause.OPERATOR)), to_ns(8.0))
    belief.look(to_ns(9.0))

    assert belief.is_stale(BeliefItem.PLACE)
    assert not belief.is_stale(BeliefItem.MODE)


def test_nothing_is_stale_while_the_contact_plan_explains_the_silence() -> None:
    belief = make_belief(link(GAP))
    belief.learn(telemetry(99.5), to_ns(100.5))
    belief.look(to_ns(201.5))
    assert not belief.now.stale

    belief.look(to_ns(204.0))
    assert belief.now.stale


def test_at_twenty_minutes_what_is_as_new_as_can_be_is_not_stale() -> None:
    belief = make_belief(link(delay_s=1200.0))
    belief.learn(telemetry(5.0), to_ns(1205.0))
    belief.look(to_ns(1206.0))

    assert not belief.now.stale


def test_on_a_slow_link_reports_are_due_when_the_rate_lets_them_through() -> None:
    slow = make_belief(link(rate_bit_s=300))
    slow.learn(telemetry(5.0), to_ns(18.0))
    slow.look(to_ns(30.0))

    assert not slow.now.stale


def test_what_is_believed_is_noted_when_it_changes_and_when_it_grows_stale() -> None:
    terms = LinkTerms.simulated(link(), seed=1)
    journal = Journal()
    belief = Belief(DownlinkPlan(terms), journal)
    for t_s, place in ((1.0, "A"), (2.0, "A"), (3.0, "B")):
        journal.now_ns = to_ns(t_s + 1)
        belief.learn(telemetry(t_s, place), journal.now_ns)
        belief.look(journal.now_ns)
    journal.now_ns = to_ns(9.0)
    belief.look(journal.now_ns)

    noted = [
        (record.log_time_ns, GROUND_BELIEF.decode(record.payload)) for record in journal.take()
    ]
    assert [(t_ns, entry.place.value, bool(entry.stale)) for t_ns, entry in noted] == [
        (to_ns(2.0), "at:A", False),
        (to_ns(4.0), "at:B", False),
        (to_ns(9.0), "at:B", True),
    ]


def test_goals_known_to_be_reached_are_remembered_by_the_event_that_told() -> None:
    belief = make_belief()
    belief.tell(event(1, 2.0, GoalReached(("at:B",))), to_ns(3.0))
    assert belief.reached(("at:B",))
    assert not belief.reached(("at:B",), belief.last_event)

    belief.tell(event(2, 9.0, GoalReached(("at:B",))), to_ns(10.0))
    assert belief.reached(("at:B",), 1)


def test_a_belief_does_not_grow_with_the_run() -> None:
    belief = make_belief()
    for number in range(1, 2 * HISTORY):
        belief.learn(telemetry(float(number)), to_ns(number + 1.0))
        belief.tell(event(number, float(number), GoalReached(("at:A",))), to_ns(number + 1.0))

    assert len(belief.events) == HISTORY
    assert belief.last_event == 2 * HISTORY - 1
    assert belief.was(to_ns(HISTORY - 1.0)) is None
    assert belief.was(to_ns(2.0 * HISTORY)) is not None


@given(
    arrivals=st.lists(
        st.tuples(st.integers(0, 100), st.booleans(), st.floats(0, 1)), min_size=1, max_size=30
    )
)
def test_the_present_is_the_newest_live_word_whatever_the_order(
    arrivals: list[tuple[int, bool, float]],
) -> None:
    belief = make_belief()
    for made_s, stored, charge in arrivals:
        belief.learn(telemetry(float(made_s), battery=charge), to_ns(200.0), stored=stored)

    live = [made_s for made_s, stored, _ in arrivals if not stored]
    if not live:
        assert belief.now.battery is None
    else:
        assert belief.now.battery.so_ns == to_ns(max(live))
    for made_s, *_ in arrivals:
        assert belief.was(to_ns(made_s)).time_ns == to_ns(made_s)


@pytest.mark.parametrize("item", list(BeliefItem))
def test_every_item_is_told_by_telemetry(item: BeliefItem) -> None:
    belief = make_belief()
    belief.learn(telemetry(5.0, failsafe=Failsafe.HOLD, proposal=3), to_ns(6.0))

    assert getattr(belief.now, item).so_ns == to_ns(5.0)
