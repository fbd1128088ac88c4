"""The stick among the pages: one commands, and hands over explicitly."""
# ruff: noqa: ARG002 - seats ask for the time

from farside.console.stick.seat import NAME, StickSeat


class Table:
    """Seats at which the first to come commands, until it hands over."""

    def __init__(self, *pages: str) -> None:
        self.here = list(pages)
        self.holder: str | None = pages[0] if pages else None
        self.asks: str | None = None

    def open(self, page: str, now_s: float) -> None:
        self.here.append(page)
        self.holder = self.holder or page

    def close(self, page: str, now_s: float) -> None:
        self.here.remove(page)

    def holds(self, page: str) -> bool:
        return self.holder == page

    def ask(self, page: str, now_s: float) -> bool:
        self.asks = page
        return False

    def hand_over(self, page: str) -> bool:
        if self.holder != page or self.asks is None:
            return False
        self.holder, self.asks = self.asks, None
        return True


def test_a_stick_that_is_alone_commands() -> None:
    alone = StickSeat(None)

    assert alone.is_held()
    assert alone.take_or_give() == "this stick commands; nobody else can"
    assert (alone.news(), alone.leave()) == ("", "")


def test_a_stick_on_the_table_takes_command_from_nobody_until_it_is_used() -> None:
    table = Table()
    seat = StickSeat(table)

    assert not seat.news()
    assert table.holder is None
    assert seat.is_held()
    assert table.holder == NAME


def test_command_is_asked_for_and_handed_over_both_ways() -> None:
    table = Table("page")
    seat = StickSeat(table)

    assert not seat.is_held()
    assert seat.take_or_give() == "asked the page that commands to hand over"
    assert table.hand_over("page")
    assert seat.news() == "this stick commands now"
    assert seat.take_or_give() == "not handed over: no page asks"
    table.asks = "page"
    assert seat.news() == "a page asks to command; Start hands over"
    assert not seat.news()
    assert not seat.take_or_give()
    assert seat.news() == "a page commands now"
    assert not seat.is_held()


def test_a_stick_that_is_unplugged_takes_part_no_more() -> None:
    table = Table("page")
    seat = StickSeat(table)
    seat.is_held()
    seat.is_held()

    seat.leave()
    seat.leave()

    assert table.here == ["page"]
