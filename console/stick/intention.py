"""The intention of whoever holds a stick: what they approach, what they feel, what they order.

A plain object that is handed positions and wall times (ns) and has no clock of its own. What is
felt follows from the options that are held already, so it waits for no link. What is ordered:

- An action is chosen by pushing the stick out in its direction, once until it has come back.
- An invalid action resists. Full deflection held for a second insists on it.
- The stick is drawn to the proposed action. Pushing it on and holding it there for half a second
  approves. The pull alone ends too near the middle for that, so consent always takes a hand.
- Letting go orders nothing. Where consent is by approval it is therefore none; where consent is by
  a veto window, letting go lets the window run down, which is what the screen says it asks for.
- Nothing is ordered within half a second of a change of the options, and a stick that is pushed out
  then has to come back first: a push that was meant for one proposal must never answer another.
"""

from enum import StrEnum

import msgspec

from farside.console.screen.screen import OptionRow, Screen
from farside.console.stick.cues import TABLE, Cue, cue_of, deflection, nearness
from farside.ground.view.view import OptionKind
from farside.node import to_ns


class Situation(msgspec.Struct, frozen=True):
    """What a stick needs to know of the screen.

    Attributes:
        options: the actions that can be chosen.
        proposal: the number of the proposal that can be answered now; `None` without one.
    """

    options: tuple[OptionRow, ...] = ()
    proposal: int | None = None

    @property
    def meaning(self) -> tuple[int | None, tuple[tuple[str, OptionKind], ...]]:
        """What a push would mean: while it stays the same, the options have not changed."""
        return self.proposal, tuple((option.action, option.kind) for option in self.options)


def situation_of(screen: Screen) -> Situation:
    """The situation that a screen shows."""
    card = screen.proposal
    return Situation(screen.options, card.number if card and card.can_answer else None)


class Choose(msgspec.Struct, frozen=True):
    """To choose an action; `insist` where it was pushed through resistance."""

    action: str
    insist: bool


class Approve(msgspec.Struct, frozen=True):
    """To approve a proposal."""

    proposal: int


class Veto(msgspec.Struct, frozen=True):
    """To veto a proposal."""

    proposal: int


Order = Choose | Approve | Veto
"""What a person can order by a stick."""


class Button(StrEnum):
    """The buttons that answer a proposal."""

    APPROVE = "approve"
    VETO = "veto"


class Felt(msgspec.Struct, frozen=True):
    """What is to be felt now.

    Attributes:
        action: whose cue it is: the action that the stick nears, or else the proposed one; empty
            where nothing is to be felt.
        cue: the cue.
        near: how near the stick is, 0 to 1; 0 where it is drawn from afar.
        since_ns: since when it is to be felt, in wall time.
    """

    action: str
    cue: Cue
    near: float
    since_ns: int


NOTHING = Felt("", Cue(OptionKind.FREE, 0.0), 0.0, 0)
"""Nothing to be felt."""


class Reading(msgspec.Struct, frozen=True):
    """What is read from a position of the stick, or a button.

    Attributes:
        felt: what is to be felt.
        approached: the action that the stick nears; empty at rest.
        order: what is ordered.
        note: why nothing is, where a person would wonder; mostly empty.
    """

    felt: Felt
    approached: str = ""
    order: Order | None = None
    note: str = ""


_CHANGED = "not ordered: the options changed just now; let the stick come back and choose again"
_FAVOUR = 0.1  # what the action that was nearest is given, so that a diagonal does not flutter


class Intention:
    """See the module. It is handed every position, at least every 10 ms, in the order of time."""

    def __init__(self) -> None:
        self._situation = Situation()
        self._changed_ns: int | None = None
        self._proposed_ns = 0
        # Whether the stick has come back since it last ordered anything. It has not at first: one
        # that stands out when it is plugged in, or is broken, orders nothing.
        self._is_back = False
        self._held: tuple[str, int] | None = None  # the action that is held, and since when
        self._told = ""  # the resisted action that the person was told of
        self._approached = ""
        self._felt = NOTHING

    def move(self, now_ns: int, x: float, y: float, situation: Situation) -> Reading:
        """Read a position: x to the east and y to the north, each from -1 to 1."""
        self._notice(now_ns, situation)
        nearest = self._nearest(x, y)
        self._approached = nearest.action if nearest else ""
        self._felt = self._feel(now_ns, x, y, nearest)
        out = max(abs(x), abs(y))
        if out < TABLE.thresholds.back_below:
            self._is_back = True
            self._told = ""
            return Reading(self._felt, self._approached)
        order, note = self._decide(now_ns, x, y)
        if order is not None:
            self._is_back = False
        return Reading(self._felt, self._approached, order, note)

    def press(self, now_ns: int, button: Button, situation: Situation) -> Reading:
        """Read a button that was pressed."""
        self._notice(now_ns, situation)
        order: Order | None = None
        if situation.proposal is None:
            note = "not ordered: no proposal waits for an answer"
        elif self._is_too_soon(now_ns):
            note = "not ordered: the options changed just now; look, and press again"
        else:
            note = ""
            answer = Approve if button is Button.APPROVE else Veto
            order = answer(situation.proposal)
        return Reading(self._felt, self._approached, order, note)

    def _notice(self, now_ns: int, situation: Situation) -> None:
        """Take note of the situation, and of when its meaning changed."""
        before, self._situation = self._situation, situation
        if self._changed_ns is not None and before.meaning == situation.meaning:
            return
        if _proposed(before) != _proposed(situation):
            self._proposed_ns = now_ns
        self._changed_ns = now_ns

    def _is_too_soon(self, now_ns: int) -> bool:
        changed_ns = self._changed_ns
        return changed_ns is None or now_ns - changed_ns < to_ns(TABLE.thresholds.quiet_s)

    def _nearest(self, x: float, y: float) -> OptionRow | None:
        """The option that the stick nears; `None` where it nears none."""

        def favoured(option: OptionRow) -> float:
            near = nearness(deflection(x, y, option.action))
            return near and near + _FAVOUR * (option.action == self._approached)

        nearest = max(self._situation.options, key=favoured, default=None)
        return nearest if nearest and favoured(nearest) else None

    def _feel(self, now_ns: int, x: float, y: float, nearest: OptionRow | None) -> Felt:
        if nearest and nearest.kind is not OptionKind.FREE:
            cue, before = cue_of(nearest), self._felt
            near = nearness(deflection(x, y, nearest.action))
            is_same = before.near > 0 and (before.action, before.cue.kind) == (
                nearest.action,
                cue.kind,
            )
            return Felt(nearest.action, cue, near, before.since_ns if is_same else now_ns)
        for option in self._situation.options:
            if option.kind is OptionKind.PROPOSED:
                return Felt(option.action, cue_of(option), 0.0, self._proposed_ns)
        return NOTHING

    def _decide(self, now_ns: int, x: float, y: float) -> tuple[Order | None, str]:
        """What a stick that stands out orders; or why it does not, said once."""
        option = self._aimed(x, y)
        if option is None or not self._is_back:
            self._held = None
            return None, ""
        if self._is_too_soon(now_ns):
            self._is_back = False
            return None, _CHANGED
        proposal = self._situation.proposal
        if option.kind is OptionKind.INVALID:
            return self._insist(now_ns, x, y, option)
        if option.kind is OptionKind.PROPOSED and proposal is not None:
            is_held = self._holds(now_ns, option.action, TABLE.thresholds.approve_s)
            return (Approve(proposal) if is_held else None), ""
        return Choose(option.action, insist=False), ""

    def _insist(
        self, now_ns: int, x: float, y: float, option: OptionRow
    ) -> tuple[Order | None, str]:
        limits = TABLE.thresholds
        note = ""
        if self._told != option.action:
            self._told = option.action
            why = f": {option.why}" if option.why else ""
            note = (
                f"not ordered: {option.action} is resisted{why}; "
                f"full deflection for {limits.insist_s:g} s insists"
            )
        if deflection(x, y, option.action) < limits.full_at:
            self._held = None
            return None, note
        is_held = self._holds(now_ns, option.action, limits.insist_s)
        return (Choose(option.action, insist=True) if is_held else None), note

    def _holds(self, now_ns: int, action: str, for_s: float) -> bool:
        """Whether this action has been held for so long."""
        if self._held is None or self._held[0] != action:
            self._held = (action, now_ns)
        return now_ns - self._held[1] >= to_ns(for_s)

    def _aimed(self, x: float, y: float) -> OptionRow | None:
        """The option that the stick is pushed out to, clearly enough to choose it."""
        limits = TABLE.thresholds
        for option in self._situation.options:
            towards = deflection(x, y, option.action)
            aside = min(abs(x), abs(y))
            if towards >= limits.choose_at and aside <= limits.aside * towards:
                return option
        return None


def _proposed(situation: Situation) -> tuple[int | None, tuple[str, ...]]:
    """The proposal, and what it proposes."""
    return situation.proposal, tuple(
        option.action for option in situation.options if option.kind is OptionKind.PROPOSED
    )
