"""The console in a terminal under a person's fingers: what it shows, and what its keys order."""

import re
from collections.abc import Callable
from typing import Any

import msgspec
from fake_station import FakeStation
from seats import Seat, seated
from textual.binding import Binding
from textual.widgets import Input

from farside.console.screen.screen import Screen
from farside.console.session import Session
from farside.console.station import Station
from farside.console.text.app import ConsoleApp
from farside.console.text.keys import help_rows
from farside.node import to_ns


class Stand(FakeStation):
    """A station whose screen a test may change, and which notes that the run was ended."""

    def __init__(self, **changes: Any) -> None:
        super().__init__()
        self.changes = changes
        self.ended = 0

    @property
    def asked(self) -> list[str]:
        return self.session.asked

    def screen(self) -> Screen:
        return msgspec.structs.replace(super().screen(), **self.changes)

    def change(self, **changes: Any) -> None:
        self.changes = changes
        self.version += 1

    def end(self) -> None:
        self.ended += 1


def sitting(station: Stand) -> Callable[[Callable[[], float]], ConsoleApp]:
    return lambda now: ConsoleApp(station, now=now)


def test_enter_approves_the_proposal_that_is_on_the_screen_and_backspace_vetoes_it() -> None:
    station = Stand()

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.wait(1)
        assert "▸ Proposal 14: E, towards B  ⏎ " in seat.text
        await seat.press("enter")
        assert (station.asked, seat.lines[-2].strip()) == (["approve 14"], "approve 14")
        await seat.press("backspace")
        assert station.asked == ["approve 14", "veto 14"]

    seated(sitting(station), does)


def test_a_proposal_that_has_only_just_come_is_not_answered() -> None:
    """A late Enter must never approve another proposal than the one that was read."""
    station = Stand()

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.wait(1)
        station.propose(15)
        await seat.wait(0.1)
        await seat.press("enter")
        assert "not approved: proposal 15 has only just come" in seat.text
        await seat.press("backspace")
        assert ("not vetoed: proposal 15" in seat.text, station.asked) == (True, [])
        await seat.wait(0.5)
        await seat.press("enter")
        assert station.asked == ["approve 15"]

    seated(sitting(station), does)


def test_a_proposal_that_came_behind_the_help_is_seen_only_when_that_is_closed() -> None:
    station = Stand()

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.press("question_mark")
        await seat.wait(2)
        await seat.press("enter", "up")
        assert station.asked == []
        await seat.press("escape", "enter")
        assert ("not approved: proposal 14" in seat.text, station.asked) == (True, [])

    seated(sitting(station), does)


def test_where_no_proposal_stands_or_none_can_be_shown_none_is_answered() -> None:
    station = Stand(proposal=None)

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.press("enter")
        assert "not approved: no proposal stands" in seat.text
        station.change()
        await seat.resize(60, 10)
        await seat.wait(1)
        await seat.press("enter")
        assert "40 columns by 11 rows show more" in seat.text
        assert "not approved: the terminal is too small to show it" in seat.text

    seated(sitting(station), does)
    assert station.asked == []


KEYS = [
    ("up", "choose N"), ("d", "choose E"), ("left", "choose W"), ("s", "choose S"),
    ("shift+down", "choose S insist"), ("D", "choose E insist"), ("escape", "discard 3"),
    ("space", "pause"), ("comma", "slower"), ("full_stop", "faster"), ("h", "heat True"),
    ("n", "warp until something arrives"), ("c", "warp until the next contact"),
    ("x", "acknowledge None"), ("h", "heat False"), ("e", "read"),
]  # fmt: skip


def test_every_key_orders_what_it_says_in_the_smallest_terminal_too() -> None:
    station = Stand()

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.press(*(key for key, _ in KEYS))

    seated(sitting(station), does, (40, 11))
    assert station.asked == [asked for _, asked in KEYS]


def test_esc_takes_back_the_newest_command_that_can_be() -> None:
    commands = tuple(row for row in FakeStation().screen().commands if row.held is None)
    newest = next(row.number for row in commands if row.can_take_back)
    station = Stand(commands=commands)

    async def does(seat: Seat[ConsoleApp]) -> None:
        assert re.search(rf"{newest} . drive .  \[Esc [0-9.]+ s left\]", seat.text)
        await seat.press("escape")

    seated(sitting(station), does)
    assert station.asked == ["take back None"]


def test_the_mode_is_asked_for_and_its_key_means_nothing_else() -> None:
    station = Stand()

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.press("m")
        assert "g guided  s shared  a alone" in seat.text
        await seat.press("z", "enter", "s")
        assert station.asked == ["mode shared"]
        await seat.press("m", "escape", "m", "h")
        assert station.asked == ["mode shared", "on loss hold"]

    seated(sitting(station), does, (40, 11))


def test_a_goal_is_typed_and_can_be_withdrawn() -> None:
    station = Stand()

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.press("g")
        assert "goal at A, B, C, D or 3,4?" in seat.text
        await seat.press("escape")
        await enter(seat, "A")
        await enter(seat, " 8, 2 5")
        await enter(seat, "-A")
        assert station.asked == ["goal A None", "goal 8,2 5.0", "withdraw at:A"]
        await enter(seat, "-Z")
        assert "not withdrawn: there is no goal Z" in seat.text
        await enter(seat, "B x")
        assert "expected a priority such as 2, found 'x'" in seat.text

    async def enter(seat: Seat[ConsoleApp], text: str) -> None:
        await seat.press("g")
        seat.app.query_one("#goal", Input).value = text
        await seat.press("enter")

    seated(sitting(station), does)


def test_esc_gives_up_the_goal_that_is_typed_and_takes_nothing_back() -> None:
    station = Stand()

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.press("g", "B", "escape")
        assert station.asked == []
        await seat.press("up")

    seated(sitting(station), does)
    assert station.asked == ["choose N"]


def test_leaving_asks_whether_the_run_goes_on() -> None:
    station = Stand()

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.press("q", "escape")
        assert (seat.app.is_running, station.ended) == (True, 0)
        await seat.press("q", "e")
        assert ("the run ends" in seat.text, station.ended) == (True, 1)
        station.change(over="The run is over: aborted.")
        await seat.wait(0.1)
        assert not seat.app.is_running

    seated(sitting(station), does)


def test_ctrl_c_ends_the_run_even_where_it_could_copy_and_the_second_one_leaves() -> None:
    station = Stand()

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.press("g", "B", "shift+home", "ctrl+c")
        assert (station.ended, seat.app.is_running) == (1, True)
        await seat.press("ctrl+c")
        assert (station.ended, seat.app.is_running) == (2, False)

    seated(sitting(station), does)


def test_a_run_that_is_over_stays_to_be_read_and_is_left_without_a_question() -> None:
    station = Stand(over="The run is over: success.")

    async def does(seat: Seat[ConsoleApp]) -> None:
        await seat.wait(5)
        assert ("■ over" in seat.text, "The run is over: success." in seat.text) == (True, True)
        await seat.press("q")
        assert (seat.app.is_running, station.ended) == (False, 0)

    seated(sitting(station), does)


def test_the_path_of_one_goal_after_the_other_is_looked_at() -> None:
    station = Stand()
    looked = []

    async def does(seat: Seat[ConsoleApp]) -> None:
        for _ in range(3):
            await seat.press("p")
            looked.append(station.session.looked_at)

    seated(sitting(station), does)
    assert looked == ["C", "B", "C"]


def test_the_help_tells_of_every_key_on_as_many_pages_as_it_needs() -> None:
    told = " ".join(row.plain for row in help_rows(200))
    names = {"comma": ",", "full_stop": ".", "question_mark": "?", "ctrl+c": "^C"}
    names |= {"escape": "Esc", "space": "Space", "enter": "Enter", "backspace": "Backspace"}
    entries = [one.key if isinstance(one, Binding) else one[0] for one in ConsoleApp.BINDINGS]
    own = [key for key in entries if len(key) == 1]
    for key in (*own, *names):
        assert f" {names.get(key, key)} " in f" {told} "

    async def does(seat: Seat[ConsoleApp]) -> None:
        read = ""
        while True:
            await seat.press("question_mark")
            if "If you do nothing" in seat.text:
                break
            read += seat.text
        assert all(row.plain.strip() in read for row in help_rows(40))

    seated(sitting(Stand()), does, (40, 20))


def test_before_the_first_word_of_a_real_session_the_screen_says_so() -> None:
    session = Session("blackout", to_ns(1200))

    async def does(seat: Seat[ConsoleApp]) -> None:
        assert ("The run begins." in seat.text, "no map yet" in seat.text) == (True, True)
        await seat.press("up")
        assert "not ordered: there is no action N yet" in seat.text
        await seat.press("space")
        assert "‖ paused" in seat.text
        await seat.press("space")
        assert "▶ 1x" in seat.text

    seated(lambda now: ConsoleApp(Station(session, end=lambda: None), now=now), does)
