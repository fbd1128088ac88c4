"""Where the rover is predicted to be, by what the shadow's lists say of its moves."""

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.control import Mode, OnLoss
from farside.dem import ShadowModel
from farside.ground.foresight import Foresight
from farside.ground.moves import MoveTerms, MoveTimes
from farside.ground.prediction import OnItsWay, Predictor
from farside.messages import (
    Command,
    Drive,
    Meant,
    Order,
    SetGoal,
    SetMode,
    Telemetry,
    WithdrawGoal,
)
from farside.node import to_ns
from farside.places import ACTIONS
from farside.topics import Prediction
from tests.ground.conftest import PLACES, taught, telemetry

TERMS = MoveTerms(cell_m=1.0, speed_m_s=1.0, turn_rate_rad_s=1.6)
MOVE_NS = MoveTimes(TERMS).expected("E", "E").mean_ns


def predictor(shadow: ShadowModel | None = None, alone_after_s: float = 30.0) -> Predictor:
    shadow = shadow or taught()
    return Predictor(Foresight(shadow, lambda: 0), MoveTimes(TERMS), to_ns(alone_after_s))


def at(place: int, t_s: float = 10.0, **changes: object) -> Telemetry:
    return telemetry(t_s, str(place), **changes)


def coming(number: int, order: Order, arrives_s: float, meant: Meant | None = None) -> OnItsWay:
    action = order.action if isinstance(order, Drive) else None
    return OnItsWay(Command(number, 10**18, order, meant), action, to_ns(arrives_s))


def most_likely(prediction: Prediction) -> str:
    return prediction.likely[0].sign[0]


def test_a_rover_that_stands_and_is_sent_nothing_is_where_it_was() -> None:
    prediction = predictor().now(at(1), (), to_ns(100.0))

    assert [(one.sign, one.probability) for one in prediction.likely] == [(("at:1",), 1.0)]
    assert (prediction.unknown, prediction.from_ns) == (0.0, to_ns(10.0))


def test_a_move_under_way_is_over_after_the_time_that_moves_take() -> None:
    moving = at(1, action="E", since_ns=to_ns(9.0))
    predict = predictor()

    assert most_likely(predict.now(moving, (), to_ns(10.0))) == "at:1"
    assert most_likely(predict.now(moving, (), to_ns(9.0) + 2 * MOVE_NS)) == "at:2"


def test_a_drive_on_its_way_begins_when_it_is_due() -> None:
    drive = coming(1, Drive("E"), arrives_s=20.0, meant=Meant(Mode.GUIDED, place="at:1"))
    predict = predictor()

    assert most_likely(predict.now(at(1), [drive], to_ns(19.0))) == "at:1"
    assert most_likely(predict.now(at(1), [drive], to_ns(20.0) + 2 * MOVE_NS)) == "at:2"


def test_after_every_command_the_rover_is_predicted_and_less_surely_each_time() -> None:
    meant = [Meant(Mode.GUIDED, place="at:0"), Meant(Mode.GUIDED, after=1)]
    drives = [coming(n, Drive("E"), 20.0 + n, meant[n - 1]) for n in (1, 2)]
    first, second = predictor().after(at(0), drives, to_ns(12.0))

    assert (first.command, most_likely(first)) == (1, "at:1")
    assert (second.command, most_likely(second)) == (2, "at:2")
    assert 1 > first.likely[0].probability > second.likely[0].probability > 0.5
    assert second.at_ns == pytest.approx(to_ns(21.0) + 2 * MOVE_NS, abs=to_ns(1.0))


def test_a_command_meant_for_another_place_is_refused_and_so_is_what_follows_on_it() -> None:
    elsewhere = coming(1, Drive("E"), 20.0, Meant(Mode.GUIDED, place="at:0"))
    behind = coming(2, Drive("E"), 21.0, Meant(Mode.GUIDED, after=1))
    prediction = predictor().now(at(1), [elsewhere, behind], to_ns(60.0))

    assert most_likely(prediction) == "at:1"
    assert prediction.likely[0].probability == 1.0


def test_where_nothing_is_known_of_a_move_nothing_is_said() -> None:
    drive = coming(1, Drive("N"), 20.0)
    prediction = predictor().now(at(1), [drive], to_ns(60.0))

    assert prediction.likely == ()
    assert prediction.unknown == 1.0


def test_of_an_action_that_there_is_not_nothing_is_said() -> None:
    drive = coming(1, Drive(""), 20.0)

    assert predictor().now(at(1), [drive], to_ns(60.0)).unknown == 1.0


def test_in_autonomous_mode_it_goes_on_by_the_map_and_stands_at_the_goal() -> None:
    alone = at(0, mode=Mode.AUTONOMOUS, goals=(("at:3",),))
    predict = predictor()
    for moves, place in ((1, "at:1"), (2, "at:2"), (3, "at:3"), (300, "at:3")):
        prediction = predict.now(alone, (), to_ns(11.3) + moves * MOVE_NS)
        assert most_likely(prediction) == place


def test_one_goal_after_the_other() -> None:
    alone = at(1, mode=Mode.AUTONOMOUS, goals=(("at:3",), ("at:0",)))
    prediction = predictor().now(alone, (), to_ns(1000.0))

    assert most_likely(prediction) == "at:0"


def test_a_goal_that_no_way_is_known_to_is_passed_over() -> None:
    alone = at(1, mode=Mode.AUTONOMOUS, goals=(("at:moon",), ("at:3",)))

    assert most_likely(predictor().now(alone, (), to_ns(1000.0))) == "at:3"


def test_orders_for_modes_and_goals_count_from_when_they_are_due() -> None:
    orders = [
        coming(1, SetGoal(("at:3",), 1.0), 20.0),
        coming(2, SetMode(Mode.AUTONOMOUS), 30.0),
        coming(3, WithdrawGoal(("at:3",)), 30.0 + 1.5 * MOVE_NS / 1e9),
    ]
    predict = predictor()

    assert most_likely(predict.now(at(0), orders, to_ns(29.0))) == "at:0"
    assert most_likely(predict.now(at(0), orders, to_ns(500.0))) == "at:2"
    assert most_likely(predict.now(at(0), orders[:2], to_ns(500.0))) == "at:3"


def test_a_drive_takes_over_from_autonomy() -> None:
    alone = at(0, mode=Mode.AUTONOMOUS, goals=(("at:3",),))
    drive = coming(1, Drive("W"), 10.5 + 1.5 * MOVE_NS / 1e9)

    # It has gone on to at:2 by then, goes back by one, and stands.
    assert most_likely(predictor().now(alone, [drive], to_ns(500.0))) == "at:1"


def test_after_long_silence_the_rover_is_taken_to_be_alone_with_its_goals() -> None:
    held = at(0, alone_goals=(("at:3",),))
    predict = predictor(alone_after_s=30.0)
    since_ns = to_ns(12.0)

    early = predict.now(held, (), to_ns(41.0), silent_since_ns=since_ns)
    late = predict.now(held, (), to_ns(90.0), silent_since_ns=since_ns)
    forbidden = at(0, alone_goals=(), on_loss=OnLoss.HOLD)
    assert most_likely(early) == "at:0"
    assert most_likely(late) == "at:3"
    assert most_likely(predict.now(forbidden, (), to_ns(90.0), silent_since_ns=since_ns)) == "at:0"


def test_a_move_that_often_fails_is_held_for_less_sure() -> None:
    drive = [coming(1, Drive("W"), 20.0)]
    good = predictor(taught()).now(at(1), drive, to_ns(60.0))
    stays = predictor(taught(bumps=4)).now(at(0), drive, to_ns(60.0))

    assert most_likely(good) == "at:0"
    assert most_likely(stays) == "at:0"  # it has learned that it bumps there


def test_a_rover_that_does_not_know_where_it_is_is_nowhere_in_particular() -> None:
    lost = telemetry(10.0, "0", tokens=())

    assert predictor().now(lost, (), to_ns(20.0)).unknown == 1.0


def test_how_long_moves_take_is_learned_from_telemetry() -> None:
    times = MoveTimes(TERMS)
    for t_s in np.arange(0.0, 400.0, 4.0):
        times.learn(telemetry(t_s, action="E", since_ns=to_ns(t_s)))
        times.learn(telemetry(t_s + 2.0, action="E", since_ns=to_ns(t_s)))

    assert times.expected("E", "E").mean_ns == pytest.approx(to_ns(4.0), rel=0.05)
    assert times.expected("E", "W") == MoveTimes(TERMS).expected("E", "W")


@given(
    orders=st.lists(
        st.one_of(
            st.sampled_from([Drive(action) for action in ACTIONS]),
            st.sampled_from([SetMode(mode) for mode in Mode]),
            st.sampled_from([SetGoal((place,), 1.0) for place in (*PLACES, "at:moon")]),
        ),
        max_size=8,
    ),
    mode=st.sampled_from(Mode),
    after_s=st.floats(0, 300),
    place=st.integers(0, 3),
)
def test_probabilities_are_probabilities_and_the_rest_is_unknown(
    orders: Sequence[Order], mode: Mode, after_s: float, place: int
) -> None:
    known = at(place, mode=mode, goals=(("at:3",),))
    way = [coming(n, order, 10.0 + 3 * n) for n, order in enumerate(orders, start=1)]
    predict = predictor(SHADOW)
    for prediction in (
        predict.now(known, way, to_ns(10.0 + after_s)),
        *predict.after(known, way, to_ns(10.0)),
    ):
        total = sum(one.probability for one in prediction.likely)
        assert total + prediction.unknown == pytest.approx(1.0, abs=1e-3)
        assert all(0 < one.probability <= 1 for one in prediction.likely)
        assert all(one.sign[0] in PLACES for one in prediction.likely)


SHADOW = taught(bumps=2)
