"""Whole missions with a shadow of the model at the ground: equal at the end, and what it costs."""

from collections.abc import Callable

import msgspec
import pytest
from nodes import flown
from restless import lists

from farside.dem import Choice
from farside.frames import Fate
from farside.link.endpoint.services import SERVICES
from farside.messages import Proposal
from farside.missions import load_mission
from farside.missions.loading import shipped_missions
from farside.missions.testing.rehearsal import Rehearsal
from farside.node import Direction
from farside.rover import PlainController
from farside.topics import (
    GROUND_PROPOSAL,
    GROUND_SHADOW,
    ROVER_CYCLE,
    ROVER_MODEL,
)


class Still(PlainController):
    """A controller of one's own, which never begins anything."""

    def choose(self, *, explore: bool = True) -> Choice | None:  # noqa: ARG002 - as all do
        return None


@pytest.mark.parametrize("name", shipped_missions())
def test_at_the_end_of_a_shipped_mission_the_ground_has_the_model(name: str) -> None:
    """Of `mars-relay` at the end of its second pass."""
    mission = load_mission(name).mission
    flight = flown(msgspec.structs.replace(mission, duration_s=min(mission.duration_s, 7_800.0)))
    shadow = flight.shadow
    assert shadow is not None
    assert shadow.in_step
    assert lists(shadow.model) == lists(flight.model)
    assert len(flight.model.hypotheses) > 20


def test_in_a_blackout_nothing_is_sent_and_after_it_one_update_tells_it_all(
    mission: Callable[[str], Rehearsal],
) -> None:
    """From 620 s to 980 s nothing is heard; the silence counts as one after 10 s."""
    run = mission("blackout").run()
    made = [(t_s, entry) for t_s, entry in run.entries(ROVER_MODEL)]
    assert not [t_s for t_s, _ in made if 632 < t_s < 980]
    after_s, first = next((t_s, entry) for t_s, entry in made if t_s > 980)
    lived = [t_s for t_s, _ in run.entries(ROVER_CYCLE) if 632 < t_s < 980]
    assert first.cycles >= len(lived) > 20
    held = {entry.number: t_s for t_s, entry in run.entries(GROUND_SHADOW)}
    assert held[first.number] - after_s < 10, "before the telemetry that was stored"
    assert all(entry.in_step for _, entry in run.entries(GROUND_SHADOW))


def test_a_proposal_names_the_lists_that_it_came_from(
    mission: Callable[[str], Rehearsal],
) -> None:
    run = mission("blackout").run()
    checks = {entry.check for _, entry in run.entries(GROUND_SHADOW)}
    proposals = [entry for _, entry in run.entries(GROUND_PROPOSAL)]
    assert len(proposals) > 10
    named = [proposal for proposal in proposals if proposal.model_check in checks]
    assert len(named) == len(proposals)


def test_the_summary_states_the_price(mission: Callable[[str], Rehearsal]) -> None:
    run = mission("blackout").run()
    price, sent = run.result.shadow, [entry for _, entry in run.entries(ROVER_MODEL)]
    assert price is not None
    assert (price.updates, price.wholes) == (len(sent), 1)
    assert price.cycles == sum(entry.cycles for entry in sent) <= len(run.entries(ROVER_CYCLE))
    carried = sum(entry.size_byte for entry in sent)
    assert carried + 70 * len(sent) < price.downlink_bytes < carried + 150 * len(sent)
    assert price.downlink_share == pytest.approx(
        price.downlink_bytes / run.link_counters(Direction.DOWN).bytes, rel=0.01
    )
    assert price.bits_per_cycle is not None
    assert 500 < price.bits_per_cycle < 2000
    assert price.downlink_share < 0.05
    assert price.in_step


@pytest.mark.parametrize("why", ["not wanted", "a controller of one's own"])
def test_where_there_is_no_shadow_nothing_is_said_of_one(
    mission: Callable[[str], Rehearsal], why: str
) -> None:
    rehearsal = mission("blackout").set("duration_s", 200.0).set("expect", [])
    if why == "not wanted":
        run = rehearsal.set("rover.shadow", False).run()
    else:
        run = rehearsal.controller(Still).run()
    assert run.result.shadow is None
    assert [*run.each(ROVER_MODEL), *run.each(GROUND_SHADOW)] == []
    assert {entry.model_check for _, entry in run.entries(GROUND_PROPOSAL)} <= {None}


def test_live_telemetry_comes_as_it_did_without_a_shadow(
    mission: Callable[[str], Rehearsal],
) -> None:
    """What the shadow takes is what nothing else needs: no frame is dropped for it."""
    clear = mission("blackout").without_blackouts().set("link.down.loss", 0.0).set("expect", [])
    waits = []
    for shadow in (True, False):
        run = clear.set("rover.shadow", shadow).run()
        assert run.frames("down", Fate.EXPIRED) == run.frames("down", Fate.QUEUE_FULL) == ()
        priority = SERVICES[Proposal].priority
        urgent = [frame for frame in run.frames("down") if frame.priority == priority]
        waits.append(max(frame.sent_ns - frame.queued_ns for frame in urgent))
    # A frame that is being sent is not cut off: 1 kB at 64 kbit/s.
    assert waits[0] - waits[1] < 130_000_000
