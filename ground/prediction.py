"""Where the rover is by now, and will be after every command on its way."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
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
from farside.node import NEVER_NS, to_s
from farside.places import ON_CHARGE, is_place_token
from farside.topics import Likely, Prediction

_BRANCHES = 24
_SHOWN = 0.01
_MOVES = 2000  # of one branch: more than fit into any light time
_IMPROBABLE = 1e-3
_TIMELY_SD = 3.0  # standard deviations beyond which a time is taken for sure


class OnItsWay(NamedTuple):
    """A command that is not known to be over.

    Attributes:
        command: the command.
        action: the action that it asks for, `None` if it asks for none.
        arrives_ns: when it is, or was, due on board.
        begun: whether its action is the one under way, as of the newest telemetry.
        lapses: whether it is due to expire on board before its turn comes.
    """

    command: Command
    action: str | None
    arrives_ns: int
    begun: bool = False
    lapses: bool = False


class Wanted(NamedTuple):
    """A goal on the Goal List, with its priority as far as the ground knows it."""

    tokens: Tokens
    priority: float


class _Branch(NamedTuple):
    """One course that things may have taken.

    Attributes:
        probability: of this course.
        place: where the rover is, `None` if that is not known.
        facing: its last move.
        free_ns: since when it stands, or is expected to.
        variance_s2: of that time.
        ended: the probability that it stands by the horizon.
        mode: its mode.
        goals: its Goal List, the top-goal first.
        done: the number of the last command with an action, and whether it was done.
        stays: whether it stands to charge.
    """

    probability: float
    place: str | None
    facing: str | None
    free_ns: int
    mode: Mode
    goals: tuple[Wanted, ...]
    done: tuple[int | None, bool] = (None, True)
    stays: bool = False
    variance_s2: float = 0.0
    ended: float = 1.0


class Predictor:
    """Predicts the rover from the last that was heard of it, and all that is on its way to it.

    It follows every course that things may take: each move leads on with the probability that the
    shadow of the model gives it. Its duration is normally distributed, with the mean and variance
    of such moves; that it is over by a moment is as probable as that makes it. A place is where the
    rover last sensed itself: it changes when a move is over. Commands that are meant for another
    place are refused on that course. In autonomous mode the rover moves on by the shadow's policy
    map.

    Not predicted are exploration, the ways back along a track, faults, and the loss of frames: what
    is on its way arrives when it is due. After unexplained silence for as long as the failsafe
    waits, the rover is taken to have lost the link too, and to be alone.

    Args:
        foresight: what the shadow's lists say; `None` without a shadow.
        times: how long moves take.
        alone_after_ns: the silence after which the failsafe leaves the rover to itself.
        priorities: of the goals on board, as far as they are known.
    """

    def __init__(
        self,
        foresight: Foresight | None,
        times: MoveTimes,
        alone_after_ns: int,
        priorities: Callable[[], Mapping[Tokens, float]] = dict,
    ) -> None:
        self._foresight, self._times, self._priorities = foresight, times, priorities
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
                        goals=self._wanted(telemetry.alone_goals),
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
            goals=self._wanted(telemetry.goals),
            stays=telemetry.action is None and telemetry.failsafe is not Failsafe.NOMINAL,
        )
        if telemetry.action is None:
            return [begin]
        began_ns, command = telemetry.since_ns, telemetry.begun
        begin = begin._replace(free_ns=began_ns)
        return self._move([begin], telemetry.action, began_ns, horizon_ns, command)

    def _wanted(self, goals: Sequence[Tokens]) -> tuple[Wanted, ...]:
        """Goals in the order that telemetry tells, which holds whatever is known of priorities."""
        known, highest, wanted = self._priorities(), math.inf, []
        for tokens in goals:
            highest = min(highest, known.get(tokens, highest))
            wanted.append(Wanted(tokens, highest))
        return tuple(wanted)

    def _carry_out(self, branches: list[_Branch], one: OnItsWay, horizon_ns: int) -> list[_Branch]:
        """A command arrives, and is carried out as soon as the rover stands."""
        if one.begun or one.arrives_ns >= horizon_ns:  # that begun is the move under way
            return branches
        branches = self._go_on(branches, one.arrives_ns, horizon_ns)
        if one.arrives_ns > one.command.expires_ns:
            return [branch._replace(done=(one.command.number, False)) for branch in branches]
        if one.action is None:
            return [_settled(branch, one) for branch in branches]
        moved: list[_Branch] = []
        for branch in branches:
            if branch.free_ns == NEVER_NS:
                moved.append(branch)
                continue
            if _is_refused(branch, one.command):
                moved.append(branch._replace(done=(one.command.number, False)))
                continue
            takes_over = branch.mode is Mode.AUTONOMOUS and isinstance(one.command.order, Drive)
            ready = branch._replace(mode=Mode.GUIDED if takes_over else branch.mode, stays=False)
            when = one.command.when
            begin_ns = max(branch.free_ns, one.arrives_ns, (when and when.at_ns) or 0)
            if begin_ns > one.command.expires_ns:
                moved.append(branch._replace(done=(one.command.number, False)))
                continue
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
        return branch.free_ns < until_ns and branch.ended > 0 and self._next(branch) is not None

    def _next(self, branch: _Branch) -> tuple[str, Tokens, bool] | None:
        """The rover's next move of its own, its goal, and whether it leads right to it."""
        if self._foresight is None or branch.place is None:
            return None
        for goal, _ in branch.goals:
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
            if one.place is None or one.free_ns == NEVER_NS:
                yield one
                continue
            met: set[Tokens] = {(one.place,)}
            if is_last and one.place != branch.place:
                met.add(goal)
            left = tuple(other for other in one.goals if other.tokens not in met)
            yield one._replace(goals=left, stays=goal in met and goal == (ON_CHARGE,))

    def _move(
        self,
        branches: Iterable[_Branch],
        action: str,
        begin_ns: int,
        horizon_ns: int,
        command: int | None,
    ) -> list[_Branch]:
        """A move that begins at `begin_ns`; who may be under way at the horizon is seen there."""
        moved: list[_Branch] = []
        for branch in branches:
            then = self._ended(branch, action, begin_ns, horizon_ns)
            over = then.ended / branch.ended if branch.ended else 0.0
            under_way = branch.probability * (1 - over)
            if under_way > 0:
                moved.append(then._replace(probability=under_way, free_ns=NEVER_NS))
            if over <= 0:
                continue
            share, known = branch.probability * over, 0.0
            for place, probability in self._outcomes(branch.place, action):
                known += probability
                done = command, place != branch.place
                moved.append(then._replace(place=place, probability=share * probability, done=done))
            if known < 1:
                left = share * (1 - known)
                moved.append(then._replace(place=None, probability=left, done=(command, True)))
        return moved

    def _ended(self, branch: _Branch, action: str, begin_ns: int, horizon_ns: int) -> _Branch:
        """The branch with the end of a move, and how probably that comes by the horizon."""
        time = self._times.expected(branch.facing, action)
        spread_s = math.sqrt(branch.variance_s2)
        # Who has waited for longer than its moves can have taken begins in time.
        is_timely = to_s(begin_ns - branch.free_ns) > _TIMELY_SD * spread_s
        variance_s2 = time.variance_s2 + (0.0 if is_timely else branch.variance_s2)
        end_ns = begin_ns + time.mean_ns
        ended = _share_by(to_s(horizon_ns - end_ns), variance_s2)
        ended = ended if is_timely else min(ended, branch.ended)
        return branch._replace(
            facing=action, free_ns=end_ns, variance_s2=variance_s2, ended=max(ended, 0.0)
        )

    def _outcomes(self, place: str | None, action: str) -> Sequence[tuple[str, float]]:
        if place is None or self._foresight is None:
            return ()
        return self._foresight.outcomes(place, action)


def _share_by(late_s: float, variance_s2: float) -> float:
    """The probability that what is due `late_s` ago has happened, if it is normally distributed."""
    if variance_s2 <= 0:
        return float(late_s >= 0)
    share = 0.5 * (1 + math.erf(late_s / math.sqrt(2 * variance_s2)))
    return 0.0 if share < _IMPROBABLE else 1.0 if share > 1 - _IMPROBABLE else share


def _settled(branch: _Branch, one: OnItsWay) -> _Branch:
    """The course after an order that is done as soon as it is received."""
    ready = branch._replace(free_ns=max(branch.free_ns, one.arrives_ns))
    match one.command.order:
        case SetMode(mode=mode):
            return ready._replace(mode=mode)
        case SetGoal(tokens=tokens, priority=priority) if priority is not None:
            others = [goal for goal in branch.goals if goal.tokens != tokens]
            goals = sorted([*others, Wanted(tokens, priority)], key=lambda goal: -goal.priority)
            return ready._replace(goals=tuple(goals))
        case WithdrawGoal(tokens=tokens):
            left = (goal for goal in branch.goals if goal.tokens != tokens)
            return ready._replace(goals=tuple(left))
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
