"""The failsafe at work: the rule that applies now, noted and told whenever it is another one."""

from collections.abc import KeysView

from farside.control import Cause, Failsafe
from farside.messages import FailsafeChanged
from farside.node import Journal, to_s
from farside.rover.events import EventQueue
from farside.rover.failsafe.silence import Silence
from farside.rover.failsafe.table import Rule, orders_for, rule_for
from farside.topics import ROVER_FAILSAFE, FailsafeEntry

CAUSES = tuple(Cause)
"""The causes in the order in which `FailsafeWatch.look` is told whether each is so."""


class FailsafeWatch:
    """Looks up what is so in the failsafe's table.

    Args:
        silence: on the link.
        journal, events: where changes are noted, and told to the ground.

    Attributes:
        rule: the rule that applies.
        orders: what becomes of the operator's orders.
    """

    def __init__(self, silence: Silence, journal: Journal, events: EventQueue) -> None:
        self._silence = silence
        self._journal, self._events = journal, events
        self._so: tuple[bool, ...] = (False,) * len(CAUSES)
        self.rule: Rule = rule_for(self._causes)
        self.orders = orders_for(self._causes)

    @property
    def _causes(self) -> KeysView[Cause]:
        """All that is so, as a set that keeps the order of `CAUSES`."""
        so = zip(CAUSES, self._so, strict=True)
        return dict.fromkeys(cause for cause, is_so in so if is_so).keys()

    @property
    def state(self) -> Failsafe:
        """The failsafe's state."""
        return self.rule.state

    def begin(self) -> None:
        """Note the state at the start."""
        self._note()

    def look(self, so: tuple[bool, ...]) -> bool:
        """Apply the rule for what is so, of `CAUSES`; true if it is another one."""
        if so == self._so:
            return False  # as at nearly every tick
        self._so = so
        causes = self._causes
        self.orders = orders_for(causes)
        rule = rule_for(causes)
        if rule is self.rule:
            return False
        self.rule = rule
        self._note()
        self._events.tell(FailsafeChanged(rule.state, rule.why, self._silence.quiet_ns))
        return True

    def _note(self) -> None:
        causes = tuple(self._causes)
        silence_s = to_s(self._silence.quiet_ns)
        countdown_s = to_s(self._silence.countdown_ns)
        self._journal.note(
            ROVER_FAILSAFE,
            FailsafeEntry(self.rule.state, self.rule.why, causes, silence_s, countdown_s),
        )
