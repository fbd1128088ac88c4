"""Contact plans of ION: what is read, and what is refused."""

from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.link.profile.plans.contacts import Contact, ContactPlanError, Range
from farside.link.profile.plans.ion import parse_ion


def test_ion_rates_are_bytes_per_second() -> None:
    plan = parse_ion("a contact +10 +20 1 2 1000", "plan.ionrc")
    assert plan.contacts == (Contact(10.0, 20.0, 1, 2, 8000),)


def test_at_moves_the_zero_of_the_times_that_follow() -> None:
    plan = parse_ion(
        "a contact +0 +5 1 2 1\n@ +100\na contact +0 +5 1 2 1\n@ +50\na contact +1 +5 1 2 1", "plan"
    )
    assert [contact[:2] for contact in plan.contacts] == [(0, 5), (100, 105), (151, 155)]


def test_the_first_date_of_a_plan_is_time_zero() -> None:
    plan = parse_ion(
        "@ 2024/02/28-23:59:50\n"
        "a contact +0 2024/02/29-00:00:00 1 2 1\n"
        "a contact 2024/03/01-00:00:00 2024/03/01-00:00:01 1 2 1\n"
        "@ 2024/02/28-23:59:00\n"
        "a contact +0 +20 1 2 1\n",
        "plan",
    )
    assert [c[:2] for c in plan.contacts] == [(-50, -30), (0, 10), (86410, 86411)]
    assert plan.zero == datetime(2024, 2, 28, 23, 59, 50, tzinfo=UTC).timestamp()


def test_a_plan_without_dates_does_not_say_when_its_second_0_is() -> None:
    assert parse_ion("@ +9\na contact +0 +5 1 2 1", "plan").zero is None


def test_commands_that_plan_nothing_are_ignored() -> None:
    plan = parse_ion(
        "1 9 ''\ns\nm horizon +0\n# a contact +0 +5 1 2 1\n\n^ 1\ne 1\n"
        "a contact -1 -1 9 9 0\n"
        "a contact +0 0 1 2 0\n"
        "a contact +0 +5 1 2 1 0.5  # likely\r\n"
        "l contact\ni contact +0 1 2\n",
        "plan",
    )
    assert plan.contacts == (Contact(0, 5, 1, 2, 8),)


def test_a_contact_can_be_changed_and_deleted_before_it_begins() -> None:
    plan = parse_ion(
        "a contact +0 +5 1 2 1\na contact +10 +15 1 2 1\na contact +0 +5 2 1 1\n"
        "a range +0 +15 1 2 3\na range +20 +30 1 2 3\n"
        "c contact +10 1 2 7\nd contact +0 1 2\nd contact * 2 1\nd range +0 1 2\n",
        "plan",
    )
    assert plan.contacts == (Contact(10, 15, 1, 2, 56),)
    assert plan.ranges == (Range(20, 30, 1, 2, 3), Range(20, 30, 2, 1, 3))


def test_a_range_from_the_lower_number_holds_both_ways() -> None:
    plan = parse_ion("a contact +0 +5 1 2 1\na range +0 +5 1 2 324", "plan")
    assert plan.ranges == (Range(0, 5, 1, 2, 324), Range(0, 5, 2, 1, 324))


def test_a_range_from_the_higher_number_holds_one_way() -> None:
    plan = parse_ion("a contact +0 +5 1 2 1\na range +0 +5 2 1 324", "plan")
    assert plan.ranges == (Range(0, 5, 2, 1, 324),)


@pytest.mark.parametrize("order", [1, -1])
def test_an_explicit_opposite_range_replaces_the_implied_one(order: int) -> None:
    lines = ["a range +0 +5 1 2 324", "a range +0 +5 2 1 300"][::order]
    plan = parse_ion("\n".join(["a contact +0 +5 1 2 1", *lines]), "plan")
    assert plan.ranges == (Range(0, 5, 1, 2, 324), Range(0, 5, 2, 1, 300))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("b contact +0 +5 1 2 1", "expected a command of ION such as `a contact`, `a range` or"),
        ("a kontact +0 +5 1 2 1", "found a kontact"),
        ("a scheme ipn 'ipnfw' 'ipnadminep'", "found a scheme"),
        ("m horizont +0", "found m horizont"),
        ("c range +0 1 2 4", "expected `a range` or `d range`, found c range"),
        (
            "a contact +0 +5 1 2",
            (
                "expected `a contact start stop from to rate [confidence]`, "
                "found 4 words after `a contact`"
            ),
        ),
        ("a range +0 +5 1 2 3 4", "expected `a range start stop from to owlt`, found 6 words"),
        ("@ +5 +6", "expected `@ time`, found 2 words"),
        ("a contact +20 +15 1 2 1", "expected a stop after the start +20, found +15"),
        ("a contact +20 +20 1 2 1", "expected a stop after the start +20, found +20"),
        ("a contact +20 30 1 2 1", "found 30; did you mean +30?"),
        ("a contact +20 +3x 1 2 1", "expected a time in seconds such as +60, or a date as"),
        ("a contact +20 2024/02/30-00:00:00 1 2 1", "found 2024/02/30-00:00:00"),
        ("a contact +20 2024/02/20-00:00:00 1 2 1", "start the plan with an `@` and a date"),
        ("a contact +20 +30 one 2 1", "expected a node number, found one"),
        (
            "a contact +20 +30 1 2 0",
            "expected a whole number of bytes per second above 0, found 0",
        ),
        ("a contact +20 +30 1 2 -5", "bytes per second above 0, found -5"),
        ("a contact +20 +30 1 2 1Mbps", "bytes per second above 0, found 1Mbps"),
        ("a contact +20 +30 1 2 1 1.5", "expected a confidence above 0, 1 at most, found 1.5"),
        ("a range +20 +30 1 2 -1", "expected a light time in seconds, found -1"),
        (
            "a contact +9 +12 1 2 1",
            (
                "expected no contact from 1 to 2 that overlaps another, "
                "found 9 s to 12 s beside 0 s to 10 s"
            ),
        ),
        ("a contact +0 +99 1 2 1", "found 0 s to 99 s beside 0 s to 10 s"),
        ("a contact +8 +21 2 1 1", "found 8 s to 21 s beside 20 s to 30 s"),
        ("a range +4 +6 1 2 1", "expected no range from 1 to 2 that overlaps another"),
        ("d contact +1 1 2", "expected one from 1 to 2 that starts at 1 s, found none so far"),
        ("c contact +0 2 1 4", "expected one from 2 to 1 that starts at 0 s, found none so far"),
    ],
)
def test_an_invalid_line_of_ion_is_refused_with_its_number(line: str, words: str) -> None:
    before = "a contact +0 +10 1 2 1\na contact +20 +30 2 1 1\na range +0 +5 1 2 1"
    text = f"{before}\n{line}\na contact +10 +15 1 2 1\n"
    with pytest.raises(ContactPlanError) as refusal:
        parse_ion(text, "relay.ionrc")
    assert str(refusal.value).startswith("relay.ionrc, line 4: ")
    assert words in str(refusal.value)


@given(st.text(alphabet="acdm@+-# \n.:/0129*'contacrange", max_size=80))
def test_any_ion_text_is_a_plan_or_refused(text: str) -> None:
    try:
        plan = parse_ion(text, "plan")
    except ContactPlanError:
        return
    assert all(contact.begin_s < contact.end_s for contact in plan.contacts)
