"""Resolves a link to plain tables: presets, files and ephemerides are read here."""

import math
from bisect import bisect_right
from collections.abc import MutableMapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from farside.frames import OutageReason
from farside.link.profile.config import (
    Affected,
    Blackout,
    ContactPlan,
    LinkChange,
    LinkConfig,
    OneWay,
)
from farside.link.profile.impairments import LossModel
from farside.link.profile.layers import (
    RATE_KEYS,
    LinkConfigError,
    profile_table,
    refused,
    text_at,
    with_preset,
)
from farside.link.profile.planned import with_plans
from farside.link.profile.plans.contacts import ContactPlanError, Plan, gaps, link_tables
from farside.link.profile.plans.hdtn import parse_hdtn
from farside.link.profile.plans.ion import parse_ion
from farside.link.profile.plans.relayed import has_direct, routing_of
from farside.link.profile.plans.traces import TraceError, parse_trace
from farside.validation import mismatches, shown

_SCHEMA = msgspec.inspect.type_info(LinkConfig)
MAX_PASSES = 100_000
"""The most periodic passes in a run (project default)."""


def load_profile(source: str | Path, duration_s: float) -> LinkConfig:
    """Read a profile: a TOML file like the `[link]` table of a mission, or a preset.

    Args:
        source: path of the file, or the name of a preset; a file of that name comes first.
        duration_s: how much simulated time the tables have to cover.

    Returns:
        the link, resolved.

    Raises:
        LinkConfigError: if the file cannot be read, or is invalid. Nothing else is raised.
    """
    try:
        config = _checked(with_preset(profile_table(source)))
        return resolve_link(config, folder=Path(source).parent, duration_s=duration_s)
    except LinkConfigError as error:
        raise LinkConfigError(*error.problems, source=str(source)) from error


def resolve_link(
    config: LinkConfig,
    *,
    folder: Path,
    duration_s: float,
    texts: MutableMapping[str, str] | None = None,
) -> LinkConfig:
    """Replace all that names a file, a plan, passes or an ephemeris by plain tables.

    Args:
        config: the link, already merged with its preset by `with_preset`.
        folder: what paths in it are relative to.
        duration_s: how much simulated time the tables have to cover.
        texts: of the files that the link names, by that name: what is there is not read from
            `folder`, and what is read from there is put in.

    Returns:
        a link without `preset`, `ephemeris`, `passes`, `contacts` and `rate_trace.file`, with a
        delay for each direction. Resolving it again changes nothing.

    Raises:
        LinkConfigError: if a file is invalid, or a direction has no delay or two.
    """
    if config.preset is not None:
        raise refused(("preset",), f"expected none left to read, found {shown(config.preset)}")
    _expect_one_delay(config)
    files = _Files(folder, {} if texts is None else texts)
    link = msgspec.structs.replace(
        config,
        up=_with_trace(config.up, "up", files),
        down=_with_trace(config.down, "down", files),
    )
    link = with_plans(_with_contacts(link, files, duration_s))
    link = _with_ephemeris(link, duration_s)
    return _with_passes(link, duration_s)


class _Files(NamedTuple):
    """The files that a link names: what of them was read so far, and the folder of the rest."""

    folder: Path
    texts: MutableMapping[str, str]

    def text(self, name: str, key: tuple[str, ...]) -> str:
        if name not in self.texts:
            self.texts[name] = text_at(self.folder / name, key)
        return self.texts[name]


def _checked(table: dict[str, Any]) -> LinkConfig:
    if problems := list(mismatches(table, _SCHEMA)):
        raise LinkConfigError(*problems)
    return msgspec.convert(table, LinkConfig)


def _expect_one_delay(config: LinkConfig) -> None:
    for way, one_way in (("up", config.up), ("down", config.down)):
        given = [f"{way}.delay_s"] if one_way.delay_s is not None else []
        given += [f"{way}.delay_table"] if one_way.delay_table else []
        given += ["ephemeris"] if config.ephemeris else []
        given += ["contacts"] if config.contacts else []
        given += ["routing"] if config.routing and not given else []
        if len(given) != 1:
            found = " and ".join(given) or "none of them"
            text = f"expected one of delay_s, delay_table, ephemeris and contacts, found {found}"
            raise refused((way,), text)


def _with_trace(one_way: OneWay, way: str, files: _Files) -> OneWay:
    trace, key = one_way.rate_trace, (way, "rate_trace")
    if trace is None:
        return one_way
    if (trace.file is None) == (not trace.times_ms):
        found = "both" if trace.file else "neither"
        raise refused(key, f"expected either file or times_ms, found {found}")
    if trace.file is None:
        return one_way
    text = files.text(trace.file, (*key, "file"))
    try:
        times_ms = parse_trace(text, str(files.folder / trace.file))
    except TraceError as error:
        raise refused((*key, "file"), str(error)) from error
    trace = msgspec.structs.replace(trace, file=None, times_ms=times_ms)
    return msgspec.structs.replace(one_way, rate_trace=trace)


def _with_contacts(link: LinkConfig, files: _Files, duration_s: float) -> LinkConfig:
    contacts = link.contacts
    if contacts is None:
        return link
    for way, one_way in (("up", link.up), ("down", link.down)):
        if given := [key for key in RATE_KEYS if getattr(one_way, key)]:
            text = f"expected the rate from contacts or from {given[0]}, found both"
            raise refused((way, given[0]), text)
    path, plan = _plan(contacts, files)
    try:
        if not has_direct(plan, contacts.ground, contacts.rover):
            routing = routing_of(plan, contacts.ground, contacts.rover, contacts.store_byte)
            return msgspec.structs.replace(link, routing=routing, contacts=None)
        tables = link_tables(plan, contacts.ground, contacts.rover, duration_s)
    except ContactPlanError as error:
        raise refused(("contacts",), f"{path}: {error}") from error
    if contacts.store_byte is not None:
        text = "expected none, since the two have direct contacts and no node between them stores"
        raise refused(("contacts", "store_byte"), text)
    return msgspec.structs.replace(
        link,
        up=msgspec.structs.replace(link.up, **tables.up._asdict()),
        down=msgspec.structs.replace(link.down, **tables.down._asdict()),
        blackouts=(*link.blackouts, *tables.blackouts),
        contacts=None,
    )


def _plan(contacts: ContactPlan, files: _Files) -> tuple[Path, Plan]:
    path = files.folder / contacts.file
    text = files.text(contacts.file, ("contacts", "file"))
    parse = parse_hdtn if path.suffix.lower() == ".json" else parse_ion
    try:
        return path, parse(text, str(path))
    except ContactPlanError as error:
        raise refused(("contacts", "file"), str(error)) from error


def _with_ephemeris(link: LinkConfig, duration_s: float) -> LinkConfig:
    if link.ephemeris is None:
        return link
    from farside.link.profile.sky.light import EphemerisError, conjunctions, delay_tables  # noqa: PLC0415

    try:
        up, down = delay_tables(link.ephemeris, duration_s)
        spans = conjunctions(link.ephemeris, duration_s)
    except EphemerisError as error:
        raise refused(("ephemeris",), str(error)) from error
    conjunction = OutageReason.CONJUNCTION
    blackouts = (
        Blackout(start_s=start_s, end_s=end_s, direction=Affected.UP, reason=conjunction)
        for start_s, end_s in spans
    )
    return msgspec.structs.replace(
        link,
        up=msgspec.structs.replace(link.up, delay_table=up),
        down=msgspec.structs.replace(link.down, delay_table=down),
        blackouts=(*link.blackouts, *blackouts),
        changes=_with_conjunctions(link, spans, link.ephemeris.conjunction_loss),
        ephemeris=None,
    )


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
    from farside.link.profile.statistics import loss_statistics  # noqa: PLC0415 - numpy

    return model if loss_statistics(model).rate >= loss else loss


def _with_passes(link: LinkConfig, duration_s: float) -> LinkConfig:
    passes = link.passes
    if passes is None:
        return link
    count = max(0, math.ceil((duration_s - passes.first_s) / passes.period_s))
    if count > MAX_PASSES:
        raise refused(
            ("passes", "period_s"),
            f"expected {MAX_PASSES} passes at most in {duration_s:g} s, found {count}",
        )
    begins_s = (passes.first_s + number * passes.period_s for number in range(count))
    spans = ((begin_s, begin_s + passes.length_s) for begin_s in begins_s)
    blackouts = (
        Blackout(start_s=start_s, end_s=end_s, direction=passes.direction, reason=OutageReason.PASS)
        for start_s, end_s in gaps(spans, duration_s)
    )
    return msgspec.structs.replace(link, blackouts=(*link.blackouts, *blackouts), passes=None)
