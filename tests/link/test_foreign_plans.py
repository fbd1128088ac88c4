"""Contact plans as other people write them, from file to link: small ones of every kind found.

The kinds are those of the public plans of ION, HDTN and simulators; the plans are our own.
"""

from pathlib import Path

import pytest

from farside.link.profile.config import Affected, LinkConfig
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.profile import load_profile

HORIZON_S = 1000

SECTIONS = """\
## File created by ionscript
## begin ionadmin
1 7 ''
a contact +5 +605 7 9 1200
a contact +5 +605 9 7 4000
a range +5 +605 7 9 2
## end ionadmin
## begin ltpadmin
1 32
a span 9 32 32 1400 10000 1 'udplso 10.1.1.9:1113'
## end ltpadmin
"""
BOTH_WAYS = "a contact +5 +605 7 9 1200\na contact +5 +605 9 7 4000\n"
PLAIN = BOTH_WAYS + "a range +5 +605 7 9 2\n"
ENTRY = '{"source":%d,"dest":%d,"startTime":%d,"endTime":%d,"rateBitsPerSec":%s%s}'


def hdtn(*entries: tuple[int, int, int, int, object, str]) -> str:
    return '{"contacts": [\n' + ",\n".join(ENTRY % entry for entry in entries) + "]}"


def linked(
    folder: Path, plan: str | bytes, ground: int, rover: int, name: str = "plan.ionrc"
) -> LinkConfig:
    """The link between two nodes of a plan, by way of a profile that names its file."""
    (folder / name).write_bytes(plan.encode() if isinstance(plan, str) else plan)
    profile = folder / "profile.toml"
    profile.write_text(f'[contacts]\nfile = "{name}"\nground = {ground}\nrover = {rover}\n')
    return load_profile(profile, HORIZON_S)


def shape_of(link: LinkConfig) -> tuple[object, ...]:
    """When the uplink is out, its first light time, and the first rate of either direction."""
    out = [(one.start_s, one.end_s) for one in link.blackouts if one.direction is Affected.UP]
    rates = [
        way.rate_table[0].rate_bit_s if way.rate_table else None for way in (link.up, link.down)
    ]
    return out, link.up.delay_table[0].delay_s, *rates


AS_TOLD = [(0, 7), (607, HORIZON_S)], 2, 9600, 32_000
WITHOUT_RANGE = [(0, 5), (605, HORIZON_S)], 0, 9600, 32_000


@pytest.mark.parametrize(
    ("plan", "shape"),
    [
        (PLAIN, AS_TOLD),
        (SECTIONS, AS_TOLD),
        (SECTIONS.replace("\n", "\r\n"), AS_TOLD),
        (SECTIONS.replace("ionadmin", "ionadmin host7"), AS_TOLD),
        (SECTIONS.replace("## end ltpadmin\n", ""), AS_TOLD),
        ("! 1\n" + PLAIN, AS_TOLD),
        ("a contact +5 +605 7 9 1200\n" + PLAIN, AS_TOLD),
        (PLAIN + PLAIN, AS_TOLD),
        (b"\xef\xbb\xbf" + PLAIN.encode(), AS_TOLD),
        ("# 5 s nach dem \u00d6ffnen\n".encode("latin-1") + PLAIN.encode(), AS_TOLD),
        (PLAIN.replace(" ", "\t\t"), AS_TOLD),
        (PLAIN.replace("1200", "1200 0.4").replace("4000", "4000 .9  # likely"), AS_TOLD),
        (PLAIN + "a contact -1 -1 9 9 0\na contact +0 0 7 9 0\na contact 0 0 9 7 0\n", AS_TOLD),
        (PLAIN + "a contact +0 +9 1 2 8\na contact +3 +4 1 2 8\n", AS_TOLD),
        (PLAIN + "a contact +9 +9 1 2 8\na contact +0 +9 1 2 0\na range +0 +9 1 2\n", AS_TOLD),
        (
            PLAIN + "c contact +9 1 2 8\nd contact +9 2 1\na contact +1 2031/01/05-00:00:00 1 2 8",
            AS_TOLD,
        ),
        (PLAIN + "q\na contact +0 +5 7 9 8\n", AS_TOLD),
        (PLAIN.replace("7 9 2\n", "9 7 2\na range +5 +605 7 9 2\n"), AS_TOLD),
        ("@ 2031/01/05-00:00:00.000\n" + PLAIN, AS_TOLD),
        (BOTH_WAYS, WITHOUT_RANGE),
        (BOTH_WAYS + "a range +5 +605 9 7 2\n", WITHOUT_RANGE),
        (BOTH_WAYS.splitlines()[0], ([(0, 5), (605, HORIZON_S)], 0, 9600, None)),
    ],
)
def test_a_plan_of_ion_gives_the_link_between_two_nodes(
    tmp_path: Path, plan: str | bytes, shape: tuple[object, ...]
) -> None:
    assert shape_of(linked(tmp_path, plan, 7, 9)) == shape


def test_dates_with_fractions_of_a_second_count_from_the_first(tmp_path: Path) -> None:
    text = (
        "a contact 2031/01/05-10:00:00.750 2031/01/05-10:10:00.250 7 9 1200\n"
        "a contact 2031/01/05-10:00:00.750 2031/01/05-10:10:00.250 9 7 4000\n"
    )
    assert shape_of(linked(tmp_path, text, 7, 9)) == ([(599.5, HORIZON_S)], 0, 9600, 32_000)


OPEN = (5, 6, 0, 120, 64_000, ',"owlt":1')
BACK = (6, 5, 0, 120, 64_000, ',"owlt":1')
AS_HDTN = [(0, 1), (121, HORIZON_S)], 1, 64_000, 64_000


@pytest.mark.parametrize(
    ("plan", "shape"),
    [
        (hdtn(OPEN, BACK), AS_HDTN),
        (hdtn(OPEN, OPEN, BACK), AS_HDTN),
        (hdtn(OPEN, BACK, (8, 9, 0, 120, 1, ""), (8, 9, 17, 200, 1, "")), AS_HDTN),
        (hdtn(OPEN, BACK, (8, 9, 50, 20, 1, ""), (8, 9, 0, 1, '"fast"', "")), AS_HDTN),
        (
            hdtn((*OPEN[:4], '"64000"', ""), (*BACK[:5], "")),
            ([(120, HORIZON_S)], 0, 64_000, 64_000),
        ),
        (hdtn((*OPEN[:4], 0, ""), (*BACK[:4], 0, "")), ([(120, HORIZON_S)], 0, None, None)),
        (
            hdtn(OPEN, BACK).replace('"rateBitsPerSec":64000', '"rate":3'),
            (*AS_HDTN[:2], 3_000_000, 3_000_000),
        ),
        (hdtn(OPEN), (*AS_HDTN[:3], None)),
    ],
)
def test_a_plan_of_hdtn_gives_the_link_between_two_nodes(
    tmp_path: Path, plan: str, shape: tuple[object, ...]
) -> None:
    assert shape_of(linked(tmp_path, plan, 5, 6, "plan.json")) == shape


@pytest.mark.parametrize(
    ("plan", "name", "words"),
    [
        (PLAIN + "frob 7", "a.rc", "a.rc, line 4: expected a command of ION"),
        (
            PLAIN + "a contact +9 +12 7 9 1200",
            "a.rc",
            "a.rc: line 4: expected no contact from 7 to 9",
        ),
        (PLAIN + "a contact +9 +12 7 ipn:9 1200", "a.rc", "line 4: expected a node number above 0"),
        (
            PLAIN + "a contact +609 2031/01/05-00:00:00 7 9 1",
            "a.rc",
            "line 4: expected a time such",
        ),
        (PLAIN.encode("utf-16"), "a.rc", "expected text in UTF-8, found byte 0xff in line 1"),
        (
            PLAIN.replace("1200", "12\xd600").encode("latin-1"),
            "a.rc",
            "line 1: expected a number of",
        ),
        (
            hdtn((7, 9, 0, 9, 1, ""), (7, 9, 8, 12, 1, "")),
            "a.json",
            "line 3: contacts[1]: expected no",
        ),
        (b'{"caf\xe9": 1}', "a.json", "expected text in UTF-8, found byte 0xe9 in line 1"),
    ],
)
def test_what_cannot_be_used_says_why_by_line(
    tmp_path: Path, plan: str | bytes, name: str, words: str
) -> None:
    with pytest.raises(LinkConfigError) as refusal:
        linked(tmp_path, plan, 7, 9, name)
    assert words in str(refusal.value)
