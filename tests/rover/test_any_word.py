"""Whatever the ground may say, sensible or not, the rover lives on and its log can be read."""

from collections.abc import Callable, Sequence

import msgspec
from any_message import values
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from farside.control import CommandStage
from farside.messages import Command, Heartbeat, SetGoal, Shown, Uplink
from farside.topics import ROVER_COMMAND
from tests.rover.conftest import Bench

ORDERS = st.one_of(
    values(msgspec.inspect.type_info(Command)),
    st.builds(
        Command,
        number=st.integers(0, 20),
        expires_ns=st.just(10**12),
        order=st.builds(SetGoal, st.just(("at:A",)), st.floats()),
    ),
)
WORDS = st.one_of(
    ORDERS,
    ORDERS,
    values(msgspec.inspect.type_info(Heartbeat)),
    values(msgspec.inspect.type_info(Shown)),
)


@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(words=st.lists(WORDS, max_size=12))
def test_no_word_ends_the_rover(bench: Callable[..., Bench], words: Sequence[Uplink]) -> None:
    rover = bench(consent={"by": "veto"}, goals=[{"place": "A"}])
    for word in words:
        rover.say(word)
        rover.run_s(1.0)
    rover.run_s(20)
    taken = [e for e in rover.of(ROVER_COMMAND) if e.stage is CommandStage.TAKEN]
    assert len(taken) == sum(isinstance(word, Command) for word in words)
    assert rover.telemetry is not None
