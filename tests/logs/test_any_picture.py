"""Pictures of whatever a record may hold."""

import msgspec
from any_message import messages
from drawn import decoded, drawn
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from noting import records_of, topic_of, with_pictures

from farside.logs.foxglove.names import PICTURES, ROVER_NUMBERS
from farside.node import NEVER_NS, Record, to_ns
from farside.topics import TOPICS, Cycle

ANY_RECORD = st.builds(
    Record,
    st.sampled_from(sorted(TOPICS)),
    st.integers(0, to_ns(2**32) - 2),
    st.integers(0, NEVER_NS),
    st.binary(max_size=8) | messages.map(msgspec.json.encode),
) | st.tuples(st.integers(0, to_ns(100)), messages).map(
    lambda said: Record(topic_of(said[1]).name, said[0], said[0], msgspec.json.encode(said[1]))
)


@settings(max_examples=80, deadline=None, suppress_health_check=list(HealthCheck))
@given(said=st.lists(ANY_RECORD, min_size=1, max_size=8))
def test_whatever_a_log_holds_it_stays_and_every_picture_of_it_can_be_read(
    said: list[Record],
) -> None:
    both = with_pictures(said)

    assert [record for record in both if record.topic in TOPICS] == said
    for record in both:
        if record.topic in PICTURES:
            decoded(record)


def test_a_count_beyond_what_a_picture_holds_is_told_as_the_nearest() -> None:
    cycle = Cycle(
        tokens=(), novel=(), unexpected=(), succeeded=0, failed=0, created=0, signs=-3,
        hypotheses=2**40, mean_cm=0.5,
    )  # fmt: skip

    ((_, numbers),) = drawn(records_of([(1, cycle)]), ROVER_NUMBERS)

    assert (numbers.signs, numbers.hypotheses, numbers.mean_cm) == (0, 2**32 - 1, 0.5)
