"""Contact plans of ION: what is read, and what is refused."""

from datetime import UTC, datetime

import pytest

from farside.link.profile.plans.contacts import (
    Contact,
    ContactPlanError,
    Plan,
    Range,
    link_tables,
)
from farside.link.profile.plans.ion import parse_ion

ONE_WAY = "a contact +0 +5 1 2 1\n"


def contacts_of(text: str) -> list[tuple[float, float, int]]:
    """When the contacts of a plan begin and end, and their rates in bit/s."""
    plan = parse_ion(text, "plan")
    assert plan.problems == ()
    return [(one.begin_s, one.end_s, one.rate_bit_s) for one in plan.contacts]


def refusal_of(text: str, ground: int = 1, rover: int = 2) -> str:
    """Why a plan cannot be used for two nodes."""
    with pytest.raises(ContactPlanError) as refusal:
        link_tables(parse_ion(text, "relay.ionrc"), ground, rover, duration_s=100)
    return str(refusal.value).removeprefix("relay.ionrc, ")


def test_ion_rates_are_bytes_per_second() -> None:
    assert contacts_of("a contact +10 +20 1 2 1000") == [(10, 20, 8000)]


def test_at_moves_the_zero_of_the_times_that_follow() -> None:
    plan = parse_ion(
        "a contact +0 +5 1 2 1\n@ +100\na contact +0 +5 1 2 1\n@ +50\na contact +1 +5 1 2 1", "plan"
    )
    assert [contact[:2] for contact in plan.contacts] == [(0, 5), (100, 105), (151, 155)]


def test_at_0_moves_the_zero_back_to_the_start_of_ionadmin() -> None:
    assert contacts_of("@ +100\n@ 0\na contact +1 +5 1 2 1") == [(1, 5, 8)]


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


def test_times_may_have_fractions_signs_and_midnights() -> None:
    plan = parse_ion(
        "a contact 2031/01/05-23:59:59.25 2031/01/05-24:00:00.000 1 2 1\n"
        "a contact 2031/01/06-00:00:01.1Z 2031/01/06-0:0:2.7 1 2 1\n",
        "plan",
    )
    assert plan.zero == datetime(2031, 1, 5, 23, 59, 59, 250_000, tzinfo=UTC).timestamp()
    assert [one[:2] for one in plan.contacts] == [(0, 0.75), (1.85, 3.45)]
    text = "@ +60\na contact +-10.5 +0x10 1 2 +1.5"
    assert parse_ion(text, "plan").contacts == (Contact(49.5, 76, 1, 2, 12),)


def test_a_contact_whose_stop_is_minus_1_lasts_until_the_last_date_of_ion() -> None:
    assert contacts_of("@ 2038/01/19-03:14:00\na contact +2 -1 1 2 1") == [(2, 7, 8)]


def test_commands_that_plan_nothing_are_passed_over() -> None:
    assert contacts_of(
        "1 9 ''\ns\nm horizon +0\n# a contact +0 +5 1 2 1\n\n^ 1\ne 1\n! 1\nr 'ltpadmin x.rc'\n"
        "\t  # indented\n? \nh\nv\nx\nm prod 1\nm in 20 -1\nb contact\nb range\nl\nl range\n"
        "a contact +0 +5 1 2 1 0.5  # likely\r\n"
        "l contact\ni contact +0 1 2\n"
    ) == [(0, 5, 8)]


@pytest.mark.parametrize("last", ["q", "t p 8"])
def test_after_the_command_that_ends_ionadmin_nothing_is_read(last: str) -> None:
    assert contacts_of(f"{ONE_WAY}{last}\na contact +9 +12 1 2 1\nnothing of ionadmin's") == [
        (0, 5, 8)
    ]


@pytest.mark.parametrize(
    "line",
    [
        "a contact -1 -1 1 1 0",
        "a contact +0 0 1 2 0",
        "a contact 0 +9 1 2 100",
        "a contact 1970/01/01-00:00:00 2038/01/19-03:14:07 1 2 0 0.000000",
        "a contact 2038/01/19-03:14:07 2038/01/19-03:14:07 1 1 0 1.000000",
    ],
)
def test_contacts_without_times_are_passed_over(line: str) -> None:
    """They register a node or are hypothetical; the last two are written by `b contact`."""
    plan = parse_ion(f"{line}\n@ 2031/01/05-00:00:00\n{ONE_WAY}", "plan")
    assert plan.contacts == (Contact(0, 5, 1, 2, 8),)
    assert plan.zero == datetime(2031, 1, 5, tzinfo=UTC).timestamp()


def test_of_nodes_with_hypothetical_contacts_only_that_is_told() -> None:
    text = f"{ONE_WAY}a contact 0 +60 1 3 100\n"
    assert refusal_of(text, 1, 3).startswith(
        "line 2: expected a contact with times such as +0 and +60, found 0 and +60"
    )
    assert refusal_of("a contact -1 -1 7 7 0").startswith("line 1: expected a contact with times")


# --- sections of a start file

SECTIONS = """\
some words of the author
## begin ionadmin {tag}
1 7 ''
a contact +0 +5 7 9 1200
@ +90
## end ionadmin {tag}
a contact +0 +5 1 2 1200
##  begin ltpadmin
a span 9 32 32 1400 10000 1 'udplso 10.1.1.9:1113'
w 1
## end ltpadmin
## begin ionadmin second
a contact +5 +10 7 9 1200
"""


@pytest.mark.parametrize("tag", ["", "host7"])
def test_of_a_start_file_the_sections_of_ionadmin_are_read(tag: str) -> None:
    text = SECTIONS.format(tag=tag)
    assert contacts_of(text) == contacts_of(text.replace("\n", "\r\n"))
    assert contacts_of(text) == [(0, 5, 9600), (5, 10, 9600)]


def test_lines_of_a_section_have_the_numbers_of_the_file() -> None:
    text = SECTIONS.format(tag="").replace("+10 7 9", "+1 7 9")
    assert refusal_of(text, 7, 9) == "line 13: expected a stop after the start +5, found +1"
    assert refusal_of(text.replace("@ +90", "zap")).startswith("line 5: expected a command of ION")


def test_a_start_file_without_a_section_of_ionadmin_is_refused() -> None:
    assert refusal_of("\n## begin bpadmin\na contact +0 +5 1 2 1\n## end bpadmin") == (
        "line 2: expected a section `## begin ionadmin`, found one of bpadmin first, and none of "
        "ionadmin"
    )


@pytest.mark.parametrize("line", ["## begin of the plan", "# begin ltpadmin", "## end ionadmin"])
def test_other_comments_begin_no_section(line: str) -> None:
    assert contacts_of(f"{line}\n{ONE_WAY}") == [(0, 5, 8)]


# --- told twice, changed, taken back


def test_what_is_told_twice_counts_once() -> None:
    plan = parse_ion(2 * (ONE_WAY + "a range +0 +5 1 2 2\na range +3 +9 1 2 2\n"), "plan")
    assert plan == Plan(
        (Contact(0, 5, 1, 2, 8),), (Range(0, 9, 1, 2, 2), Range(0, 9, 2, 1, 2)), None
    )


def test_ranges_that_agree_become_one_however_they_overlap() -> None:
    lines = ["a range +0 +9 1 2 2", "a range +20 +30 1 2 2", "a range +8 +21 1 2 2"]
    for order in (lines, lines[::-1], [lines[1], lines[2], lines[0]]):
        plan = parse_ion("\n".join([ONE_WAY, *order, "a range +3 +4 1 2 2"]), "plan")
        assert plan.ranges == (Range(0, 30, 1, 2, 2), Range(0, 30, 2, 1, 2))


def test_a_contact_can_be_changed_and_deleted_before_it_begins() -> None:
    plan = parse_ion(
        "a contact +0 +5 1 2 1\na contact +10 +15 1 2 1\na contact +0 +5 2 1 1\n"
        "a range +0 +15 1 2 3\na range +20 +30 1 2 3\n"
        "c contact +10 1 2 7\nd contact +0 1 2\nd contact * 2 1\nd contact * 8 9\nd range +0 1 2\n"
        "d contact -1 1 1\nd contact 0 1 2\n",
        "plan",
    )
    assert plan.contacts == (Contact(10, 15, 1, 2, 56),)
    assert plan.ranges == (Range(20, 30, 1, 2, 3), Range(20, 30, 2, 1, 3))


# --- ranges


def test_a_range_from_the_lower_number_holds_both_ways() -> None:
    plan = parse_ion("a contact +0 +5 1 2 1\na range +0 +5 1 2 324", "plan")
    assert plan.ranges == (Range(0, 5, 1, 2, 324), Range(0, 5, 2, 1, 324))


def test_a_range_from_the_higher_number_holds_one_way() -> None:
    plan = parse_ion("a contact +0 +5 1 2 1\na range +0 +5 2 1 324.25", "plan")
    assert plan.ranges == (Range(0, 5, 2, 1, 324.25),)


@pytest.mark.parametrize("order", [1, -1])
def test_an_explicit_opposite_range_replaces_the_implied_one(order: int) -> None:
    lines = ["a range +0 +5 1 2 324", "a range +0 +5 2 1 300"][::order]
    plan = parse_ion("\n".join(["a contact +0 +5 1 2 1", *lines]), "plan")
    assert plan.ranges == (Range(0, 5, 1, 2, 324), Range(0, 5, 2, 1, 300))


# --- refusals


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("frobnicate 7", "expected a command of ION such as `a contact`, `a range` or `@`, found"),
        ("b contact +0 +5 1 2 1", "expected a command of ION such as `a contact`, `a range` or"),
        ("range +0 +5 1 2 1", "found range +0"),
        ("A contact +0 +5 1 2 1", "found A contact"),
        ("; a contact", "found ; a"),
        ("a kontact +0 +5 1 2 1", "found a kontact"),
        ("a scheme ipn 'ipnfw' 'ipnadminep'", "found a scheme"),
        ("m horizont +0", "found m horizont"),
        ("l kontact", "found l kontact"),
        ("c range +0 1 2 4", "found c range"),
        ("@ +5 +6", "expected `@ time`, found 2 words"),
        ("@ 5", "found 5; did you mean +5?"),
        ("x" * 10_000, "found " + "x" * 60 + "…"),
    ],
)
def test_a_line_that_is_no_command_is_refused_with_its_number(line: str, words: str) -> None:
    with pytest.raises(ContactPlanError) as refusal:
        parse_ion(f"\n\n\n{line}\n{ONE_WAY}", "relay.ionrc")
    assert str(refusal.value).startswith("relay.ionrc, line 4: ")
    assert words in str(refusal.value)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (
            "a contact +0 +5 1 2",
            (
                "expected `a contact start stop from to rate [confidence]`, "
                "found 4 words after `a contact`"
            ),
        ),
        ("a range +0 +5 1 2 3 4", "expected `a range start stop from to owlt`, found 6 words"),
        ("a contact +20 +15 1 2 1", "expected a stop after the start +20, found +15"),
        ("a contact +20 +20 1 2 1", "expected a stop after the start +20, found +20"),
        ("a contact +20 30 1 2 1", "found 30; did you mean +30?"),
        ("a contact +20 +3x 1 2 1", "expected a time in seconds such as +60, found 3x"),
        ("a contact +20 2024/02/30-00:00:00 1 2 1", "found 2024/02/30-00:00:00"),
        ("a contact +20 2024/02/20-00:00:00 1 2 1", "start the plan with an `@` and a date"),
        ("a contact +20 +30 one 2 1", "expected a node number above 0, found one"),
        ("a contact +20 +30 ipn:1 2 1", "expected a node number above 0, found ipn:1"),
        ("a contact +20 +30 1 2 0", "expected a number of bytes per second above 0, found 0"),
        ("a contact +20 +30 1 2 -5", "bytes per second above 0, found -5"),
        ("a contact +20 +30 1 2 1Mbps", "bytes per second above 0, found 1Mbps"),
        ("a contact +20 +30 1 2 1e6", "bytes per second above 0, found 1e6"),
        ("a contact +20 +30 1 2 1 1.5", "expected a confidence of 0 to 1, found 1.5"),
        ("a contact +020 +30 1 2 1", "found 020, which ionadmin reads as octal"),
        ("a range +20 +30 1 2 -1", "expected a light time in seconds, found -1"),
        (
            "a contact +9 +12 1 2 1",
            (
                "expected no contact from 1 to 2 that overlaps another, "
                "found 9 s to 12 s beside 0 s to 10 s"
            ),
        ),
        ("a contact +0 +10 1 2 2", "found 0 s to 10 s beside 0 s to 10 s"),
        ("a contact +0 +99 1 2 1", "found 0 s to 99 s beside 0 s to 10 s"),
        ("a contact +8 +21 2 1 1", "found 8 s to 21 s beside 20 s to 30 s"),
        ("a range +4 +6 1 2 2", "expected no range from 1 to 2 that overlaps another"),
        ("d contact +1 1 2", "expected one from 1 to 2 that starts at 1 s, found none so far"),
        ("c contact +0 2 1 4", "expected one from 2 to 1 that starts at 0 s, found none so far"),
    ],
)
def test_an_invalid_line_refuses_its_own_nodes_with_its_number(line: str, words: str) -> None:
    before = "a contact +0 +10 1 2 1\na contact +20 +30 2 1 1\na range +0 +5 1 2 1"
    text = f"{before}\n{line}\na contact +10 +15 1 2 1\na contact +0 +5 7 9 1\n"
    why = refusal_of(text)
    assert why.startswith("line 4: ")
    assert words in why
    link_tables(parse_ion(text, "plan"), 7, 9, duration_s=100)


def test_a_line_that_leaves_open_whose_it_is_refuses_all() -> None:
    text = f"{ONE_WAY}a contact +9 +12 1 x 1\na contact +0 +5 3 4 1\n"
    assert refusal_of(text) == "line 2: expected a node number above 0, found x"
    link_tables(parse_ion(text, "plan"), 3, 4, duration_s=100)
    assert refusal_of(f"{text}a contact 3 4 1 1\n", 3, 4).startswith("line 4: expected `a contact")


def test_relative_times_after_at_0_do_not_fit_a_plan_with_dates() -> None:
    text = "@ 2031/01/05-00:00:00\na contact +0 +5 1 2 1\n@ 0\na contact +9 +12 1 2 1"
    assert refusal_of(text).startswith("line 4: expected a date, as before, found a time, +9")
