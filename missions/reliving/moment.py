"""A moment of a run, alive: `farside.relive`."""

from pathlib import Path
from typing import TYPE_CHECKING

from farside.dem import ShadowModel
from farside.ground.node import Ground
from farside.link.channel.node import Channel
from farside.logs import LogFile
from farside.missions.extensions.kinds import Extensions, search_path, searching
from farside.missions.reliving.crew import advanced, revived
from farside.missions.reliving.past import Past, RelivingError, read_past, refuse_beyond
from farside.missions.schema import MissionFile
from farside.node import to_ns, to_s
from farside.rover.controller import Controller
from farside.rover.node import Rover

if TYPE_CHECKING:
    from farside.ground.operators.operator import Operator


class Relived:
    """The live objects of a run at a moment: ask them anything, and change nothing that goes on.

    They are the very objects that a run consists of, so whatever these classes offer can be asked:
    `model.policy_map()`, `model.why()`, `rover.parts.goals.listed`, `rover.world.pose`,
    `ground.situation.predicted()`, `channel.outage(…)`. All that the log tells of up to and
    including the moment has happened to them, and nothing later.

    Made by `relive`.

    Attributes:
        mission: the mission in force.
    """

    def __init__(self, past: Past, extensions: Extensions) -> None:
        self._past = past
        self._path = extensions.path
        self._crew = revived(past, extensions)

    @property
    def now_s(self) -> float:
        """Simulated time up to which everything has happened."""
        return to_s(max(0, self._crew.now_ns - self.mission.tick_ns))

    @property
    def mission(self) -> MissionFile:
        """The mission in force."""
        return self._crew.mission

    @property
    def rover(self) -> Rover:
        """The rover: `parts`, `pilot.authority`, `world`, `estimate`, `config`, `controller`."""
        return self._crew.live.rover

    @property
    def model(self) -> Controller:
        """The controller on board: the `DynamicExpectancyModel`, or one of one's own."""
        return self.rover.controller

    @property
    def channel(self) -> Channel:
        """The link: `settings`, `outage`."""
        return self._crew.live.link

    @property
    def ground(self) -> Ground:
        """The ground station: `situation`, `operator`, `shadow`."""
        return self._crew.live.ground

    @property
    def shadow(self) -> ShadowModel | None:
        """What the ground holds of the model on board; `None` where that is not sent."""
        shadow = self.ground.shadow
        return None if shadow is None else shadow.model

    def go_on(self, until_s: float) -> None:
        """Live on up to and including a later moment, in simulated seconds.

        Raises:
            RelivingError: if it is before `now_s` or after the end of the record, or a node fails
                that did not fail then.
        """
        refuse_beyond(self._past, until_s)
        tick_ns = self._past.mission.tick_ns
        until_ns = min(self._past.until_ns, (to_ns(until_s) // tick_ns + 1) * tick_ns)
        if until_ns < self._crew.now_ns:
            raise RelivingError(
                f"expected a moment at {self.now_s:g} s or later, found {until_s:g} s: "
                f"nobody can live back"
            )
        with searching(self._path):
            advanced(self._crew, self._past, until_ns)

    def __repr__(self) -> str:
        return f"<{self._past.log.path} re-lived up to {self.now_s:g} s>"


def relive(
    log: LogFile | Path | str,
    until_s: float,
    *,
    controller: type[Controller] | None = None,
    operator: "type[Operator] | None" = None,
) -> Relived:
    """Live a run again in this process, up to and including a moment.

    The mission, the seed and the orders in the log make it the same run, whoever gave the orders,
    and however many processes it took then.

    Args:
        log: the log of the run, open or by its path.
        until_s: the moment, in simulated seconds.
        controller: the class of the run's own controller, where the name in its mission does not
            lead to it, as for a class inside a test.
        operator: likewise.

    Raises:
        LogError: if the log cannot be read.
        RelivingError: if the moment is none of the run's; if a process had ended before it; if the
            log holds no mission, or one that this Farside cannot read; or if code of one's own that
            the mission names cannot be imported.
    """
    past = read_past(log)
    refuse_beyond(past, until_s)
    extensions = Extensions(controller, operator, search_path(Path.cwd()))
    with searching(extensions.path):
        relived = Relived(past, extensions)
    relived.go_on(until_s)
    return relived
