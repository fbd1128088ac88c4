"""The commands as the ground knew them, entry by entry, and the words for that."""

from typing import Any

import msgspec
import pytest
from noting import command_sent, said_of

from farside.control import CommandStage, Mode, TakeBackChance, Verdict
from farside.logs import LogEntry, Picture
from farside.logs.known import KnownCommands, command_text
from farside.messages import Drive, SetMode, When
from farside.node import to_ns
from farside.topics import HeldEntry, HeldFate

TAKEN, BEGUN, DONE = CommandStage.TAKEN, CommandStage.BEGUN, CommandStage.DONE
ON_TIME, LATE, OVERDUE, UNKNOWN = Verdict.ON_TIME, Verdict.LATE, Verdict.OVERDUE, Verdict.UNKNOWN
DUE_S = {TAKEN: 3.0, BEGUN: 3.0, DONE: 6.0}


class Desk:
    """What a ground says of its commands, as it says it."""

    def __init__(self) -> None:
        self.known = KnownCommands()

    def note(self, t_s: float, *messages: Any) -> "Desk":
        """Have the ground note messages."""
        for message in messages:
            self.known.apply(message, to_ns(t_s))
        return self

    def words(self, t_s: float, number: int = 1) -> str:
        """What is said of a command at a time."""
        (command,) = (one for one in self.known.foremost(100) if one.number == number)
        return " · ".join(command.words(to_ns(t_s)))


@pytest.fixture
def drive() -> Desk:
    """A drive given at 1 s, to begin at 3 s and to be done at 6 s."""
    return Desk().note(1, command_sent(1, Drive("E"), due_s=DUE_S))


def test_the_life_of_a_drive_from_its_begin_to_its_end(drive: Desk) -> None:
    assert drive.words(1.5) == "begins in 1.5 s · word within 8.5 s · take back: maybe too late"
    assert drive.words(3.5).startswith("begins about now · word within 6.5 s")

    drive.note(4, said_of(1, TAKEN, UNKNOWN), said_of(1, BEGUN, UNKNOWN))
    assert drive.words(4.2) == "should have begun 1.2 s ago · word within 5.8 s"

    drive.note(4.5, said_of(1, TAKEN, ON_TIME, so_s=3), said_of(1, BEGUN, ON_TIME, so_s=3.2))
    assert drive.words(5) == (
        "began 1.8 s ago, told 0.5 s ago, on time · done in 1.0 s · word within 8.0 s"
    )

    drive.note(7.5, said_of(1, DONE, ON_TIME, so_s=6.1))
    assert drive.words(8.1) == "done 2.0 s ago, told 0.6 s ago, on time"
    assert drive.known.open == {}


def test_how_long_a_command_can_still_be_taken_back(drive: Desk) -> None:
    drive.note(1, said_of(1, take_back=TakeBackChance.SURE, until_s=2.6))
    assert drive.words(1) == "begins in 2.0 s · take back: 1.6 s left · word within 9.0 s"

    drive.note(2.7, said_of(1, take_back=TakeBackChance.OPEN))
    assert drive.words(2.7).endswith("take back: maybe too late")

    drive.note(2.8, said_of(1, take_back=TakeBackChance.TOO_LATE))
    assert "take back" not in drive.words(2.8)


def test_what_is_overdue_says_so_first_with_what_is_missing(drive: Desk) -> None:
    drive.note(10, said_of(1, TAKEN, OVERDUE), said_of(1, BEGUN, OVERDUE))

    assert drive.words(12) == "overdue: should have begun 9.0 s ago, no word"
    assert drive.known.overdue == 1

    drive.note(13, said_of(1, TAKEN, LATE, so_s=5), said_of(1, BEGUN, LATE, so_s=5))
    assert drive.words(13).startswith("began 8.0 s ago, told 0.0 s ago, late")
    assert drive.known.overdue == 0


def test_a_begin_that_telemetry_tells_has_no_time_of_its_own(drive: Desk) -> None:
    drive.note(4.5, said_of(1, BEGUN, ON_TIME))

    assert drive.words(5).startswith("has begun, told 0.5 s ago, on time · done in 1.0 s")


def test_what_telemetry_calls_over_is_not_on_the_way_any_more(run: Any, drive: Desk) -> None:
    heard = LogEntry.of(run.hear(7, "at:D", since_s=6).records[-1]).message

    def telemetry(commands_done: int) -> msgspec.Struct:
        return msgspec.structs.replace(heard, commands_done=commands_done)

    drive.note(7, telemetry(0))
    assert drive.known.on_the_way == 1

    drive.note(7, telemetry(1))
    assert drive.known.on_the_way == 0
    assert drive.words(7.4) == "over, told 0.4 s ago, not yet how it ended"


def test_an_end_that_is_not_done_has_its_reason(drive: Desk) -> None:
    refused = said_of(1, CommandStage.REFUSED, ON_TIME, so_s=3.1, why="the battery is flat")

    drive.note(4.5, refused)

    assert drive.words(5.1) == "refused 2.0 s ago, told 0.6 s ago: the battery is flat"


def test_a_setting_takes_effect_and_does_not_begin() -> None:
    desk = Desk().note(1, command_sent(1, SetMode(Mode.SHARED), due_s={TAKEN: 3.0, DONE: 3.0}))
    assert desk.words(1) == "takes effect in 2.0 s · word within 9.0 s"

    desk.note(10, said_of(1, TAKEN, OVERDUE), said_of(1, DONE, OVERDUE))
    assert desk.words(10) == "overdue: should have taken effect 7.0 s ago, no word"

    desk.note(11, said_of(1, DONE, LATE, so_s=5))
    assert desk.words(11) == "took effect 6.0 s ago, told 0.0 s ago, late"


def test_what_waits_on_board_is_overdue_when_it_is_not_heard_to_have_arrived() -> None:
    waiting = command_sent(
        2, Drive("N"), when=When(after=1), due_s={TAKEN: 3.0, BEGUN: 60.0, DONE: 63.0}
    )
    desk = Desk().note(1, waiting).note(10, said_of(2, TAKEN, OVERDUE))

    assert command_text(desk.known.open[2]) == "drive N, after command 1"
    assert desk.words(10, 2) == "overdue: should have arrived 7.0 s ago, no word"


def test_a_command_of_an_old_log_has_no_dues_and_is_shown_all_the_same() -> None:
    assert Desk().note(1, command_sent(1, Drive("N"))).words(3) == "sent 2.0 s ago"


def test_what_is_held_stays_until_it_is_sent_or_given_up() -> None:
    one, two = (Drive("E"),), (Drive("E"), Drive("N"))
    desk = Desk().note(1, HeldEntry(1, one, HeldFate.HELD), HeldEntry(2, one, HeldFate.HELD))

    desk.note(2, HeldEntry(1, two, HeldFate.HELD))
    assert desk.known.held == {1: two, 2: one}

    desk.note(3, HeldEntry(1, two, HeldFate.RELEASED, (4, 5)))
    desk.note(4, HeldEntry(2, one, HeldFate.GIVEN_UP))
    assert desk.known.held == {}


def test_overdue_ones_come_before_the_newest_and_what_is_over_last() -> None:
    desk = Desk()
    for number in range(1, 7):
        desk.note(1, command_sent(number, Drive("E"), due_s=DUE_S))
    desk.note(7, said_of(6, DONE, ON_TIME, so_s=6), said_of(2, BEGUN, OVERDUE))

    def shown(most: int) -> list[int]:
        return [command.number for command in desk.known.foremost(most)]

    assert shown(1) == [2]
    assert shown(3) == [5, 4, 2]
    assert shown(9) == [6, 5, 4, 3, 2, 1]


def test_however_long_a_run_is_no_more_is_kept_than_a_screen_can_use() -> None:
    desk = Desk()
    for number in range(1, 3001):
        desk.note(number, command_sent(number, Drive("E"), due_s=DUE_S))
        desk.note(number, HeldEntry(number, (Drive("E"),), HeldFate.HELD))
        if number % 2:
            desk.note(number, said_of(number, DONE, ON_TIME, so_s=6))

    assert len(desk.known.open) == len(desk.known.held) == 1000
    assert [command.number for command in desk.known.ended] == list(range(2985, 3000, 2))


def lines(run: Any) -> list[str]:
    picture = Picture()
    for record in run.records:
        picture.apply(LogEntry.of(record))
    return [line.text for line in picture.lines if not line.routine]


def test_a_delay_is_told_once_and_so_is_the_word_that_ends_the_wait(run: Any) -> None:
    """Of three stages of one drive, which all are overdue, then known and late."""
    run.note(1, command_sent(1, Drive("E"), due_s=DUE_S))
    for t_s, stage in enumerate((TAKEN, BEGUN, DONE), 11):
        run.note(t_s, said_of(1, stage, UNKNOWN, due_s=4), said_of(1, stage, OVERDUE, due_s=4))
    run.note(20, said_of(1, TAKEN, ON_TIME, due_s=4, so_s=3.5))
    run.note(20, said_of(1, BEGUN, LATE, due_s=4, so_s=5))
    run.note(21, said_of(1, DONE, LATE, due_s=7, so_s=9))

    assert lines(run) == [
        "command 1 overdue: should have arrived by 4.0 s, no word",
        "command 1 arrived on time after all",
        "command 1 began late, 1.0 s after it was due",
        "command 1 done late, 2.0 s after it was due",
    ]


def test_what_comes_when_it_is_due_is_no_news(run: Any) -> None:
    run.note(1, command_sent(1, Drive("E"), due_s=DUE_S))
    for stage in (TAKEN, BEGUN, DONE):
        run.note(8, said_of(1, stage, UNKNOWN, due_s=4))
        run.note(9, said_of(1, stage, ON_TIME, due_s=4, so_s=3.5))

    assert lines(run) == []


def test_what_will_expire_before_its_turn_is_said_so_until_word_comes() -> None:
    dues = {TAKEN: 3.0, BEGUN: 60.0, DONE: 63.0}
    desk = Desk().note(0, command_sent(1, Drive("E"), expires_s=30.0, due_s=dues))

    assert desk.words(10).startswith("expires in 20.0 s, before its turn")
    assert desk.words(34).startswith("should have expired 4.0 s ago, before its turn")
    desk.note(35, said_of(1, CommandStage.EXPIRED, LATE, due_s=60, so_s=30.1, why="too late"))
    assert desk.words(36).startswith("expired 5.9 s ago")
