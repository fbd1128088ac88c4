"""What follows from what the ground was told: where the rover is by now, and its paths."""

from collections.abc import Sequence

from farside.ground.belief import Belief
from farside.ground.foresight import Foresight
from farside.ground.moves import MoveTerms, MoveTimes
from farside.ground.prediction import OnItsWay, Predictor
from farside.ground.review import Lists, review_path, review_proposal
from farside.ground.shadow import Shadow
from farside.messages import Proposal, Telemetry, Tokens
from farside.topics import PathReview, Prediction


class Outlook:
    """Joins belief, shadow and the commands on their way to what follows from them.

    Args:
        belief: what the ground knows.
        shadow: the shadow of the model on board; `None` where that is not sent.
        moves: what is known beforehand of the rover's moves.
        alone_after_ns: the silence after which the failsafe leaves the rover to itself.
    """

    def __init__(
        self, belief: Belief, shadow: Shadow | None, moves: MoveTerms, alone_after_ns: int
    ) -> None:
        self._belief, self._shadow = belief, shadow
        self._times = MoveTimes(moves)
        self._foresight = None
        if shadow is not None:
            self._foresight = Foresight(shadow.model, lambda: (shadow.number, shadow.check))
        self._predictor = Predictor(self._foresight, self._times, alone_after_ns)

    def learn(self, telemetry: Telemetry) -> None:
        """Telemetry has come straight from the rover, newer than all before it."""
        self._times.learn(telemetry)

    def predicted(
        self, coming: Sequence[OnItsWay], now_ns: int, silent_since_ns: int | None = None
    ) -> Prediction | None:
        """Where the rover is by now; `None` before anything was heard of it.

        Args:
            coming: the commands not known to be over, in order.
            now_ns: the present.
            silent_since_ns: since when nothing is heard though something was due.
        """
        telemetry = self._belief.telemetry
        if telemetry is None:
            return None
        return self._predictor.now(telemetry, coming, now_ns, silent_since_ns=silent_since_ns)

    def predicted_after(self, coming: Sequence[OnItsWay], now_ns: int) -> tuple[Prediction, ...]:
        """Where the rover will be after each command on its way that asks for an action."""
        telemetry = self._belief.telemetry
        if telemetry is None:
            return ()
        return tuple(self._predictor.after(telemetry, coming, now_ns))

    def review(self, proposal: Proposal, coming: Sequence[OnItsWay], now_ns: int) -> PathReview:
        """What the ground finds of a proposal."""
        return review_proposal(proposal, self._belief, coming, self._lists, now_ns)

    def review_path(
        self, goal: Tokens, coming: Sequence[OnItsWay], now_ns: int
    ) -> PathReview | None:
        """What the ground finds of the way to a goal from where the rover will be.

        That is where it most probably is after all that is on its way; `None` where that is not
        known, or the shadow knows no way from there.
        """
        lists, shadow = self._lists, self._shadow
        predictions = self.predicted_after(coming, now_ns)
        last = predictions[-1] if predictions else self.predicted(coming, now_ns)
        if lists is None or shadow is None or last is None or not last.likely:
            return None
        start = last.likely[0].sign[0]
        return review_path(goal, start, lists, shadow.made_ns, now_ns)

    @property
    def _lists(self) -> Lists | None:
        if self._shadow is None or self._foresight is None:
            return None
        return Lists(self._shadow.model, self._foresight, self._shadow.check)
