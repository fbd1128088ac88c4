"""Sequences, conditions and withdrawals at random; and what the ground said of them, judged."""

from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Literal

from hazards import ACTIONS, YARDS, Hazard, Wild, fly, hazards, orders
from hypothesis import strategies as st
from numpy.random import Generator

from farside.acts import Act, Discard, Planned
from farside.control import CommandStage, OnLoss, TakeBackChance, Verdict
from farside.frames import FrameFate
from farside.ground import Situation
from farside.ground.commands.life import Life
from farside.logs.file.reading import LogEntry, LogFile
from farside.messages import CommandReached, Drive, SetOnLoss, TakeBack, Telemetry
from farside.missions import FinishedRun
from farside.node import NEVER_NS, Direction, to_ns, to_s
from farside.places import Chart
from farside.topics import (
    GROUND_COMMAND,
    GROUND_EVENT,
    GROUND_LIFE,
    GROUND_STORED_TELEMETRY,
    GROUND_TELEMETRY,
    LINK_FRAME,
    ROVER_COMMAND,
    CommandEntry,
    CommandSent,
    EventLearned,
    LifeEntry,
)

_TICK_NS = to_ns(0.04)
_BEGUN = [stage for stage in CommandStage if stage.is_last or stage is CommandStage.BEGUN]
_REACHED = CommandStage.BEGUN, CommandStage.DONE, CommandStage.FAILED


Habits = tuple[float | Literal["last"] | None, ...]


# --- to fly -----------------------------------------------------------------------------------


class Withdrawing(Wild):
    """Takes back some of what it gave.

    Attributes:
        habits: what it does with one command after the other, over and over. `last`: it takes it
            back at the last moment at which that is sure. A number: after so many seconds, sure or
            not. `None`: it leaves it.
    """

    habits: Habits = (None,)

    def __init__(self, chart: Chart, *, rng: Generator) -> None:
        super().__init__(chart, rng=rng)
        self._withdrawn: set[int] = set()

    def act(self, situation: Situation) -> Sequence[Act]:
        given: list[Act] = list(super().act(situation))
        for life in situation.commands.live:
            number = life.number
            if number in self._withdrawn or isinstance(life.command.order, TakeBack):
                continue
            if self._wants_back(life, situation):
                self._withdrawn.add(number)
                given.append(TakeBack(number))
        return given

    def _wants_back(self, life: Life, situation: Situation) -> bool:
        habit, now_ns = self.habits[life.number % len(self.habits)], situation.now_ns
        if habit is None:
            return False
        if habit != "last":
            return now_ns >= life.given_ns + to_ns(habit)
        _, until_ns = situation.commands.take_back(life.number, now_ns)
        return until_ns is not None and now_ns + _TICK_NS > until_ns


def _sequences(places: Sequence[str], at_s: float) -> st.SearchStrategy[list[Act]]:
    """One sequence, given at that time."""
    order = st.one_of(
        st.builds(Drive, ACTIONS),
        st.builds(Drive, ACTIONS),
        st.builds(SetOnLoss, st.sampled_from(OnLoss)),
        orders(places),
    )
    later_ns = st.floats(0, 100).map(lambda t_s: to_ns(round(at_s + t_s, 2)))
    planned = st.builds(
        Planned,
        order,
        follows=st.sampled_from([True, True, False]),
        at_ns=st.one_of(st.none(), later_ns),
        link_up=st.sampled_from([False, False, False, True]),
    )
    back_and_forth = st.sampled_from(["EW", "NS", "EEWW"]).map(
        lambda way: [Planned(Drive(action), follows=True) for action in way * 2]
    )
    due = st.builds(Planned, st.just(Drive("E")), at_ns=later_ns)
    discard = st.builds(Discard, st.integers(1, 3)).map(lambda act: [act])
    return st.one_of(
        st.lists(planned, min_size=1, max_size=5),
        st.lists(planned, min_size=1, max_size=5),
        st.builds(lambda first, rest: [first, *rest], st.one_of(due, planned), back_and_forth),
        discard,
    )


@st.composite
def planned_hazards(draw: st.DrawFn) -> tuple[Hazard, Habits]:
    """A hazard with sequences in it, over delays from 0.1 s to a minute, and what is taken back."""
    hazard = draw(hazards())
    places = sorted({place for step in hazard.script for place in getattr(step, "places", ())})
    delay_s = draw(st.sampled_from([0.1, 0.5, 1.28, 5.0, 20.0, 60.0]))
    values = {
        **hazard.values,
        "duration_s": 240.0 + 2 * delay_s,
        "link.up.delay_s": delay_s,
        "link.down.delay_s": delay_s,
        "ground.command_lifetime_s": draw(st.sampled_from([2.0, 20.0, 200.0])),
    }
    rarely = st.sampled_from([False, False, True])
    if draw(rarely):
        values["link.passes"] = draw(
            st.sampled_from(
                [
                    {"first_s": 0.0, "period_s": 120.0, "length_s": 40.0},
                    {"first_s": 3.0, "period_s": 17.0, "length_s": 6.0},
                ]
            )
        )
    if draw(rarely):
        values["link.down.jitter"] = values["link.up.jitter"] = {"spread_s": 0.2}
    if draw(st.booleans()):
        values["link.blackouts"] = []
    if draw(st.booleans()):
        values |= {"link.up.loss": 0.0, "link.down.loss": 0.0}
    script = hazard.script
    if draw(st.booleans()):
        script = ()
        # Where moves to and fro are done, so that what follows on them begins.
        values |= {"world.map": "\n".join(YARDS["corridor"]), "rover.start": "D"}
        values |= {"rover.goals": [], "rover.faults": [], "rover.battery.capacity_j": 250_000.0}
        places = ["B", "D"]
    acts = list(hazard.orders) if draw(st.booleans()) else []
    for at_s in draw(st.lists(st.floats(1, 150), min_size=1, max_size=4)):
        acts += [(round(at_s, 2), act) for act in draw(_sequences(places, at_s))]
    acts.sort(key=lambda one: one[0])
    habit: st.SearchStrategy[float | Literal["last"] | None] = st.one_of(
        st.none(), st.just("last"), st.sampled_from([0.0, 2.0, 10.0])
    )
    habits = draw(st.lists(habit, min_size=1, max_size=7))
    return hazard._replace(values=values, script=script, orders=tuple(acts)), tuple(habits)


def fly_planned(planned: tuple[Hazard, Habits], folder: Path) -> FinishedRun:
    """Run it in this process; the log is in `folder`."""
    hazard, habits = planned
    return fly(hazard, folder, type("Planning", (Withdrawing,), {"habits": habits}))


# --- to judge ---------------------------------------------------------------------------------


class Judge:
    """Finds what the ground said of commands and was not so, in the log of the whole run.

    Attributes:
        wrong: what was not so, in words.
        said: how often it said what.
    """

    def __init__(self, run: FinishedRun) -> None:
        self.wrong: list[str] = []
        self.said: Counter[str] = Counter()
        log = LogFile(run.log)
        topics = (ROVER_COMMAND, LINK_FRAME)
        self._so: dict[tuple[int, CommandStage], int] = {}
        self._light_ns = NEVER_NS
        self._arrived: list[tuple[int, int]] = []  # frames from the rover: made, arrived
        for entry in map(LogEntry.of, log.records(topics)):
            match entry.message:
                case CommandEntry(number=number, stage=stage):
                    self._so[number, stage] = entry.log_time_ns
                case FrameFate(direction=Direction.DOWN, arrival_ns=int(at_ns), queued_ns=made_ns):
                    self._arrived.append((made_ns, at_ns))
                    self._light_ns = min(self._light_ns, at_ns - made_ns)
        self._sent: dict[int, CommandSent] = {}
        self._words: set[tuple[int, CommandStage]] = set()
        self._chance: dict[int, tuple[TakeBackChance, int | None]] = defaultdict(
            lambda: (TakeBackChance.OPEN, None)
        )
        self._verdicts: dict[tuple[int, CommandStage], Verdict] = {}
        self._exact: set[tuple[int, CommandStage]] = set()
        self._news: set[tuple[int, CommandStage]] = set()
        lives = (GROUND_COMMAND, GROUND_EVENT, GROUND_LIFE)
        heard = (GROUND_STORED_TELEMETRY, GROUND_TELEMETRY)
        for entry in map(LogEntry.of, log.records((*lives, *heard))):
            self._follow(entry)
        self._finish(log.end_ns)

    def _follow(self, entry: LogEntry) -> None:
        match entry.message:
            case CommandSent() as sent:
                self._sent[sent.number] = sent
                self._promise(sent, entry.log_time_ns)
            case EventLearned(event=event) if isinstance(event.what, CommandReached):
                number, stage = event.what.number, event.what.stage
                self._words |= {(number, CommandStage.TAKEN), (number, stage)}
                self._news |= {(number, CommandStage.TAKEN), (number, stage)}
                if stage.is_last:
                    self._over(number)
            case Telemetry() as telemetry:
                self._telemetry(telemetry)
            case LifeEntry() as life:
                self._life(life, entry)

    def _over(self, number: int) -> None:
        stages = CommandStage.TAKEN, CommandStage.BEGUN, CommandStage.DONE
        self._words |= {(number, stage) for stage in stages}

    def _telemetry(self, telemetry: Telemetry) -> None:
        for number in range(1, telemetry.commands_done + 1):
            self._over(number)
        for number in telemetry.waiting:
            self._words.add((number, CommandStage.TAKEN))
        if telemetry.begun is not None:
            begun = telemetry.begun
            self._words |= {(begun, CommandStage.TAKEN), (begun, CommandStage.BEGUN)}

    def _life(self, life: LifeEntry, entry: LogEntry) -> None:
        number, stage, verdict = life.number, life.stage, life.verdict
        self._chance[number] = life.take_back, life.take_back_until_ns
        begun_ns = min(self._so.get((number, one), NEVER_NS) for one in _BEGUN)
        if life.take_back is TakeBackChance.TOO_LATE and begun_ns > entry.log_time_ns:
            self.wrong.append(f"command {number} was said to be too late to take back")
        if verdict is None:
            return
        assert stage is not None
        self.said[verdict.value] += 1
        due = CommandStage.DONE if stage.is_last else stage
        self._verdicts[number, due] = verdict
        text = f"{to_s(entry.log_time_ns):.2f} s: command {number} {stage} {verdict}"
        if verdict in {Verdict.ON_TIME, Verdict.LATE}:
            wrong = self._known(life, self._so.get((number, stage)))
            if life.so_ns is not None:
                self._exact.add((number, due))
        else:
            wrong = self._not_known(life, entry.log_time_ns, (number, due) in self._words)
        self.wrong += [f"{text}, {one}" for one in wrong]

    def _known(self, life: LifeEntry, so_ns: int | None) -> Iterator[str]:
        """What is wrong with the words on a stage that has come."""
        assert life.due_ns is not None
        if so_ns is None:
            yield "and it never came"
        elif (so_ns <= life.due_ns) is not (life.verdict is Verdict.ON_TIME):
            yield f"was so at {so_ns}, and due at {life.due_ns}"
        if life.so_ns is not None and life.so_ns != so_ns:
            yield f"at {life.so_ns}, was so at {so_ns}"

    def _not_known(self, life: LifeEntry, now_ns: int, has_word: bool) -> Iterator[str]:
        """What is wrong with the words on a stage that is not known to have come."""
        assert life.due_ns is not None
        assert life.told_due_ns is not None
        if has_word:
            yield "and word of it had come"
        if life.verdict is Verdict.OVERDUE:
            if now_ns < life.told_due_ns:
                yield f"and word is due at {life.told_due_ns}"
            if self._arrived and life.told_due_ns - life.due_ns < self._light_ns:
                yield "and word of it could not have come"
            return
        if not life.due_ns <= now_ns < life.told_due_ns:
            yield f"was due at {life.due_ns}, and word at {life.told_due_ns}"
        heard = [one for one in self._arrived if one[0] > life.due_ns and one[1] < now_ns]
        if heard:
            yield f"and {len(heard)} frames made after it was due had come"

    def _promise(self, sent: CommandSent, now_ns: int) -> None:
        """An order to take back: if the promise was kept until then, the command never began."""
        if not isinstance(sent.order, TakeBack) or sent.when is not None:
            return
        number = sent.order.number
        chance, until_ns = self._chance[number]
        taken_ns = self._so.get((sent.number, CommandStage.TAKEN))
        self.said[f"{chance.value}, and was ordered to be"] += 1
        began = any((number, stage) in self._so for stage in _REACHED)
        if chance is not TakeBackChance.SURE or until_ns is None or now_ns > until_ns:
            return
        if taken_ns is None or taken_ns > sent.dues[0].due_ns:
            return
        self.said["promises put to the test"] += 1
        if now_ns > until_ns - 2 * _TICK_NS:
            self.said["promises put to the test at the last moment"] += 1
        if began:
            self.wrong.append(
                f"{to_s(now_ns):.2f} s: command {number} could be taken back until {until_ns}; "
                f"the withdrawal was taken at {taken_ns}, and it began all the same"
            )

    def _finish(self, end_ns: int) -> None:
        """Something is said of every stage that was due, or that word came of."""
        for sent in self._sent.values():
            for due in sent.dues:
                key = sent.number, due.stage
                if key in self._words or due.due_ns > end_ns - _TICK_NS:
                    continue
                is_overdue = due.told_due_ns <= end_ns - _TICK_NS
                wanted = Verdict.OVERDUE if is_overdue else Verdict.UNKNOWN
                if self._verdicts.get(key) is not wanted:
                    found = self._verdicts.get(key)
                    self.wrong.append(f"in the end command {key} {found} and not {wanted}")
        for number, stage in self._news:
            key = number, CommandStage.DONE if stage.is_last else stage
            if key not in self._exact:
                self.wrong.append(f"word of command {number} {stage} came, and no verdict")
