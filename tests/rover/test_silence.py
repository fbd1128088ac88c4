"""Silence on the link: stories of what counts as it, and laws against a naive count."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from hypothesis import given
from hypothesis import strategies as st

from farside.frames import OutageReason
from farside.link import Blackout, LinkConfig, LinkTerms, OneWay
from farside.node import to_ns, to_s
from farside.rover.config import FailsafeConfig
from farside.rover.failsafe.silence import Silence

LIGHT_S, HOLD_S, LOST_S = 3, 10, 30
Span = tuple[int, int]


def silence(
    *, closed: Iterable[Span] = (), foreseen: bool = True, light_s: int = LIGHT_S, beat_s: int = 2
) -> Silence:
    """One that nothing has been heard on; the rover's end is closed in these spans of seconds."""
    reason = OutageReason.CONTACT if foreseen else OutageReason.BLACKOUT
    config = LinkConfig(
        up=OneWay(delay_s=light_s),
        blackouts=tuple(Blackout(begin_s, end_s, reason=reason) for begin_s, end_s in closed),
    )
    failsafe = FailsafeConfig(hold_after_s=HOLD_S, lost_after_s=LOST_S)
    return Silence(failsafe, LinkTerms.simulated(config, seed=1, heartbeat_ns=to_ns(beat_s)))


def hear(one: Silence, *times_s: float) -> None:
    for time_s in times_s:
        one.heard(to_ns(time_s))


def hear_until(one: Silence, time_s: int) -> None:
    """Hear a frame every 2 s, the last one at a time."""
    hear(one, *range(LIGHT_S, time_s, 2), time_s)


def word(one: Silence, time_s: float) -> str:
    """What is so at a time."""
    one.look(to_ns(time_s))
    if one.silent:
        return "lost" if one.lost else "silent"
    return "expected" if one.expected else "heard"


def changes(one: Silence, *, since_s: int, until_s: int) -> list[tuple[int, str]]:
    """What becomes so when, looked at once a second."""
    told: list[tuple[int, str]] = []
    for time_s in range(since_s, until_s):
        now = word(one, time_s)
        if not told or told[-1][1] != now:
            told.append((time_s, now))
    return told


# --- stories -----------------------------------------------------------------------------------


def test_silence_begins_after_ten_seconds_and_the_link_is_lost_after_thirty() -> None:
    one = silence()
    hear_until(one, 100)
    assert changes(one, since_s=100, until_s=200) == [
        (100, "heard"),
        (110, "silent"),
        (130, "lost"),
    ]
    assert one.countdown_ns == 0


def test_any_frame_ends_it() -> None:
    one = silence()
    hear_until(one, 100)
    assert word(one, 140) == "lost"
    hear(one, 140)
    assert (one.silent, one.lost, one.quiet_ns) == (False, False, 0)
    assert word(one, 141) == "heard"


def test_nothing_is_missed_before_the_first_frame_can_arrive() -> None:
    one = silence(light_s=1200)
    assert changes(one, since_s=0, until_s=1300) == [
        (0, "heard"),
        (1210, "silent"),
        (1230, "lost"),
    ]


def test_a_planned_silence_neither_alarms_nor_uses_up_the_countdown() -> None:
    one = silence(closed=[(100, 4000)])
    hear_until(one, 99)
    assert changes(one, since_s=99, until_s=4005) == [(99, "heard"), (109, "expected")]
    assert one.countdown_ns == to_ns(LOST_S)
    hear(one, 4005)
    assert word(one, 4006) == "heard"


def test_silence_within_a_contact_counts_over_the_gaps_between_contacts() -> None:
    one = silence(closed=[(20, 120), (130, 1000)])
    hear_until(one, 15)
    assert changes(one, since_s=15, until_s=1100) == [
        (15, "heard"),
        (25, "expected"),
        (125, "silent"),  # 5 s before the gap, 5 s after it
        (1015, "lost"),
    ]


def test_an_unforeseen_outage_is_no_planned_silence() -> None:
    one = silence(closed=[(100, 4000)], foreseen=False)
    hear_until(one, 100)
    assert word(one, 109) == "heard"
    assert word(one, 110) == "silent"
    assert word(one, 130) == "lost"


def test_the_countdown_grows_again_at_a_quarter_of_the_pace() -> None:
    one = silence()
    hear_until(one, 100)
    hear(one, 120)
    assert to_s(one.countdown_ns) == LOST_S - 20
    hear(one, *range(122, 142, 2))
    assert to_s(one.countdown_ns) == LOST_S - 20 + 5
    hear(one, *range(142, 222, 2))
    assert to_s(one.countdown_ns) == LOST_S


def flapping(one: Silence, *, dark_s: int, light_s: int, gaps: int) -> int | None:
    """The gap in which the link is lost, with a frame every 2 s in the light between."""
    now_s = 100
    hear_until(one, now_s)
    for gap in range(1, gaps + 1):
        now_s += dark_s
        if word(one, now_s) == "lost":
            return gap
        hear(one, *range(now_s, now_s + light_s + 1, 2))
        now_s += light_s
    return None


def test_a_link_that_flaps_with_long_gaps_is_lost_in_the_third() -> None:
    assert flapping(silence(), dark_s=12, light_s=4, gaps=10) == 3


def test_a_link_that_flaps_with_short_gaps_never_is() -> None:
    assert flapping(silence(), dark_s=8, light_s=4, gaps=1000) is None


def test_a_single_lost_heartbeat_does_not_count() -> None:
    one = silence()
    hear_until(one, 100)
    hear(one, 104, 106, 110)
    assert one.countdown_ns == to_ns(LOST_S)


def test_a_single_lost_heartbeat_does_not_count_right_after_a_loss_either() -> None:
    one = silence()
    hear_until(one, 100)
    assert word(one, 200) == "lost"
    hear(one, 200)
    assert changes(one, since_s=200, until_s=204) == [(200, "heard")]
    hear(one, 204)
    assert to_s(one.countdown_ns) == 1
    # What is silence, though, is a loss at once: the countdown has not grown by much.
    assert changes(one, since_s=204, until_s=220) == [(204, "heard"), (214, "lost")]


def test_where_the_heart_beats_slowly_more_silence_is_none() -> None:
    one = silence(beat_s=10)
    hear_until(one, 100)
    assert word(one, 124) == "heard"
    assert word(one, 125) == "silent"


def test_a_frame_that_arrived_before_the_last_one_tells_nothing_new() -> None:
    one = silence()
    hear_until(one, 100)
    hear(one, 95)
    assert one.heard_ns == to_ns(100)


# --- laws --------------------------------------------------------------------------------------


class Told(NamedTuple):
    """What a `Silence` says."""

    quiet_ns: int
    countdown_ns: int
    silent: bool
    expected: bool
    lost: bool


def told(one: Silence, time_s: int) -> Told:
    one.look(to_ns(time_s))
    return Told(one.quiet_ns, one.countdown_ns, one.silent, one.expected, one.lost)


def naive(now_s: int, arrivals_s: Iterable[int], closed: Sequence[Span]) -> Told:
    """What is so, from all that has arrived, second by second."""

    def is_closed(second: int) -> bool:
        return any(begin_s <= second < end_s for begin_s, end_s in closed)

    def gap(begin_s: int, end_s: int) -> int:
        """How much of a gap between frames could have been heard in, if it is a long one."""
        opened = [second for second in range(begin_s, end_s) if not is_closed(second)]
        return end_s - begin_s if end_s - begin_s < HOLD_S else len(opened)

    def used(before_s: float, quiet_s: int) -> float:
        """What is used of the countdown after a gap."""
        if quiet_s >= HOLD_S:
            return min(LOST_S, before_s + quiet_s)
        return max(0, before_s - quiet_s / 4)

    heard_s, used_s = LIGHT_S, 0.0
    for arrival_s in sorted(time_s for time_s in arrivals_s if LIGHT_S < time_s <= now_s):
        used_s = used(used_s, gap(heard_s, arrival_s))
        heard_s = arrival_s
    quiet_s = gap(heard_s, now_s) if now_s > heard_s else 0
    used_s = used(used_s, quiet_s)
    long, silent = now_s - heard_s >= HOLD_S, quiet_s >= HOLD_S
    return Told(
        to_ns(quiet_s),
        to_ns(LOST_S - used_s),
        silent,
        long and (not silent or is_closed(now_s)),
        silent and used_s >= LOST_S,
    )


moments = st.integers(0, 150)
arrivals = st.lists(moments, max_size=40, unique=True).map(sorted)
plans = st.lists(st.tuples(moments, st.integers(1, 60)), max_size=6).map(
    lambda spans: [(begin_s, begin_s + length_s) for begin_s, length_s in spans]
)


@given(arrivals, plans)
def test_it_says_what_a_naive_count_says(arrivals_s: list[int], closed: list[Span]) -> None:
    one = silence(closed=closed)
    for now_s in range(160):
        if now_s in arrivals_s:
            hear(one, now_s)
        assert told(one, now_s) == naive(now_s, arrivals_s, closed), now_s


@given(arrivals, plans, st.sets(moments))
def test_it_does_not_matter_how_often_one_looks(
    arrivals_s: list[int], closed: list[Span], looks_s: set[int]
) -> None:
    often, once = silence(closed=closed), silence(closed=closed)
    for now_s in sorted({*arrivals_s, *looks_s}):
        often.look(to_ns(now_s))
        if now_s in arrivals_s:
            hear(often, now_s)
            hear(once, now_s)
    assert told(often, 160) == told(once, 160)


@given(arrivals, plans)
def test_the_countdown_stays_within_its_budget_and_only_shrinks_in_silence(
    arrivals_s: list[int], closed: list[Span]
) -> None:
    one = silence(closed=closed)
    before = told(one, 0)
    for now_s in range(1, 160):
        if now_s in arrivals_s:
            hear(one, now_s)
        now = told(one, now_s)
        assert 0 <= now.countdown_ns <= to_ns(LOST_S)
        assert not (before.silent and now.silent) or now.countdown_ns <= before.countdown_ns
        assert now.countdown_ns <= before.countdown_ns + to_ns(0.25)
        assert now.lost <= now.silent
        before = now


@given(st.lists(st.integers(1, to_ns(HOLD_S) - 1), max_size=200), st.booleans())
def test_no_series_of_gaps_that_are_no_silence_leads_anywhere(
    gaps_ns: list[int], after_a_loss: bool
) -> None:
    one, now_ns = silence(), to_ns(100)
    if not after_a_loss:
        hear_until(one, 98)
    one.heard(now_ns)
    for gap_ns in gaps_ns:
        now_ns += gap_ns
        one.look(now_ns)
        assert (one.silent, one.lost) == (False, False)
        one.heard(now_ns)
        assert (one.silent, one.lost) == (False, False)
