"""A built-in operator with no ground station around it, and what it is shown."""

from farside.acts import Act
from farside.control import CommandStage
from farside.ground import Operator, Situation
from farside.ground.config import (
    GroundConfig,
)
from farside.ground.operators.built_in import built_in_operator
from farside.messages import (
    CommandReached,
    Event,
    GoalReached,
    Proposal,
    Tokens,
)
from farside.node import to_ns
from farside.places import Chart
from farside.topics import PathReview
from tests.ground.conftest import CHART, make_belief, make_desk, telemetry


class Reviews:
    """Reviews in place of those of an outlook: every way costs the same, by what was said."""

    def __init__(self) -> None:
        self.costs: dict[Tokens, float] = {}

    def review(self, proposal: Proposal, _now_ns: int) -> PathReview:
        cost = self.costs.get(proposal.goal, 1.0)
        return PathReview(proposal.goal, proposal.action, (), 0.0, cost)

    def review_path(self, goal: Tokens, _now_ns: int) -> PathReview | None:
        return PathReview(goal, "E", (), 0.0, self.costs[goal]) if goal in self.costs else None


class Ground:
    """An operator, and what it is shown."""

    def __init__(self, config: GroundConfig, chart: Chart = CHART) -> None:
        self.operator: Operator = built_in_operator(config, chart)
        self.belief, self.desk, self.reviews = make_belief(), make_desk(), Reviews()
        self.events = 0
        self.t_s = 0.0

    def learn(self, place: str = "A", **changes: object) -> None:
        """Telemetry says that the rover stands here, and that all commands are over."""
        self.t_s += 1.0
        said = telemetry(self.t_s, place, **{"commands_done": self.desk.last_given, **changes})
        self.belief.learn(said, said.time_ns)
        self.desk.learn(said)

    def end(self, stage: CommandStage, number: int | None = None) -> None:
        """The rover says how a command ended, by default the last one."""
        number = number or self.desk.last_given
        self.desk.learn_stage(CommandReached(number, stage, "for a reason"))

    def reach(self, place: str) -> None:
        """The rover says that it has reached a goal."""
        self.events += 1
        self.belief.tell(Event(self.events, 0, GoalReached((f"at:{place}",))), 0)

    def act(self, t_s: float | None = None, *, silent: bool = False) -> list[Act]:
        now_ns = to_ns(self.t_s if t_s is None else t_s)
        situation = Situation(now_ns, self.belief, self.desk, silent, self.reviews)  # type: ignore[arg-type]
        acts = list(self.operator.act(situation))
        for act in acts:
            self.desk.give(act, now_ns)
        return acts

    @property
    def waits_for(self) -> str | None:
        return self.operator.progress.waiting_for
