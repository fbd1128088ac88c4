"""Resolves a link to plain tables: presets, files and ephemerides are read here."""

from collections.abc import MutableMapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import msgspec

from farside.files import read_text
from farside.frames import OutageReason
from farside.link.profile.config import DELAY_KEYS, RATE_KEYS, Blackout, LinkConfig, OneWay
from farside.link.profile.layers import refused
from farside.link.profile.measured import Files, Kernels, change_with_tables, with_tables
from farside.link.profile.plans.contacts import (
    ContactPlanError,
    KnownLightTimes,
    LightTimes,
    Plan,
    WayTables,
    link_tables,
)
from farside.link.profile.plans.formats import is_hdtn, parse_plan
from farside.link.profile.plans.planned import with_plans
from farside.link.profile.plans.relayed import has_direct, routing_of
from farside.link.profile.plans.times import Window, count_of, gaps_between, placed
from farside.validation import shown

if TYPE_CHECKING:
    from farside.link.profile.sky.sky import Sky

MAX_PASSES = 1_000_000
"""The most periodic passes whose outages are in memory at a time (project default)."""

MAX_PLAN_BYTE = 32 * 1024 * 1024
"""The longest contact plan (project default): 100,000 contacts of HDTN, spaced out."""


def resolve_link(
    config: LinkConfig,
    *,
    folder: Path,
    window: Window,
    texts: MutableMapping[str, str] | None = None,
    kernels: "Kernels | None" = None,
    may_lack_delay: bool = False,
) -> LinkConfig:
    """Replace all that names a file, a plan, passes or an ephemeris by plain tables.

    Args:
        config: the link, already merged with its preset by `with_preset`.
        folder: what paths in it are relative to.
        window: the simulated time that the tables have to cover.
        texts: of the files that the link names, by that name: what is there is not read from
            `folder`, and what is read from there is put in.
        kernels: likewise of the orbits in the kernels that it names.
        may_lack_delay: whether a direction may be without a delay, which is then 0.

    Returns:
        a link without `preset`, `start`, `ephemeris`, `passes`, `contacts` and files, with a
        delay for each direction. Resolving it again changes nothing.

    Raises:
        LinkConfigError: if a file is invalid, or a direction has no delay or two.
    """
    if config.preset is not None:
        raise refused(("preset",), f"expected none left to read, found {shown(config.preset)}")
    _expect_one_delay(config, least=0 if may_lack_delay else 1)
    files = Files(folder, {} if texts is None else texts, {} if kernels is None else kernels)
    link = msgspec.structs.replace(
        config,
        up=with_tables(config.up, ("up",), files),
        down=with_tables(config.down, ("down",), files),
        changes=tuple(
            change_with_tables(change, ("changes", str(index)), files)
            for index, change in enumerate(config.changes)
        ),
    )
    start, plan = _begun(link, files)
    link, sky = _with_ephemeris(link, files, start, window)
    link = with_plans(_with_contacts(link, plan, files, window, sky))
    return msgspec.structs.replace(_with_passes(link, window), start=None)


class LightEnd(NamedTuple):
    """Where the light times of an ephemeris end: in simulated time, and as a date in UTC."""

    at_s: float
    date: str


def light_end(
    config: LinkConfig, *, folder: Path, texts: MutableMapping[str, str], kernels: "Kernels"
) -> LightEnd | None:
    """The end of a link's ephemeris; `None` if it has none. Arguments as of `resolve_link`.

    Raises:
        LinkConfigError: if a file is invalid.
    """
    if config.ephemeris is None:
        return None
    files = Files(folder, texts, kernels)
    start, _ = _begun(config, files)
    sky = _sky_of(config, files, start)
    return None if sky is None else LightEnd(sky.last_s, sky.last_date)


def _read_plan(path: Path) -> str:
    """The text of a contact plan.

    One of ION may be in Latin-1: its commands are in ASCII, and the encoding of its comments is
    nobody's business. One of HDTN is JSON, which is in UTF-8.
    """
    return read_text(path, most_byte=MAX_PLAN_BYTE, is_old=not is_hdtn(path.name))


def _expect_one_delay(config: LinkConfig, least: int) -> None:
    for way, one_way in (("up", config.up), ("down", config.down)):
        given = [f"{way}.delay_s"] if one_way.delay_s is not None else []
        given += [f"{way}.{key}" for key in DELAY_KEYS[1:] if getattr(one_way, key)]
        given += ["ephemeris"] if config.ephemeris else []
        most_lacking = least if config.contacts is None and config.routing is None else 0
        if not most_lacking <= len(given) <= 1:
            found = " and ".join(given) or "none of them"
            expected = ", ".join((*DELAY_KEYS, "ephemeris"))
            text = f"expected one of {expected} and contacts, found {found}"
            raise refused((way,), text)


def _begun(link: LinkConfig, files: Files) -> tuple[datetime | None, Plan | None]:
    """The date at simulated time 0, and the contact plan counted from it, if there are any."""
    start = _start_of(link)
    plan = _plan_of(link, files, start)
    if start is None and plan is not None and plan.zero is not None:
        start = datetime.fromtimestamp(plan.zero, UTC)
    return start, plan


def _start_of(link: LinkConfig) -> datetime | None:
    """The date at simulated time 0, if the link says one."""
    from farside.link.profile.sky.dates import parsed_date  # noqa: PLC0415

    epoch = None if link.ephemeris is None else link.ephemeris.epoch
    if link.start is not None and epoch is not None:
        raise refused(("start",), "expected a date here or in ephemeris.epoch, found both")
    key = ("ephemeris", "epoch") if link.start is None else ("start",)
    text = link.start or epoch
    try:
        return None if text is None else parsed_date(text)
    except ValueError as error:
        raise refused(key, str(error)) from error


def _plan_of(link: LinkConfig, files: Files, start: datetime | None) -> Plan | None:
    """The contact plan that the link names, counted from its start."""
    contacts = link.contacts
    if contacts is None:
        if link.start is not None and link.ephemeris is None:
            text = "expected an ephemeris or a contact plan that it is the start of, found neither"
            raise refused(("start",), text)
        return None
    path = files.folder / contacts.file
    text = files.text(contacts.file, ("contacts", "file"), _read_plan)
    try:
        plan = parse_plan(text, str(path))
    except ContactPlanError as error:
        raise refused(("contacts", "file"), str(error)) from error
    if plan.zero is None and link.start is not None and link.ephemeris is None:
        text = f"expected a contact plan with dates, found none in {shown(str(path))}"
        raise refused(("start",), text)
    return placed(plan, None if start is None else start.timestamp())


def _with_contacts(
    link: LinkConfig, plan: Plan | None, files: Files, window: Window, sky: "Sky | None"
) -> LinkConfig:
    contacts = link.contacts
    if contacts is None or plan is None:
        return link
    for way, one_way in (("up", link.up), ("down", link.down)):
        if given := [key for key in RATE_KEYS if getattr(one_way, key)]:
            text = f"expected the rate from contacts or from {given[0]}, found both"
            raise refused((way, given[0]), text)
    nodes = contacts.ground, contacts.rover
    path = files.folder / contacts.file
    try:
        if not has_direct(plan, *nodes):
            if sky is not None:
                text = "expected none, since the contacts by way of other nodes give light times"
                raise refused(("ephemeris",), text)
            routing = routing_of(plan, *nodes, contacts.store_byte)
            return msgspec.structs.replace(link, routing=routing, contacts=None)
        tables = link_tables(plan, *nodes, window.plan_end_s, _known(link, plan, window, sky))
    except ContactPlanError as error:
        raise refused(("contacts",), f"{path}: {error}") from error
    if contacts.store_byte is not None:
        text = "expected none, since the two have direct contacts and no node between them stores"
        raise refused(("contacts", "store_byte"), text)
    return msgspec.structs.replace(
        link,
        up=_with_tables(link.up, tables.up),
        down=_with_tables(link.down, tables.down),
        blackouts=(*link.blackouts, *tables.blackouts),
        contacts=None,
    )


def _known(
    link: LinkConfig, plan: Plan, window: Window, sky: "Sky | None"
) -> tuple[LightTimes | None, LightTimes | None]:
    """The light times of both directions, where the plan is not to give them."""
    if sky is None:
        up, down = link.up, link.down
    else:
        from farside.link.profile.sky.orbiting import reaching  # noqa: PLC0415

        up, down = reaching(link, sky, plan, window)
    return KnownLightTimes.of(up), KnownLightTimes.of(down)


def _with_tables(one_way: OneWay, tables: WayTables) -> OneWay:
    one_way = msgspec.structs.replace(one_way, rate_table=tables.rate_table)
    if not tables.delay_table:
        return one_way
    return msgspec.structs.replace(one_way, delay_table=tables.delay_table)


def _sky_of(link: LinkConfig, files: Files, start: datetime | None) -> "Sky | None":
    """Where the other end is, if the link has an ephemeris."""
    if link.ephemeris is None:
        return None
    if start is None:
        text = "expected a date here, or as start of the link, found none"
        raise refused(("ephemeris", "epoch"), text)
    from farside.link.profile.sky.positions import EphemerisError  # noqa: PLC0415
    from farside.link.profile.sky.sky import sky_of  # noqa: PLC0415

    def text_of(name: str) -> str:
        return files.text(name, ("ephemeris", "horizons"))

    try:
        return sky_of(link.ephemeris, start, text_of, files.orbits)
    except EphemerisError as error:
        raise refused(("ephemeris",), str(error)) from error


def _with_ephemeris(
    link: LinkConfig, files: Files, start: datetime | None, window: Window
) -> "tuple[LinkConfig, Sky | None]":
    """The link with light times, and where they are from."""
    ephemeris = link.ephemeris
    if ephemeris is None:
        return link, None
    from farside.link.profile.sky.orbiting import Seen, seen_in, with_light_times  # noqa: PLC0415
    from farside.link.profile.sky.positions import EphemerisError  # noqa: PLC0415

    # A kernel may be larger than a log. What a mission took of it stands for it among the texts.
    described = msgspec.json.encode((msgspec.structs.replace(ephemeris, epoch=f"{start}"), window))
    kept = f"light times of {described.decode()}" if ephemeris.kernel and window.is_whole else ""
    if kept in files.texts:
        seen = msgspec.json.decode(files.texts[kept], type=Seen)
        return with_light_times(link, seen, ephemeris.conjunction_loss), None
    sky = _sky_of(link, files, start)
    if sky is None:
        return link, None
    try:
        seen = seen_in(sky, window, ephemeris.conjunction_deg)
    except EphemerisError as error:
        raise refused(("ephemeris",), str(error)) from error
    if kept:
        files.texts[kept] = msgspec.json.encode(seen).decode()
    return with_light_times(link, seen, ephemeris.conjunction_loss), sky


def _with_passes(link: LinkConfig, window: Window) -> LinkConfig:
    passes = link.passes
    if passes is None:
        return link
    count = count_of(passes, window)
    if count > MAX_PASSES:
        length_s = window.end_s - window.begin_s
        raise refused(
            ("passes", "period_s"),
            f"expected {MAX_PASSES} passes at most in {length_s:g} s, found {count}",
        )
    blackouts = (
        Blackout(start_s=start_s, end_s=end_s, direction=passes.direction, reason=OutageReason.PASS)
        for start_s, end_s in gaps_between(passes, window)
    )
    return msgspec.structs.replace(link, blackouts=(*link.blackouts, *blackouts), passes=None)
