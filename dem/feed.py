"""The feed of a shadow: the changes of a model's lists as numbered deltas.

The first is a whole; then follow the changes of the lists in order, not the resulting numbers. See
`farside.dem.shadow`.
"""

import zlib

import msgspec

from farside.dem.changes import ListChange
from farside.dem.lists.actions import ActionList
from farside.dem.lists.goals import Goal
from farside.dem.lists.hypotheses import HypothesisList
from farside.dem.lists.hypothesis import HypothesesState
from farside.dem.lists.signs import SignList, SignsState
from farside.dem.memory import compress
from farside.dem.parameters import Parameters
from farside.dem.policy.aversions import Aversion, AversionList

FEW_CHANGES = 1000
"""So many changes are kept in any case (project default)."""

CHANGES_KEPT = 5
"""So many changes of each hypothesis are kept: two bytes and more each, where a hypothesis takes
about ten in a whole (project default)."""


class Delta(msgspec.Struct, frozen=True, array_like=True):
    """The changes of a model's lists since the previous delta, to be sent as MessagePack.

    Attributes:
        number: sequence number, from 1.
        follows: `check` of the previous delta; `None` for a whole, which may follow any.
        check: CRC-32 of this delta and of all before it, back to the last whole.
        changes: the changes, in order.
        goals: the Goal List if it changed, else `None`.
        aversions: the same of the Aversion List.
        whole: the compressed lists if this is a whole, else `None`.
    """

    number: int
    follows: int | None
    check: int
    changes: tuple[ListChange, ...]
    goals: tuple[Goal, ...] | None
    aversions: tuple[Aversion, ...] | None
    whole: bytes | None


class Whole(msgspec.Struct, frozen=True, array_like=True):
    """All lists of a model, as they are saved, and its parameters. Actions are in order of id."""

    action_costs: dict[str, float]
    parameters: Parameters
    signs: SignsState
    hypotheses: HypothesesState


class ChangeFeed:
    """Collects the changes of a model's lists into numbered deltas for a shadow.

    Args:
        actions, parameters: those of the model.
        signs, hypotheses: its lists, whose changes are recorded from now on.
        aversions: its Aversion List.
    """

    def __init__(
        self,
        actions: ActionList,
        parameters: Parameters,
        signs: SignList,
        hypotheses: HypothesisList,
        aversions: AversionList,
    ) -> None:
        self._actions = actions
        self._parameters = parameters
        self._signs = signs
        self._hypotheses = hypotheses
        self._aversions = aversions
        self._told: tuple[Aversion, ...] = ()
        self._changes: list[ListChange] = []
        signs.recorded = hypotheses.recorded = self._changes
        self._number = 0
        self._check: int | None = None
        self._goals: tuple[Goal, ...] = ()

    def change(self, parameters: Parameters) -> None:
        """The model has other parameters from now on: the next delta is a whole that says so."""
        self._parameters = parameters
        self._changes.clear()
        self._check = None

    def delta(self, goals: tuple[Goal, ...]) -> Delta:
        """The changes since the last delta; a whole if this is the first, or a whole is shorter."""
        if self._check is None:
            return self.whole(goals)
        # Fewer changes than hypotheses are hardly ever longer than all lists.
        if len(self._changes) > self._hypotheses.count:
            packed = self._packed()
            if len(packed) < len(msgspec.msgpack.encode(self._changes)):
                return self._whole(goals, packed)
        return self._next(goals if goals != self._goals else None, goals)

    def whole(self, goals: tuple[Goal, ...]) -> Delta:
        """All lists as they are, in place of the next delta."""
        return self._whole(goals, self._packed())

    def trim(self) -> None:
        """Forget changes that have become longer than a whole: the next delta is one.

        So what is kept for a shadow that nobody can reach is bounded by the lists themselves.
        """
        if len(self._changes) > max(FEW_CHANGES, CHANGES_KEPT * self._hypotheses.count):
            self._changes.clear()
            self._check = None

    def _packed(self) -> bytes:
        return compress(
            Whole(
                action_costs=self._actions.by_name,
                parameters=self._parameters,
                signs=self._signs.state(),
                hypotheses=self._hypotheses.state(),
            )
        )

    def _whole(self, goals: tuple[Goal, ...], packed: bytes) -> Delta:
        self._changes.clear()
        self._check = None
        return self._next(goals, goals, packed)

    def _next(
        self, changed: tuple[Goal, ...] | None, goals: tuple[Goal, ...], whole: bytes | None = None
    ) -> Delta:
        self._number += 1
        averted = self._aversions.ordered
        told = averted if whole is not None or averted != self._told else None
        delta = Delta(self._number, self._check, 0, tuple(self._changes), changed, told, whole)
        self._check = zlib.crc32(msgspec.msgpack.encode(delta))
        self._changes.clear()
        self._goals, self._told = goals, averted
        return msgspec.structs.replace(delta, check=self._check)
