"""Light times and conjunctions, against JPL Horizons, published dates, eclipses and themselves."""

import subprocess
import sys
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from itertools import pairwise

import numpy as np
import pytest

from farside.link.profile.config import DelayPoint
from farside.link.profile.ephemeris import Ephemeris
from farside.link.profile.sky import light
from farside.link.profile.sky.dates import parsed_date
from farside.link.profile.sky.light import LightTime
from farside.link.profile.sky.positions import EphemerisError
from farside.link.profile.sky.sky import BODIES, Sky, sky_of

DAY_S = 86400.0
BEGIN = datetime(2021, 2, 18, tzinfo=UTC)
MARS = Ephemeris(body="mars", epoch=BEGIN.isoformat(), conjunction_deg=2.2)


def sky(ephemeris: Ephemeris) -> Sky:
    """What it describes, without a file."""
    return sky_of(ephemeris, parsed_date(ephemeris.epoch or ""), str, lambda _: [])


def light_time(body: str, epoch: str) -> LightTime:
    """Light times between the Earth and `body` at an epoch."""
    return light.light_time(sky(Ephemeris(body=body, epoch=epoch)))


def delay_tables(ephemeris: Ephemeris, duration_s: float) -> Sequence[tuple[DelayPoint, ...]]:
    """The delays of a run, up and down."""
    return light.delay_tables(sky(ephemeris), 0.0, duration_s)


def conjunctions(ephemeris: Ephemeris, duration_s: float) -> list[tuple[float, float]]:
    """The conjunctions of a run."""
    return light.conjunctions(sky(ephemeris), 0.0, duration_s, ephemeris.conjunction_deg)


def after(time_s: float, begin: datetime = BEGIN) -> str:
    """The epoch that much later, as people write it."""
    return (begin + timedelta(seconds=time_s)).isoformat()


@pytest.mark.parametrize(
    ("epoch", "horizons_s"),
    [
        ("2012-08-06", 827.414),
        ("2018-08-01", 192.116),
        ("2019-08-28", 1334.994),
        ("2021-02-18", 678.047),
    ],
)
def test_the_downlink_light_time_from_mars_agrees_with_horizons(
    epoch: str, horizons_s: float
) -> None:
    assert light_time("mars", epoch).downlink_s == pytest.approx(horizons_s, abs=0.05)


def test_uplink_and_downlink_differ_by_the_growth_of_the_distance_in_between() -> None:
    # Mars recedes: the distance is that of half a light time later, or earlier.
    now, later = light_time("mars", after(0)), light_time("mars", after(678))

    assert now.uplink_s < now.downlink_s
    assert later.uplink_s > now.uplink_s
    assert light_time("mars", after(now.uplink_s)).downlink_s == pytest.approx(
        now.uplink_s + (now.downlink_s - now.uplink_s) * 2, abs=0.2
    )


@pytest.mark.parametrize("body", BODIES)
def test_every_body_is_within_its_range_of_distances(body: str) -> None:
    least_s, greatest_s = {
        "moon": (1.18, 1.36),
        "sun": (490, 508),
        "mercury": (255, 740),
        "venus": (125, 870),
        "mars": (180, 1345),
        "jupiter": (1950, 3240),
        "saturn": (3950, 5550),
        "uranus": (8600, 10600),
        "neptune": (14300, 15700),
    }[body]
    found = light_time(body, "2024-04-08T18:17:00Z")

    assert least_s < found.uplink_s < greatest_s
    assert found.downlink_s == pytest.approx(found.uplink_s, rel=5e-4)
    assert 0 <= found.sun_earth_target_deg <= 180


def test_case_does_not_matter_and_a_date_alone_is_midnight_utc() -> None:
    midnight = light_time("mars", "2021-02-18T00:00:00Z")

    assert light_time("Mars", "2021-02-18") == midnight
    assert light_time("mars", "2021-02-18T05:30:00+05:30") == midnight
    assert light_time("mars", "2021-02-18T00:00:00+05:30") != midnight


def test_the_angle_is_small_in_an_eclipse_and_large_at_opposition() -> None:
    assert light_time("moon", "2024-04-08T18:17Z").sun_earth_target_deg < 0.5
    assert light_time("mars", "2018-07-27").sun_earth_target_deg > 170
    assert light_time("sun", "2018-07-27").sun_earth_target_deg == 0


@pytest.mark.processes
def test_with_outdated_leap_seconds_nothing_is_downloaded_and_nobody_is_warned() -> None:
    script = """
import sys
from astropy.time import Time
from astropy.utils import iers
from farside.link.profile.ephemeris import Ephemeris
from farside.link.profile.sky.dates import parsed_date
from farside.link.profile.sky.light import light_time
from farside.link.profile.sky.sky import sky_of

far = Time("2099-01-01", scale="tai")
fetched = []
iers.LeapSeconds._today = staticmethod(lambda: far)
iers.iers.download_file = lambda url, **_: fetched.append(url)
sky = sky_of(Ephemeris(body="mars"), parsed_date("2085-06-01"), str, lambda _: [])
assert light_time(sky).downlink_s > 180
assert fetched == [], fetched
assert iers.conf.auto_download
"""
    command = [sys.executable, "-W", "error", "-c", script]
    ended = subprocess.run(command, check=False, capture_output=True, text=True)  # noqa: S603
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.parametrize("body", ["mars", "moon", "mercury"])
def test_the_tables_hold_the_light_time_of_what_is_sent_at_each_time(body: str) -> None:
    tables = delay_tables(Ephemeris(body=body, epoch=BEGIN.isoformat()), 5 * 3600)

    for up, down in zip(*tables, strict=True):
        assert up.delay_s == pytest.approx(light_time(body, after(up.t_s)).uplink_s, abs=2e-6)
        arrival = light_time(body, after(down.t_s + down.delay_s))
        assert down.delay_s == pytest.approx(arrival.downlink_s, abs=2e-6)


@pytest.mark.parametrize(
    ("duration_s", "last_s"), [(0.5, 3600), (3600, 3600), (3601, 7200), (DAY_S, DAY_S)]
)
def test_the_tables_cover_a_run_from_beginning_to_end(duration_s: float, last_s: float) -> None:
    for table in delay_tables(MARS, duration_s):
        assert (table[0].t_s, table[-1].t_s) == (0, last_s)
        assert all(later.t_s - sooner.t_s == 3600 for sooner, later in pairwise(table))


@pytest.mark.parametrize("body", BODIES)
def test_between_its_points_a_table_is_within_a_millisecond(body: str) -> None:
    # Three moments, half a step apart, everywhere in 139 years.
    far = sky(Ephemeris(body=body, epoch="1960-01-01"))
    begins_s = np.linspace(0, 139 * 365.25 * DAY_S, 251)
    half_s = light._STEP_S / 2
    for ends in ((far.home, far.body), (far.body, far.home)):
        begin, middle, end = (far.light_s(*ends, begins_s + step * half_s) for step in range(3))
        assert np.abs((begin + end) / 2 - middle).max() < 1e-3


def test_a_table_interpolated_gives_the_light_time_in_between() -> None:
    up, _ = delay_tables(Ephemeris(body="mercury", epoch=BEGIN.isoformat()), 3600)
    between_s = np.interp(1800, [p.t_s for p in up], [p.delay_s for p in up])

    assert between_s == pytest.approx(light_time("mercury", after(1800)).uplink_s, abs=1e-3)


@pytest.mark.parametrize(
    ("first", "last"),
    [
        ("2017-07-22", "2017-08-01"),
        ("2019-08-28", "2019-09-07"),
        ("2021-10-02", "2021-10-16"),
        ("2023-11-11", "2023-11-25"),
    ],
)
def test_conjunctions_of_mars_are_the_published_moratoria_to_two_days(
    first: str, last: str
) -> None:
    begin = datetime.fromisoformat(first).replace(tzinfo=UTC) - timedelta(days=60)
    ephemeris = Ephemeris(body="mars", epoch=begin.isoformat(), conjunction_deg=2.2)
    ((start_s, end_s),) = conjunctions(ephemeris, 200 * DAY_S)

    for time_s, published in ((start_s, first), (end_s, last)):
        found = (begin + timedelta(seconds=time_s)).date()
        assert abs(found - datetime.fromisoformat(published).date()) <= timedelta(days=2)


def test_within_a_conjunction_the_angle_is_below_the_limit_and_outside_it_is_not() -> None:
    ephemeris = Ephemeris(body="mars", epoch="2021-09-01", conjunction_deg=2.2)
    ((start_s, end_s),) = conjunctions(ephemeris, 90 * DAY_S)
    begin = datetime(2021, 9, 1, tzinfo=UTC)

    for edge_s, inwards_s in ((start_s, 60), (end_s, -60)):
        inside = light_time("mars", after(edge_s + inwards_s, begin))
        outside = light_time("mars", after(edge_s - inwards_s, begin))
        assert inside.sun_earth_target_deg < 2.2 < outside.sun_earth_target_deg


def test_a_conjunction_that_is_under_way_begins_with_the_run_and_ends_when_it_does() -> None:
    (whole,) = conjunctions(Ephemeris(body="mars", epoch="2021-09-01", conjunction_deg=2.2), 9e6)
    late = Ephemeris(body="mars", epoch="2021-10-08", conjunction_deg=2.2)

    for duration_s in (3600, 20 * DAY_S):
        ((start_s, end_s),) = conjunctions(late, duration_s)
        assert start_s == 0
        assert end_s == pytest.approx(whole[1] - 37 * DAY_S, abs=60)


def test_a_run_that_ends_just_before_a_conjunction_or_begins_just_after_it_has_none() -> None:
    september = datetime(2021, 9, 1, tzinfo=UTC)
    ephemeris = Ephemeris(body="mars", epoch=september.isoformat(), conjunction_deg=2.2)
    ((start_s, end_s),) = conjunctions(ephemeris, 90 * DAY_S)
    later = Ephemeris(body="mars", epoch=after(end_s + 600, september), conjunction_deg=2.2)

    assert conjunctions(ephemeris, start_s - 600) == []
    assert conjunctions(later, DAY_S) == []


def test_a_pass_by_the_sun_much_shorter_than_the_scan_is_found() -> None:
    # In 2024 the Moon came within 0.36 degrees of the Sun twice: at the two eclipses.
    year = Ephemeris(body="moon", epoch="2024-01-01", conjunction_deg=0.36)
    found = conjunctions(year, 366 * DAY_S)
    days = [(datetime(2024, 1, 1) + timedelta(seconds=start_s)).date() for start_s, _ in found]  # noqa: DTZ001

    assert [f"{day}" for day in days] == ["2024-04-08", "2024-10-02"]
    assert all(60 < end_s - start_s < 3 * 3600 for start_s, end_s in found)


def test_a_pass_by_the_sun_is_found_wherever_the_run_around_it_begins_and_ends() -> None:
    begin = datetime(2024, 4, 8, 12, tzinfo=UTC)
    for hours in range(6):
        epoch = after(hours * 3600, begin)
        ephemeris = Ephemeris(body="moon", epoch=epoch, conjunction_deg=0.36)
        ((start_s, end_s),) = conjunctions(ephemeris, (8 - hours) * 3600)
        assert datetime.fromisoformat(after(start_s + hours * 3600, begin)).hour in {17, 18}
        assert end_s < (8 - hours) * 3600


def test_without_a_limit_or_far_from_the_sun_there_is_no_conjunction() -> None:
    assert conjunctions(Ephemeris(body="mars", epoch="2021-10-08"), 20 * DAY_S) == []
    assert conjunctions(MARS, 20 * DAY_S) == []


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("mrs", 'found "mrs"; did you mean mars?'),
        ("Jupitr", 'found "Jupitr"; did you mean jupiter?'),
        ("earth", 'found "earth"'),
        ("", 'found ""'),
        (-74, "found -74"),
        (None, "found none"),
    ],
)
def test_an_unknown_body_is_refused(body: str | int | None, told: str) -> None:
    with pytest.raises(EphemerisError) as refused:
        sky(Ephemeris(body=body, epoch="2021-02-18"))
    assert str(refused.value).startswith(f"expected one of {', '.join(BODIES)}, {told}")


@pytest.mark.parametrize(
    ("epoch", "told"),
    [
        ("tomorrow", 'found "tomorrow"'),
        ("2021-02-30", 'found "2021-02-30"'),
        ("2021-02-18T00:00", 'found "2021-02-18T00:00"; did you mean 2021-02-18T00:00Z?'),
        ("", 'found ""'),
    ],
)
def test_an_invalid_date_is_refused(epoch: str, told: str) -> None:
    with pytest.raises(ValueError, match="expected a date") as refused:
        parsed_date(epoch)
    assert str(refused.value) == (
        "expected a date and time in ISO 8601 with Z or an offset, "
        f"such as 2021-02-18T00:00:00Z, {told}"
    )


@pytest.mark.parametrize("epoch", ["1959-12-31", "2100-01-02", "0001-01-01T00:00+05:00"])
def test_a_time_that_the_ephemeris_does_not_cover_is_refused(epoch: str) -> None:
    with pytest.raises(EphemerisError, match="from 1960-01-01 to 2100-01-01, found "):
        light_time("mars", epoch)


def test_without_astropy_people_are_told_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in ("astropy", "astropy.utils"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(EphemerisError, match=r"found no astropy.*pip install 'farside\[astropy\]'"):
        light_time("mars", "2021-02-18")


@pytest.mark.processes
def test_whatever_needs_no_light_time_does_not_import_astropy() -> None:
    script = "import sys, farside.missions.commands.main; sys.exit('astropy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", script], check=False).returncode == 0  # noqa: S603
