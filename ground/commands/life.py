"""The life of one command as the ground knows it: what is due, what is known, and the verdicts."""

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from farside.control import CommandStage, TakeBackChance, Verdict
from farside.ground.commands.timing import MARGIN_NS, Timing
from farside.ground.moves import MoveTimes
from farside.messages import ACTS, Command, CommandReached, Telemetry
from farside.node import NEVER_NS
from farside.topics import LifeEntry, StageDue


class Stage:
    """A stage on board.

    Attributes:
        due: when it is due, and when word of it is.
        so_ns: when it was so; `None` while that is not known.
        by_ns: by when it is known to have been so.
        learned_ns: when the ground learned that it was so.
        verdict: what is known of it; `None` before it is due.
    """

    def __init__(self, due: StageDue) -> None:
        self.due = due
        self.so_ns: int | None = None
        self.by_ns: int | None = None
        self.learned_ns: int | None = None
        self.verdict: Verdict | None = None
        self._told: tuple[Verdict | None, int | None] = (None, None)

    @property
    def is_known(self) -> bool:
        """Whether it is known to have been so."""
        return self.so_ns is not None or self.by_ns is not None

    def learn(self, so_ns: int, now_ns: int) -> None:
        """It was so at exactly this time."""
        if self.so_ns is None:
            self.so_ns = so_ns
            self.learned_ns = now_ns if self.learned_ns is None else self.learned_ns

    def learn_by(self, by_ns: int, now_ns: int) -> None:
        """It was so by this time."""
        self.by_ns = by_ns if self.by_ns is None else min(self.by_ns, by_ns)
        self.learned_ns = now_ns if self.learned_ns is None else self.learned_ns

    def judge(self, now_ns: int, *, over: bool) -> bool:
        """Give the verdict of this moment; true if there is news.

        Args:
            now_ns: the present.
            over: whether the command is known to be over: then no more word of this is due.
        """
        due = self.due
        if self.so_ns is not None:
            self.verdict = Verdict.ON_TIME if self.so_ns <= due.due_ns else Verdict.LATE
        elif self.by_ns is not None:
            if self.by_ns <= due.due_ns:
                self.verdict = Verdict.ON_TIME
        elif not over:
            if now_ns >= due.told_due_ns:
                self.verdict = Verdict.OVERDUE
            elif now_ns >= due.due_ns:
                self.verdict = Verdict.UNKNOWN
        told, self._told = self._told, (self.verdict, self.so_ns)
        return self.verdict is not None and told != self._told

    def wakes_ns(self, now_ns: int) -> int:
        """When its verdict changes next if nothing is heard."""
        if self.is_known:
            return NEVER_NS
        due = self.due
        return min((t for t in (due.due_ns, due.told_due_ns) if t > now_ns), default=NEVER_NS)


class Foreseen(NamedTuple):
    """When a command is expected to be taken, begun and done, from what is known."""

    taken_ns: int
    begun_ns: int
    done_ns: int


class Life:
    """The life of a command that has left the ground.

    Attributes:
        command: the command.
        action: the action that it asks for; `None` if for none, or if not known.
        given_ns: when it left the operator's hands.
        arrives_ns: when by plan it is at the rover, behind what is queued before it.
        stages: taken, begun (of an action) and done; what ends it otherwise counts as done.
        end: how it ended; `None` while that is not known.
        over_by_ns: by when it is known to have been over.
        waited_ns: until when it is known not to have begun.
        absent_ns: until when it is known not to have been on board, though it was due.
        begins_ns: before this it cannot begin, by plan and by what is known.
        take_back: whether it can be taken back, and until when, as told last.
    """

    def __init__(
        self, command: Command, action: str | None, given_ns: int, arrives_ns: int, begins_ns: int
    ) -> None:
        self.command, self.action, self.given_ns = command, action, given_ns
        self.is_action = isinstance(command.order, ACTS)
        self.stages: dict[CommandStage, Stage] = {}
        self.end: CommandReached | None = None
        self.over_by_ns: int | None = None
        self.waited_ns = self.absent_ns = 0
        self.arrives_ns, self.begins_ns = arrives_ns, begins_ns
        self.take_back: tuple[TakeBackChance, int | None] = (TakeBackChance.OPEN, None)

    def expect(self, foreseen: Foreseen, timing: Timing) -> None:
        """Set the dues."""
        times = {CommandStage.TAKEN: foreseen.taken_ns, CommandStage.BEGUN: foreseen.begun_ns}
        if not self.is_action:
            del times[CommandStage.BEGUN]
        times[CommandStage.DONE] = foreseen.done_ns
        for stage, expected_ns in times.items():
            due_ns = min(NEVER_NS, expected_ns + MARGIN_NS)
            due = StageDue(stage, expected_ns, due_ns, timing.told_ns(due_ns))
            self.stages[stage] = Stage(due)

    @property
    def number(self) -> int:
        """The number of the command."""
        return self.command.number

    @property
    def is_over(self) -> bool:
        """Whether it is known to be over."""
        return self.end is not None or self.over_by_ns is not None

    @property
    def has_begun(self) -> bool:
        """Whether it is known to have begun, or to be over."""
        begun = self.stages.get(CommandStage.BEGUN)
        return self.is_over or (begun is not None and begun.is_known)

    @property
    def begun_ns(self) -> int | None:
        """When its action began, if that is known."""
        begun = self.stages.get(CommandStage.BEGUN)
        return None if begun is None else begun.so_ns

    @property
    def dues(self) -> tuple[StageDue, ...]:
        """When its stages are due."""
        return tuple(stage.due for stage in self.stages.values())

    # --- what is learned -----------------------------------------------------------------------

    def reach(self, reached: CommandReached, so_ns: int, now_ns: int) -> None:
        """The rover says that it came to a stage; see `CommandReached` for what that implies."""
        self.stages[CommandStage.TAKEN].learn(so_ns, now_ns)
        if reached.stage.is_last:
            self.end = reached
            self.stages[CommandStage.DONE].learn(so_ns, now_ns)
        else:
            self.stages[reached.stage].learn(so_ns, now_ns)

    def see(self, telemetry: Telemetry, now_ns: int) -> bool:
        """What telemetry says of it; true if that is news."""
        made_ns, before = telemetry.time_ns, (self.is_over, self.has_begun, self._is_taken)
        if self.number <= telemetry.commands_done:
            self.over_by_ns = min(self.over_by_ns or made_ns, made_ns)
        elif self.number in telemetry.waiting:
            self.waited_ns = max(self.waited_ns, made_ns)
        elif self.number == telemetry.begun:
            self.stages[CommandStage.BEGUN].learn_by(made_ns, now_ns)
        else:
            self.absent_ns = max(self.absent_ns, made_ns)
            return False
        self.stages[CommandStage.TAKEN].learn_by(made_ns, now_ns)
        return before != (self.is_over, self.has_begun, self._is_taken)

    @property
    def _is_taken(self) -> bool:
        return self.stages[CommandStage.TAKEN].is_known

    # --- what is told --------------------------------------------------------------------------

    def judge(self, now_ns: int) -> Iterator[LifeEntry]:
        """The verdicts that are new at this moment."""
        for stage in self.stages.values():
            if stage.judge(now_ns, over=self.is_over):
                yield self._entry(stage)

    def _entry(self, stage: Stage) -> LifeEntry:
        due, end = stage.due, None
        if due.stage is CommandStage.DONE:
            end = self.end
        chance, until_ns = self.take_back
        return LifeEntry(
            number=self.number,
            stage=due.stage if end is None else end.stage,
            verdict=stage.verdict,
            due_ns=due.due_ns,
            told_due_ns=due.told_due_ns,
            so_ns=stage.so_ns,
            take_back=chance,
            take_back_until_ns=until_ns,
            why=None if end is None else end.why,
        )

    def wakes_ns(self, now_ns: int) -> int:
        """When a verdict changes next if nothing is heard."""
        if self.is_over:
            return NEVER_NS
        return min(stage.wakes_ns(now_ns) for stage in self.stages.values())


def foresee(lives: Iterable[Life], times: MoveTimes, round_trip_ns: int) -> dict[int, Foreseen]:
    """When commands not known to be over are expected to be done, moves in the usual time.

    What is known not to have been on board when it was due was lost, and comes again a round trip
    later, or several.

    Actions follow one another; what has a `when` waits for that.
    """
    found: dict[int, Foreseen] = {}
    free_ns, facing = 0, times.facing
    for life in lives:
        taken_ns = life.stages[CommandStage.TAKEN].so_ns if life.stages else None
        if taken_ns is None:
            late_ns = max(0, life.absent_ns - life.arrives_ns)
            again_ns = round_trip_ns + 2 * MARGIN_NS
            taken_ns = life.arrives_ns + -(-late_ns // again_ns) * again_ns
        begun_ns = max(taken_ns, life.waited_ns)
        when = life.command.when
        if when is not None:
            begun_ns = max(begun_ns, when.at_ns or 0)
            if when.after in found:
                begun_ns = max(begun_ns, found[when.after].done_ns)
        done_ns = begun_ns
        if life.is_action:
            so_ns = life.begun_ns
            begun_ns = max(begun_ns, free_ns) if so_ns is None else so_ns
            move_ns = times.expected(facing, life.action).mean_ns
            done_ns = free_ns = min(NEVER_NS, begun_ns + move_ns)
            facing = life.action
        found[life.number] = Foreseen(taken_ns, begun_ns, done_ns)
    return found


def bound(life: Life, known: Callable[[int], Life | None], least_move_ns: int) -> int:
    """Before this a command cannot begin: by what it waits for, and by what is known of that.

    It holds whatever the rover meets, if the link is not faster than planned: a move that is done
    takes `least_move_ns`, and what is meant to follow on an action is refused unless that is done.

    Args:
        life: the command's; the bounds of those before it are known.
        known: gives the lives of those that are not forgotten.
        least_move_ns: see `Moves`.
    """
    command, begins_ns = life.command, max(life.begins_ns, life.waited_ns)
    afters: list[int | None] = []
    if command.when is not None:
        begins_ns = max(begins_ns, command.when.at_ns or 0)
        afters.append(command.when.after)
    if command.meant is not None and life.is_action:
        afters.append(command.meant.after)
    for after in afters:
        first = None if after is None else known(after)
        if first is not None:
            begins_ns = max(begins_ns, _done_ns(first, least_move_ns))
    return begins_ns


def _done_ns(life: Life, least_move_ns: int) -> int:
    """Before this a command cannot be done."""
    done_ns = life.stages[CommandStage.DONE].so_ns
    if done_ns is not None:
        return done_ns
    if not life.is_action:
        return life.begins_ns
    begun_ns = life.begins_ns if life.begun_ns is None else life.begun_ns
    return begun_ns + least_move_ns
