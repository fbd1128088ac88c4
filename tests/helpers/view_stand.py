"""A ground that was told this and that, to be looked at."""

import numpy as np

from farside.acts import Act
from farside.dem import DynamicExpectancyModel, Parameters, ShadowModel
from farside.ground.downlink import DownlinkPlan, GroundSilence
from farside.ground.moves import MoveTimes
from farside.ground.outlook import Outlook
from farside.ground.shadow import Shadow
from farside.ground.view.knowledge import Sources
from farside.ground.view.looking import look
from farside.ground.view.memory import Memory
from farside.ground.view.view import Focus, GroundView, Option
from farside.link import LinkConfig, LinkTerms, OneWay
from farside.messages import (
    CommandReached,
    Event,
    Happening,
    Proposal,
    Telemetry,
)
from farside.node import Direction, Frame, Journal, to_ns
from farside.places import ACTIONS, Chart
from tests.ground.conftest import MOVES, ROVER, make_belief, make_desk, telemetry

LINK = LinkConfig(up=OneWay(delay_s=1.0), down=OneWay(delay_s=1.0))
YARD = Chart(("######", "#.~.o#", "#A..B#", "######"), 1.0)
CORRIDOR = ("A", "2,1", "3,1", "B")


def driven(*bumps: str) -> ShadowModel:
    """The shadow of a model that was driven along the corridor, and bumped at A these ways."""
    model = DynamicExpectancyModel(
        dict.fromkeys(ACTIONS, 1.0), Parameters(), rng=np.random.default_rng(1)
    )
    model.record_changes()
    model.sense(["at:A"])
    for _ in range(4):
        for action, places in (("E", CORRIDOR[1:]), ("W", CORRIDOR[-2::-1])):
            for place in places:
                model.perform(action)
                model.sense([f"at:{place}"])
    for action in bumps:
        model.perform(action)
        model.sense(["at:A"])
    shadow = ShadowModel(dict.fromkeys(ACTIONS, 1.0), Parameters())
    shadow.apply(model.take_delta())
    return shadow


class Stand:
    """A ground that was told this, at 10 s of light time 1 s, and gave these acts."""

    def __init__(
        self, *heard: Telemetry, model: ShadowModel | None = None, link: LinkConfig = LINK
    ) -> None:
        terms = LinkTerms.simulated(link, seed=1)
        self.now_ns = to_ns(10.0)
        self.belief, self.desk = make_belief(link), make_desk(link, valid_ns=to_ns(60.0))
        self.memory, plan, times = Memory(terms.schedule), DownlinkPlan(terms), MoveTimes(MOVES)
        self.silence = GroundSilence(plan, to_ns(6.0), to_ns(1.0))
        shadow = Shadow(model or driven(), Journal())
        outlook = Outlook(
            self.belief,
            self.desk,
            self.silence,
            shadow=shadow,
            times=times,
            alone_after_ns=ROVER.alone_after_ns,
        )
        self.sources = Sources(
            self.belief,
            self.desk,
            self.silence,
            outlook,
            self.memory,
            shadow=shadow,
            plan=plan,
            schedule=terms.schedule,
            rover=ROVER,
            chart=YARD,
        )
        for message in heard:
            self.belief.learn(message, self.now_ns)
            self.desk.learn(message, self.now_ns)
        if heard:
            self.belief.heard_ns = self.now_ns
        self.silence.look(self.belief.heard_ns, self.now_ns)
        heartbeat = Frame(Direction.UP, 0, self.now_ns, bytes(20))
        self.memory.send([heartbeat])

    def tell(self, *happened: Happening, at_s: float = 9.0) -> "Stand":
        for number, what in enumerate(happened, start=self.belief.last_event + 1):
            event = Event(number, to_ns(at_s), what)
            self.belief.tell(event, self.now_ns)
            self.memory.tell(event)
            if isinstance(what, CommandReached):
                self.desk.learn_stage(what, to_ns(at_s), self.now_ns)
        return self

    def give(self, *acts: Act) -> "Stand":
        for act in acts:
            self.memory.give(act)
            self.desk.give(act, self.now_ns)
        return self

    def propose(self, proposal: Proposal) -> "Stand":
        self.belief.consider(proposal)
        self.memory.show(proposal.number, self.now_ns)
        return self

    def view(self, focus: Focus | None = None, after_s: float = 0.0) -> GroundView:
        now_ns = self.now_ns + to_ns(after_s)
        self.silence.look(self.belief.heard_ns, now_ns)
        return look(self.sources, focus or Focus(), now_ns, now_ns)


def option(view: GroundView, action: str) -> Option:
    return next(option for option in view.options if option.action == action)


def stand_at(place: str, *bumps: str, **changes: object) -> Stand:
    return Stand(telemetry(9.0, place, **changes), model=driven(*bumps))


def proposal(action: str = "E", veto_window_s: float | None = None) -> Proposal:
    return Proposal(14, to_ns(9.5), ("at:B",), action, (), veto_window_s)
