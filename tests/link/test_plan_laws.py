"""What holds for every contact plan: it is read as told, or refused in words."""

import json
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Any

from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from farside.link.profile.plans.contacts import (
    Contact,
    ContactPlanError,
    Plan,
    Range,
    link_tables,
)
from farside.link.profile.plans.hdtn import parse_hdtn
from farside.link.profile.plans.ion import parse_ion

LONGEST_MESSAGE = 1000
HORIZON_S = 100

nodes = st.integers(1, 4)
moments = st.integers(0, 60)
spans = st.tuples(moments, st.integers(1, 20)).map(lambda span: (span[0], span[0] + span[1]))
told = st.tuples(spans, nodes, nodes, st.integers(1, 9))


def reading(entries: Sequence[tuple[tuple[int, int], int, int, int]]) -> list[tuple[int, ...]]:
    """The entries once each, if none of a pair overlaps another; flat and in order."""
    flat: list[tuple[int, ...]] = sorted({(*entry[0], *entry[1:]) for entry in entries})
    for one in flat:
        for other in flat:
            same = one is not other and one[2:4] == other[2:4]
            assume(not (same and one[0] < other[1] and other[0] < one[1]))
    return flat


ion_noise = st.sampled_from(
    ["", "# a contact +0 +5 1 2 1", "! 1", "s", "m horizon +0", "\tl contact\r", "1 7 ''", "e 1"]
)
"""Lines that ionadmin passes over."""


@settings(max_examples=40)
@given(
    st.lists(told, min_size=1, max_size=8),
    st.lists(told, max_size=4),
    st.lists(ion_noise, max_size=4),
    st.booleans(),
    st.randoms(use_true_random=False),
)
def test_a_plan_of_ion_is_read_as_it_is_told(
    contacts: Any, ranges: Any, noise: list[str], is_start_file: bool, random: Any
) -> None:
    """In any order, some of it twice, between other commands, in a start file or alone."""
    expected = [(b, e, s, d, 8 * r) for b, e, s, d, r in reading(contacts)]
    light_times = reading(ranges)
    lines = [f"a contact +{b} +{e} {s} {d} {r // 8}" for b, e, s, d, r in expected]
    lines += [f"a range +{b} +{e} {s} {d} {owlt}" for b, e, s, d, owlt in light_times]
    lines += [*noise, *random.sample(lines, len(lines) // 2)]
    random.shuffle(lines)
    if is_start_file:
        lines = ["## begin ionadmin", *lines, "## end ionadmin", "## begin bpadmin", "a scheme x"]
    plan = parse_ion("\n".join(lines), "plan")
    assert plan.problems == ()
    assert plan.contacts == tuple(Contact(*one) for one in expected)
    assert {Range(*one) for one in light_times} <= set(plan.ranges)


@settings(max_examples=40)
@given(st.lists(told, min_size=1, max_size=8), st.booleans(), st.randoms(use_true_random=False))
def test_a_plan_of_hdtn_is_read_as_it_is_told(entries: Any, has_owlt: bool, random: Any) -> None:
    """In any order, some of it twice, in numbers or strings."""
    expected = reading(entries)
    objects = []
    for begin, end, source, dest, value in expected + random.sample(expected, len(expected) // 2):
        keys = {"source": source, "dest": dest, "startTime": begin, "endTime": end}
        keys |= {"rateBitsPerSec": value} | ({"owlt": value} if has_owlt else {})
        objects.append({k: random.choice((v, str(v))) for k, v in keys.items()})
    random.shuffle(objects)
    plan = parse_hdtn(json.dumps({"contacts": objects}, indent=1), "plan")
    assert plan.problems == ()
    assert plan.contacts == tuple(Contact(*one) for one in expected)
    assert {one.owlt_s for one in plan.ranges} == (
        {one[-1] for one in expected} if has_owlt else {0}
    )


def refusal(of: Callable[[], object]) -> str:
    """The words in which a plan is refused; empty if it is not."""
    try:
        of()
    except ContactPlanError as error:
        return str(error)
    return ""


def is_in_words(text: str) -> bool:
    """Whether a message names a line and fits a terminal."""
    text.encode()
    return "line " in text and len(text) < LONGEST_MESSAGE and text.isprintable()


def expect_a_plan_or_words(parse: Callable[[str, str], Plan], text: str) -> None:
    """Expect that a text is refused in words, or gives each pair of nodes a link or words."""
    if words := refusal(lambda: parse(text, "plan")):
        assert is_in_words(words)
        return
    plan = parse(text, "plan")
    assert plan.zero is None or datetime.fromtimestamp(plan.zero, UTC)
    assert all(one.begin_s < one.end_s and one.rate_bit_s > 0 for one in plan.contacts)
    for problem in (*plan.problems, *plan.untimed):
        assert is_in_words(problem.text)
    for one, other in {(contact.source, contact.dest) for contact in plan.contacts}:
        about = [problem.text for problem in plan.problems if problem.is_about(one, other)]
        words = refusal(partial(link_tables, plan, one, other, HORIZON_S))
        assert words == next(iter(about), "")


times = st.sampled_from(
    (
        *("+0", "+5", "+9", "+-9", "+1.5", "5", "0", "-1", "*", "+010", "+0x1f", "+1e9", "+\u0663"),
        *("2031/01/05-00:00:00", "2031/01/05-00:00:09.5Z", "1970/01/01-00:00:00"),
        *("2038/01/19-03:14:07", "9999/12/31-24:00:00", "0000/00/00-99:99:99"),
    )
)
numbers = st.sampled_from(["1", "2", "7", "0", "-1", "010", "0x1f", "1e9", ".5", "ipn:1", "9" * 40])
words = st.sampled_from(
    (
        *(
            "a contact",
            "c contact",
            "d range",
            "@",
            "m",
            "q",
            "!",
            "#",
            "''",
            "\ud800",
            "\xa0",
            "\0",
        ),
        *("## begin ionadmin", "## end ionadmin", "## begin bpadmin", "x" * 500),
    )
)
ion_lines = (
    st.tuples(st.just("a contact"), times, times, numbers, numbers, numbers)
    | st.tuples(st.just("a range"), times, times, numbers, numbers, numbers)
    | st.tuples(st.sampled_from(["c contact", "d contact", "d range"]), times, numbers, numbers)
    | st.tuples(st.just("@"), times)
    | st.lists(words | times | numbers, max_size=6)
).map(" ".join)


@settings(max_examples=60)
@given(st.lists(ion_lines, max_size=8).map("\n".join) | st.text(max_size=99))
@example("a contact +" + "9" * 5000 + " +1 1 2 1")
@example("a contact " + " ".join("x" * 1000 for _ in range(50)))
@example("a range +0 +5 1 2 0." + "9" * 5000)
@example("a contact 9999/12/31-24:00:00 -1 1 2 1")
def test_whatever_text_is_a_plan_of_ion_or_refused_in_words(text: str) -> None:
    expect_a_plan_or_words(parse_ion, text)


values = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=80)
some = st.integers(-1, 9) | st.sampled_from(["1", "2", "1.5", " 3 ", "x", 1.5, 10**30, 1e300])
keys = st.sampled_from(
    ["source", "dest", "startTime", "endTime", "rateBitsPerSec", "rate", "owlt", "rateBps", "a"]
)
objects = st.dictionaries(keys, some | values, max_size=9) | st.fixed_dictionaries(
    {"source": some, "dest": some, "startTime": some, "endTime": some, "rate": some}
)
plans = st.dictionaries(
    st.sampled_from(["contacts", "name"]), st.lists(objects | values, max_size=5) | values
)


@settings(max_examples=60)
@given((plans | values).map(lambda plan: json.dumps(plan, indent=1)) | st.text(max_size=99))
@example('{"contacts": [' + "9" * 5000 + "]}")
@example('{"contacts": [{"source": ' + "9" * 5000 + "}]}")
@example('{"contacts": [{' + ",".join(f'"{n}": 1' for n in range(5000)) + "}]}")
@example('{"contacts": [{"source":1, "dest":2, "startTime":1e17, "endTime":2e17, "rate":1}]}')
@example('{"\ud800": [NaN]}')
@example('"' + "\\" * 9999)
@example("\n" * 100_000 + "a")
def test_whatever_text_is_a_plan_of_hdtn_or_refused_in_words(text: str) -> None:
    expect_a_plan_or_words(parse_hdtn, text)


def test_large_plans_take_no_longer_per_contact_than_small_ones() -> None:
    """Told backwards, changed, taken back and wrong; the square of this would take minutes."""
    numbers = range(4000)
    told = [f"a contact +{10 * n} +{10 * n + 5} 1 2 1" for n in numbers]
    wrong = [f"a contact +{10 * n + 1} +{10 * n + 6} 1 2 1" for n in numbers]
    ranges = [f"a range +{10 * n} +{10 * n + 15} 1 2 1" for n in numbers]
    changes = [f"c contact +{10 * n} 1 2 2\nd contact +{10 * n} 1 2" for n in numbers[1:]]
    plan = parse_ion("\n".join([*told[::-1], *wrong, *ranges, *changes]), "plan")
    assert plan.contacts == (Contact(0, 5, 1, 2, 8),)
    assert len(plan.problems) == len(numbers)
    assert plan.ranges[0] == Range(0, 40_005, 1, 2, 1)
