"""What the rover learned: surprises, the growth of its lists, C_m, and its policy maps."""

from typing import Any

from farside.logs.events import sign_text
from farside.logs.file.reading import LogEntry
from farside.logs.report.model import Panel, PolicyMoment, Side, View
from farside.logs.report.thinning import Curve, ms, rounded, thinning_note
from farside.node import Topic
from farside.topics import (
    GROUND_SHADOW,
    ROVER_CYCLE,
    ROVER_DECISION,
    ROVER_POLICY_MAP,
    Cycle,
    Decision,
    PolicyMapEntry,
    ShadowEntry,
)

_PLACES = 20_000  # on all policy maps together


class Learning:
    """The curves of the model on board; for the ground, those of its shadow."""

    topics: tuple[Topic[Any], ...] = (ROVER_CYCLE, ROVER_DECISION, ROVER_POLICY_MAP, GROUND_SHADOW)

    def __init__(self, side: Side) -> None:
        self._as_ground = side.is_ground
        self._totals = {"novel": 0, "unexpected": 0, "failed predictions": 0}
        self._surprises = {name: Curve(side.until_ns, "steps") for name in self._totals}
        self._lists = {name: Curve(side.until_ns, "steps") for name in ("Signs", "hypotheses")}
        self._mean = Curve(side.until_ns, "steps")
        self._acted = Curve(side.until_ns, "dots")
        self._maps: list[PolicyMoment] = []
        self._places = 0
        self._more_maps = 0

    def take(self, entry: LogEntry) -> None:
        """See `Gatherer`."""
        t_ns = entry.log_time_ns
        match entry.message:
            case Cycle() as cycle:
                self._totals["novel"] += len(cycle.novel)
                self._totals["unexpected"] += len(cycle.unexpected)
                self._totals["failed predictions"] += cycle.failed
                for name, curve in self._surprises.items():
                    curve.add(t_ns, self._totals[name])
                self._lists["Signs"].add(t_ns, cycle.signs)
                self._lists["hypotheses"].add(t_ns, cycle.hypotheses)
                self._mean.add(t_ns, cycle.mean_cm)
            case Decision(behind=behind) if behind is not None:
                self._acted.add(t_ns, behind.cm)
            case PolicyMapEntry() as policy_map:
                self._take_map(t_ns, policy_map)
            case ShadowEntry() as shadow if self._as_ground:
                self._lists["Signs"].add(t_ns, shadow.signs, t_ns)
                self._lists["hypotheses"].add(t_ns, shadow.hypotheses, t_ns)

    def _take_map(self, t_ns: int, entry: PolicyMapEntry) -> None:
        if entry.goal is None:
            return
        self._places += len(entry.places)
        if self._places > _PLACES:
            self._more_maps += 1
            return
        places = [
            (sign_text(place.sign), rounded(place.value), place.action or "", place.depth)
            for place in entry.places
        ]
        self._maps.append(PolicyMoment(ms(t_ns), sign_text(entry.goal), places))

    def fill(self, view: View) -> None:
        """See `Gatherer`."""
        whose = "of the shadow at the ground" if self._as_ground else "on board"
        lists = [curve.series(name) for name, curve in self._lists.items()]
        if self._as_ground:
            if lists[0].t:
                view.panels.append(Panel(f"Growth of the lists {whose}", "", lists))
            return
        view.maps = self._maps
        if self._more_maps:
            view.notes.append(
                f"Policy maps: the first {len(self._maps)}, with {_PLACES} places at most; "
                f"{self._more_maps} later ones are left out"
            )
        if not lists[0].t:
            return
        surprises = [curve.series(name) for name, curve in self._surprises.items()]
        view.panels += [
            Panel("Surprises so far", "", surprises),
            Panel(f"Growth of the lists {whose}", "", lists),
            Panel(
                "Corroboration C_m",
                "",
                [
                    self._mean.series("mean of all hypotheses"),
                    self._acted.series("the hypothesis acted upon"),
                ],
                top=1.0,
            ),
        ]
        curves = [*self._surprises.values(), *self._lists.values(), self._mean, self._acted]
        view.notes += thinning_note("Surprises, lists and C_m", curves)
