"""What would surprise the operator, found in the log of a run."""

from collections.abc import Iterator
from typing import NamedTuple

import msgspec

from farside.control import Chooser, CommandStage, Failsafe, Mode
from farside.logs.events import sign_text
from farside.logs.views.run import RunView
from farside.messages import Approve, Drive, Override, Proposal, Tokens, Veto
from farside.node import to_ns, to_s
from farside.topics import (
    GROUND_COMMAND,
    ROVER_ACTION_STARTED,
    ROVER_COMMAND,
    ROVER_FAILSAFE,
    ROVER_GOAL,
    ROVER_MODE,
    ROVER_PROPOSAL,
    ROVER_PROPOSAL_ENDED,
    ActionStarted,
    CommandEntry,
    CommandSent,
    FailsafeEntry,
    GoalChange,
    GoalEntry,
    GoalSource,
    ModeEntry,
    ProposalEnded,
)

_BEFORE: dict[CommandStage, set[CommandStage | None]] = {
    CommandStage.TAKEN: {None},
    CommandStage.WAITING: {CommandStage.TAKEN},
    CommandStage.BEGUN: {CommandStage.WAITING},
    CommandStage.DONE: {CommandStage.TAKEN, CommandStage.WAITING, CommandStage.BEGUN},
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

    No action without an order or a goal behind it, nor another than ordered. None of the rover's
    own but alone, in autonomous mode while nothing is wrong, or by consent: a proposal that stands
    and had no veto before its window was over. No order begun after it expired, twice, or that
    nobody gave. No command whose life does not go from taken to its end, stage by stage.
    """
    judge = _Judge()
    for t_s, message in run.together(
        ROVER_MODE,
        ROVER_FAILSAFE,
        ROVER_GOAL,
        ROVER_COMMAND,
        ROVER_PROPOSAL,
        ROVER_PROPOSAL_ENDED,
        ROVER_ACTION_STARTED,
        GROUND_COMMAND,
    ):
        what = judge.follow(message, t_s)
        if what is not None:
            yield Surprise(t_s, what)
    yield from judge.left(run.duration_s)


class _Standing(NamedTuple):
    """A proposal, the time that it was made at, and that of its end."""

    proposal: Proposal
    made_s: float
    ended_s: float | None = None


class _Judge:
    def __init__(self) -> None:
        self._mode = Mode.GUIDED
        self._failsafe = Failsafe.NOMINAL
        self._sent: dict[int, CommandSent] = {}
        self._last: _Standing | None = None
        self._actions: dict[int, str] = {}
        self._stages: dict[int, CommandStage] = {}
        self._acted: set[int] = set()
        self._goals: set[tuple[Tokens, GoalSource]] = set()

    def follow(self, message: msgspec.Struct, t_s: float) -> str | None:
        """The next message of the log; what surprises about it, `None` if nothing does."""
        match message:
            case CommandEntry():
                return self._command(message, t_s)
            case ActionStarted():
                return self._action(message, t_s)
            case CommandSent():
                self._sent[message.number] = message
            case GoalEntry():
                self._goal(message)
            case Proposal():
                self._proposed(message, t_s)
            case ProposalEnded(number=number):
                self._proposal_ended(number, t_s)
            case ModeEntry(mode=mode):
                self._mode = mode
            case FailsafeEntry(state=state):
                self._failsafe = state
        return None

    def _goal(self, entry: GoalEntry) -> None:
        goal = tuple(sorted(set(entry.tokens))), entry.source
        if entry.change is GoalChange.SET:
            self._goals.add(goal)
        elif entry.change in {GoalChange.REACHED, GoalChange.WITHDRAWN}:
            self._goals.discard(goal)

    def _proposed(self, proposal: Proposal, t_s: float) -> None:
        self._last = _Standing(proposal, t_s)
        self._actions[proposal.number] = proposal.action

    def _proposal_ended(self, number: int, t_s: float) -> None:
        if self._last is not None and self._last.proposal.number == number:
            self._last = self._last._replace(ended_s=t_s)

    def _command(self, entry: CommandEntry, t_s: float) -> str | None:
        number, stage, before = entry.number, entry.stage, self._stages.get(entry.number)
        self._stages[number] = stage
        if isinstance(entry.order, Veto) and stage is CommandStage.DONE:
            self._last = None
        sent = self._sent.get(number)
        if sent is None or sent.order != entry.order:
            return f"command {number} {stage}, though nobody gave it"
        if before not in _BEFORE[stage]:
            if before is None:
                return f"command {number} {stage} without being taken"
            if before is stage:
                return f"command {number} {stage} twice"
            return f"command {number} went from {before} to {stage}"
        if stage is CommandStage.BEGUN and t_s > to_s(sent.expires_ns):
            return f"command {number} begun after it expired at {to_s(sent.expires_ns):.1f} s"
        return None

    def _action(self, action: ActionStarted, t_s: float) -> str | None:
        if action.command is not None:
            return self._ordered(action.action, action.command)
        if action.goal is None or action.chooser is Chooser.GUIDED:
            return f"action {action.action} without an order or a goal"
        if not any(tokens == action.goal for tokens, _ in self._goals):
            return f"action {action.action} for {sign_text(action.goal)}, which is no goal"
        if self._is_left_alone or self._has_consent(action, t_s):
            return None
        where = f"in mode {self._mode}, failsafe {self._failsafe}"
        if (self._mode, self._failsafe) == (Mode.SHARED, Failsafe.NOMINAL):
            where = f"in mode {self._mode} without the operator's consent"
        return f"action {action.action} of the rover's own {where}"

    def _ordered(self, action: str, number: int) -> str | None:
        if number in self._acted:
            return f"action {action} for command {number}, which had its action before"
        self._acted.add(number)
        if self._stages.get(number) is not CommandStage.BEGUN:
            return f"action {action} for command {number}, which did not begin"
        ordered = self._action_of(number)
        if ordered != action:
            return f"action {action} for command {number}, which orders {ordered or 'none'}"
        return None

    def _action_of(self, number: int) -> str | None:
        """The action that a command orders, `None` for none."""
        sent = self._sent.get(number)
        match sent and sent.order:
            case Drive(action=action) | Override(action=action):
                return action
            case Approve(proposal=proposal):
                return self._actions.get(proposal)
            case _:
                return None

    @property
    def _is_left_alone(self) -> bool:
        if self._failsafe is Failsafe.ALONE:
            return True
        return self._mode is Mode.AUTONOMOUS and self._failsafe is Failsafe.NOMINAL

    def _has_consent(self, action: ActionStarted, t_s: float) -> bool:
        """Whether its veto window ran out: consent by approval comes with a command."""
        last, self._last = self._last, None
        return (
            self._mode is Mode.SHARED
            and self._failsafe is Failsafe.NOMINAL
            and last is not None
            # Being carried out ends it, at that very time.
            and last.ended_s in {None, t_s}
            and last.proposal.veto_window_s is not None
            and to_ns(t_s - last.made_s) >= to_ns(last.proposal.veto_window_s)
            and (last.proposal.action, last.proposal.goal) == (action.action, action.goal)
        )

    def left(self, end_s: float) -> Iterator[Surprise]:
        """The commands that nothing became of by the end, or that wait though they expired."""
        for number, stage in self._stages.items():
            if stage is CommandStage.TAKEN:
                yield Surprise(end_s, f"command {number} taken, and nothing became of it")
            elif stage is CommandStage.WAITING and number in self._sent:
                expires_s = to_s(self._sent[number].expires_ns)
                if expires_s < end_s - 1:
                    yield Surprise(
                        end_s, f"command {number} waits though it expired at {expires_s:.1f} s"
                    )
