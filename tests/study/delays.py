"""The fourth study: does autonomy pay? Goals an hour against the round trip, in four ways to work."""

from collections.abc import Iterator, Sequence
from typing import Any

from predicting import Judge
from working import memory, shuffled
from yards import CountingModel, mission_with, simulated

from farside.acts import Act, Planned
from farside.control import Mode
from farside.ground import Operator, ScriptedOperator, Situation
from farside.ground.config import Tour
from farside.messages import Approve, Drive, SetGoal, SetMode
from farside.node import Record, to_ns
from farside.places import Chart, place_token
from farside.topics import ROVER_ACTION_ENDED, TRUTH_POSE, OperatorEntry

ROUND_TRIPS_S = (0.2, 2.56, 10.0, 60.0, 480.0, 1200.0, 2400.0)
"""From the next room to the far side of the Sun."""

WAYS = ("wait", "consent", "trust", "goals")
TARGETS = 400
LEAST_S, ROUND_TRIPS = 3600.0, 20
"""A run lasts an hour, or twenty round trips."""

SURE = 0.5
"""Who trusts a prediction goes on from it as long as it is more probable than not."""


class Consenting:
    """An operator in shared mode who gives one goal after another, and consents to all proposals.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, targets: Sequence[str]) -> None:
        self._targets = list(targets)
        self._answered = 0
        self._sent: int | None = None
        self.progress = OperatorEntry(0, 1, None)

    def act(self, situation: Situation) -> Sequence[Act]:
        """See `Operator.act`."""
        belief = situation.belief
        if belief.telemetry is None:
            return ()
        if self._sent is None:
            self._sent = belief.last_event
            return [SetMode(Mode.SHARED), self._goal]
        if belief.reached((place_token(self._targets[0]),), self._sent):
            self._targets.pop(0)
            self._sent = belief.last_event
            return [self._goal]
        proposal = belief.proposal
        if proposal is None or proposal.number <= self._answered:
            return ()
        self._answered = proposal.number
        return [Approve(proposal.number)]

    @property
    def _goal(self) -> SetGoal:
        return SetGoal((place_token(self._targets[0]),), 1.0)


class Trusting:
    """An operator who sends whole sequences from where the rover is predicted to be by then.

    While the prediction is more probable than not, it does not wait to hear how the last one went;
    otherwise until all that it sent is known to be over.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, targets: Sequence[str]) -> None:
        self._targets = list(targets)
        self.progress = OperatorEntry(0, 1, None)

    def act(self, situation: Situation) -> Sequence[Act]:
        """See `Operator.act`."""
        if situation.belief.telemetry is None:
            return ()
        if not situation.settled:
            ahead = situation.predicted_after()
            if not ahead or not ahead[-1].likely or ahead[-1].likely[0].probability < SURE:
                return ()
        review = situation.review_path((place_token(self._targets[0]),))
        if review is None:
            place = situation.belief.now.place
            if place is not None and place.value == place_token(self._targets[0]):
                self._targets.pop(0)
            return ()
        self._targets.pop(0)
        return [
            Planned(Drive(step.action), follows=number > 0 or not situation.settled)
            for number, step in enumerate(review.path)
        ]


class Leaving:
    """An operator who gives all goals at once, the next one first, and leaves the rover alone.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, targets: Sequence[str]) -> None:
        self._goals = [
            SetGoal((place_token(target),), 1.0 - n / TARGETS / 2)
            for n, target in enumerate(targets)
        ]
        self._begun = False
        self.progress = OperatorEntry(0, 1, None)

    def act(self, situation: Situation) -> Sequence[Act]:
        """See `Operator.act`."""
        if not self._begun:
            self._begun = True
            return [SetMode(Mode.AUTONOMOUS)]
        if not self._goals or not situation.settled:
            return ()
        orders, self._goals = self._goals[:10], self._goals[10:]
        return orders


def operator(way: str, targets: Sequence[str], chart: Chart) -> Operator:
    """Who works in this way."""
    match way:
        case "wait":
            return ScriptedOperator([Tour(places=tuple(targets))], chart)
        case "consent":
            return Consenting(targets)
        case "trust":
            return Trusting(targets)
        case _:
            return Leaving(targets)


class Tally:
    """Counts from the records of a run the targets reached one after the other, and the moves."""

    def __init__(self, targets: Sequence[str]) -> None:
        self._targets = [place_token(target) for target in targets]
        self.reached = 0
        self.moves = 0

    def add(self, records: Sequence[Record]) -> None:
        """Count what is in the records of a window."""
        for record in records:
            if record.topic == TRUTH_POSE.name:
                place = TRUTH_POSE.decode(record.payload).place
                if self.reached < len(self._targets) and place == self._targets[self.reached]:
                    self.reached += 1
            elif record.topic == ROVER_ACTION_ENDED.name:
                self.moves += 1


def delayed(way: str, round_trip_s: float, seed: int) -> dict[str, Any]:
    """One run: goals and moves, and how the predicted rover compared with the true one."""
    duration_s = max(LEAST_S, ROUND_TRIPS * round_trip_s)
    mission = mission_with(
        seed,
        duration_s=duration_s,
        link__up={"delay_s": round_trip_s / 2, "rate_bit_s": 2000, "loss": 0.01},
        link__down={"delay_s": round_trip_s / 2, "rate_bit_s": 64_000, "loss": 0.01},
    )
    chart = mission.world.chart()
    names = shuffled(chart, seed)
    targets = [names[n % len(names)] for n in range(TARGETS)]
    if way == "goals":
        targets = names  # a place can be on the Goal List once
    model = CountingModel.load(memory(mission.world.map))
    assert isinstance(model, CountingModel)
    model.watch(chart)
    run = simulated(mission, operator(way, targets, chart), model)
    tally, judge = Tally(targets), Judge()
    end_ns, now_ns = to_ns(duration_s), 0
    while now_ns < end_ns and tally.reached < len(targets):
        now_ns = min(now_ns + mission.window_ns, end_ns)
        records = run.crew.advance(now_ns)
        tally.add(records)
        judge.add(records)
    assert not run.crew.lost_processes
    return {
        "way": way,
        "round_trip_s": round_trip_s,
        "seed": seed,
        "hours": round(now_ns / 3.6e12, 4),
        "goals": tally.reached,
        "moves": tally.moves,
        **judge.told(),
    }


def delay_cases(seeds: Sequence[int]) -> Iterator[tuple[str, float, int]]:
    """Every run of the study, the longest first."""
    for round_trip_s in ROUND_TRIPS_S[::-1]:
        for way in WAYS:
            yield from ((way, round_trip_s, seed) for seed in seeds)
