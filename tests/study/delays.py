"""The fourth study: does autonomy pay? Goals an hour, by round trip and way to work."""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any

from predicting import Judge
from working import shuffled
from yards import CountingModel, mission_with, simulated, taught

from farside.acts import Act, Planned
from farside.control import Mode
from farside.ground import Operator, Situation
from farside.messages import Approve, Drive, Order, SetGoal, SetMode
from farside.node import Record, to_ns
from farside.places import Chart, place_name, place_token
from farside.topics import ROVER_ACTION_STARTED, ROVER_CYCLE, OperatorEntry

ROUND_TRIPS_S = (0.2, 2.56, 10.0, 60.0, 480.0, 1200.0, 2400.0)
"""From the next room to the far side of the Sun."""

LESSONS = 3
"""The model was led three times over every arc, where nothing else is said."""

LESSON_TRIPS_S, LESSON_ROUNDS = (2.56, 60.0), (0.0, 0.25, 0.5, 1.0)

WAYS = ("wait", "consent", "trust", "goals")
TARGETS = 30
LEAST_S, ROUND_TRIPS = 3600.0, 12
"""A run lasts an hour, or twelve round trips, or until all targets are reached."""

SURE = 0.5
"""Who trusts a prediction goes on from it as long as it is more probable than not."""


class Visits:
    """The places where the rover is known to have been, as the ground hears of them."""

    def __init__(self, targets: Sequence[str]) -> None:
        self.left = list(targets)

    def hear(self, situation: Situation) -> None:
        """Leave out the places where it is known to have been."""
        place = situation.belief.now.place
        if place is not None and place.value is not None:
            self.left = [one for one in self.left if place_token(one) != place.value]


class Waiting:
    """An operator who drives from target to target, and waits after every move to hear of it.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, targets: Sequence[str], chart: Chart) -> None:
        self._visits, self._chart = Visits(targets), chart
        self.progress = OperatorEntry(0, 1, None)

    def act(self, situation: Situation) -> Sequence[Act]:
        """See `Operator.act`."""
        self._visits.hear(situation)
        place = situation.belief.now.place
        if place is None or place.value is None or not self._visits.left or not situation.settled:
            return ()
        target = self._chart.places[self._visits.left[0]]
        return [Drive(self._chart.way(self._chart.cells[place.value], target)[0])]


class Consenting:
    """An operator in shared mode who gives one goal after another, and consents to all proposals.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, targets: Sequence[str]) -> None:
        self._visits = Visits(targets)
        self._goal: str | None = None
        self._answered = 0
        self.progress = OperatorEntry(0, 1, None)

    def act(self, situation: Situation) -> Sequence[Act]:
        """See `Operator.act`."""
        belief = situation.belief
        self._visits.hear(situation)
        if belief.telemetry is None or not self._visits.left:
            return ()
        if self._goal != self._visits.left[0]:
            first = self._goal is None
            self._goal = self._visits.left[0]
            wanted = SetGoal((place_token(self._goal),), 1.0)
            return [SetMode(Mode.SHARED), wanted] if first else [wanted]
        proposal = belief.proposal
        if proposal is None or proposal.number <= self._answered:
            return ()
        self._answered = proposal.number
        return [Approve(proposal.number)]


class Trusting:
    """An operator who sends whole sequences from where the rover is predicted to be by then.

    While the prediction is more probable than not, it does not wait to hear how the last one went;
    otherwise until all that it sent is known to be over.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, targets: Sequence[str]) -> None:
        self._visits = Visits(targets)
        self._sent: set[str] = set()
        self._looked_ns = -1
        self.progress = OperatorEntry(0, 1, None)

    def act(self, situation: Situation) -> Sequence[Act]:
        """See `Operator.act`."""
        self._visits.hear(situation)
        if situation.settled:
            self._sent.clear()
        left = [target for target in self._visits.left if target not in self._sent]
        telemetry = situation.belief.telemetry
        if telemetry is None or not left or telemetry.time_ns == self._looked_ns:
            return ()
        self._looked_ns = telemetry.time_ns  # without news there is nothing new to predict
        if not situation.settled:
            ahead = situation.predicted_after()
            if not ahead or not ahead[-1].likely or ahead[-1].likely[0].probability < SURE:
                return ()
        review = situation.review_path((place_token(left[0]),))
        if review is None:
            return ()
        self._sent.update(place_name(step.sign[0]) for step in review.path)
        self._sent.add(left[0])
        return [
            Planned(Drive(step.action), follows=number > 0 or not situation.settled)
            for number, step in enumerate(review.path)
        ]


class Leaving:
    """An operator who gives all goals at once, the next one first, and leaves the rover alone.

    What came too late is given again, and that is all.

    Attributes:
        progress: see `Operator`.
    """

    def __init__(self, targets: Sequence[str]) -> None:
        self._orders: list[Order] = [SetMode(Mode.AUTONOMOUS)]
        self._orders += [
            SetGoal((place_token(target),), 1.0 - n / TARGETS / 2)
            for n, target in enumerate(targets)
        ]
        self._given: dict[int, Order] = {}
        self.progress = OperatorEntry(0, 1, None)

    def act(self, situation: Situation) -> Sequence[Act]:
        """See `Operator.act`."""
        commands = situation.commands
        late = [number for number in self._given if commands.end_of(number) is not None]
        orders = [*self._orders, *(self._given.pop(number) for number in late)]
        self._orders = []
        self._given.update(enumerate(orders, start=commands.last_given + 1))
        return orders


def operator(way: str, targets: Sequence[str], chart: Chart) -> Operator:
    """Who works in this way."""
    match way:
        case "wait":
            return Waiting(targets, chart)
        case "consent":
            return Consenting(targets)
        case "trust":
            return Trusting(targets)
        case _:
            return Leaving(targets)


class Tally:
    """Counts from the records of a run the targets that the rover was at, and its moves.

    A target counts once, also when the rover comes by on the way to another: so it is when a goal
    is on its list.

    Attributes:
        left: the targets that it was not at yet.
        moves: how many moves it made.
        began_ns: when the first of them began; `None` before.
    """

    def __init__(self, targets: Sequence[str]) -> None:
        self.left = set(map(place_token, targets))
        self.moves = 0
        self.began_ns: int | None = None

    def add(self, records: Sequence[Record]) -> None:
        """Count what is in the records of a window."""
        for record in records:
            if record.topic == ROVER_CYCLE.name:
                self.left.difference_update(ROVER_CYCLE.decode(record.payload).tokens)
            elif record.topic == ROVER_ACTION_STARTED.name:
                self.moves += 1
                if self.began_ns is None:
                    self.began_ns = record.log_time_ns


def delayed(way: str, round_trip_s: float, seed: int, lessons: float = LESSONS) -> dict[str, Any]:
    """One run: goals and moves, and how the predicted rover compared with the true one.

    Args:
        way: one of `WAYS`.
        round_trip_s: light time both ways.
        seed: of the run.
        lessons: how often the model was led over every arc of the yard before.
    """
    duration_s = max(LEAST_S, ROUND_TRIPS * round_trip_s)
    mission = mission_with(
        seed,
        duration_s=duration_s,
        link__up={"delay_s": round_trip_s / 2, "rate_bit_s": 2000, "loss": 0.01},
        link__down={"delay_s": round_trip_s / 2, "rate_bit_s": 64_000, "loss": 0.01},
    )
    chart = mission.world.chart()
    targets = shuffled(chart, seed)[:TARGETS]
    model = CountingModel.load(lesson(mission.world.map, lessons))
    assert isinstance(model, CountingModel)
    model.watch(chart)
    run = simulated(mission, operator(way, targets, chart), model)
    tally, judge = Tally(targets), Judge()
    end_ns, now_ns = to_ns(duration_s), 0
    while now_ns < end_ns and tally.left:
        now_ns = min(now_ns + mission.window_ns, end_ns)
        records = run.crew.advance(now_ns)
        tally.add(records)
        judge.add(records, now_ns)
    assert not run.crew.lost_processes
    return {
        "way": way,
        "round_trip_s": round_trip_s,
        "seed": seed,
        "lessons": lessons,
        "hours": round((now_ns - (tally.began_ns or 0)) / 3.6e12, 4),
        "goals": TARGETS - len(tally.left),
        "moves": tally.moves,
        **judge.told(),
    }


@cache
def lesson(drawing: str, rounds: float) -> bytes:
    """What a model remembers that was led over a yard's arcs so many times, or a part of them."""
    return taught(mission_with(0, world__map=drawing).world.chart(), rounds)


def delay_cases(seeds: Sequence[int]) -> Iterator[tuple[str, float, int]]:
    """Every run of the study of delays, the longest first."""
    for round_trip_s in ROUND_TRIPS_S[::-1]:
        for way in WAYS:
            yield from ((way, round_trip_s, seed) for seed in seeds)


def lesson_cases(seeds: Sequence[int]) -> Iterator[tuple[str, float, int, float]]:
    """Every run of the study of how well the model was taught, beside those of `delay_cases`."""
    for round_trip_s in LESSON_TRIPS_S[::-1]:
        for rounds in LESSON_ROUNDS:
            yield from (("wait", round_trip_s, seed, rounds) for seed in seeds)
