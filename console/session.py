"""A session: a person at the ground station of a run in progress.

A plain object: it is handed what the ground has noted and what it can know, keeps the time warp and
the orders that were given, and says what the screen shows. It has no thread and no clock.
"""

import math
from collections.abc import Sequence

from msgspec.structs import replace

from farside.acts import Act, Discard, Planned
from farside.console.alarms import Alarms
from farside.console.decisions import Decisions, is_idle
from farside.console.events import EventList
from farside.console.exercise import Exercise
from farside.console.pacing import Pacing, Until
from farside.console.screen.blocks import (
    failsafe_said,
    goal_rows,
    link_said,
    mode_said,
    model_said,
    rover_said,
    status_said,
)
from farside.console.screen.mapping import map_view, place_text
from farside.console.screen.orders import (
    act_text,
    can_take_back,
    choice_text,
    command_rows,
    nothing_said,
    option_rows,
    order_of,
    proposal_card,
)
from farside.console.screen.screen import Chart, MapView, ProposalCard, Screen, Strip
from farside.console.strip import StripOf
from farside.control import Mode, OnLoss, TakeBackChance
from farside.ground.view.view import Focus, GroundView, OptionKind
from farside.logs.file.reading import LogEntry
from farside.logs.picture import Picture
from farside.messages import (
    Approve,
    Drive,
    Order,
    Override,
    SetGoal,
    SetMode,
    SetOnLoss,
    TakeBack,
    Tokens,
    Veto,
    WithdrawGoal,
)
from farside.node import Record
from farside.places import Chart as Places
from farside.places import place_token
from farside.validation import one_line, shown

_GROUND = "/ground/"
_PRIORITY = 2.0  # as of a goal of a script: above what missions preload
_OVER = "not ordered: the run is over"
_LOST = "The ground's process is lost: nothing is heard of the rover, and nothing can be ordered."


class Session:
    """See the module.

    Every method that orders returns what to tell the person, in one line. Where a line begins with
    `not `, nothing was ordered, and it says why. What is ordered goes out at the start of the next
    window, in order; while time stands it waits here, and can be given up.

    Args:
        mission: its name.
        end_ns: its duration.
        speed: simulated seconds per wall second, to begin with.
        exercise: the guided exercise, where the mission has one.

    Attributes:
        focus: what the person looks at: the goal in focus, and whether heat is shown.
        pacing: how fast time passes.
        chart: the map as the ground has it; `None` before the first window.
    """

    def __init__(
        self, mission: str, end_ns: int, *, speed: float = 1.0, exercise: Exercise | None = None
    ) -> None:
        self.focus = Focus()
        self.pacing = Pacing(speed)
        self.chart: Chart | None = None
        self._mission, self._end_ns = mission, end_ns
        self._picture = Picture(as_ground=True)
        self._view: GroundView | None = None
        self._queued: dict[int, Act] = {}  # by numbers that never come again
        self._put_so_far = 0
        self._alarms, self._events, self._strip = Alarms(), EventList(), StripOf()
        self._exercise = exercise
        self._decisions = Decisions(self.pacing)
        self._now_ns = 0
        self._standing = self._over = self._lost = ""

    # --- from the run --------------------------------------------------------------------------

    def take(self, now_ns: int, records: Sequence[Record]) -> None:
        """A window is over: what was recorded in it. Of that only what the ground noted is read."""
        self._now_ns, self._standing = now_ns, self._lost
        if self._lost and self._view is not None:
            self._view = replace(self._view, now_ns=now_ns)  # what was known grows old
        for record in records:
            if not record.topic.startswith(_GROUND):
                continue
            entry = LogEntry.of(record)
            line = self._picture.apply(entry)
            self._events.take(entry, line)
            self._alarms.take(entry)
            self._strip.take(entry)
            self._decisions.take(entry, self._picture)
            if self._exercise is not None:
                self._exercise.take(entry)
        self._picture.settle(now_ns)
        self._decisions.settle(now_ns, self._picture, self._alarms.raised)
        if self.chart is None and self._picture.chart is not None:
            self.chart = Chart(self._picture.chart.rows, self._picture.chart.cell_m)

    def see(self, view: GroundView | None) -> None:
        """What the ground can know by now; `None` once it is lost, and for good."""
        if view is None:
            self._lost = self._standing = _LOST
            self._queued.clear()
            return
        up = view.up.until(self._end_ns - view.up.light_ns)
        view = self._view = replace(view, up=up, down=view.down.until(self._end_ns))
        self._alarms.see(view)
        self._foresee(view)

    def _foresee(self, view: GroundView) -> None:
        self._decisions.see(view, () if self._exercise is None else self._exercise.moments())

    def wait(self, standing: str) -> None:
        """The run waits for something, in words; empty when it goes on."""
        self._standing = standing

    def finish(self, outcome: str) -> None:
        """The run is over."""
        self._over = outcome
        self._queued.clear()

    # --- to the run ----------------------------------------------------------------------------

    def orders(self) -> list[Act]:
        """What was ordered since the last call, in order."""
        given, self._queued = self._queued, {}
        return list(given.values())

    # --- to the person -------------------------------------------------------------------------

    def screen(self) -> Screen:
        """What is shown now."""
        view, picture, pacing = self._view, self._picture, self.pacing
        begun = Screen(
            mission=self._mission,
            now_ns=self._now_ns,
            rover_ns=self._now_ns,
            end_ns=self._end_ns,
            speed=pacing.speed,
            paused=pacing.paused,
            mode=mode_said(picture),
            if_nothing=self._over or self._lost or "The run begins.",
            map=MapView(),
            strip=Strip(0, 0, 0),
            warp="" if pacing.until is None else f"until {pacing.until}",
            slowed=pacing.slowed,
            over=self._over,
            standing=self._standing,
        )
        if view is None or picture.chart is None:
            return begun
        return self._shown(begun, view, picture.chart)

    def _shown(self, begun: Screen, view: GroundView, chart: Places) -> Screen:
        picture, now_ns = self._picture, self._now_ns
        card = self._card(view)
        return replace(
            begun,
            rover_ns=max(0, now_ns - view.down.light_ns),
            if_nothing=self._over or self._lost or nothing_said(view, len(self._queued)),
            map=map_view(picture, view, chart),
            strip=self._strip.strip(now_ns, view, picture.commands),
            status=status_said(picture, view),
            on_the_way=picture.commands.on_the_way,
            waiting=len(self._queued),
            proposal=card,
            options=option_rows(picture, view, card, chart),
            commands=command_rows(picture.commands, self._queued, now_ns),
            goals=goal_rows(view),
            rover=rover_said(picture, view),
            model=model_said(picture, view),
            failsafe=failsafe_said(picture, view),
            link=link_said(view),
            events=self._events.rows(),
            alarms=self._alarms.rows(),
            exercise=() if self._exercise is None else self._exercise.rows(),
        )

    def _card(self, view: GroundView) -> ProposalCard | None:
        return proposal_card(self._picture, view, self._queued)

    # --- from the person: orders ---------------------------------------------------------------

    def choose(self, action: str, *, insist: bool = False) -> str:
        """Choose an action: answers the proposal that waits for an answer, or drives.

        Args:
            action: one of those that the screen shows as options.
            insist: order what is invalid all the same, or into silence; the rover's safety gate is
                told that the operator insists.
        """
        view = self._view
        option = next((one for one in view.options if one.action == action), None) if view else None
        if view is None or option is None:
            return f"not ordered: there is no action {one_line(action)} yet"
        if option.kind is OptionKind.INVALID and not insist:
            why = "; ".join(option.why) or "it leads nowhere"
            return f"not ordered: {action}: {why}. Shift with the key orders it all the same"
        card = self._card(view)
        force = insist and option.kind is OptionKind.INVALID
        order: Order
        if card is None or not card.can_answer:
            order = Drive(action, force=force)
        elif card.action == action:
            order = Approve(card.number)
        else:
            order = Override(card.number, action, force=force)
        return self._act(order, choice_text(action, self._picture, card), insist=insist)

    def approve(self, proposal: int) -> str:
        """Approve the proposal of this number, if it is the one that stands."""
        return self._answer(Approve(proposal), "approved")

    def veto(self, proposal: int) -> str:
        """Veto the proposal of this number, if it is the one that stands."""
        return self._answer(Veto(proposal), "vetoed")

    def _answer(self, order: Approve | Veto, done: str) -> str:
        card = None if self._view is None else self._card(self._view)
        if card is None:
            return f"not {done}: no proposal stands"
        if card.number != order.proposal:
            return f"not {done}: proposal {card.number} stands now, not {order.proposal}"
        if card.answered:
            return f"not {done}: proposal {card.number} is {card.answered}"
        return self._act(order, f"{done} proposal {card.number}")

    def take_back(self, number: int | None = None) -> str:
        """Take back a command: by default the newest that can be, what waits here first."""
        if number is None and self._queued:
            return f"given up here: {act_text(self._queued.popitem()[1])}"
        known = self._picture.commands
        if number is None:
            number = max(
                (n for n, c in known.open.items() if can_take_back(c, known)), default=None
            )
        if number is None:
            return "not taken back: nothing is on its way that can be"
        command = known.open.get(number)
        if command is None or not can_take_back(command, known):
            return f"not taken back: command {number} has begun, is over, or is being taken back"
        sure = command.take_back is TakeBackChance.SURE
        hope = "in time, if nothing is lost" if sure else "maybe too late"
        return self._act(TakeBack(number), f"takes back command {number}: {hope}", insist=True)

    def discard(self, held: int) -> str:
        """Give up what is held at the ground under this number; below 0, what waits here."""
        if held < 0:
            act = self._queued.pop(-held, None)
            if act is None:
                return "not given up: it has gone out"
            return f"given up here: {act_text(act)}"
        if held not in self._picture.commands.held:
            return "not given up: it has been sent"
        return self._put(Discard(held), "gives up what is held at the ground")

    def set_goal(self, place: str, priority: float | None = None) -> str:
        """Set a goal at a place of the chart, by its name; of priority 2 unless one is said."""
        chart = self._picture.chart
        if chart is None:
            return "not ordered: there is no map yet"
        if place not in chart.places:
            found = f"{shown(place)}{chart.like(place)}"
            return f"not ordered: expected a place of the map, found {found}"
        worth = _PRIORITY if priority is None else priority
        if not math.isfinite(worth):
            return f"not ordered: expected a priority that is a number, found {worth:g}"
        order = SetGoal((place_token(place),), worth)
        return self._act(order, f"sets goal {place}, priority {worth:g}")

    def withdraw_goal(self, tokens: Tokens) -> str:
        """Withdraw a goal, whoever wanted it: one that is known, or waits here to be set."""
        known = [goal.tokens for goal in self._view.goals] if self._view else []
        held = self._picture.commands.held.values()
        orders = (*map(order_of, self._queued.values()), *(order for one in held for order in one))
        waiting = [order.tokens for order in orders if isinstance(order, SetGoal)]
        if tokens not in (*known, *waiting):
            return "not withdrawn: that is no goal, or no longer"
        return self._act(WithdrawGoal(tokens), f"withdraws goal {place_text(tokens)}")

    def set_mode(self, mode: Mode) -> str:
        """Say who drives."""
        return self._act(SetMode(mode), f"sets mode {mode}")

    def set_on_loss(self, on_loss: OnLoss) -> str:
        """Say what the rover does when the link is lost."""
        return self._act(SetOnLoss(on_loss), f"sets {on_loss} on loss of the link")

    def _act(self, order: Order, said: str, *, insist: bool = False) -> str:
        """Order something; into silence settings are held, and moves must be insisted on."""
        silent = self._view is not None and self._view.silent_since_ns is not None
        if not silent or insist:
            return self._put(order, said)
        if isinstance(order, Drive | Approve | Override | Veto):
            insist_too = ". Shift with the key orders it" if isinstance(order, Drive) else ""
            return f"not ordered: the rover is silent{insist_too}"
        held = Planned(order, link_up=True)
        return self._put(held, f"{said}, held at the ground until the link is up")

    def _put(self, act: Act, said: str) -> str:
        if self._over or self._lost:
            return _OVER if self._over else "not ordered: the ground's process is lost"
        self._put_so_far += 1
        self._queued[self._put_so_far] = act
        return said

    # --- from the person: time, looking, alarms ------------------------------------------------

    def greet(self) -> str:
        """Somebody is here: time that stood by passes; nothing to tell."""
        self.pacing.begin()
        return ""

    def pause(self) -> str:
        """Let time stand, or pass again."""
        if self.pacing.paused:
            self.pacing.play()
            return "time passes"
        self.pacing.pause()
        return "time stands"

    def set_speed(self, speed: float) -> str:
        """Let time pass at this speed, in simulated seconds per wall second, if it is a speed."""
        try:
            self.pacing.set_speed(speed)
        except ValueError as error:
            return f"not set: {error}"
        return f"{speed:g}x"

    def faster(self) -> str:
        """The next higher speed."""
        self.pacing.step(faster=True)
        return f"{self.pacing.speed:g}x"

    def slower(self) -> str:
        """The next lower speed."""
        self.pacing.step(faster=False)
        return f"{self.pacing.speed:g}x"

    def warp(self, until: Until) -> str:
        """Let time pass as fast as it can until something happens."""
        if until is Until.CONTACT and (self._view is None or self._view.up.changes_ns is None):
            return "not warped: the contact plan has no further contact"
        if until is Until.ARRIVAL and not self._queued and is_idle(self._picture, self._view):
            return "not warped: nothing is on its way, and the rover waits for your orders"
        self.pacing.warp(until)
        if self._view is not None:
            self._foresee(self._view)  # a contact that ends is no reason to stop now
        return f"time passes until {until}"

    def look_at(self, place: str | None) -> None:
        """Look at the way to a place of the chart; of any other name, at that to the top-goal."""
        chart = self._picture.chart
        known = {} if chart is None else chart.places
        tokens = (place_token(place),) if place is not None and place in known else None
        self.focus = Focus(tokens, self.focus.heat)

    def show_heat(self, shown: bool) -> None:  # noqa: FBT001 - a switch
        """Show the cost to go from every known place, or not."""
        self.focus = Focus(self.focus.goal, shown)

    def acknowledge(self, alarm: int | None = None) -> str:
        """Acknowledge an alarm, or all."""
        count = self._alarms.acknowledge(alarm)
        if count and not self._alarms.left and self._exercise is not None:
            self._exercise.acknowledged()
        return f"{count} acknowledged" if count else "not acknowledged: no alarm stands"

    def read(self) -> None:
        """Somebody reads what happened meanwhile."""
        if self._exercise is not None:
            self._exercise.read()
