"""The one owner of the controller's cycle: sense, choose, perform, and what is noted of each."""

import msgspec

from farside.control import Chooser
from farside.dem import Choice, Goal, Recall, Why
from farside.messages import ProposedStep, Tokens
from farside.node import Journal
from farside.places import ACTIONS
from farside.rover.controller import Controller, Mapped, Shadowed
from farside.rover.goals import Goals
from farside.topics import (
    ROVER_CYCLE,
    ROVER_DECISION,
    ROVER_POLICY_MAP,
    Arc,
    Cycle,
    Decision,
    PolicyMapEntry,
    PolicyMapPlace,
)


class ControlCycle:
    """Leads a controller through its cycles, and notes what it senses, decides and does with goals.

    Args:
        controller: the learning controller.
        goals: the goals on its list.
        journal: where cycles and decisions are noted.
        is_shadowed: whether the ground is to have a shadow of the controller, if that can be.
        memory: how many steps back the controller senses what was sensed and done, as a Token of
            its own, which nobody else takes for what is so; see `farside.dem.Recall`.

    Attributes:
        shadowed: the controller, if the ground is to have a shadow of it.
        tokens: what was last sensed, without the memory Token.
        number: counts the cycles.
    """

    def __init__(
        self,
        controller: Controller,
        goals: Goals,
        journal: Journal,
        *,
        is_shadowed: bool = False,
        memory: int = 0,
    ) -> None:
        self._controller, self._goals, self._journal = controller, goals, journal
        self.shadowed = controller if is_shadowed and isinstance(controller, Shadowed) else None
        self._mapped: Tokens | None = None
        self._checked: tuple[int, bool, tuple[Goal, ...], int] = (-1, False, (), 0)
        self._active: tuple[Tokens, ...] = ()
        self._is_open = False
        self._recall = Recall(memory)
        self.tokens: frozenset[str] = frozenset()
        self.number = 0

    def perform(self, action: str) -> None:
        """End the cycle with the action that begins now, whoever chose it (path A3).

        From now on, what was last sensed may not be so any more: a goal that is set is not taken
        for satisfied until the next cycle begins.
        """
        self._controller.perform(action)
        self._recall.did(action)
        self._is_open = False

    def sense(self, tokens: frozenset[str]) -> None:
        """Begin the next cycle; nothing was performed in one that is not ended yet.

        Args:
            tokens: what is sensed now.
        """
        controller = self._controller
        if self._is_open:
            controller.perform(None)
        self._is_open = True
        self.tokens = tokens
        self._recall.sense(tokens)
        self.number += 1
        sensed = controller.sense(self._with_memory(tokens))
        self._active = sensed.active
        self._goals.reached(sensed.reached)
        self._goals.follow_aside(self._with_memory(tokens))
        self._journal.note(
            ROVER_CYCLE,
            Cycle(
                tokens=sensed.tokens,
                novel=sensed.novel,
                unexpected=sensed.unexpected,
                succeeded=sensed.succeeded,
                failed=sensed.failed,
                created=sensed.created,
                signs=controller.sign_count,
                hypotheses=controller.hypothesis_count,
                mean_cm=controller.mean_cm,
            ),
        )
        self._note_map()

    def follow(self, tokens: frozenset[str]) -> None:
        """Begin a new cycle while standing, if the Tokens changed or satisfy a new goal."""
        if self._goals.are_met(self._with_memory(tokens)) or tokens != self.tokens:
            self.sense(tokens)
        else:
            self._goals.follow_aside(self._with_memory(tokens))
            self._note_map()

    def _with_memory(self, tokens: frozenset[str]) -> frozenset[str]:
        return tokens.union(self._recall.tokens)

    def _note_map(self) -> None:
        """Note the policy map whenever another goal is on top."""
        top = self._goals.top
        goal = None if top is None else top.tokens
        if goal == self._mapped or not isinstance(self._controller, Mapped):
            return
        self._mapped = goal
        values = () if goal is None else self._controller.policy_map()
        places = tuple(PolicyMapPlace(*msgspec.structs.astuple(value)) for value in values)
        self._journal.note(ROVER_POLICY_MAP, PolicyMapEntry(goal, places))

    @property
    def lists_check(self) -> int | None:
        """CRC-32 of the controller's lists as they are; `None` without a shadow at the ground."""
        if self.shadowed is None:
            return None
        # They change as a cycle begins and ends, and with the goals, and not otherwise.
        now = self.number, self._is_open, self._controller.goals
        if self._checked[:3] != now:
            self._checked = (*now, self.shadowed.lists_check())
        return self._checked[3]

    def choose(self, *, explore: bool) -> Choice | None:
        """What the controller would do now; `None` for nothing.

        Raises:
            ValueError: if that is no action of the rover.
        """
        choice = self._controller.choose(explore=explore)
        if choice is not None and choice.action not in ACTIONS:
            known = ", ".join(ACTIONS)
            raise ValueError(
                f"expected the controller to choose one of {known}, found {choice.action!r}"
            )
        return choice

    def path(self) -> tuple[ProposedStep, ...]:
        """The policy path to the top-goal, as a proposal tells it."""
        return tuple(
            ProposedStep(step.sign, step.action, step.cost_to_go)
            for step in self._controller.policy_path()
        )

    def decided(
        self,
        chooser: Chooser,
        action: str,
        *,
        goal: Tokens | None = None,
        command: int | None = None,
        proposal: int | None = None,
    ) -> None:
        """Note a decision, with the hypotheses behind it."""
        why = self._controller.why() if goal is not None else None
        if why is not None and why.action == action:
            behind: Arc | None = _arc(why)
            runner_up = None if why.runner_up is None else _arc(why.runner_up)
            margin = why.margin
        else:
            known = self._controller.expected(action)
            behind = None
            if known is not None:
                behind = Arc(known.context, known.action, known.outcome, known.cm, None)
            runner_up = margin = None
        self._journal.note(
            ROVER_DECISION,
            Decision(
                chooser=chooser,
                action=action,
                goal=goal,
                active=self._active,
                behind=behind,
                runner_up=runner_up,
                margin=margin,
                proposal=proposal,
                command=command,
            ),
        )


def _arc(why: Why) -> Arc:
    return Arc(why.context, why.action, why.outcome, why.cm, why.cost_to_go)
