"""Rehearsals: missions run from a test in simulated time, with blackouts scripted in the test."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Self, cast

from farside.acts import Act
from farside.ground.config import QUEUED
from farside.ground.operators.operator import Operator
from farside.missions.loading import MissionError, load_mission, shipped_missions
from farside.missions.orders.timed import TimedOrders
from farside.missions.run import FinishedRun, run_mission
from farside.rover.controller import Controller
from farside.settings import Plain
from farside.validation import did_you_mean

_BLACKOUTS = "link.blackouts"

_CONTROLLER, _OPERATOR = "rover.controller", "ground.operator"


def find_mission(source: str | Path, folder: Path) -> str | Path:
    """The mission file at `source`, which is relative to `folder`, or a shipped mission's name.

    Raises:
        MissionError: if there is neither. The message says where it was looked for.
    """
    path = folder / source
    if path.is_file():
        return path
    shipped = shipped_missions()
    if str(source) in shipped:
        return source
    raise MissionError(
        f"{source}: expected a mission file, from the folder of the test file, or the name of a "
        f"shipped mission, found neither {path} nor one of that name among {', '.join(shipped)}"
        f"{did_you_mean(Path(source).stem, shipped)}"
    )


def _unheeded(_run: FinishedRun) -> None:
    pass


class Rehearsal:
    """A mission to run with changed values, in this process and as fast as possible.

    Every method but `run` returns a new rehearsal and leaves this one unchanged:
    `mission("blackout").with_seed(5).blackout(60, 300).run()`.

    Args:
        source: path of a mission file, or name of a shipped mission.
        out: folder for logs.
        assignments: values by dotted key, in place of the mission file's.
        orders: orders from outside, each with its time in simulated seconds.
        when_over: is called with every run that was made.
    """

    def __init__(
        self,
        source: str | Path,
        out: str | Path,
        assignments: Mapping[str, object] | None = None,
        orders: Sequence[tuple[float, Act]] = (),
        *,
        when_over: Callable[[FinishedRun], None] = _unheeded,
    ) -> None:
        self._source = source
        self._out = Path(out)
        self._assignments = dict(assignments or {})
        self._orders = tuple(orders)
        self._when_over = when_over

    def _changed(
        self, assignments: Mapping[str, object], orders: Sequence[tuple[float, Act]]
    ) -> Self:
        return type(self)(self._source, self._out, assignments, orders, when_over=self._when_over)

    def set(self, key: str, value: object) -> Self:
        """Replace a value of the mission file, such as that of `link.up.loss`."""
        return self._changed({**self._assignments, key: value}, self._orders)

    def with_seed(self, seed: int) -> Self:
        """Replace the seed."""
        return self.set("seed", seed)

    def without_blackouts(self) -> Self:
        """Remove all blackouts."""
        return self.set(_BLACKOUTS, [])

    def blackout(self, start_s: float, duration_s: float, direction: str = "both") -> Self:
        """Add a blackout. The first replaces all blackouts of the mission file.

        Args:
            start_s: start in simulated seconds.
            duration_s: length in seconds.
            direction: `up`, `down` or `both`.
        """
        scripted = self._assignments.get(_BLACKOUTS, [])
        assert isinstance(scripted, list)  # noqa: S101 - only set here
        blackout = {"start_s": start_s, "end_s": start_s + duration_s, "direction": direction}
        return self.set(_BLACKOUTS, [*scripted, blackout])

    def controller(
        self, controller: type[Controller] | str, **options: Plain | Sequence[Plain]
    ) -> Self:
        """Have the rover flown by this controller.

        Args:
            controller: the class, which may be one of the test's own, or the name of one.
            options: what it is made with, in place of `rover.controller_options`.
        """
        return self.set(_CONTROLLER, controller).set(f"{_CONTROLLER}_options", options)

    def operator(self, operator: type[Operator] | str, **options: Plain | Sequence[Plain]) -> Self:
        """Have this operator decide at the ground; see `controller`."""
        return self.set(_OPERATOR, operator).set(f"{_OPERATOR}_options", options)

    def order(self, t_s: float, act: Act) -> Self:
        """Have this ordered at the start of the first window from `t_s` on.

        The first order makes `queued` the operator, unless the rehearsal names another one.

        Args:
            t_s: simulated seconds.
            act: what to order.
        """
        assignments = {_OPERATOR: QUEUED, **self._assignments}
        return self._changed(assignments, (*self._orders, (t_s, act)))

    def run(self) -> FinishedRun:
        """Run the mission.

        Raises:
            MissionError: if the mission with the changed values is not valid.
            ValueError: if there are orders from outside, and the operator takes none.
            KeyboardInterrupt: if the run was interrupted.
        """
        given = dict(self._assignments)
        classes = {
            key: given.pop(key)
            for key in (_CONTROLLER, _OPERATOR)
            if isinstance(given.get(key), type)
        }
        loaded = load_mission(
            self._source,
            given,
            controller=cast("type[Controller] | None", classes.get(_CONTROLLER)),
            operator=cast("type[Operator] | None", classes.get(_OPERATOR)),
        )
        watcher = TimedOrders(self._orders)
        run = run_mission(loaded, in_process=True, out=self._out, watcher=watcher)
        if run.interrupted:
            raise KeyboardInterrupt
        self._when_over(run)
        return run
