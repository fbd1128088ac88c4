"""A link to what an ephemeris gives: its delays, and what a conjunction does to it."""

from bisect import bisect_right
from collections.abc import Iterable, Sequence

import msgspec

from farside.frames import OutageReason
from farside.link.profile.config import (
    Affected,
    Blackout,
    DelayPoint,
    LinkChange,
    LinkConfig,
    OneWay,
)
from farside.link.profile.impairments import LossModel
from farside.link.profile.plans.contacts import Plan
from farside.link.profile.plans.times import Window
from farside.link.profile.sky.light import conjunctions, delay_tables
from farside.link.profile.sky.positions import EphemerisError
from farside.link.profile.sky.sky import Sky
from farside.link.profile.statistics import loss_statistics

_ROUNDING_S = 1e-3


class Seen(msgspec.Struct, frozen=True):
    """What of an ephemeris bears on a link, over a window of time.

    Attributes:
        up, down: delay tables of both directions.
        conjunctions: beginning and end of each, in seconds.
    """

    up: tuple[DelayPoint, ...]
    down: tuple[DelayPoint, ...]
    conjunctions: tuple[tuple[float, float], ...]


def seen_in(sky: Sky, window: Window, conjunction_deg: float) -> Seen:
    """What `sky` gives in a window.

    Raises:
        EphemerisError: if the light times end before a window that is whole, or a conjunction is
            asked for where only distances are known.
    """
    if window.is_whole and sky.last_s < window.end_s - _ROUNDING_S:
        raise EphemerisError(
            f"expected light times for {window.end_s:g} s from the start, "
            f"found them for {sky.last_s:.0f} s, until {sky.last_date}"
        )
    up, down = delay_tables(sky, window.begin_s, window.end_s)
    spans = conjunctions(sky, window.begin_s, window.end_s, conjunction_deg)
    if window.is_whole:
        spans = [(begin_s, min(end_s, window.end_s)) for begin_s, end_s in spans]
    return Seen(up, down, tuple(spans))


def with_light_times(link: LinkConfig, seen: Seen, conjunction_loss: float) -> LinkConfig:
    """A link with delays, and the outages and losses of conjunctions, in place of an ephemeris."""
    conjunction = OutageReason.CONJUNCTION
    blackouts = (
        Blackout(start_s=begin_s, end_s=end_s, direction=Affected.UP, reason=conjunction)
        for begin_s, end_s in seen.conjunctions
    )
    return msgspec.structs.replace(
        link,
        up=msgspec.structs.replace(link.up, delay_table=seen.up),
        down=msgspec.structs.replace(link.down, delay_table=seen.down),
        blackouts=(*link.blackouts, *blackouts),
        changes=_with_conjunctions(link, seen.conjunctions, conjunction_loss),
        ephemeris=None,
    )


def reaching(link: LinkConfig, sky: Sky, plan: Plan, window: Window) -> tuple[OneWay, OneWay]:
    """Both directions, with light times that reach to the first contact after a window.

    So the outage before it ends when the next window will have it end.
    """
    next_s = min(
        (one.begin_s for one in plan.contacts if one.begin_s >= window.end_s), default=None
    )
    if window.is_whole or next_s is None or next_s > sky.last_s:
        return link.up, link.down
    tables = delay_tables(sky, next_s, next_s)
    up, down = (
        msgspec.structs.replace(way, delay_table=(*way.delay_table, *_after(way, table)))
        for way, table in zip((link.up, link.down), tables, strict=True)
    )
    return up, down


def _after(way: OneWay, table: Iterable[DelayPoint]) -> list[DelayPoint]:
    return [point for point in table if point.t_s > way.delay_table[-1].t_s]


def _with_conjunctions(
    link: LinkConfig, spans: Sequence[tuple[float, float]], loss: float
) -> tuple[LinkChange, ...]:
    """The changes of a link, plus those of the downlink to `loss` and back for each of `spans`.

    A greater loss stays, including one that another change brings during a span.
    """
    own = sorted(link.changes, key=_at_s)
    ours = [c for c in own if c.loss is not None and c.direction is not Affected.UP]
    losses = [(0.0, link.down.loss), *((c.at_s, c.loss) for c in ours if c.loss is not None)]
    starts_s = [at_s for at_s, _ in losses]
    added = []
    for start_s, end_s in spans:
        first, after = bisect_right(starts_s, start_s), bisect_right(starts_s, end_s)
        for at_s, other in [(start_s, losses[first - 1][1]), *losses[first:after]]:
            added.append(_downlink_loss(at_s, _greater_loss(other, loss)))
        added.append(_downlink_loss(end_s, losses[after - 1][1]))
    return tuple(sorted([*own, *added], key=_at_s))


def _at_s(change: LinkChange) -> float:
    return change.at_s


def _downlink_loss(at_s: float, loss: LossModel) -> LinkChange:
    return LinkChange(at_s=at_s, direction=Affected.DOWN, loss=loss)


def _greater_loss(model: LossModel, loss: float) -> LossModel:
    return model if loss_statistics(model).rate >= loss else loss
