"""The moments that need a decision: time goes back to 1x by itself, before or when they come."""

from farside.console.pacing import Pacing, Until
from farside.control import CommandStage, Mode
from farside.ground.view.view import GroundView
from farside.logs.file.reading import LogEntry
from farside.logs.picture import Picture
from farside.messages import CommandReached, Proposal, Telemetry
from farside.node import NEVER_NS, NS_PER_S
from farside.topics import EventLearned

BEFORE_NS = 10 * NS_PER_S
"""How long before a moment that is foreseen time slows down: for reading and answering (project
default)."""

WORKING_SPEED = 10.0
"""At this speed a person still works with a rover that waits for every word (project default)."""

_GAP_NS = 10 * NS_PER_S
_ROUTINE = {CommandStage.TAKEN, CommandStage.WAITING, CommandStage.BEGUN}


def is_idle(picture: Picture, view: GroundView | None) -> bool:
    """Whether the rover is heard, waits for orders, and has none: time would pass unused."""
    silent = view is None or view.silent_since_ns is not None or view.silence_expected
    return picture.mode is Mode.GUIDED and not silent and not picture.commands.on_the_way


class Decisions:
    """Sees from what the ground notes, and can know, when somebody has to decide.

    When it comes: a proposal that asks for consent; an alarm; the rover, driven by commands, stands
    and waits for the next. Where the rover waits for the word, however long that takes, speeds up
    to `WORKING_SPEED` are kept. Before it comes: a contact ends, the last moment for a veto.

    Args:
        pacing: what is slowed down.
    """

    def __init__(self, pacing: Pacing) -> None:
        self._pacing = pacing
        self._alarms = 0
        self._proposal = 0
        self._heard_ns = 0
        self._busy = False
        self._foreseen: tuple[int, str] = (NEVER_NS, "")
        self._passed_ns = -1

    def take(self, entry: LogEntry, picture: Picture) -> None:
        """What the ground has noted, after the picture took it."""
        match entry.message:
            case Proposal(number=number) as message if number > self._proposal:
                self._proposal = number
                self._pacing.arrive(Until.ARRIVAL, f"proposal {number} has come")
                stands = picture.proposal is not None and picture.proposal.number == number
                if stands:
                    # Silence is consent to what would be done without a veto: that cannot wait.
                    above = WORKING_SPEED if message.veto_window_s is None else 1.0
                    self._pacing.slow(f"proposal {number} asks for your word", above=above)
            case EventLearned(event=event):
                what = event.what
                if not (isinstance(what, CommandReached) and what.stage in _ROUTINE):
                    self._pacing.arrive(Until.ARRIVAL, f"event {event.number} has come")
            case Telemetry():
                if entry.log_time_ns - self._heard_ns > _GAP_NS:
                    self._pacing.arrive(Until.ARRIVAL, "the rover is heard")
                self._heard_ns = entry.log_time_ns
            case _:
                pass

    def settle(self, now_ns: int, picture: Picture, alarms: int) -> None:
        """A window is over; so many alarms were raised so far."""
        pacing = self._pacing
        if alarms > self._alarms:
            pacing.slow("an alarm has come")
        self._alarms = alarms
        busy = picture.commands.on_the_way > 0
        if self._busy and not busy and picture.mode is Mode.GUIDED:
            pacing.slow("all that was ordered is done", above=WORKING_SPEED)
        self._busy = busy
        moment_ns, why = self._foreseen
        if moment_ns <= now_ns:
            self._passed_ns, self._foreseen = moment_ns, (NEVER_NS, "")
            pacing.slow(why)
            pacing.expect(NEVER_NS)

    def see(self, view: GroundView) -> None:
        """What the ground can know by now: the moments ahead."""
        self._foreseen = min(self._moments(view), default=(NEVER_NS, ""))
        self._pacing.expect(self._foreseen[0])
        if view.up.changes_ns is None:
            self._pacing.arrive(Until.CONTACT, "the contact plan has no further contact")

    def _moments(self, view: GroundView) -> list[tuple[int, str]]:
        warped = self._pacing.until is Until.CONTACT
        moments: list[tuple[int, str]] = []
        changes_ns = view.up.changes_ns
        if changes_ns is not None and changes_ns < NEVER_NS:
            if not view.up.is_open:
                moments.append((changes_ns, "contact begins"))
            elif not warped:
                moments.append((changes_ns - BEFORE_NS, "contact ends in 10 s"))
        if view.veto_until_ns is not None:
            moments.append((view.veto_until_ns - BEFORE_NS, "the veto window runs out in 10 s"))
        return [one for one in moments if one[0] > max(view.now_ns, self._passed_ns)]
