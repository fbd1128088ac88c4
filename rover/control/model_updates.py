"""Updates of the model on board for its shadow at the ground: when one is made, and what of."""

from collections import OrderedDict

import msgspec

from farside.link.endpoint.endpoint import Endpoint, LinkTerms
from farside.messages import Downlink, ModelHeld, ModelUpdate, Uplink
from farside.node import NS_PER_S, Journal
from farside.rover.config import HEARTBEATS
from farside.rover.control.cycle import ControlCycle
from farside.rover.failsafe.silence import Silence
from farside.topics import ROVER_MODEL, ModelSent

_MARGIN_NS = 10 * NS_PER_S  # an update waits for all else
_HELD_SAID = 5  # heartbeats at most from one that says what the ground holds to the next
_REMEMBERED = 1024


class ModelUpdates:
    """Sends the changes of the model's lists, in what all else leaves of the link.

    While the ground is heard, an update is made as soon as there is something to tell and the last
    one has left. So a fast link carries one for every cycle, and a slow one few that tell more. In
    silence none is made: what changes meanwhile is told in one go, as a whole where that is
    shorter.

    The ground says what it holds. Where that is not what was sent, or it asks for it, a whole
    follows: once in the time that an answer takes, and ever more rarely if it does not help.

    Args:
        cycle: of the model; without one that can be shadowed nothing is ever sent.
        endpoint: the rover's end of the link.
        terms: of the link.
        silence: on the link.
        journal: where updates are noted.
    """

    def __init__(
        self,
        cycle: ControlCycle,
        endpoint: Endpoint[Downlink, Uplink],
        terms: LinkTerms,
        silence: Silence,
        journal: Journal,
    ) -> None:
        self._cycle, self._endpoint = cycle, endpoint
        self._silence, self._journal = silence, journal
        self._model = cycle.shadowed
        if self._model is not None:
            self._model.record_changes()
        said_ns = int((_HELD_SAID + HEARTBEATS) * terms.heartbeat_ns)
        self._answer_ns = terms.round_trip_ns + said_ns + _MARGIN_NS
        self._patience_ns = self._answer_ns
        self._whole_at_ns = 0  # no whole is made before, however much it is wanted
        self._wants_whole = False
        self._covered = 0  # cycles up to this one are told
        self._told_check: int | None = None
        self._sent: OrderedDict[int, int] = OrderedDict()  # check by number
        self._last_whole = 0

    def heard(self, held: ModelHeld | None) -> None:
        """The ground says what it holds of the model."""
        if held is None or self._model is None:
            return
        check = self._sent.get(held.number)
        differs = check is not None and check != held.check
        self._wants_whole = held.wants_whole or differs
        if not self._wants_whole and check is not None and held.number >= self._last_whole:
            self._patience_ns = self._answer_ns
            self._whole_at_ns = 0

    def look(self, now_ns: int) -> None:
        """Make an update if one is due."""
        if self._model is None or self._endpoint.aside_waits:
            return
        if self._silence.silent or self._silence.expected:
            return
        whole = self._wants_whole and now_ns >= self._whole_at_ns
        if whole or self._cycle.lists_check != self._told_check:
            self._make(now_ns, whole=whole)

    def _make(self, now_ns: int, *, whole: bool) -> None:
        assert self._model is not None  # noqa: S101 - `look` saw to it
        check = self._cycle.lists_check
        assert check is not None  # noqa: S101 - there is a model
        delta = self._model.whole() if whole else self._model.take_delta()
        number, cycles = delta.number, self._cycle.number - self._covered
        update = ModelUpdate(number, now_ns, cycles, check, msgspec.msgpack.encode(delta))
        self._told_check, self._covered = check, self._cycle.number
        if delta.whole is not None:
            self._wants_whole, self._last_whole = False, number
            self._whole_at_ns = now_ns + self._patience_ns
            self._patience_ns *= 2
        if not self._endpoint.send_aside(update, now_ns):
            return  # longer than a message may be: the ground will miss it, and ask for a whole
        self._sent[number] = check
        if len(self._sent) > _REMEMBERED:
            self._sent.popitem(last=False)
        sent = ModelSent(number, len(update.delta), cycles, delta.whole is not None)
        self._journal.note(ROVER_MODEL, sent)
