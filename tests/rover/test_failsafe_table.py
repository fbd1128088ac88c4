"""The failsafe's table row by row, and the rules that no sequence of events may break with it."""

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import chain, combinations

import pytest
from failsafe_rules import UNHEARD, Play, Scene, Witness, broken
from hypothesis import given, settings
from hypothesis import strategies as st
from pilot_stand import EVENTS, Memory, Word

from farside.control import Cause, OnLoss
from farside.rover.failsafe.table import TABLE, OrdersThen, Rule, orders_for, rule_for

LENGTH = 6


def subsets() -> Iterator[frozenset[Cause]]:
    """Every set of causes."""
    sizes = range(len(Cause) + 1)
    return map(frozenset, chain.from_iterable(combinations(Cause, size) for size in sizes))


# --- the table ---------------------------------------------------------------------------------

STORIES = (
    ({Cause.TILT}, "safe: the rover tilts too much"),
    ({Cause.SENSOR_DEAD, Cause.LOST}, "safe: the rover does not know where it is"),
    ({Cause.STUCK, Cause.UNCONFIRMED}, "safe: the rover is stuck"),
    ({Cause.LOST, Cause.FORBIDDEN}, "hold: the link is lost, and autonomy is forbidden then"),
    (
        {Cause.LOST, Cause.RESERVE, Cause.NO_SIGNAL},
        "alone: the link is lost, and the charge just suffices for the way to the dock",
    ),
    ({Cause.LOST, Cause.NO_SIGNAL}, "alone: the link is lost, and terrain hides the other end"),
    ({Cause.LOST, Cause.SILENCE}, "alone: the link is lost"),
    ({Cause.LOST, Cause.EXHAUSTED}, "hold: the link is lost, and no goal is left"),
    ({Cause.SILENCE, Cause.UNCONFIRMED}, "hold: nothing is heard"),
    (
        {Cause.UNCONFIRMED, Cause.RESERVE},
        "hold: the link is back, and the operator has not yet said who drives",
    ),
    ({Cause.RESERVE}, "nominal: the charge just suffices for the way to the dock"),
    ({Cause.EXPECTED_SILENCE, Cause.NO_SIGNAL}, "nominal: nothing is heard, as planned"),
    ({Cause.FORBIDDEN, Cause.EXHAUSTED}, "nominal: the link is up"),
)


def told(rule: Rule) -> str:
    return f"{rule.state}: {rule.why}"


@pytest.mark.parametrize(("causes", "expected"), STORIES)
def test_each_row_applies_for_its_reason(causes: set[Cause], expected: str) -> None:
    assert told(rule_for(causes)) == expected


def test_the_stories_reach_every_row_in_the_order_of_the_table() -> None:
    assert [story for _, story in STORIES] == [told(rule) for rule in TABLE]


def test_every_row_has_a_reason_of_its_own() -> None:
    assert len({rule.why for rule in TABLE}) == len(TABLE)
    assert all(rule.why for rule in TABLE)


def test_the_last_row_always_applies() -> None:
    assert TABLE[-1].when == TABLE[-1].unless == frozenset()
    assert all(rule_for(causes) in TABLE for causes in subsets())


def test_all_causes_matter_in_some_row() -> None:
    assert frozenset().union(*(rule.when | rule.unless for rule in TABLE)) == frozenset(Cause)


def test_planned_silence_never_makes_another_state() -> None:
    for causes in subsets():
        assert rule_for(causes).state is rule_for(causes | {Cause.EXPECTED_SILENCE}).state


def test_an_order_begins_only_while_the_ground_is_heard() -> None:
    for causes in subsets():
        begins = orders_for(causes) in {OrdersThen.BEGIN, OrdersThen.INSIST}
        assert begins is not bool(causes & UNHEARD)


# --- the rules ---------------------------------------------------------------------------------

HAPPENINGS: tuple[tuple[Cause | Word, ...], ...] = (*((event,) for event in EVENTS), ())
"""What may happen before a tick: one of the events, or nothing."""
Node = tuple[Memory, Witness]
"""All that what happens next can depend on."""


def check(scene: Scene) -> None:
    assert not broken(scene), scene
    rule = rule_for(scene.causes)
    assert (scene.now.state, scene.now.reason) == (rule.state, rule.why), scene


def test_no_sequence_of_up_to_six_events_breaks_a_rule() -> None:
    """Walked by what is remembered after each sequence, with how many sequences lead there."""
    play = Play(OnLoss.AUTONOMY)
    following: dict[Node, list[Node]] = {}
    level = Counter(Play(on_loss).node for on_loss in OnLoss)
    covered = 0
    for _ in range(LENGTH):
        longer: Counter[Node] = Counter()
        for node, sequences in level.items():
            if node not in following:
                following[node] = []
                for events in HAPPENINGS:
                    play.resume(node)
                    check(play.step(*events))
                    following[node].append(play.node)
            for after in following[node]:
                longer[after] += sequences
        level = longer
        covered += level.total()
    assert len(HAPPENINGS) == 16
    assert covered == len(OnLoss) * sum(16**length for length in range(1, LENGTH + 1))


happenings = st.lists(st.lists(st.sampled_from(EVENTS), max_size=4), max_size=60)


@settings(max_examples=500)
@given(st.sampled_from(OnLoss), happenings)
def test_no_longer_sequence_breaks_a_rule_either(
    on_loss: OnLoss, ticks: Sequence[Sequence[Cause | Word]]
) -> None:
    """With several events between two ticks, as when a frame ends a silence and brings a word."""
    play = Play(on_loss)
    for events in ticks:
        check(play.step(*events))


@given(st.sampled_from(OnLoss), happenings)
def test_nothing_is_remembered_beside_what_a_node_holds(
    on_loss: OnLoss, ticks: Sequence[Sequence[Cause | Word]]
) -> None:
    """So walking sequences by their nodes leaves none out."""
    live, node = Play(on_loss), Play(on_loss).node
    for events in ticks:
        resumed = Play(OnLoss.AUTONOMY)
        resumed.resume(node)
        assert resumed.step(*events) == live.step(*events)
        node = resumed.node
