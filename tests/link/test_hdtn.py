"""Contact plans of HDTN: what is read, and what is refused."""

from datetime import UTC, datetime

import pytest

from farside.link.profile.plans.contacts import (
    UNLIMITED_BIT_S,
    Contact,
    ContactPlanError,
    Plan,
    Range,
    link_tables,
)
from farside.link.profile.plans.hdtn import parse_hdtn
from farside.link.profile.plans.ion import parse_ion

CONTACT = (
    '{"contact": 0, "source": 1, "dest": 2, "startTime": 0, "endTime": 60,\n'
    ' "rateBitsPerSec": 1000, "owlt": 1.5}'
)
OTHER = CONTACT.replace('"source": 1', '"source": 8').replace('"dest": 2', '"dest": 9')


def hdtn(*entries: str) -> str:
    return (
        '{"name": "contacts", "notes": [{"on": []}],\n"contacts": [\n'
        + ",\n".join(entries)
        + "\n]}"
    )


def test_hdtn_rates_are_bits_per_second_and_light_times_come_with_the_contacts() -> None:
    assert parse_hdtn(hdtn(CONTACT), "plan.json") == Plan(
        (Contact(0, 60, 1, 2, 1000),), (Range(0, 60, 1, 2, 1.5),)
    )


@pytest.mark.parametrize(
    ("found", "put", "rate_bit_s", "owlt_s"),
    [
        (', "owlt": 1.5', "", 1000, 0),
        ('"owlt": 1.5', '"owlt": "2.25"', 1000, 2.25),
        ("1000", '"64000"', 64_000, 1.5),
        ("1000", '" 64000 "', 64_000, 1.5),
        ('"rateBitsPerSec": 1000', '"rate": 12', 12_000_000, 1.5),
        ('"rateBitsPerSec": 1000', '"rate": "12", "rateBitsPerSec": 9', 9, 1.5),
        ('"rateBitsPerSec": 1000', '"rate": 0', UNLIMITED_BIT_S, 1.5),
        ("1000", "0", UNLIMITED_BIT_S, 1.5),
        ("1000", '1000, "rateBitsPerSec": 1000', 1000, 1.5),
        ("1000", '1000, "finalDestination": 7, "flowId": "1"', 1000, 1.5),
        ('"source": 1', '"source": "1"', 1000, 1.5),
        ('"endTime": 60', '"endTime": "60"', 1000, 1.5),
    ],
)
def test_a_contact_is_read_as_hdtn_reads_it(
    found: str, put: str, rate_bit_s: int, owlt_s: float
) -> None:
    plan = parse_hdtn("\ufeff" + hdtn(CONTACT.replace(found, put)), "plan.json")
    assert plan == Plan((Contact(0, 60, 1, 2, rate_bit_s),), (Range(0, 60, 1, 2, owlt_s),))


def test_a_contact_told_twice_counts_once() -> None:
    again = CONTACT.replace('"contact": 0', '"contact": 7')
    assert parse_hdtn(hdtn(CONTACT, again), "plan.json") == parse_hdtn(hdtn(CONTACT), "plan.json")


def test_a_contact_may_have_begun_before_second_0() -> None:
    plan = parse_hdtn(hdtn(CONTACT.replace('"startTime": 0', '"startTime": "-30"')), "plan.json")
    assert plan.contacts[0][:2] == (-30, 60)


def test_times_may_be_dates_in_posix_seconds() -> None:
    later = CONTACT.replace('"startTime": 0', '"startTime": 1767225660').replace(
        '"endTime": 60', '"endTime": 1767225700.5'
    )
    first = later.replace("1767225660", "1767225600").replace("1767225700.5", "1767225660")
    plan = parse_hdtn(hdtn(later, first), "plan.json")
    assert plan.zero == datetime(2026, 1, 1, tzinfo=UTC).timestamp()
    assert [one[:2] for one in plan.contacts] == [(0, 60), (60, 100.5)]
    assert [one[:2] for one in plan.ranges] == [(0, 60), (60, 100.5)]


@pytest.mark.parametrize(
    ("found", "put", "words"),
    [
        ('"rateBitsPerSec"', '"rateBytesPerSec"', "as rateBitsPerSec, found rateBytesPerSec"),
        ('"rateBitsPerSec"', '"bps"', "rateBitsPerSec: expected a rate in bits per second, found"),
        ('"owlt": 1.5', '"owltMs": 1500', "expected a light time in seconds as owlt, found owltMs"),
        ("1000", "1e3", "rateBitsPerSec: expected a rate in bits per second, found 1000.0"),
        ("1000", "-1", "rateBitsPerSec: expected a rate in bits per second, found -1"),
        ("1000", '"1 Mbit"', 'found "1 Mbit"'),
        ("1000", "true", "found true"),
        ("1000", "9" * 5000, 'found "' + "9" * 59 + "…"),
        ("1000", '1000, "rateBitsPerSec": 9', "expected one value of rateBitsPerSec, found two"),
        ("60", "0", "endTime: expected a time after startTime = 0, found 0"),
        ("60", "1e999", "endTime: expected a time in seconds, found inf"),
        ('"source": 1', '"source": "ipn:1"', 'source: expected a node number, found "ipn:1"'),
        ('"source": 1', '"from": 1', "source: expected a node number, found no such key, only"),
        ('"startTime": 0', '"startTime": 30', "overlaps another, found 30 s to 60 s beside 0 s"),
        ("1.5", "2", "expected no range from 1 to 2 that overlaps another"),
    ],
)
def test_an_invalid_contact_refuses_its_own_nodes_with_its_line(
    found: str, put: str, words: str
) -> None:
    plan = parse_hdtn(hdtn(CONTACT, CONTACT.replace(found, put), OTHER), "plan.json")
    with pytest.raises(ContactPlanError) as refusal:
        link_tables(plan, 1, 2, duration_s=100)
    assert str(refusal.value).startswith("line 5: contacts[1]: ")
    assert words in str(refusal.value)
    link_tables(plan, 9, 8, duration_s=100)


def test_a_contact_that_leaves_open_whose_it_is_refuses_all() -> None:
    wrong = CONTACT.replace('"source": 1', '"source": "A"').replace('"dest": 2', '"dest": "B"')
    with pytest.raises(ContactPlanError, match=r'^line 3: contacts\[0\]: source: .* found "A"$'):
        link_tables(parse_hdtn(hdtn(wrong, CONTACT), "plan.json"), 1, 2, duration_s=100)


@pytest.mark.parametrize(
    ("text", "line", "words"),
    [
        ('{"contacts": [\n{]}', 2, "expected JSON, found "),
        ('{"contacts": [\n{"source": Gateway}]}', 2, "expected JSON, found Expecting value"),
        ("[]", 1, "contacts: expected an array of objects, found no object"),
        ('{"contact": []}', 1, "contacts: expected an array of objects, found no such key"),
        ('{"a":\n1, "contacts": 3}', 2, "contacts: expected an array of objects, found 3"),
        ('{"contacts": [3]}', 1, "found an array with other entries"),
        ('{"contacts": []}', 1, "expected a contact at least, found none"),
        ('{"contacts": [],\n"contacts": [{}]}', 2, "found an object with two keys contacts"),
        ('{"a": "NaN",\n"contacts": [\nNaN, {}, Infinity]}', 3, "found NaN, which is not a number"),
        ('\n{"contacts": [{}]}', 2, "contacts[0]: source: expected a node number, found no such"),
        ('{"a": 1,\n"b":' + "[" * 100_000, 2, "found arrays and objects nested too deeply"),
    ],
)
def test_json_that_is_no_plan_is_refused_with_its_line(text: str, line: int, words: str) -> None:
    with pytest.raises(ContactPlanError) as refusal:
        parse_hdtn(text, "plan.json")
    assert str(refusal.value).startswith(f"plan.json, line {line}: ")
    assert words in str(refusal.value)


def test_each_format_recognises_the_other() -> None:
    with pytest.raises(ContactPlanError, match="found JSON; a plan of HDTN has a name that ends"):
        parse_ion("\ufeff" + hdtn(CONTACT), "plan.ionrc")
    with pytest.raises(ContactPlanError, match="found the commands of an ION contact plan"):
        parse_hdtn("# relay\na contact +0 +5 1 2 1\n", "plan.json")
