"""Vector tables as JPL Horizons prints them, made here of the built-in ephemeris."""

import json
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest

from farside.link.profile.ephemeris import Ephemeris
from farside.link.profile.sky.dates import parsed_date
from farside.link.profile.sky.horizons import AU_KM, LIGHT_KM_S, horizons_table
from farside.link.profile.sky.light import conjunctions, delay_tables, light_time
from farside.link.profile.sky.positions import DAY_S, J2000_DAY, EphemerisError
from farside.link.profile.sky.sky import Sky, sky_of

pytest.importorskip("astropy")

BEGIN = "2021-09-20T00:00:00Z"
MARS, EARTH, SUN = 499, 399, 10
TILT = math.radians(84_381.448 / 3600)
RULE = "*" * 79


class Style(NamedTuple):
    """How a table is printed."""

    csv: bool = False
    labels: bool = True
    units: str = "KM-S"
    frame: str = "ICRF"
    scale: str = "TDB"
    columns: Sequence[str] = ("X", "Y", "Z", "VX", "VY", "VZ", "LT", "RG", "RR")
    center: int = EARTH


def built_in(begin: str = BEGIN) -> Sky:
    """Mars without a file."""
    return Sky(parsed_date(begin), MARS, EARTH)


def printed(style: Style, days: float = 30.0, step_s: float = 6 * 3600.0) -> str:
    """Mars as seen from the Earth or another body, in the layout of Horizons."""
    sky = built_in()
    times_s = np.arange(-DAY_S, days * DAY_S + 1, step_s)
    length_km = AU_KM if style.units.startswith("AU") else 1.0
    period_s = DAY_S if style.units.endswith("D") else 1.0

    def seen(at_s: np.ndarray) -> np.ndarray:
        home = sky._at(style.center, at_s) if style.center else 0.0
        return (sky._at(MARS, at_s) - home) * LIGHT_KM_S

    position, half_s = seen(times_s), 60.0
    velocity = (seen(times_s + half_s) - seen(times_s - half_s)) / (2 * half_s)
    if "Ecliptic" in style.frame:
        turn = np.array(
            [[1, 0, 0], [0, math.cos(TILT), math.sin(TILT)], [0, -math.sin(TILT), math.cos(TILT)]]
        )
        position, velocity = turn @ position, turn @ velocity
    distance = np.linalg.norm(position, axis=0)
    values = dict(zip("XYZ", position / length_km, strict=True))
    values |= dict(zip(("VX", "VY", "VZ"), velocity / length_km * period_s, strict=True))
    values |= {"LT": distance / LIGHT_KM_S / period_s, "RG": distance / length_km}
    values["RR"] = (position * velocity).sum(axis=0) / distance / length_km * period_s
    # BEGIN is 69.184 s later in TDB than in UTC.
    ahead_s = 69.184 if style.scale == "TDB" else 0.0
    zero_day = 2_459_477.5
    rows = []
    for index, time_s in enumerate(times_s):
        whole, seconds = divmod(time_s + ahead_s, DAY_S)
        fraction = 0.5 + seconds / DAY_S
        day = f"{zero_day - 0.5 + whole + fraction // 1:.0f}{f'{fraction % 1:.15f}'[1:]}"
        date = "A.D. 2021-Sep-20 00:00:00.0000"
        texts = [f"{values[name][index]: .15E}" for name in style.columns]
        if style.csv:
            rows.append(f"{day}, {date}, " + ", ".join(texts) + ",")
            continue
        rows.append(f"{day} = {date} {style.scale} [del_T=     69.184 s]")
        for begin in range(0, len(texts), 3):
            named = zip(style.columns[begin : begin + 3], texts[begin : begin + 3], strict=True)
            rows.append(
                " "
                + " ".join(f"{name:<2}={text}" if style.labels else text for name, text in named)
            )
    jd = f"JD{style.scale}"
    if style.csv:
        heading = [f"            {jd},            Calendar Date ({style.scale}),"]
        heading[0] += "".join(f"{name:>24}," for name in style.columns)
    else:
        groups = [style.columns[i : i + 3] for i in range(0, len(style.columns), 3)]
        heading = [jd, *("   " + "    ".join(group) for group in groups)]
    center = {EARTH: "Earth (399)", 0: "Solar System Barycenter (0)", SUN: "Sun (10)"}
    return "\n".join(
        [
            "API VERSION: 1.2",
            RULE,
            "Ephemeris / API_USER Sat Nov 28 08:00:00 2026 Pasadena, USA      / Horizons",
            RULE,
            "Target body name: Mars (499)                      {source: mars097}",
            f"Center body name: {center[style.center]:<30}  {{source: DE441}}",
            "Center-site name: BODY CENTER",
            RULE,
            f"Output units    : {style.units}",
            "Output type     : GEOMETRIC cartesian states",
            f"Reference frame : {style.frame}",
            RULE,
            *heading,
            RULE,
            "$$SOE",
            *rows,
            "$$EOE",
            RULE,
            "",
        ]
    )


def sky(text: str, **ephemeris: object) -> Sky:
    """The sky of a table."""
    table = Ephemeris(horizons="mars.txt", **ephemeris)  # type: ignore[arg-type]
    return sky_of(table, parsed_date(BEGIN), lambda _: text, lambda _: [])


@pytest.mark.parametrize(
    "style",
    [
        Style(),
        Style(csv=True),
        Style(labels=False, units="AU-D"),
        Style(csv=True, units="KM-D", frame="Ecliptic of J2000.0"),
        Style(frame="Ecliptic of J2000.0", center=SUN),
        Style(scale="UT", center=0),
        Style(csv=True, columns=("X", "Y", "Z")),
    ],
    ids=lambda style: " ".join(str(each) for each in style[:5]),
)
def test_however_a_table_is_printed_its_light_times_are_those_of_the_body(style: Style) -> None:
    table, mars = sky(printed(style)), built_in()
    for sent_s in (0.0, 3 * DAY_S + 17, 20 * DAY_S):
        times_s = np.array([sent_s])
        for ends in ((EARTH, MARS), (MARS, EARTH)):
            expected_s = mars.light_s(*ends, times_s)
            assert table.light_s(*ends, times_s) == pytest.approx(expected_s, abs=1e-5)
    assert light_time(table).sun_earth_target_deg == pytest.approx(
        light_time(mars).sun_earth_target_deg, abs=1e-6
    )


def test_a_conjunction_is_found_in_a_table() -> None:
    found = conjunctions(sky(printed(Style(csv=True))), 0, 28 * DAY_S, 2.2)
    expected = conjunctions(built_in(), 0, 28 * DAY_S, 2.2)
    assert np.array(found) == pytest.approx(np.array(expected), abs=60)


def test_light_times_alone_do_for_delays_but_not_for_a_conjunction() -> None:
    alone = sky(printed(Style(columns=("LT", "RG", "RR"))))
    up, down = delay_tables(alone, 0, 10 * DAY_S)
    mars_up, mars_down = delay_tables(built_in(), 0, 10 * DAY_S)
    for own, whole in ((up, mars_up), (down, mars_down)):
        by_time = {point.t_s: point.delay_s for point in own}
        for point in whole:
            assert by_time[point.t_s] == pytest.approx(point.delay_s, abs=0.15)
    assert light_time(alone).sun_earth_target_deg is None
    with pytest.raises(EphemerisError, match="found a table of light times alone"):
        conjunctions(alone, 0, DAY_S, 2.2)


def test_the_json_of_the_interface_is_unwrapped() -> None:
    wrapped = json.dumps({"signature": {}, "result": printed(Style())})
    assert horizons_table(wrapped, "mars.json").target == MARS


def test_what_the_table_covers_is_said() -> None:
    short = sky(printed(Style(csv=True), days=2.0))
    assert short.last_s < 2 * DAY_S - 1000  # what is sent later would arrive after the last line
    assert short.last_date.startswith("2021-09-21T23:")
    with pytest.raises(EphemerisError) as refusal:
        sky_of(
            Ephemeris(horizons="mars.txt"),
            parsed_date("2021-12-01"),
            lambda _: printed(Style(), days=2.0),
            lambda _: [],
        )
    assert "expected a date in what the files cover, 2021-09-19T00:00:00Z to 2021-09-22" in str(
        refusal.value
    )


def test_a_body_that_is_not_that_of_the_table_is_refused() -> None:
    assert sky(printed(Style()), body="mars").body == MARS
    with pytest.raises(EphemerisError, match=r"expected a table of 299 \(venus\) as in body"):
        sky(printed(Style()), body="venus")


def test_lines_too_far_apart_to_tell_what_is_between_are_refused() -> None:
    with pytest.raises(EphemerisError, match="ask Horizons for a shorter step"):
        horizons_table(printed(Style(columns=("X", "Y", "Z")), days=300, step_s=30 * DAY_S), "mars")


def without(text: str, line: str) -> str:
    return "\n".join(one for one in text.split("\n") if not one.startswith(line))


GOOD = printed(Style(csv=True), days=1.0)
FIRST_ROW = GOOD.split("\n").index("$$SOE") + 2


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "mars: expected a vector table of Horizons, between one $$SOE and one $$EOE, found 0"),
        (without(GOOD, "$$EOE"), "found 1 of these lines"),
        ("{", "mars: expected Horizons' JSON with a result, found none"),
        (without(GOOD, "Output units"), "expected output units KM-S, KM-D or AU-D"),
        (without(GOOD, "Reference frame"), "expected the axes of the ICRF or the ecliptic"),
        (GOOD.replace("ICRF", "FK4/B1950.0"), "the ecliptic of J2000 in the header, found fk4"),
        (
            without(GOOD, "            JDTDB"),
            "expected a header that ends with the names of the col",
        ),
        (GOOD.replace("GEOMETRIC", "ASTROMETRIC"), "expected geometric states (no aberrations)"),
        (
            printed(Style(columns=("X", "Y", "RR"))),
            "expected the columns X, Y and Z, or LT, found X",
        ),
        (
            GOOD.replace("E+0", "E+x", 1),
            f"mars, line {FIRST_ROW}: expected a date and numbers, found 2459476.5",
        ),
        (GOOD.replace(",\n2459476.75", "\n2459476.75").replace(" RR,", ""), "expected 8 numbers"),
        (GOOD.replace("2459477.0", "2459476.0"), "expected a date after that of the line before"),
        (GOOD.replace("E+0", "E+999", 1), "expected finite numbers"),
    ],
)
def test_what_is_wrong_with_a_table_is_told_by_file_and_line(text: str, words: str) -> None:
    with pytest.raises(EphemerisError) as refusal:
        horizons_table(text, "mars")
    assert words in str(refusal.value)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 500


def test_times_are_counted_as_horizons_counts_them() -> None:
    table = horizons_table(printed(Style()), "mars")
    assert table.span[0] / DAY_S + J2000_DAY == pytest.approx(2_459_476.5 + 69.184 / DAY_S)
