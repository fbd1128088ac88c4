"""Who has the stick, of the pages that look."""

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from farside.console.seats import GONE_S, Seats

PAGES = st.sampled_from(["a", "b", "c"])


def opened(*pages: str) -> Seats:
    seats = Seats()
    for page in pages:
        seats.open(page, 0.0)
    return seats


def test_the_first_page_gets_the_stick_and_the_second_only_looks() -> None:
    seats = opened("first", "second")

    assert seats.holds("first")
    assert not seats.holds("second")


def test_the_holder_hands_over_to_who_asks() -> None:
    seats = opened("first", "second")
    assert not seats.hand_over("first")

    assert not seats.ask("second", 1.0)
    assert seats.holds("first")
    assert not seats.hand_over("second")
    assert seats.hand_over("first")

    assert seats.holds("second")
    assert seats.asks is None


def test_a_reload_keeps_the_stick() -> None:
    """The new page of a reload may come before the old one is known to be gone, or after."""
    seats = opened("first", "second")
    seats.open("first", 1.0)
    seats.close("first", 1.1)
    assert seats.holds("first")

    seats.close("first", 2.0)
    assert not seats.ask("second", 2.0 + GONE_S - 0.1)
    seats.open("first", 2.0 + GONE_S - 0.1)
    assert not seats.ask("second", 2.0 + 2 * GONE_S)
    assert seats.holds("first")


def test_of_a_page_that_is_gone_for_long_whoever_asks_or_comes_gets_the_stick() -> None:
    seats = opened("first", "second")
    seats.close("first", 5.0)
    assert seats.ask("second", 5.0 + GONE_S)
    assert seats.holds("second")

    seats.close("second", 20.0)
    seats.open("third", 20.0 + GONE_S)
    assert seats.holds("third")


def test_who_is_not_here_gets_nothing() -> None:
    seats = opened("first", "second")
    assert not seats.ask("stranger", 1.0)
    seats.ask("second", 1.0)
    seats.close("second", 2.0)

    assert not seats.hand_over("first")
    assert seats.holds("first")


class SeatsMachine(RuleBasedStateMachine):
    """Pages come, go, ask and hand over, in any order."""

    def __init__(self) -> None:
        super().__init__()
        self.seats, self.now_s = Seats(), 0.0
        self.open: list[str] = []
        self.holder: str | None = None

    @rule(page=PAGES)
    def comes(self, page: str) -> None:
        here = self.holder in self.open
        self.seats.open(page, self.now_s)
        assert not here or self.seats.holds(self.holder)
        self.open.append(page)

    @rule(page=PAGES)
    def goes(self, page: str) -> None:
        self.seats.close(page, self.now_s)
        if page in self.open:
            self.open.remove(page)

    @rule(page=PAGES)
    def asks(self, page: str) -> None:
        here = self.holder in self.open
        has = self.seats.ask(page, self.now_s)
        assert has == self.seats.holds(page)
        assert not here or self.seats.holds(self.holder), "it is taken from nobody who is here"

    @rule(page=PAGES)
    def hands_over(self, page: str) -> None:
        held = self.seats.holds(page)
        if self.seats.hand_over(page):
            assert held

    @rule(seconds=st.floats(0.0, 2 * GONE_S))
    def time_passes(self, seconds: float) -> None:
        self.now_s += seconds

    @invariant()
    def there_are_never_two_holders(self) -> None:
        holders = [page for page in "abc" if self.seats.holds(page)]
        assert len(holders) <= 1
        assert holders or not self.open
        new = holders[0] if holders else None
        if self.holder not in {None, new}:
            assert new in self.open, "the stick is never given to a page that is gone"
        self.holder = new


SeatsMachine.TestCase.settings = settings(max_examples=40, stateful_step_count=25)
TestSeats = SeatsMachine.TestCase
