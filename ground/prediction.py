"""Where the rover is by now, and will be after every command on its way."""

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

from farside.control import Failsafe, Mode, OnLoss
from farside.ground.foresight import Foresight
from farside.ground.moves import MoveTimes
from farside.messages import (
    Command,
    Drive,
    Override,
    SetGoal,
    SetMode,
    Telemetry,
    Tokens,
    WithdrawGoal,
)
from farside.node import NEVER_NS
from farside.places import ON_CHARGE, is_place_token
from farside.topics import Likely, Prediction

_BRANCHES = 24
_SHOWN = 0.01
_MOVES = 2000  # of one branch: more than fit into any light time
_MIDWAY = 0.6  # share of a move after which the rover is in the next cell


class OnItsWay(NamedTuple):
    """A command that is not known to be over.

    Attributes:
        command: the command.
        action: the action that it asks for, `None` if it asks for none.
        arrives_ns: when it is, or was, due on board.
        begun_ns: when it is known to have begun; `None` if it is not known to have.
    """

    command: Command
    action: str | None
    arrives_ns: int
    begun_ns: int | None = None


class _Branch(NamedTuple):
    """One course that things may have taken.

    Attributes:
        probability: of this course.
        place: where the rover is, `None` if that is not known.
        seen: where it is at the horizon, in the middle of a move.
        facing: its last move.
        free_ns: since when it stands.
        mode: its mode.
        goals: its Goal List.
        done: the number of the last command with an action, and whether it was done.
        stays: whether it stands to charge.
    """

    probability: float
    place: str | None
    facing: str | None
    free_ns: int
    mode: Mode
    goals: tuple[Tokens, ...]
    done: tuple[int | None, bool] = (None, True)
    stays: bool = False


class Predictor:
    """Predicts the rover from the last that was heard of it, and all that is on its way to it.

    It follows every course that things may take: each move leads on with the probability that the
    shadow of the model gives it, and takes the mean time that such moves took. Commands that are
    meant for another place are refused on that course. In autonomous mode the rover moves on by
    the shadow's policy map.

    Not predicted are exploration, the ways back along a track, faults, and the loss of frames: what
    is on its way arrives when it is due. After unexplained silence for as long as the failsafe
    waits, the rover is taken to have lost the link too, and to be alone.

    Args:
        foresight: what the shadow's lists say; `None` without a shadow.
        times: how long moves take.
        alone_after_ns: the silence after which the failsafe leaves the rover to itself.
    """

    def __init__(self, foresight: Foresight | None, times: MoveTimes, alone_after_ns: int) -> None:
        self._foresight, self._times = foresight, times
        self._alone_after_ns = alone_after_ns

    def now(
        self,
        telemetry: Telemetry,
        coming: Sequence[OnItsWay],
        now_ns: int,
        *,
        silent_since_ns: int | None = None,
    ) -> Prediction:
        """Where the rover is at `now_ns`.

        Args:
            telemetry: the newest that came straight from the rover.
            coming: the commands not known to be over, in order.
            now_ns: the present.
            silent_since_ns: since when nothing is heard though something was due.
        """
        alone_ns = NEVER_NS
        if silent_since_ns is not None and telemetry.on_loss is OnLoss.AUTONOMY:
            alone_ns = silent_since_ns + self._alone_after_ns
        branches = self._start(telemetry, now_ns)
        for one in coming:
            if one.arrives_ns < alone_ns:
                branches = self._carry_out(branches, one, now_ns)
        branches = self._go_on(branches, min(now_ns, alone_ns), now_ns)
        if alone_ns < now_ns and telemetry.alone_goals:
            branches = self._go_on(
                [
                    one._replace(
                        mode=Mode.AUTONOMOUS,
                        goals=telemetry.alone_goals,
                        free_ns=max(one.free_ns, alone_ns),
                    )
                    for one in branches
                ],
                now_ns,
                now_ns,
            )
        return _told(branches, telemetry.time_ns, now_ns, None)

    def after(
        self, telemetry: Telemetry, coming: Sequence[OnItsWay], now_ns: int
    ) -> Iterator[Prediction]:
        """Where the rover will be after each command with an action, in order; see `now`."""
        branches = self._start(telemetry, NEVER_NS)
        for one in coming:
            branches = self._carry_out(branches, one, NEVER_NS)
            if one.action is not None:
                at_ns = _mean_ns(branches, now_ns)
                yield _told(branches, telemetry.time_ns, at_ns, one.command.number)

    # --- one course after another --------------------------------------------------------------

    def _start(self, telemetry: Telemetry, horizon_ns: int) -> list[_Branch]:
        begin = _Branch(
            probability=1.0,
            place=next(filter(is_place_token, telemetry.tokens), None),
            facing=self._times.facing,
            free_ns=telemetry.time_ns,
            mode=telemetry.mode,
            goals=telemetry.goals,
            stays=telemetry.action is None and telemetry.failsafe is not Failsafe.NOMINAL,
        )
        if telemetry.action is None:
            return [begin]
        return self._move([begin], telemetry.action, telemetry.since_ns, horizon_ns, None)

    def _carry_out(self, branches: list[_Branch], one: OnItsWay, horizon_ns: int) -> list[_Branch]:
        """A command arrives, and is carried out as soon as the rover stands."""
        if one.begun_ns is not None:  # its action is the one under way
            return [branch._replace(done=(one.command.number, True)) for branch in branches]
        if one.arrives_ns >= horizon_ns:
            return branches
        branches = self._go_on(branches, one.arrives_ns, horizon_ns)
        if one.action is None:
            return [_settled(branch, one) for branch in branches]
        moved: list[_Branch] = []
        for branch in branches:
            if _is_refused(branch, one.command):
                moved.append(branch._replace(done=(one.command.number, False)))
                continue
            takes_over = branch.mode is Mode.AUTONOMOUS and isinstance(one.command.order, Drive)
            ready = branch._replace(mode=Mode.GUIDED if takes_over else branch.mode, stays=False)
            when = one.command.when
            begin_ns = max(branch.free_ns, one.arrives_ns, (when and when.at_ns) or 0)
            moved += self._move([ready], one.action, begin_ns, horizon_ns, one.command.number)
        return _merged(moved)

    def _go_on(self, branches: list[_Branch], until_ns: int, horizon_ns: int) -> list[_Branch]:
        """What the rover begins of its own before `until_ns`, in autonomous mode."""
        done: list[_Branch] = []
        for _ in range(_MOVES):
            busy = [one for one in branches if self._intends(one, until_ns)]
            done += [one for one in branches if not self._intends(one, until_ns)]
            if not busy:
                return _merged(done)
            branches = _merged([after for one in busy for after in self._pursue(one, horizon_ns)])
        return _merged(done + branches)

    def _intends(self, branch: _Branch, until_ns: int) -> bool:
        if branch.mode is not Mode.AUTONOMOUS or branch.place is None or branch.stays:
            return False
        return branch.free_ns < until_ns and self._next(branch) is not None

    def _next(self, branch: _Branch) -> tuple[str, Tokens, bool] | None:
        """The rover's next move of its own, its goal, and whether it leads right to it."""
        if self._foresight is None or branch.place is None:
            return None
        for goal in branch.goals:
            if goal == (branch.place,):
                continue
            intent = self._foresight.intent(branch.place, goal)
            if intent is not None:
                return intent.action, goal, intent.is_last
        return None

    def _pursue(self, branch: _Branch, horizon_ns: int) -> Iterator[_Branch]:
        chosen = self._next(branch)
        assert chosen is not None  # noqa: S101 - `_intends` saw to it
        action, goal, is_last = chosen
        for one in self._move([branch], action, branch.free_ns, horizon_ns, None):
            if is_last and one.place not in {None, branch.place}:
                left = tuple(other for other in one.goals if other != goal)
                yield one._replace(goals=left, stays=goal == (ON_CHARGE,))
            else:
                yield one

    def _move(
        self,
        branches: Iterable[_Branch],
        action: str,
        begin_ns: int,
        horizon_ns: int,
        command: int | None,
    ) -> list[_Branch]:
        """A move, up to the horizon: who is under way there is where most of the way has led."""
        moved: list[_Branch] = []
        for branch in branches:
            if begin_ns >= horizon_ns:
                moved.append(branch)
                continue
            lasts_ns = self._times.expected_ns(branch.facing, action)
            then = branch._replace(facing=action, free_ns=begin_ns + lasts_ns)
            if begin_ns + int(_MIDWAY * lasts_ns) > horizon_ns:
                moved.append(then._replace(done=(command, True)))
                continue
            known = 0.0
            for place, probability in self._outcomes(branch.place, action):
                known += probability
                done = command, place != branch.place
                share = branch.probability * probability
                moved.append(then._replace(place=place, probability=share, done=done))
            left = branch.probability * (1 - known)
            if left > 0:
                moved.append(then._replace(place=None, probability=left, done=(command, True)))
        return moved

    def _outcomes(self, place: str | None, action: str) -> Sequence[tuple[str, float]]:
        if place is None or self._foresight is None:
            return ()
        return self._foresight.outcomes(place, action)


def _settled(branch: _Branch, one: OnItsWay) -> _Branch:
    """The course after an order that is done as soon as it is received."""
    ready = branch._replace(free_ns=max(branch.free_ns, one.arrives_ns))
    match one.command.order:
        case SetMode(mode=mode):
            return ready._replace(mode=mode)
        case SetGoal(tokens=wanted):
            # Where it comes among the others is not known; a new goal is mostly the most wanted.
            left = tuple(goal for goal in branch.goals if goal != wanted)
            return ready._replace(goals=(wanted, *left))
        case WithdrawGoal(tokens=dropped):
            return ready._replace(goals=tuple(goal for goal in branch.goals if goal != dropped))
        case _:
            return branch


def _is_refused(branch: _Branch, command: Command) -> bool:
    meant, when = command.meant, command.when
    if when is not None and when.after is not None and branch.done != (when.after, True):
        return True
    if meant is None or isinstance(command.order, Override):
        return False
    if meant.after is not None:
        return branch.done != (meant.after, True)
    return meant.place is not None and branch.place not in {None, meant.place}


def _merged(branches: list[_Branch]) -> list[_Branch]:
    """Courses that have led to the same are one; the least probable ones beyond a limit too."""
    together: dict[tuple[object, ...], _Branch] = {}
    for one in branches:
        key = one.place, one.facing, one.mode, one.goals, one.done, one.stays, one.free_ns
        same = together.get(key)
        total = one.probability + (same.probability if same else 0.0)
        together[key] = one._replace(probability=total)
    if len(together) <= _BRANCHES:
        return list(together.values())
    kept = sorted(together.values(), key=lambda one: -one.probability)
    kept, rest = kept[:_BRANCHES], kept[_BRANCHES:]
    for one in rest:
        near = [index for index, other in enumerate(kept) if other.place == one.place]
        index = near[0] if near else len(kept)
        if near:
            other = kept[index]
            kept[index] = other._replace(probability=other.probability + one.probability)
        else:
            kept.append(one._replace(place=None))
    return kept


def _mean_ns(branches: list[_Branch], now_ns: int) -> int:
    total = sum(one.probability for one in branches)
    if not total:
        return now_ns
    return round(sum(one.free_ns * one.probability for one in branches) / total)


def _told(branches: list[_Branch], from_ns: int, at_ns: int, command: int | None) -> Prediction:
    places: dict[str, float] = {}
    for one in branches:
        if one.place is not None:
            places[one.place] = places.get(one.place, 0.0) + one.probability
    likely = sorted(places.items(), key=lambda pair: (-pair[1], pair[0]))
    shown = tuple(Likely((place,), round(p, 4)) for place, p in likely if p >= _SHOWN)
    unknown = max(0.0, round(1 - sum(one.probability for one in shown), 4))
    return Prediction(at_ns, from_ns, shown, unknown, command)
