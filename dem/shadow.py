"""A shadow: the lists of a model elsewhere, kept the same by what the model tells of its changes.

The model sends a whole first, then deltas: what happened to its lists, in order, not what came of
it. A shadow does the same to its own lists and so computes the same numbers, to the last bit.
"""

import zlib
from collections.abc import Iterable, Mapping

import msgspec

from farside.dem.journal import (
    Entry,
    HypothesisAdded,
    HypothesisRemoved,
    SignAdded,
    SignRemoved,
    Verdict,
    judgement,
)
from farside.dem.lists.goals import Goal
from farside.dem.lists.hypotheses import ActionList, HypothesesState, Hypothesis, HypothesisList
from farside.dem.lists.signs import Sign, SignList, SignsState, to_sign
from farside.dem.memory import compress, decompress
from farside.dem.parameters import Parameters
from farside.dem.policy.planning import Planner, PolicyValue


class Delta(msgspec.Struct, frozen=True, array_like=True):
    """What happened to a model's lists since the delta before. Made to be sent as MessagePack.

    Attributes:
        number: counts from 1.
        follows: `check` of the delta before; `None` for a whole, which follows anything.
        check: CRC-32 of the delta and all before it, back to the last whole.
        entries: what happened, in order.
        goals: the Goal List where it is another than before, else `None`.
        whole: the lists, compressed, where this is a whole; else `None`.
    """

    number: int
    follows: int | None
    check: int
    entries: tuple[Entry, ...]
    goals: tuple[Goal, ...] | None
    whole: bytes | None


class DeltaError(ValueError):
    """A delta that cannot be applied: one before is missing, or it is of another model.

    The shadow is as it was. Only a whole, see `DynamicExpectancyModel.whole`, gets it going again.
    """


class _Whole(msgspec.Struct, frozen=True, array_like=True):
    action_costs: dict[str, float]
    parameters: Parameters
    signs: SignsState
    hypotheses: HypothesesState


class Recorder:
    """Makes the deltas of a model's lists.

    Args:
        actions, parameters: those of the model.
        signs, hypotheses: its lists, which write down what happens to them from now on.
    """

    def __init__(
        self,
        actions: ActionList,
        parameters: Parameters,
        signs: SignList,
        hypotheses: HypothesisList,
    ) -> None:
        self._actions = actions
        self._parameters = parameters
        self._signs = signs
        self._hypotheses = hypotheses
        self._journal: list[Entry] = []
        signs.journal = hypotheses.journal = self._journal
        self._number = 0
        self._check: int | None = None
        self._goals: tuple[Goal, ...] = ()

    def delta(self, goals: tuple[Goal, ...]) -> Delta:
        """What happened since the last delta; a whole, where this is the first."""
        if self._check is None:
            return self.whole(goals)
        return self._next(goals if goals != self._goals else None, goals)

    def whole(self, goals: tuple[Goal, ...]) -> Delta:
        """All lists as they are, in place of the next delta."""
        self._journal.clear()
        self._check = None
        whole = _Whole(
            action_costs=dict(zip(self._actions.names, self._actions.costs, strict=True)),
            parameters=self._parameters,
            signs=self._signs.state(),
            hypotheses=self._hypotheses.state(),
        )
        return self._next(goals, goals, compress(whole))

    def _next(
        self, changed: tuple[Goal, ...] | None, goals: tuple[Goal, ...], whole: bytes | None = None
    ) -> Delta:
        self._number += 1
        delta = Delta(self._number, self._check, 0, tuple(self._journal), changed, whole)
        self._check = zlib.crc32(msgspec.msgpack.encode(delta))
        self._journal.clear()
        self._goals = goals
        return msgspec.structs.replace(delta, check=self._check)


class ShadowModel:
    """The lists of a model elsewhere, and its policy map. It learns nothing of its own.

    It knows nothing until a whole is applied, which the first delta of any model is.

    Args:
        action_costs, parameters: those of the model.

    Raises:
        ValueError: if there is no action, or a cost is not finite and above 0.
    """

    def __init__(self, action_costs: Mapping[str, float], parameters: Parameters) -> None:
        self._actions = ActionList(action_costs)
        self._parameters = parameters
        self._goals: tuple[Goal, ...] = ()
        self._number = 0
        self._check: int | None = None
        self._begin_anew()

    def apply(self, delta: Delta) -> None:
        """Take in the next delta, or a whole.

        Raises:
            DeltaError: if it is not the one that comes next, or a whole of a model with other
                actions or parameters. The message says what was expected.
            UnreadableMemoryError: if the lists of a whole are damaged.
        """
        if delta.whole is not None:
            self._restore(delta.whole)
        else:
            self._expect_next(delta)
        for entry in delta.entries:
            self._replay(entry)
        if delta.goals is not None:
            self._goals = delta.goals
        self._number, self._check = delta.number, delta.check

    @property
    def number(self) -> int:
        """Number of the last delta applied, 0 before any."""
        return self._number

    @property
    def signs(self) -> tuple[Sign, ...]:
        """The Sign List, in order of age."""
        return tuple(self._signs.names[sign] for sign in self._signs.by_age())

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """The Hypothesis List, in order of age."""
        return self._hypotheses.named(self._signs.names)

    @property
    def goals(self) -> tuple[Goal, ...]:
        """The Goal List, as that of the model."""
        return self._goals

    def policy_map(self) -> tuple[PolicyValue, ...]:
        """The top-goal's DPM, ordered by value, then Sign. Empty without a known top-goal."""
        self._aim()
        return self._planner.table()

    def value(self, tokens: Iterable[str]) -> float:
        """P_v of a Sign towards the top-goal; infinite where no path is known, or the Sign is not.

        Raises:
            TypeError: if `tokens` is a string.
        """
        sign = self._signs.find(to_sign(tokens))
        self._aim()
        return float("inf") if sign is None else self._planner.value(sign)

    def _aim(self) -> None:
        top = self._goals[0] if self._goals and not self._goals[0].suspended else None
        self._planner.aim(None if top is None else top.tokens)

    def _begin_anew(self) -> None:
        self._signs = SignList()
        self._hypotheses = HypothesisList(self._actions, self._parameters)
        self._planner = Planner(self._signs, self._hypotheses, self._actions)

    def _restore(self, packed: bytes) -> None:
        whole = decompress(packed, _Whole)
        costs = dict(zip(self._actions.names, self._actions.costs, strict=True))
        if (whole.action_costs, whole.parameters) != (costs, self._parameters):
            raise DeltaError(
                f"the lists of another model: expected action costs {costs} and "
                f"{self._parameters}, found {whole.action_costs} and {whole.parameters}"
            )
        self._begin_anew()
        self._signs.restore(whole.signs)
        self._hypotheses.restore(whole.hypotheses)

    def _expect_next(self, delta: Delta) -> None:
        if self._check is None:
            raise DeltaError(f"expected a whole first, found delta {delta.number}: ask for a whole")
        if delta.number != self._number + 1:
            raise DeltaError(
                f"expected delta {self._number + 1}, found delta {delta.number}: ask for a whole"
            )
        if delta.follows != self._check:
            raise DeltaError(
                f"delta {delta.number} is of another model: expected it to follow "
                f"{self._check:08x}, found that it follows {delta.follows:08x}: ask for a whole"
            )

    def _replay(self, entry: Entry) -> None:
        match entry:
            case int():
                self._judge(entry)
            case SignAdded(sign):
                self._signs.add(sign)
            case SignRemoved(sign_id):
                self._signs.remove(sign_id)
            case HypothesisAdded(context, action, outcome, delay, credit):
                self._hypotheses.add(context, action, outcome, delay, credit)
            case HypothesisRemoved(hypothesis):
                self._hypotheses.remove(hypothesis)

    def _judge(self, entry: int) -> None:
        hypothesis, verdict = judgement(entry)
        if verdict is Verdict.FAILED:
            self._hypotheses.fail(hypothesis)
        else:
            self._hypotheses.succeed(hypothesis, alone=verdict is Verdict.ALONE)
