"""Contact plans of HDTN: what is read, and what is refused."""

import pytest

from farside.link.profile.plans.contacts import Contact, ContactPlanError, Plan, Range
from farside.link.profile.plans.hdtn import parse_hdtn
from farside.link.profile.plans.ion import parse_ion

CONTACT = (
    '{"contact": 0, "source": 1, "dest": 2, "startTime": 0, "endTime": 60,\n'
    ' "rateBitsPerSec": 1000, "owlt": 1.5}'
)


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
    ("found", "put", "words"),
    [
        ('"rateBitsPerSec"', '"rateBytesPerSec"', "in bits per second, found rateBytesPerSec"),
        ('"rateBitsPerSec"', '"rate"', "found rate, HDTN's old key for megabits per second"),
        ('"rateBitsPerSec"', '"bps"', "rateBitsPerSec: expected a rate in bits per second, found"),
        ('"owlt": 1.5', '"owltMs": 1500', "owlt: expected a light time in seconds, found no such"),
        ("1000", "1e3", "rateBitsPerSec: expected a rate in bits per second, found 1000.0"),
        ("1000", "-1", "rateBitsPerSec: expected a rate in bits per second, found -1"),
        ("1000", '"1 Mbit"', 'found "1 Mbit"'),
        ("1000", "true", "found true"),
        ("1000", "0", "expected bits per second above 0, found 0, which HDTN takes for unlimited"),
        ("60", "0", "endTime: expected a time after startTime = 0, found 0"),
        ("60", "1e999", "endTime: expected a time in seconds, found inf"),
        ('"source": 1', '"source": "ipn:1"', 'source: expected a node number, found "ipn:1"'),
        ('"startTime": 0', '"startTime": 30', "overlaps another, found 30 s to 60 s beside 0 s"),
    ],
)
def test_an_invalid_contact_of_hdtn_is_refused_with_its_line(
    found: str, put: str, words: str
) -> None:
    with pytest.raises(ContactPlanError) as refusal:
        parse_hdtn(hdtn(CONTACT, CONTACT.replace(found, put)), "plan.json")
    assert str(refusal.value).startswith("plan.json, line 5: contacts[1]: ")
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"contacts": [\n{]}', "plan.json, line 2: expected JSON, found "),
        ("[]", "contacts: expected an array of objects, found no object"),
        ('{"contact": []}', "contacts: expected an array of objects, found no such key"),
        ('{"contacts": 3}', "contacts: expected an array of objects, found 3"),
        ('{"contacts": [3]}', "found an array with other entries"),
        ('{"contacts": []}', "expected a contact at least, found none"),
        ('{"contacts": [], "contacts": []}', "found an object with two keys contacts"),
        ('{"contacts": [NaN]}', "found NaN, which is not a number of JSON"),
        ("[" * 100_000, "expected JSON, found "),
    ],
)
def test_json_that_is_no_plan_is_refused(text: str, words: str) -> None:
    with pytest.raises(ContactPlanError) as refusal:
        parse_hdtn(text, "plan.json")
    assert words in str(refusal.value)


def test_each_format_recognises_the_other() -> None:
    with pytest.raises(ContactPlanError, match="found JSON; a plan of HDTN has a name that ends"):
        parse_ion(hdtn(CONTACT), "plan.ionrc")
    with pytest.raises(ContactPlanError, match="found the commands of an ION contact plan"):
        parse_hdtn("# relay\na contact +0 +5 1 2 1\n", "plan.json")
