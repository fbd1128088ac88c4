"""The second study: goals an hour on a link that is out for a share of the time."""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

from yards import (
    CountingModel,
    mission_with,
    random_stream,
    shadowed_map,
    simulated,
    taught,
)

from farside.acts import Act
from farside.control import Mode
from farside.ground import Operator, ScriptedOperator, Situation
from farside.ground.config import Pursue, ScriptStep, SwitchMode
from farside.messages import Approve, Order, SetGoal, SetMode
from farside.missions import MissionFile
from farside.places import Chart, is_place_token, place_name, place_token
from farside.topics import OperatorEntry

BEGIN_S = 100.0
"""By then the operator's list is on board, and the first outage may begin."""

WORK_S = 900.0
SHADOW_S = 1800.0
GOALS = 40
BATCH = 10
"""So many commands at once come through the uplink before they expire."""
SHARES = (0, 15, 30, 45, 60, 75, 90)
LENGTHS_S = {"long": 180.0, "short": 40.0}
"""Mean length of an outage, by name."""


class Consenting:
    """An operator who sends a list of goals at once, the first with the highest priority.

    Then it consents to whatever is proposed, and takes over again from a rover that was alone.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, places: Sequence[str]) -> None:
        self._orders: list[Order] = [SetMode(Mode.SHARED)]
        self._orders += [
            SetGoal((place_token(place),), 10 - n / 100) for n, place in enumerate(places)
        ]
        self._answered = 0
        self.progress = OperatorEntry(0, 1, None)

    def act(self, situation: Situation) -> Sequence[Act]:
        """See `Operator.act`."""
        proposal, telemetry = situation.belief.proposal, situation.belief.telemetry
        if situation.silent or telemetry is None or not situation.settled:
            return ()
        if self._orders:
            orders, self._orders = self._orders[:BATCH], self._orders[BATCH:]
            return orders
        if telemetry.mode is not Mode.SHARED:
            return [SetMode(Mode.SHARED)]
        if proposal is None or proposal.number == self._answered:
            return ()
        self._answered = proposal.number
        return [Approve(proposal.number)]


class WorkList:
    """An operator with a list of places: in shared mode, by consent, one after the other.

    What the rover has reached meanwhile by itself it leaves out.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, places: Sequence[str], chart: Chart) -> None:
        self._places = list(places)
        self._chart = chart
        self._script: ScriptedOperator | None = None
        self.progress = OperatorEntry(0, len(self._places), None)

    def act(self, situation: Situation) -> Sequence[Act]:
        """See `Operator.act`."""
        if self._script is not None:
            orders = self._script.act(situation)
            if self._script.progress.waiting_for is not None:
                return orders
            self._script = None
        while self._places:
            place = self._places.pop(0)
            if not situation.belief.reached((place_token(place),)):
                steps: list[ScriptStep] = [SwitchMode(mode=Mode.SHARED), Pursue(place=place)]
                self._script = ScriptedOperator(steps, self._chart)
                return self._script.act(situation)
        return ()


def outages(share: float, mean_s: float, seed: int) -> list[dict[str, float]]:
    """Outages for a share of the time on average: both they and the times between exponential."""
    rng = random_stream(seed, 77)
    if not share:
        return []
    up_s, spans = mean_s * (1 - share) / share, []
    # It begins as if it had been so for long: in an outage, or between two.
    t_s = BEGIN_S + (0.0 if rng.random() < share else rng.exponential(up_s))
    while t_s < BEGIN_S + WORK_S:
        end_s = t_s + rng.exponential(mean_s)
        spans.append({"start_s": round(t_s, 3), "end_s": round(end_s, 3) + 0.001})
        t_s = end_s + 0.002 + rng.exponential(up_s)
    return spans


def shuffled(chart: Chart, seed: int) -> list[str]:
    """All places but the dock, in an order of the seed's."""
    names = sorted(place_name(token) for token in chart.cells if token != "at:D")  # noqa: S105
    random_stream(seed, 78).shuffle(names)
    return names


@cache
def memory(drawing: str) -> bytes:
    """What a model remembers that was led over every arc of a yard."""
    return taught(mission_with(0, world__map=drawing).world.chart())


def goals_reached(mission: MissionFile, operator: Operator) -> tuple[int, int]:
    """One run: how many places were reached as goals, and the number of actions."""
    model = CountingModel.load(memory(mission.world.map))
    assert isinstance(model, CountingModel)
    model.watch(mission.world.chart())
    simulated(mission, operator, model).run(model)
    return len({goal for goal in model.reached if is_place_token(goal[0])}), model.performed


def worked(on_loss: str, length: str, share: int, seed: int) -> dict[str, Any]:
    """A quarter of an hour of work on a list in the yard of `blackout`, with outages."""
    spans = outages(share / 100, LENGTHS_S[length], seed)
    end_s = BEGIN_S + WORK_S
    mission = mission_with(
        seed, duration_s=end_s, link__blackouts=spans, rover__failsafe__on_loss=on_loss
    )
    places = shuffled(mission.world.chart(), seed)[:GOALS]
    reached, actions = goals_reached(mission, Consenting(places))
    out_s = sum(min(span["end_s"], end_s) - span["start_s"] for span in spans)
    return {
        "on_loss": on_loss,
        "length": length,
        "share": share,
        "seed": seed,
        "goals": reached,
        "actions": actions,
        "out": round(out_s / WORK_S, 4),
    }


def shadowed(policy: str, seed: int) -> dict[str, Any]:
    """Half an hour in the yard with terrain shadow; `hold` for no autonomy at all."""
    mission = mission_with(
        seed,
        duration_s=SHADOW_S,
        world__map=shadowed_map(),
        rover__failsafe__on_loss="hold" if policy == "hold" else "autonomy",
        rover__failsafe__return_to="none" if policy == "hold" else policy,
    )
    chart = mission.world.chart()
    reached, actions = goals_reached(mission, WorkList(shuffled(chart, seed), chart))
    return {"policy": policy, "seed": seed, "goals": reached, "actions": actions}


def cases(seeds: Sequence[int]) -> Iterator[tuple[str, str, int, int]]:
    """Every run of the blackout study; without outages their length makes no difference."""
    for on_loss in ("autonomy", "hold"):
        for length in LENGTHS_S:
            for share in SHARES:
                if share or length == "long":
                    yield from ((on_loss, length, share, seed) for seed in seeds)
