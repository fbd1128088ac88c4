"""What would surprise the operator, found in the log of a run."""

from collections.abc import Iterator
from typing import NamedTuple

from farside.control import Chooser, CommandStage, Failsafe, Mode
from farside.logs.views import RunView
from farside.messages import Proposal, Tokens
from farside.node import to_s
from farside.topics import (
    GROUND_COMMAND,
    ROVER_ACTION_STARTED,
    ROVER_COMMAND,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_PROPOSAL,
    ActionStarted,
    CommandEntry,
    CommandSent,
    FailsafeEntry,
    GoalChange,
    GoalEntry,
    GoalSource,
    ModeEntry,
)

_BEFORE: dict[CommandStage, set[CommandStage | None]] = {
    CommandStage.TAKEN: {None},
    CommandStage.WAITING: {CommandStage.TAKEN},
    CommandStage.BEGUN: {CommandStage.WAITING},
    CommandStage.DONE: {CommandStage.TAKEN, CommandStage.BEGUN},
    CommandStage.FAILED: {CommandStage.BEGUN},
    CommandStage.REFUSED: {CommandStage.TAKEN, CommandStage.WAITING},
    CommandStage.EXPIRED: {CommandStage.TAKEN, CommandStage.WAITING},
    CommandStage.WITHDRAWN: {CommandStage.WAITING},
    CommandStage.SUPERSEDED: {CommandStage.WAITING},
}
"""The stages that may come right before each stage of a command."""


class Surprise(NamedTuple):
    """Something that the operator could not expect: when, and what, in words."""

    t_s: float
    what: str


def surprises(run: RunView) -> Iterator[Surprise]:
    """Every surprise in a run, in order.

    No action without an order or a goal behind it. None of the rover's own but alone, in autonomous
    mode while nothing is wrong, or by consent. No order begun after it expired, twice, or that
    nobody gave. No command whose life does not go from taken to its end, stage by stage.
    """
    judge = _Judge()
    t_s = 0.0
    for t_s, message in run.together(
        ROVER_MODE,
        ROVER_FAILSAFE,
        ROVER_GOAL,
        ROVER_COMMAND,
        ROVER_PROPOSAL,
        ROVER_ACTION_STARTED,
        GROUND_COMMAND,
    ):
        what: str | None = None
        match message:
            case ModeEntry(mode=mode):
                judge.mode = mode
            case FailsafeEntry(state=state):
                judge.failsafe = state
            case GoalEntry():
                judge.goal(message)
            case Proposal():
                judge.proposal = message
            case CommandSent():
                judge.sent[message.number] = message
            case CommandEntry():
                what = judge.command(message, t_s)
            case ActionStarted():
                what = judge.action(message)
        if what is not None:
            yield Surprise(t_s, what)
    yield from judge.left(run.duration_s)


class _Judge:
    def __init__(self) -> None:
        self.mode = Mode.GUIDED
        self.failsafe = Failsafe.NOMINAL
        self.proposal: Proposal | None = None
        self.sent: dict[int, CommandSent] = {}
        self._stages: dict[int, CommandStage] = {}
        self._begun: set[int] = set()
        self._goals: set[tuple[Tokens, GoalSource]] = set()

    def goal(self, entry: GoalEntry) -> None:
        if entry.change is GoalChange.SET:
            self._goals.add((entry.tokens, entry.source))
        elif entry.change in {GoalChange.REACHED, GoalChange.WITHDRAWN}:
            self._goals.discard((entry.tokens, entry.source))

    def command(self, entry: CommandEntry, t_s: float) -> str | None:
        number, before = entry.number, self._stages.get(entry.number)
        self._stages[number] = entry.stage
        sent = self.sent.get(number)
        if sent is None or sent.order != entry.order:
            return f"command {number} {entry.stage}, which nobody gave"
        if before not in _BEFORE[entry.stage]:
            return f"command {number} {entry.stage} after it was {before or 'not taken'}"
        if entry.stage is CommandStage.BEGUN and t_s > to_s(sent.expires_ns):
            return f"command {number} begun after it expired at {to_s(sent.expires_ns):.1f} s"
        return None

    def action(self, action: ActionStarted) -> str | None:
        number = action.command
        if number is not None:
            twice = number in self._begun
            self._begun.add(number)
            if twice or self._stages.get(number) is not CommandStage.BEGUN:
                return f"action {action.action} for command {number}, which did not begin"
            return None
        if action.goal is None or action.chooser is Chooser.GUIDED:
            return f"action {action.action} without an order or a goal"
        if not any(tokens == action.goal for tokens, _ in self._goals):
            return f"action {action.action} for {' + '.join(action.goal)}, which is no goal"
        if not (self._is_left_alone or self._has_consent(action)):
            return (
                f"action {action.action} of the rover's own in mode {self.mode}, "
                f"failsafe {self.failsafe}"
            )
        return None

    @property
    def _is_left_alone(self) -> bool:
        if self.failsafe is Failsafe.ALONE:
            return True
        return self.mode is Mode.AUTONOMOUS and self.failsafe is Failsafe.NOMINAL

    def _has_consent(self, action: ActionStarted) -> bool:
        """Whether a veto window was open for it: consent by approval comes with a command."""
        proposal, self.proposal = self.proposal, None
        return (
            self.mode is Mode.SHARED
            and self.failsafe is Failsafe.NOMINAL
            and proposal is not None
            and proposal.veto_window_s is not None
            and proposal.action == action.action
        )

    def left(self, end_s: float) -> Iterator[Surprise]:
        """The commands that wait at the end, though they may not begin any more."""
        for number, stage in self._stages.items():
            expires_s = to_s(self.sent[number].expires_ns) if number in self.sent else end_s
            if stage is CommandStage.WAITING and expires_s < end_s - 1:
                yield Surprise(end_s, f"command {number} waits though it expired")
