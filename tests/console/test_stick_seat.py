"""The stick among the pages: one commands, and hands over explicitly."""

from farside.console.seats import Seats
from farside.console.stick.seat import NAME, StickSeat


def page_that_commands() -> Seats:
    seats = Seats()
    seats.open("page", 0.0)
    return seats


def test_a_stick_that_is_alone_commands() -> None:
    alone = StickSeat(None)

    assert alone.is_held()
    assert alone.take_or_give() == "this stick commands; nobody else can"
    assert (alone.news(), alone.leave()) == ("", "")


def test_a_stick_on_the_table_takes_command_from_nobody_until_it_is_used() -> None:
    seats = Seats()
    seat = StickSeat(seats)

    assert not seat.news()
    assert not seats.looking
    assert seat.is_held()
    assert seats.holds(NAME)


def test_command_is_asked_for_and_handed_over_both_ways() -> None:
    seats = page_that_commands()
    seat = StickSeat(seats)

    assert not seat.is_held()
    assert seat.take_or_give() == "asked the page that commands to hand over"
    assert seats.hand_over("page")
    assert seat.news() == "this stick commands now"
    assert seat.take_or_give() == "not handed over: no page asks"
    seats.ask("page", 0.0)
    assert seat.news() == "a page asks to command; Start hands over"
    assert not seat.news()
    assert not seat.take_or_give()
    assert seats.holds("page")
    assert seat.news() == "a page commands now"
    assert not seat.is_held()


def test_a_stick_that_is_unplugged_takes_part_no_more() -> None:
    seats = page_that_commands()
    seat = StickSeat(seats)
    seat.is_held()
    seat.is_held()

    seat.leave()
    seat.leave()

    assert seats.looking == 1
