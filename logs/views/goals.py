"""Queries on goals: who set them, and when they were reached."""

from collections.abc import Sequence
from functools import cached_property

from farside.logs.spans import (
    GoalSpan,
)
from farside.logs.views.state import StateView
from farside.messages import Tokens
from farside.places import (
    BATTERY_LOW,
    ON_CHARGE,
    Chart,
    is_place_token,
    place_name,
    place_token,
)
from farside.topics import (
    GROUND_CHART,
    ROVER_GOAL,
    TRUTH_POSE,
    TRUTH_YARD,
    GoalChange,
    GoalSource,
)
from farside.validation import did_you_mean, shown


class GoalView(StateView):
    """The goals of a run. They are kept once they were asked for, and so is the map."""

    def reached(self, token: str | Sequence[str]) -> float | None:
        """When a Sign was first reached as a goal; `None` if it never was.

        A goal that names a place counts only if the rover was truly there, whatever it estimated.

        Args:
            token: the Sign's only Token, or all its Tokens in any order. The name of a place,
                such as `B`, stands for its Token, `at:B`.

        Raises:
            ValueError: if there is no Token, or one is neither a place of the map nor any that the
                rover senses or anybody set as a goal. The message names the nearest one.
        """
        named = (token,) if isinstance(token, str) else tuple(token)
        sign = tuple(sorted({self._token(name) for name in named}))
        if not sign:
            raise ValueError("expected one Token at least, found none")
        times = (goal.reached_s for goal in self.goals if goal.tokens == sign)
        return next((t_s for t_s in times if t_s is not None), None)

    def _token(self, name: str) -> str:
        """The Token of this name, or of the place of this name."""
        wanted = {token for goal in self.goals for token in goal.tokens}
        tokens = wanted.union((ON_CHARGE, BATTERY_LOW))
        if name in tokens or name in self.chart.cells:
            return name
        if name in self.chart.places:
            return place_token(name)
        hint = self.chart.like(place_name(name))
        if not hint and not is_place_token(name):
            hint = did_you_mean(name, sorted(tokens))
        known = ", ".join(self.chart.named)
        raise ValueError(
            f"expected a place of the map ({known} or EAST,NORTH) or a Token such as {ON_CHARGE}, "
            f"found {shown(name)}{hint}"
        )

    @cached_property
    def chart(self) -> Chart:
        """The map of the yard; as ground, the ground's own.

        Raises:
            ValueError: if there is none in the log.
        """
        yard = self._latest(GROUND_CHART if self.is_as_ground else TRUTH_YARD, 0)
        return Chart(yard.rows, yard.cell_m)

    @cached_property
    def goals(self) -> tuple[GoalSpan, ...]:
        """Every goal in the order in which it was set; one span per source if several set it."""
        spans: list[GoalSpan] = []
        listed: dict[tuple[Tokens, GoalSource], int] = {}
        for t_s, entry in self.each(ROVER_GOAL):
            key = entry.tokens, entry.source
            if entry.change is GoalChange.SET and key not in listed:
                listed[key] = len(spans)
                spans.append(GoalSpan(entry.tokens, entry.source, t_s))
            if entry.change not in {GoalChange.REACHED, GoalChange.WITHDRAWN}:
                continue
            index = listed.pop(key, None)
            if index is None:
                continue  # a mission goal can be withdrawn before it comes on the list
            if entry.change is GoalChange.WITHDRAWN:
                spans[index] = spans[index]._replace(withdrawn_s=t_s)
            elif self._was_true(entry.tokens, t_s):
                spans[index] = spans[index]._replace(reached_s=t_s)
        return tuple(spans)

    def _was_true(self, sign: Tokens, t_s: float) -> bool:
        places = [token for token in sign if is_place_token(token)]
        return not places or places == [self._latest(TRUTH_POSE, t_s).place]
