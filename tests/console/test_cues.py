"""The same option gives the same cue by force, by rumble and on the screen."""

import json

import msgspec
import pytest

from farside.console.screen.screen import OptionRow
from farside.console.stick.cues import (
    TABLE,
    Edge,
    Table,
    cue_of,
    deflection,
    edge_of,
    force_of,
    nearness,
    rumble_of,
)
from farside.ground.view.view import OptionKind


def option(kind: OptionKind, severity: float = 0.5) -> OptionRow:
    return OptionRow("E", kind, severity, does="drives E")


def by_force(row: OptionRow) -> OptionKind:
    """What a hand on a stick with motors would say that the option is."""
    far, near = force_of(cue_of(row), 0.1), force_of(cue_of(row), 1.0)
    if near.spring:
        return OptionKind.PROPOSED if near.centre else OptionKind.INVALID
    return OptionKind.PROBLEMATIC if near.shake > far.shake else OptionKind.FREE


def by_rumble(row: OptionRow) -> OptionKind:
    """What a hand on a pad would say."""
    far, near = rumble_of(cue_of(row), 0.1), rumble_of(cue_of(row), 1.0)
    if near.strength > far.strength:
        return OptionKind.PROBLEMATIC
    return {
        (2, True): OptionKind.INVALID,
        (1, False): OptionKind.PROPOSED,
        (0, True): OptionKind.FREE,
    }[near.pulses, near.pulse_ms < 100]


def by_sight(row: OptionRow) -> OptionKind:
    """What an eye on the screen would say."""
    return {
        Edge.BARRED: OptionKind.INVALID,
        Edge.HATCHED: OptionKind.PROBLEMATIC,
        Edge.LIT: OptionKind.PROPOSED,
        Edge.PLAIN: OptionKind.FREE,
    }[edge_of(cue_of(row))]


@pytest.mark.parametrize("severity", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("kind", OptionKind)
def test_hand_on_a_stick_hand_on_a_pad_and_eye_tell_the_same(
    kind: OptionKind, severity: float
) -> None:
    row = option(kind, severity)

    assert (by_force(row), by_rumble(row), by_sight(row)) == (kind, kind, kind)


def test_what_weighs_more_shakes_more_and_even_the_least_is_felt() -> None:
    strengths = [
        (force_of(cue, 1.0).shake, rumble_of(cue, 1.0).strength)
        for severity in (0.0, 0.5, 1.0)
        for cue in [cue_of(option(OptionKind.PROBLEMATIC, severity))]
    ]

    assert strengths == sorted(set(strengths))
    assert strengths[0] > (0.1, 0.1)


def test_vibration_rises_from_nothing_as_the_stick_nears() -> None:
    cue = cue_of(option(OptionKind.PROBLEMATIC, 1.0))

    steps = [nearness(deflection(x / 100, 0.3, "E")) for x in range(-100, 101)]

    assert steps == sorted(steps)
    assert (steps[0], steps[120], steps[180], steps[200]) == (0.0, 0.0, 1.0, 1.0)
    assert (rumble_of(cue, 0.0).strength, force_of(cue, 0.0).shake) == (0.0, 0.0)


def test_resistance_is_stronger_than_the_pull_and_the_pull_alone_chooses_nothing() -> None:
    resisted = force_of(cue_of(option(OptionKind.INVALID)), 1.0)
    drawn = force_of(cue_of(option(OptionKind.PROPOSED)), 0.0)

    assert drawn.spring < resisted.spring / 2
    assert TABLE.thresholds.dead_zone < drawn.centre < TABLE.thresholds.back_below


def test_an_action_without_a_direction_is_never_near() -> None:
    assert deflection(1.0, 1.0, "sample") == 0.0


def test_the_page_is_sent_the_same_numbers() -> None:
    sent = json.loads(json.dumps(msgspec.to_builtins(TABLE)))

    assert sent["forms"]["problematic"]["edge"] == "hatched"
    assert msgspec.convert(sent, Table) == TABLE
