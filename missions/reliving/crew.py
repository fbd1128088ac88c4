"""The crew of a run that is lived again: orders and changes come at the time that its log says."""

from collections.abc import Iterable, Sequence

from farside.acts import Act
from farside.ground.config import QUEUED
from farside.ground.view.view import Focus, GroundView
from farside.missions.build import build_channel, build_ground, build_operator, build_rover
from farside.missions.crew.crew import Crew, CrewError, InProcessCrew, LostProcess
from farside.missions.extensions.kinds import NONE, ExtensionError, Extensions
from farside.missions.reliving.changing import Live, change
from farside.missions.reliving.past import Past, RelivingError
from farside.missions.schema import Change, MissionFile
from farside.node import NEVER_NS, Record
from farside.rover.control.queued import QueuedController

_NOTHING: tuple[int, tuple[Act, ...]] = (NEVER_NS, ())
_NO_ACTION = (NEVER_NS, "")


class RelivedCrew(Crew):
    """Rover, link and ground in this process, with a past to live through.

    What was ordered from outside comes on the very tick on which it came then, however long the
    windows are, and each change of the mission on its tick.

    Args:
        mission: the mission at the start.
        changes: of the mission, in order of time.
        orders: what is ordered from outside while the mission's operator is `queued`, by time.
        actions: what the rover does by its controller if that is `queued`, by time.
        extensions: the controller and operator of one's own.

    Attributes:
        live: the live objects.
        now_ns: simulated time reached.
        mission: the mission in force.

    Raises:
        ExtensionError: if code of one's own is not found.
        LogError, RelivingError: as `Past.orders`, where they are asked for.
    """

    def __init__(
        self,
        mission: MissionFile,
        changes: Sequence[Change] = (),
        orders: Iterable[tuple[int, tuple[Act, ...]]] = (),
        extensions: Extensions = NONE,
        *,
        actions: Iterable[tuple[int, str]] = (),
    ) -> None:
        self.mission = mission
        self.live = Live(
            build_rover(mission, extensions),
            build_channel(mission),
            build_ground(mission, build_operator(mission, extensions)),
        )
        self.now_ns = 0
        self._crew = InProcessCrew(*self.live)
        self._changes = list(changes)
        missions = (mission, *(change.mission for change in changes))
        asked = any(one.ground.operator == QUEUED for one in missions)
        self._orders = iter(orders) if asked else iter(())
        self._next = next(self._orders, _NOTHING)
        controller = self.live.rover.controller
        self._queued = controller if isinstance(controller, QueuedController) else None
        self._actions = iter(actions) if self._queued else iter(())
        self._action = next(self._actions, _NO_ACTION)
        self._extensions = extensions

    @property
    def lost_processes(self) -> Sequence[LostProcess]:
        """See `Crew.lost_processes`."""
        return self._crew.lost_processes

    def advance(self, until_ns: int, acts: Sequence[Act] = ()) -> list[Record]:
        """See `Crew.advance`; here a window may be of any length."""
        records: list[Record] = []
        while self.now_ns < until_ns:
            while self._changes and self._changes[0].at_ns <= self.now_ns:
                self._change(self._changes.pop(0))
            given = (*self._due(), *acts)
            acts = ()
            self._put_due()
            end_ns = min(
                until_ns, self.now_ns + self.mission.window_ns, self._next[0], self._action[0]
            )
            if self._changes:
                end_ns = min(end_ns, self._changes[0].at_ns)
            records += self._crew.advance(end_ns, given)
            self.now_ns = end_ns
        return records

    def look(self, focus: Focus) -> GroundView | None:
        """See `Crew.look`."""
        return self._crew.look(focus)

    def close(self) -> None:
        """Does nothing: nothing was started."""

    def _due(self) -> tuple[Act, ...]:
        """What was ordered from outside at this time."""
        due: tuple[Act, ...] = ()
        while self._next[0] <= self.now_ns:
            due += self._next[1]
            self._next = next(self._orders, _NOTHING)
        return due if self.mission.ground.operator == QUEUED else ()

    def _put_due(self) -> None:
        """Have the rover begin what it began at this time."""
        while self._queued is not None and self._action[0] <= self.now_ns:
            self._queued.put(self._action[1])
            self._action = next(self._actions, _NO_ACTION)

    def _change(self, made: Change) -> None:
        change(self.live, self.mission, made.mission, self.now_ns, self._extensions)
        self.mission = made.mission


def revived(past: Past, extensions: Extensions) -> RelivedCrew:
    """The crew of a recorded run, at its start.

    Raises:
        RelivingError: if code of one's own that its mission names cannot be imported.
    """
    try:
        return RelivedCrew(
            past.mission, past.changes, past.orders(), extensions, actions=past.actions()
        )
    except ExtensionError as error:
        raise RelivingError(f"{past.log.path}: the run cannot be lived again: {error}") from error


def advanced(crew: RelivedCrew, past: Past, until_ns: int) -> list[Record]:
    """The records of the crew's life up to, not including, `until_ns`.

    Raises:
        RelivingError: if a node fails that did not fail in the recorded run.
    """
    try:
        records = crew.advance(until_ns)
        lost = crew.lost_processes
    except CrewError as error:
        lost = (error.lost,)
    except ExtensionError as error:
        raise RelivingError(f"{past.log.path}: the run cannot be lived again: {error}") from error
    if lost:
        raise RelivingError(
            f"{past.log.path}: the run cannot be lived again, as it failed now and not then: "
            f"{lost[0]}"
        )
    return records
