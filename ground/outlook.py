"""What follows from what the ground was told: where the rover is by now, and its paths."""

from typing import NamedTuple

from farside.ground.belief import Belief
from farside.ground.commands.desk import CommandDesk
from farside.ground.downlink import GroundSilence
from farside.ground.foresight import Foresight, Outcome
from farside.ground.moves import MoveTerms, MoveTimes
from farside.ground.prediction import OnItsWay, Predictor
from farside.ground.review import Lists, review_path, review_proposal
from farside.ground.shadow import Shadow
from farside.messages import Proposal, Telemetry, Tokens
from farside.node import to_s
from farside.topics import PathReview, Prediction


class EnergyTerms(NamedTuple):
    """What the ground knows beforehand of what the rover's moves take.

    Attributes:
        capacity_j: energy of the full battery.
        driving_w: power drawn while driving.
        idle_w: power drawn at rest.
        reserve: so many times what the way to the dock takes counts as reserve.
        move_cost_s: cost of a move for the model on board.
    """

    capacity_j: float
    driving_w: float
    idle_w: float
    reserve: float
    move_cost_s: float


class RoverTerms(NamedTuple):
    """What the ground knows of the rover beforehand.

    Attributes:
        moves: of its moves.
        least_move_ns: what a move takes at least unless it is blocked: the rover sees to it.
        hold_after_ns: the silence after which the failsafe holds it; no shorter one is silence.
        alone_after_ns: the silence after which the failsafe leaves it to itself.
        explores: whether in autonomous mode it explores where it knows no way.
        energy: what its moves take.
    """

    moves: MoveTerms
    least_move_ns: int
    hold_after_ns: int
    alone_after_ns: int
    explores: bool
    energy: EnergyTerms


class Outlook:
    """Joins belief, shadow and the commands on their way to what follows from them.

    Args:
        belief: what the ground knows.
        desk: the commands given so far.
        silence: whether the rover is heard.
        shadow: the shadow of the model on board; `None` where that is not sent.
        times: how long moves take.
        alone_after_ns: the silence after which the failsafe leaves the rover to itself.
    """

    def __init__(
        self,
        belief: Belief,
        desk: CommandDesk,
        silence: GroundSilence,
        *,
        shadow: Shadow | None,
        times: MoveTimes,
        alone_after_ns: int,
    ) -> None:
        self._belief, self._desk, self._silence, self._shadow = belief, desk, silence, shadow
        self._times = times
        self._foresight = None
        if shadow is not None:
            self._foresight = Foresight(shadow.model, lambda: (shadow.number, shadow.check))
        self._predictor = Predictor(self._foresight, times, alone_after_ns, self._priorities)

    def learn(self, telemetry: Telemetry) -> None:
        """Telemetry has come straight from the rover, newer than all before it."""
        self._times.learn(telemetry)

    def predicted(self, now_ns: int) -> Prediction | None:
        """Where the rover is by now; `None` before anything was heard of it."""
        telemetry = self._belief.telemetry
        if telemetry is None:
            return None
        since_ns = self._silence.since_ns
        return self._predictor.now(telemetry, self.coming, now_ns, silent_since_ns=since_ns)

    def predicted_after(self, now_ns: int) -> tuple[Prediction, ...]:
        """Where the rover will be after each command on its way that asks for an action."""
        telemetry = self._belief.telemetry
        if telemetry is None:
            return ()
        return tuple(self._predictor.after(telemetry, self.coming, now_ns))

    def review(self, proposal: Proposal, now_ns: int) -> PathReview:
        """What the ground finds of a proposal."""
        return review_proposal(proposal, self._belief, self.coming, self._lists, now_ns)

    def review_path(self, goal: Tokens, now_ns: int) -> PathReview | None:
        """What the ground finds of the way to a goal from where the rover will be.

        That is where it most probably is after all that is on its way; `None` where that is not
        known, or the shadow knows no way from there.
        """
        predictions = self.predicted_after(now_ns)
        last = predictions[-1] if predictions else self.predicted(now_ns)
        return self.review_path_from(last, goal, now_ns)

    def review_path_from(
        self, start: Prediction | None, goal: Tokens, now_ns: int
    ) -> PathReview | None:
        """What the ground finds of the way to a goal from where the rover most probably will be."""
        lists, shadow = self._lists, self._shadow
        if lists is None or shadow is None or start is None or not start.likely:
            return None
        return review_path(goal, start.likely[0].sign[0], lists, shadow.made_ns, now_ns)

    def outcomes(self, place: str, action: str) -> tuple[Outcome, ...]:
        """The places that a move may lead to, the most probable first; none without a shadow."""
        return () if self._foresight is None else self._foresight.outcomes(place, action)

    def move_s(self) -> float:
        """How long a move with a quarter turn is expected to take, in seconds."""
        return to_s(self._times.expected(None, None).mean_ns)

    def _priorities(self) -> dict[Tokens, float]:
        if self._shadow is None:
            return {}
        return {goal.tokens: goal.priority for goal in self._shadow.model.goals}

    @property
    def coming(self) -> list[OnItsWay]:
        """The commands not known to be over, in order."""
        telemetry = self._belief.telemetry
        begun = None if telemetry is None else telemetry.begun
        foreseen = self._desk.foreseen
        return [
            OnItsWay(
                life.command,
                life.action,
                foreseen[life.number].taken_ns,
                begun=life.number == begun,
                lapses=not life.has_begun
                and foreseen[life.number].begun_ns > life.command.expires_ns,
            )
            for life in self._desk.live
            if not life.is_over
        ]

    @property
    def _lists(self) -> Lists | None:
        if self._shadow is None or self._foresight is None:
            return None
        return Lists(self._shadow.model, self._foresight, self._shadow.check)
