"""The shadow at the ground: what it holds of the model on board, and whether that is so."""

from collections import OrderedDict, deque
from enum import StrEnum
from typing import NamedTuple

import msgspec

from farside.dem import Delta, DeltaError, ShadowModel, UnreadableMemoryError
from farside.messages import ModelHeld, ModelUpdate
from farside.node import Journal
from farside.topics import GROUND_SHADOW, ShadowEntry

_REMEMBERED = 256  # lists that a proposal which is still on its way may come from
_JUDGED = 50
_SAID_EVERY = 5  # heartbeats; the rover counts on it

_read = msgspec.msgpack.Decoder(Delta).decode


class Age(StrEnum):
    """How lists on board stand to those of the shadow.

    `SAME`; `OLDER`: the shadow held them before; `UNKNOWN`: it never did. As a rule those are
    newer, and their update is still on its way.
    """

    SAME = "same"
    OLDER = "older"
    UNKNOWN = "unknown"


class Judged(NamedTuple):
    """An expectation of the model that fell due: by when on board, and whether it came true."""

    by_ns: int
    is_true: bool


class Shadow:
    """Keeps a shadow of the model on board by the updates that arrive.

    Whatever arrives, it goes on: what cannot be applied is refused with a reason, the lists held
    until then stand, and a whole is asked for.

    Args:
        model: the shadow, empty.
        journal: where its state is noted.

    Attributes:
        model: the shadow; of the rover at `made_ns`.
        check: CRC-32 of its lists.
        made_ns: when the newest update applied was made on board; -1 before the first.
        cycles: how many cycles of the model the updates applied have covered.
        judged: the newest of the model's most credible expectations that fell due.
        why: why the lists may not be those on board after that update; `None` if they are.
    """

    def __init__(self, model: ShadowModel, journal: Journal) -> None:
        self.model = model
        self._journal = journal
        self.check = model.lists_check()
        self.made_ns = -1
        self.cycles = 0
        self.why: str | None = "no update has come yet"
        self.judged: deque[Judged] = deque(maxlen=_JUDGED)
        self._numbers: OrderedDict[int, int] = OrderedDict()  # of the updates, by their check
        self._said: ModelHeld | None = None
        self._unsaid = 0  # heartbeats since
        self._has_heard = False

    @property
    def in_step(self) -> bool:
        """Whether the lists are those that the rover had after the newest update applied."""
        return self.why is None

    @property
    def number(self) -> int:
        """Number of the newest update applied, 0 before the first."""
        return self.model.number

    def apply(self, update: ModelUpdate) -> None:
        """Apply an update that has arrived; one that does not fit is refused with a reason."""
        before, covered = self.why, 0
        self._has_heard = True
        try:
            delta = _read(update.delta)
            came_true = self.model.came_true(delta)
            self.model.apply(delta)
        except (msgspec.MsgspecError, UnicodeDecodeError) as error:
            self.why = f"an update that cannot be read: {error}"
        except (DeltaError, UnreadableMemoryError) as error:
            self.why = str(error)
        else:
            self.why, covered = None, update.cycles
            self.judged += (Judged(update.time_ns, is_true) for is_true in came_true)
            self.made_ns = update.time_ns
            self.cycles += covered
        self.check = self.model.lists_check()
        if self.why is None:
            self._remember(self.check)
            if self.check != update.check:
                self.why = f"its lists are not those on board after update {self.number}"
        elif self.why == before:
            return
        self._journal.note(
            GROUND_SHADOW,
            ShadowEntry(
                number=self.number,
                check=self.check,
                in_step=self.in_step,
                why=self.why,
                signs=self.model.sign_count,
                hypotheses=self.model.hypothesis_count,
                cycles=covered,
            ),
            publish_time_ns=update.time_ns,
        )

    def _remember(self, check: int) -> None:
        self._numbers[check] = self.number
        self._numbers.move_to_end(check)
        if len(self._numbers) > _REMEMBERED:
            self._numbers.popitem(last=False)

    def number_of(self, check: int) -> int | None:
        """The number of the newest update after which the shadow held the lists of this check."""
        return self._numbers.get(check)

    def age_of(self, check: int) -> Age:
        """How the lists of this check stand to those held now: of a proposal, say."""
        if check == self.check:
            return Age.SAME
        return Age.UNKNOWN if self.number_of(check) is None else Age.OLDER

    def held(self) -> ModelHeld | None:
        """What the next heartbeat says of it; `None` for nothing, since nothing is new.

        It is said in the first heartbeat after a change, and in every fifth from then on, lest
        that one was lost.
        """
        wants_whole = not self.in_step and self._has_heard
        held = ModelHeld(self.number, self.check, wants_whole)
        if held == self._said and self._unsaid < _SAID_EVERY - 1:
            self._unsaid += 1
            return None
        self._said, self._unsaid = held, 0
        return held
