"""Contact plans without direct contacts: taken by way of other nodes, or refused in words."""

from pathlib import Path
from typing import Any

import pytest
from channels import DOWN, UP

from farside.link.emulator import Emulator
from farside.link.profile.layers import LinkConfigError
from farside.link.profile.profile import load_profile
from farside.link.profile.schedule import Schedule
from farside.node import NEVER_NS, to_ns

RELAY = """
a range +0 +900 1 3 1
a range +0 +400 3 6 300
a range +400 +900 3 6 310
a range +0 +900 6 8 1
a contact +0 +900 1 3 10000
a contact +0 +900 3 1 10000
a contact +100 +200 3 6 1000
a contact +300 +500 6 3 1000
a contact +0 +60 8 6 1000
a contact +500 +600 6 8 1000
"""
PROFILE = '[contacts]\nfile = "relay.ionrc"\nground = 1\nrover = 8\n'


def profile(folder: Path, text: str = PROFILE, plan: str = RELAY) -> Path:
    (folder / "relay.ionrc").write_text(plan)
    (folder / "relay.toml").write_text(text)
    return folder / "relay.toml"


def refusal(folder: Path, text: str, plan: str = RELAY) -> str:
    with pytest.raises(LinkConfigError) as refused:
        load_profile(profile(folder, text, plan), 60.0)
    return str(refused.value)


def test_a_pair_without_direct_contacts_goes_by_way_of_the_others(tmp_path: Path) -> None:
    link = load_profile(profile(tmp_path), 60.0)
    assert link.routing is not None
    assert link.contacts is None
    assert link.lookahead_ns == to_ns(1 + 300 + 1)
    schedule = Schedule(link)
    assert schedule.opens_ns(DOWN, 0) == 0
    assert schedule.closes_ns(DOWN, 0) == to_ns(60)
    assert schedule.opens_ns(DOWN, to_ns(60)) >= NEVER_NS
    # The station sees the orbiter at 300 s; with 1 kB sent over twice, and light time.
    work_s = 1024 / 1000 + 1024 / 10_000
    assert schedule.delay_ns(DOWN, 0) == pytest.approx(to_ns(300 + 300 + 1 + work_s), abs=1000)
    assert schedule.opens_ns(UP, 0) == 0
    # Until the first word can be there, nothing is missing; then all of the minute is.
    assert not schedule.is_heard(DOWN, to_ns(500))
    assert schedule.unheard_ns(DOWN, 0, to_ns(500)) == 0
    assert schedule.unheard_ns(DOWN, 0, to_ns(610)) == pytest.approx(to_ns(8), rel=0.1)


def test_a_contact_whose_light_time_changes_counts_as_two(tmp_path: Path) -> None:
    link = load_profile(profile(tmp_path), 60.0)
    assert link.routing is not None
    hops = [hop for hop in link.routing.hops if (hop.sender, hop.receiver) == (6, 3)]
    assert [(hop.begin_s, hop.end_s, hop.owlt_s) for hop in hops] == [
        (300.0, 400.0, 300.0),
        (400.0, 500.0, 310.0),
    ]


def test_where_one_direction_has_no_way_it_is_always_out(tmp_path: Path) -> None:
    only_down = "\n".join(line for line in RELAY.splitlines() if "+100 +200 3 6" not in line)
    schedule = Schedule(load_profile(profile(tmp_path, plan=only_down), 60.0))
    assert schedule.opens_ns(UP, 0) >= NEVER_NS
    assert schedule.opens_ns(DOWN, 0) == 0


def test_mistakes_count_on_the_way_and_nowhere_else(tmp_path: Path) -> None:
    elsewhere = f"{RELAY}a contact +0 +5 20 21 10\na contact +1 +6 20 21 99\n"
    load_profile(profile(tmp_path, plan=elsewhere), 60.0)
    on_the_way = f"{RELAY}a contact +320 +550 6 3 5\n"
    assert "line 12" in refusal(tmp_path, PROFILE, on_the_way)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            PROFILE.replace("rover = 8", "rover = 9"),
            "by way of other nodes, found from 1 ways to 3, 6, 8 only and from 9 none",
        ),
        (
            f"{PROFILE}[up]\ndelay_s = 1.0\n",
            "up.delay_s: expected none, since the link goes",
        ),
        (f"{PROFILE}[down]\nrate_bit_s = 9\n", "down.rate_bit_s: expected the rate from contacts"),
        (f"{PROFILE}[[changes]]\nat_s = 5.0\nrate_bit_s = 9\n", "changes: expected neither rate"),
        (
            f"{PROFILE.replace('rover = 8', 'rover = 3')}store_byte = 9\n",
            "contacts.store_byte: expected none, since the two have direct contacts",
        ),
        (
            "[routing]\nground = 1\nrover = 1\nhops = []\n",
            "routing: expected two nodes, found 1 for rover and ground",
        ),
    ],
)
def test_what_does_not_go_with_it_is_refused(tmp_path: Path, text: str, words: str) -> None:
    assert words in refusal(tmp_path, text)


def test_contacts_in_the_profile_itself_are_checked(tmp_path: Path) -> None:
    def hop(**other: Any) -> str:
        values = {
            "begin_s": 0.0,
            "end_s": 9.0,
            "sender": 1,
            "receiver": 8,
            "rate_bit_s": 800,
            "owlt_s": 1.0,
        } | other
        return "{" + ", ".join(f"{key} = {value}" for key, value in values.items()) + "}"

    def routing(*hops: str) -> str:
        return f"[routing]\nground = 1\nrover = 8\nhops = [{', '.join(hops)}]\n"

    assert load_profile(profile(tmp_path, routing(hop())), 60.0).up.delay_table
    assert "overlap" in refusal(tmp_path, routing(hop(), hop(begin_s=5.0, end_s=12.0)))
    assert "begin_s = 9 and end_s = 9" in refusal(tmp_path, routing(hop(begin_s=9.0)))
    assert "found 8 twice" in refusal(tmp_path, routing(hop(sender=8)))


def test_the_emulator_wakes_in_time_counts_and_warns_of_full_stores(tmp_path: Path) -> None:
    """As `farside link` runs it: by its own alarm, nothing comes late."""
    text = PROFILE + "store_byte = 1500\n"
    emulator: Emulator[int] = Emulator(load_profile(profile(tmp_path, text), 60.0))
    for number in range(3):
        emulator.send(DOWN, to_ns(10.0 + 5 * number), b"x" * 600, number)
    now_ns, arrived = to_ns(21.0), []
    while (next_ns := emulator.next_ns) is not None:
        now_ns = max(now_ns + 1, next_ns)
        for at_ns, _, _, cargo in emulator.advance(now_ns + 1):
            assert now_ns <= at_ns + 1
            arrived.append((round(at_ns / 1e9, 2), cargo))
    assert arrived == [(601.66, 0), (602.26, 1)]
    down = emulator.state().down.counters
    assert (down.received, down.delivered, down.store_full) == (3, 2, 1)
    (warning,) = emulator.take_warnings()
    assert "600 bytes was dropped" in warning
    assert "contacts.store_byte" in warning
    emulator.send(DOWN, now_ns, b"x", 3)
    emulator.advance(now_ns + to_ns(1.0))
    state = emulator.state().down
    assert state.counters.no_route == 1
    assert state.outage is not None
    assert state.outage.reason == "contact"
    assert emulator.control(b'{"down": {"loss": 0.5}}').down.settings.loss == 0.5
    with pytest.raises(LinkConfigError, match=r"down.delay_s: expected none"):
        emulator.control(b'{"down": {"delay_s": 1}}')
