"""SPICE kernels of positions, written here, against orbits that are known by a formula."""

import math
import os
import sys
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from kernels import Floats, Segment, chebyshev, hermite, write_kernel

from farside.link.profile.config import LinkConfig
from farside.link.profile.ephemeris import Ephemeris
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.plans.times import Window
from farside.link.profile.profile import Profile
from farside.link.profile.resolve import resolve_link
from farside.link.profile.sky.dates import parsed_date
from farside.link.profile.sky.kernels import kernel_orbits
from farside.link.profile.sky.light import conjunctions, delay_tables, light_time
from farside.link.profile.sky.positions import EphemerisError, Moments, et_s
from farside.link.profile.sky.sky import Sky, sky_of

pytest.importorskip("jplephem")

BEGIN = "2026-11-28T00:00:00Z"
DAY_S = 86_400.0
LIGHT_KM_S = 299_792.458
ET_S = et_s(parsed_date(BEGIN))
MARS, EARTH, SUN, CRAFT = 499, 399, 10, -74
RADIUS_KM, PERIOD_S = 3_650.0, 6_720.0


def low_orbit(et: Floats) -> Floats:
    """An orbiter around Mars, one turn in 112 minutes: positions and velocities."""
    angle, turn = 2 * math.pi * (et - ET_S) / PERIOD_S, 2 * math.pi / PERIOD_S
    sine, cosine, tilt = np.sin(angle), np.cos(angle), 1.6
    around = [cosine, sine * math.cos(tilt), sine * math.sin(tilt)]
    along = [-sine * turn, cosine * turn * math.cos(tilt), cosine * turn * math.sin(tilt)]
    states: Floats = np.stack([*around, *along], axis=1) * RADIUS_KM
    return states


def states(first_s: float, last_s: float, seed: int = 1) -> Segment:
    """The orbiter at uneven steps of a minute or so (type 13)."""
    steps_s = np.random.default_rng(seed).uniform(45, 75, int((last_s - first_s) / 45))
    epochs_s = ET_S + first_s + np.concatenate([[0.0], np.cumsum(steps_s)])
    epochs_s = np.append(epochs_s[epochs_s < ET_S + last_s], ET_S + last_s)
    return hermite(CRAFT, MARS, epochs_s, low_orbit(epochs_s))


def sky(*kernels: Path, begin: str = BEGIN, **ephemeris: Any) -> Sky:
    """The sky of these kernels."""
    table = Ephemeris(kernel=tuple(map(str, kernels)), **ephemeris)
    return sky_of(table, parsed_date(begin), str, lambda name: kernel_orbits(Path(name)))


@pytest.fixture
def orbiter(tmp_path: Path) -> Path:
    """A kernel of three days of the orbiter, in two segments."""
    path = tmp_path / "orbiter.bsp"
    return write_kernel(path, [states(-DAY_S, DAY_S), states(DAY_S, 2 * DAY_S, seed=2)])


@pytest.fixture
def straight(tmp_path: Path) -> Path:
    """Earth at rest, Sun beside it, and a probe that leaves at 30 km/s, by polynomials (type 2)."""
    first_s, last_s = ET_S - DAY_S, ET_S + 10 * DAY_S
    middle_km, speed_km = 3e7 + 30 * 4.5 * DAY_S, 30 * 5.5 * DAY_S
    return write_kernel(
        tmp_path / "straight.bsp",
        [
            chebyshev(EARTH, 0, first_s, last_s, ([0, 0], [0, 0], [0, 0])),
            chebyshev(SUN, 0, first_s, last_s, ([0, 0], [1.5e8, 0], [0, 0])),
            chebyshev(CRAFT, EARTH, first_s, last_s, ([middle_km, speed_km], [0, 0], [0, 0])),
        ],
    )


def test_light_times_to_a_probe_that_recedes_are_those_of_the_formula(straight: Path) -> None:
    probe = sky(straight, body=CRAFT)
    found = light_time(probe)
    # Up, light runs after the probe at c - v; down, it left when the probe was nearer.
    assert found.uplink_s == pytest.approx(3e7 / (LIGHT_KM_S - 30), abs=1e-8)
    assert found.downlink_s == pytest.approx(3e7 / (LIGHT_KM_S + 30), abs=1e-8)
    assert found.sun_earth_target_deg == pytest.approx(90)
    up, down = delay_tables(probe, 0, 5 * DAY_S)
    distance_km = 3e7 + 30 * 3 * DAY_S
    sent_s = [point.t_s for point in up]
    three_days = sent_s.index(3 * DAY_S)
    assert up[three_days].delay_s == pytest.approx(distance_km / (LIGHT_KM_S - 30), abs=1e-7)
    assert down[three_days].delay_s == pytest.approx(distance_km / LIGHT_KM_S, abs=1e-7)


def test_around_mars_the_orbit_adds_to_the_light_time_of_mars_itself(orbiter: Path) -> None:
    near, far = sky(orbiter, body="MRO"), sky(orbiter, body=CRAFT)
    mars = Sky(parsed_date(BEGIN), MARS, EARTH)
    sent_s = np.arange(0, DAY_S, 311.0)
    up_s = near.light_s(EARTH, CRAFT, sent_s)
    assert (up_s == far.light_s(EARTH, CRAFT, sent_s)).all()
    mars_up_s = mars.light_s(EARTH, MARS, sent_s)
    # Seen from afar the orbiter is ahead of Mars or behind it by its place along the line of sight.
    line = mars._at(MARS, sent_s + mars_up_s) - mars._at(EARTH, sent_s)
    line /= np.linalg.norm(line, axis=0)
    ahead_s = (low_orbit(ET_S + sent_s + mars_up_s)[:, :3].T * line).sum(axis=0) / LIGHT_KM_S
    assert np.abs(up_s - mars_up_s - ahead_s).max() < 2e-6
    assert np.ptp(ahead_s) > 0.01


def test_the_table_follows_an_orbit_that_turns_in_two_hours(orbiter: Path) -> None:
    craft = sky(orbiter, body=CRAFT)
    up, _ = delay_tables(craft, 0, DAY_S)
    between_s = np.arange(7.0, DAY_S, 97.0)
    linear_s = np.interp(between_s, [p.t_s for p in up], [p.delay_s for p in up])
    assert np.abs(linear_s - craft.light_s(EARTH, CRAFT, between_s)).max() < 1e-3
    assert len(up) < 2000
    # A window that begins later has the same points.
    later, _ = delay_tables(craft, 10_000.0, DAY_S)
    assert set(later) <= set(up)


def test_the_axes_may_be_those_of_the_ecliptic(tmp_path: Path) -> None:
    epochs_s = ET_S + np.arange(0.0, 1000.0, 100.0)
    to_the_pole = np.tile([0.0, 0.0, 1000.0, 0.0, 0.0, 0.0], (len(epochs_s), 1))
    segment = hermite(CRAFT, EARTH, epochs_s, to_the_pole, frame=17)
    (orbit,) = kernel_orbits(write_kernel(tmp_path / "pole.bsp", [segment]))
    found = orbit.position_km(Moments(parsed_date(BEGIN), np.array([500.0])))[:, 0]
    tilt = math.radians(84_381.448 / 3600)
    assert found == pytest.approx([0, -1000 * math.sin(tilt), 1000 * math.cos(tilt)])


def test_the_later_kernel_counts_first_and_where_it_ends_the_other_goes_on(
    tmp_path: Path, straight: Path
) -> None:
    first_s, last_s = ET_S - 10, ET_S + DAY_S
    nearer = chebyshev(CRAFT, EARTH, first_s, last_s, ([1e6, 0], [0, 0], [0, 0]))
    override = write_kernel(tmp_path / "newer.bsp", [nearer])
    both = sky(straight, override, body=CRAFT)
    light_s = both.light_s(CRAFT, EARTH, np.array([0.5 * DAY_S, 2 * DAY_S]))
    assert light_s[0] == pytest.approx(1e6 / LIGHT_KM_S)
    assert light_s[1] == pytest.approx((3e7 + 30 * 2 * DAY_S) / LIGHT_KM_S)


def test_a_chain_may_lead_over_several_files_and_turn_elsewhere(
    tmp_path: Path, straight: Path
) -> None:
    first_s, last_s = ET_S - 10, ET_S + 10 * DAY_S
    relay, lander = -100, -200
    hop = chebyshev(lander, relay, first_s, last_s, ([0, 0], [400.0, 0], [0, 0]))
    base = chebyshev(relay, CRAFT, first_s, last_s, ([0, 0], [300.0, 0], [0, 0]))
    back = chebyshev(CRAFT, lander, first_s, last_s, ([9.0, 0], [0, 0], [0, 0]))
    # The last one closes the chain, which leads nowhere: the others are used.
    files = [
        write_kernel(tmp_path / f"{number}.bsp", [segment])
        for number, segment in enumerate((hop, base, back))
    ]
    there = sky(*files, straight, body=lander, center=CRAFT)
    assert there.light_s(lander, CRAFT, np.zeros(1))[0] == pytest.approx(700 / LIGHT_KM_S)


def test_a_conjunction_of_a_spacecraft_is_found(tmp_path: Path, straight: Path) -> None:
    # The probe passes behind the Sun at 1e8 km beyond it, from left to right in ten days.
    first_s, last_s = ET_S - DAY_S, ET_S + 10 * DAY_S
    across = ([0, 2e7], [2.5e8, 0], [0, 0])
    probe = write_kernel(tmp_path / "p.bsp", [chebyshev(-5, EARTH, first_s, last_s, across)])
    ((begin_s, end_s),) = conjunctions(sky(straight, probe, body=-5), 0, 9 * DAY_S, 1.0)
    half_s = 2.5e8 * math.tan(math.radians(1)) / 2e7 * 5.5 * DAY_S
    assert begin_s == pytest.approx(4.5 * DAY_S - half_s, abs=30)
    assert end_s == pytest.approx(4.5 * DAY_S + half_s, abs=30)


def test_a_planet_of_which_a_kernel_has_only_the_barycentre_is_there(tmp_path: Path) -> None:
    first_s, last_s = ET_S - DAY_S, ET_S + DAY_S
    mars = chebyshev(4, 0, first_s, last_s, ([2e8, 0], [0, 0], [0, 0]))
    assert sky(write_kernel(tmp_path / "de.bsp", [mars]), body="mars").body == 4


# --- ranges and errors


def test_a_mission_within_the_kernel_resolves_and_one_beyond_it_is_refused(orbiter: Path) -> None:
    orbit = {"body": CRAFT, "kernel": orbiter.name, "epoch": BEGIN}
    profile = Profile({"ephemeris": orbit}, orbiter.parent)
    link: LinkConfig = profile.resolved(Window.of(1.9 * DAY_S))
    assert link.up.delay_table[-1].t_s >= 1.9 * DAY_S
    with pytest.raises(LinkConfigError) as refusal:
        profile.resolved(Window.of(3 * DAY_S))
    words = str(refusal.value)
    assert words.startswith("ephemeris: expected light times for 259200 s from the start, found")
    assert "until 2026-11-29T23:" in words
    end = profile.light_end()
    assert end is not None
    # What leaves the Earth then arrives when the kernel ends, ten minutes of light time later.
    assert 2 * DAY_S - end.at_s == pytest.approx(
        light_time(sky(orbiter, body=CRAFT)).uplink_s, 0.02
    )


def test_a_mission_that_is_run_again_does_without_the_kernel(orbiter: Path) -> None:
    orbit = {"body": CRAFT, "kernel": orbiter.name, "conjunction_deg": 175}
    config = msgspec.convert({"ephemeris": orbit, "start": BEGIN}, LinkConfig)
    window, folder = Window.of(DAY_S), orbiter.parent
    texts: dict[str, str] = {}
    link = resolve_link(config, folder=folder, window=window, texts=texts)
    assert link.blackouts
    orbiter.unlink()
    assert resolve_link(config, folder=folder, window=window, texts=texts) == link
    with pytest.raises(LinkConfigError, match="expected a kernel, found"):
        resolve_link(config, folder=folder, window=Window.of(DAY_S / 2), texts=texts)


@pytest.mark.parametrize(
    ("ephemeris", "begin", "words"),
    [
        (
            {"body": CRAFT},
            "2030-01-01",
            "expected a date in what the files cover, 2026-11-27T00:00:00Z to",
        ),
        ({"body": "venus"}, BEGIN, "expected a body of the kernels (-74 (mro)), found 299 (venus)"),
        (
            {"body": "mor"},
            BEGIN,
            'expected a body by name or NAIF number, found "mor"; did you mean',
        ),
        ({}, BEGIN, "expected a body of the kernels (-74 (mro)), found none"),
        ({"body": CRAFT, "center": 401}, BEGIN, "expected 401 (phobos), or a chain of orbits"),
    ],
)
def test_what_the_kernels_do_not_hold_is_refused(
    orbiter: Path, ephemeris: dict[str, Any], begin: str, words: str
) -> None:
    with pytest.raises(EphemerisError) as refusal:
        sky(orbiter, begin=begin, **ephemeris)
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"KPL/FK\nnot positions", "expected a binary SPK kernel, found"),
        (b"", "expected a binary SPK kernel, found an empty file"),
        (None, "expected a kernel, found"),
    ],
)
def test_a_file_that_is_no_kernel_is_refused(
    tmp_path: Path, content: bytes | None, words: str
) -> None:
    path = tmp_path / "x.bsp"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(EphemerisError) as refusal:
        kernel_orbits(path)
    assert words in str(refusal.value)
    assert "x.bsp" in str(refusal.value)


def test_a_kernel_that_would_never_end_to_be_read_is_refused(tmp_path: Path) -> None:
    os.mkfifo(pipe := tmp_path / "pipe.bsp")
    with pytest.raises(EphemerisError, match="expected a regular file, found a pipe"):
        kernel_orbits(pipe)


def test_a_body_seen_from_itself_is_refused(orbiter: Path) -> None:
    with pytest.raises(
        EphemerisError, match=r"expected two bodies, found -74 \(mro\) at both ends"
    ):
        sky(orbiter, body=CRAFT, center="mro")


def test_a_segment_of_another_type_or_in_other_axes_is_refused(tmp_path: Path) -> None:
    data = np.zeros(12)
    for segment, words in (
        (Segment(CRAFT, MARS, ET_S, ET_S + 1, 5, data), "expected data type 1, 2, 3, 8, 9, 12, 13"),
        (Segment(CRAFT, MARS, ET_S, ET_S + 1, 13, data, 3000), "expected the axes of J2000 (1)"),
    ):
        path = write_kernel(tmp_path / "odd.bsp", [segment])
        with pytest.raises(EphemerisError, match="segment of -74 about 499") as refusal:
            kernel_orbits(path)
        assert words in str(refusal.value)


def test_a_kernel_cut_short_is_refused(orbiter: Path) -> None:
    cut = orbiter.with_name("cut.bsp")
    cut.write_bytes(orbiter.read_bytes()[:20_000])
    with pytest.raises(EphemerisError, match=r"cut\.bsp"):
        sky(cut, body=CRAFT)


def test_without_jplephem_people_are_told_what_to_install(
    orbiter: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in ("jplephem", "jplephem.spk"):
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(EphemerisError, match=r"found no jplephem.*pip install 'farside\[spice\]'"):
        kernel_orbits(orbiter)


@pytest.mark.parametrize(
    ("date", "horizons_s"),
    [
        ("2012-08-06", 827.414),
        ("2018-08-01", 192.116),
        ("2019-08-28", 1334.994),
        ("2021-02-18", 678.047),
    ],
)
def test_a_kernel_of_jpl_gives_the_light_times_of_horizons(date: str, horizons_s: float) -> None:
    data = pytest.importorskip("skyfield_data", reason="17 MB, for this test alone")
    path = Path(data.get_skyfield_data_path()) / "de421.bsp"
    mars = light_time(sky(path, begin=date, body="mars"))
    assert mars.downlink_s == pytest.approx(horizons_s, abs=0.0006)
    assert mars.downlink_s == pytest.approx(
        light_time(Sky(parsed_date(date), MARS, EARTH)).downlink_s, abs=0.013
    )
