"""Every word between ground and rover, joined from what both ends and the channel say."""

from collections import Counter

import msgspec
import pytest
from noting import log_of, records_of

from farside.control import Mode, ModeCause, OnLoss
from farside.frames import Carried, Fate, FrameEvent, FrameFate, FrameStage, OutageReason
from farside.link.endpoint.services import carried, part_of
from farside.logs import LogFile, RunView
from farside.logs.spacetime import Word, lost_to, words
from farside.messages import Command, Event, ModeChanged, SetOnLoss, Shown
from farside.node import Direction, Journal, Topic, to_ns
from farside.topics import GROUND_FRAME, LINK_FRAME, ROVER_FRAME

UP, DOWN = Direction.UP, Direction.DOWN
COMMAND = Carried("command", 7)
EVENT = Carried("event", 3, to_ns(5))


def _receiver(direction: Direction) -> Topic[FrameEvent]:
    return GROUND_FRAME if direction is DOWN else ROVER_FRAME


class Wire:
    """Frames noted message by message, at both ends and in the channel."""

    def __init__(self) -> None:
        self._journal = Journal()

    def made(self, t_s: float, direction: Direction, number: int, *carries: Carried) -> "Wire":
        sender = ROVER_FRAME if direction is DOWN else GROUND_FRAME
        return self._end(
            t_s,
            FrameEvent(direction, number, FrameStage.MADE, 99, "segment", carries=carries),
            sender,
        )

    def used(self, t_s: float, direction: Direction, number: int, *carries: Carried) -> "Wire":
        event = FrameEvent(direction, number, FrameStage.USED, 99, "segment", carries=carries)
        return self._end(t_s, event, _receiver(direction))

    def refused(self, t_s: float, direction: Direction, number: int, why: str) -> "Wire":
        event = FrameEvent(direction, number, FrameStage.REFUSED, 99, why)
        return self._end(t_s, event, _receiver(direction))

    def shadowed(self, t_s: float, direction: Direction, number: int) -> "Wire":
        return self._end(
            t_s, FrameEvent(direction, number, FrameStage.SHADOWED, 99, ""), ROVER_FRAME
        )

    def fate(
        self,
        t_s: float,
        direction: Direction,
        number: int,
        sent_s: float,
        fate: Fate = Fate.DELIVERED,
        *,
        copy: int = 0,
        outage: OutageReason | None = None,
    ) -> "Wire":
        arrival_ns = to_ns(t_s) if fate is Fate.DELIVERED else None
        sent_ns = to_ns(sent_s)
        one = FrameFate(
            direction,
            number,
            99,
            sent_ns,
            sent_ns,
            sent_ns + to_ns(0.1),
            arrival_ns,
            fate,
            priority=3,
            copy=copy,
            outage=outage,
        )
        self._journal.note(LINK_FRAME, one, log_time_ns=to_ns(t_s))
        return self

    def _end(self, t_s: float, event: FrameEvent, topic: Topic[FrameEvent]) -> "Wire":
        self._journal.note(topic, event, log_time_ns=to_ns(t_s))
        return self

    def words(self, start_s: float = 0, end_s: float = 1000, *, ground: bool = False) -> list[Word]:
        with log_of(self._journal.take()) as log:
            known = log.as_ground() if ground else log
            return list(words(known, to_ns(start_s), to_ns(end_s)))


@pytest.fixture
def wire() -> Wire:
    return Wire()


def told(word: Word) -> tuple[str, float, float | None, str | None]:
    arrives_s = None if word.arrives_ns is None else word.arrives_ns / 1e9
    return word.what, word.sent_ns / 1e9, arrives_s, word.lost


def test_a_command_that_arrives(wire: Wire) -> None:
    """At the same moment the rover's record comes first, and yet the channel's time counts."""
    wire.made(1, UP, 0, COMMAND).used(2.5, UP, 0, COMMAND).fate(2.5, UP, 0, 1)
    (word,) = wire.words()
    assert told(word) == ("command 7", 1, 2.5, None)
    assert (word.direction, word.frame, word.priority, word.carries) == (UP, 0, 3, COMMAND)


def test_a_frame_of_which_the_channel_says_nothing_arrives_when_it_is_used(wire: Wire) -> None:
    wire.made(1, UP, 0, COMMAND).used(2.5, UP, 0, COMMAND).made(3, UP, 1)
    assert [told(word)[2] for word in wire.words()] == [2.5, None]


@pytest.mark.parametrize(
    ("fate", "outage", "lost"),
    [
        (Fate.LOST, None, "lost on the way"),
        (Fate.OUTAGE, OutageReason.BLACKOUT, "lost to the blackout"),
        (Fate.OUTAGE, OutageReason.PASS, "lost to the gap between passes"),
        (Fate.QUEUE_FULL, None, "dropped, since the transmit queue was full"),
        (Fate.EXPIRED, None, "dropped, since it waited too long in the transmit queue"),
        (Fate.BIT_ERROR, None, "lost to bit errors"),
    ],
)
def test_what_a_frame_is_lost_to(
    wire: Wire, fate: Fate, outage: OutageReason | None, lost: str
) -> None:
    wire.made(1, DOWN, 0, EVENT).fate(1.1, DOWN, 0, 1, fate, outage=outage)
    assert [told(word) for word in wire.words()] == [("event 3", 1, None, lost)]


def test_terrain_shadow_takes_a_frame_as_it_is_sent_or_as_it_arrives(wire: Wire) -> None:
    wire.made(1, DOWN, 0, EVENT).shadowed(1, DOWN, 0)
    wire.made(2, UP, 0, COMMAND).fate(3.3, UP, 0, 2).shadowed(3.3, UP, 0)
    assert [told(word) for word in wire.words()] == [
        ("event 3", 1, None, "lost in terrain shadow"),
        ("command 7", 2, 3.3, "lost in terrain shadow"),
    ]


def test_a_refused_frame_is_lost_and_a_duplicate_is_no_word(wire: Wire) -> None:
    wire.made(1, UP, 0, COMMAND).fate(2, UP, 0, 1).refused(2, UP, 0, "corrupted")
    wire.made(3, UP, 1, COMMAND).fate(4, UP, 1, 3).used(4, UP, 1, COMMAND)
    wire.fate(5, UP, 1, 3, copy=1).refused(5, UP, 1, "replayed")
    assert [told(word)[3] for word in wire.words()] == [
        "refused by the receiver: corrupted",
        None,
    ]


def test_what_is_under_way_at_the_end_comes_last(wire: Wire) -> None:
    wire.made(1, UP, 0, COMMAND)
    wire.made(2, UP, 1, COMMAND).fate(3, UP, 1, 2).used(3, UP, 1, COMMAND)
    assert [(word.frame, word.arrives_ns) for word in wire.words()] == [(1, to_ns(3)), (0, None)]


def test_a_time_takes_in_the_words_sent_in_it(wire: Wire) -> None:
    """One sent before it is left out though it arrives in it; one sent in it is told to its end."""
    for number, sent_s in enumerate((1, 5, 9)):
        wire.made(sent_s, UP, number)
        wire.used(sent_s + 3, UP, number, COMMAND)
        wire.fate(sent_s + 3, UP, number, sent_s)
    found = wire.words(2, 6)
    assert [(word.frame, word.arrives_ns) for word in found] == [(1, to_ns(8))]


def test_the_parts_and_attempts_of_a_message_are_told_apart(wire: Wire) -> None:
    whole = Carried("proposal", 4, to_ns(1))
    wire.made(1, DOWN, 0, part_of(whole, 1, 2)).made(1.1, DOWN, 1, part_of(whole, 2, 2, 3))
    assert [word.what for word in wire.words()] == [
        "proposal 4, part 1 of 2",
        "proposal 4, part 2 of 2, sent 3 ×",
    ]


def test_the_ground_knows_what_it_sent_and_what_it_heard(wire: Wire) -> None:
    """Of what came down it knows the delay of the last telemetry, and of what went up nothing."""
    telemetry = Carried("telemetry", time_ns=to_ns(1))
    wire.made(1, DOWN, 0, telemetry).fate(2.3, DOWN, 0, 1).used(2.3, DOWN, 0, telemetry)
    wire.made(1.5, UP, 0, COMMAND).fate(3, UP, 0, 1.5, Fate.LOST)
    wire.made(3, DOWN, 1, EVENT).fate(4.3, DOWN, 1, 3).used(4.3, DOWN, 1, EVENT)
    wire.made(3.5, DOWN, 2, EVENT).fate(3.6, DOWN, 2, 3.5, Fate.LOST)
    assert sorted(told(word)[:3] for word in wire.words(ground=True)) == [
        ("command 7", 1.5, None),
        ("event 3", 3.0, 4.3),
        ("telemetry", 1.0, 2.3),
    ]


@pytest.mark.parametrize(
    ("message", "found"),
    [
        (Command(12, 0, SetOnLoss(OnLoss.HOLD)), Carried("command", 12)),
        (Shown(4), Carried("shown", 4)),
        (
            Event(5, 9, ModeChanged(Mode.SHARED, ModeCause.OPERATOR)),
            Carried("event", 5, 9),
        ),
    ],
)
def test_a_message_is_known_by_its_kind_and_number(message: msgspec.Struct, found: Carried) -> None:
    assert carried(message) == found


def test_in_a_real_run_every_frame_is_one_word_and_says_what_it_carries(flown: LogFile) -> None:
    found = list(words(flown))
    counts = Counter((word.direction, word.frame) for word in found)
    assert set(counts.values()) == {1}
    for direction in Direction:
        of_way = [word for word in found if word.direction is direction]
        link = RunView(flown).link_counters(direction)
        arrived = [word for word in of_way if word.arrives_ns is not None and word.lost is None]
        lost = Counter(word.lost for word in of_way)
        assert len(arrived) == link.delivered
        assert (lost["lost on the way"], lost["lost to the blackout"]) == (link.lost, link.outage)
    assert {word.what for word in found if word.carries is None} == {"report"}


def test_in_a_real_run_a_resend_names_the_message_it_repeats(flown: LogFile) -> None:
    """Of each message the attempts count from 1, and it arrives once before they end."""
    attempts: dict[tuple[str, int | None, int], list[int]] = {}
    arrived = set()
    for word in sorted(words(flown), key=lambda word: word.sent_ns):
        if word.carries is None or word.carries.number is None:
            continue
        key = word.carries.kind, word.carries.number, word.carries.part
        attempts.setdefault(key, []).append(word.carries.attempt)
        if word.lost is None and word.arrives_ns is not None:
            arrived.add(key)
    assert all(row == list(range(1, len(row) + 1)) for row in attempts.values())
    assert max(map(len, attempts.values())) > 10, "a blackout in which nothing is repeated"
    assert {key for key, row in attempts.items() if len(row) > 1} <= arrived


def test_an_outage_without_a_reason_loses_frames_all_the_same() -> None:
    fate = FrameFate(UP, 0, 9, 0, 0, 1, None, Fate.OUTAGE)
    assert lost_to(fate) == "lost to an outage"


def test_records_of_older_logs_still_say_what_became_of_a_frame() -> None:
    made = FrameEvent(UP, 0, FrameStage.MADE, 9, "segment")
    (word,) = _words_of((1, made))
    assert (word.what, word.carries) == ("part of a message", None)


def test_what_a_log_calls_a_message_is_no_format() -> None:
    carries = (Carried("{0.__class__} {1:>999999999999}", 7), Carried("}", 7))
    (word,) = _words_of((1, FrameEvent(UP, 0, FrameStage.MADE, 9, "segment", carries=carries)))
    assert word.what == "{0.__class__} {1:>999999999999}, }"


def _words_of(*noted: tuple[float, FrameEvent]) -> list[Word]:
    with log_of(records_of(noted)) as log:
        return list(words(log))
