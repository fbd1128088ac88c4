"""The crew and its barrier, with toy nodes and without processes."""

from collections.abc import Callable, Sequence

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.missions.crew.barrier import Advance, Party, Said, WindowReport
from farside.missions.crew.crew import CrewError, InProcessCrew, LostRole
from farside.missions.crew.network import advance_key, heard_by, report_key
from farside.node import Direction, Frame, Node, Record, Role, Step

WINDOWS = 4


class End:
    """Sends a frame a window, named after itself and the window, and records what arrived."""

    def __init__(self, name: str, direction: Direction) -> None:
        self.name, self.direction, self.count = name, direction, 0

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        frame = Frame(self.direction, self.count, until_ns, f"{self.name}{self.count}".encode())
        self.count += 1
        return Step([frame], [note(self.name, until_ns, arrivals)])


class Wire:
    """Passes everything on, and records it."""

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        return Step(list(arrivals), [note("link", until_ns, arrivals)])


def note(who: str, time_ns: int, arrivals: Sequence[Frame]) -> Record:
    return Record(who, time_ns, time_ns, b" ".join(frame.payload for frame in arrivals))


def toy_nodes() -> dict[Role, Node]:
    return {
        Role.ROVER: End("rover", Direction.DOWN),
        Role.LINK: Wire(),
        Role.GROUND: End("ground", Direction.UP),
    }


def toy_crew() -> InProcessCrew:
    return InProcessCrew(*toy_nodes().values())


def told(records: Sequence[Record]) -> list[tuple[str, bytes]]:
    return [(record.topic, record.payload) for record in records]


def test_a_window_lets_the_link_take_what_both_ends_sent_in_it_the_rovers_frames_first() -> None:
    assert told(toy_crew().advance(10)) == [
        ("rover", b""),
        ("link", b"rover0 ground0"),
        ("ground", b""),
    ]


def test_what_the_link_gives_out_reaches_the_other_end_in_the_next_window() -> None:
    crew = toy_crew()
    crew.advance(10)
    assert told(crew.advance(20)) == [
        ("rover", b"ground0"),
        ("link", b"rover1 ground1"),
        ("ground", b"rover0"),
    ]


def test_a_crew_in_one_process_loses_nobody() -> None:
    with toy_crew() as crew:
        assert crew.losses == ()


def test_an_exception_in_a_node_passes_through_a_crew_in_one_process() -> None:
    class Broken:
        def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
            raise ZeroDivisionError(until_ns, arrivals)

    nodes = toy_nodes() | {Role.LINK: Broken()}
    with pytest.raises(ZeroDivisionError):
        InProcessCrew(*nodes.values()).advance(10)


def test_a_loss_reads_as_a_sentence_that_ends_in_the_last_words() -> None:
    loss = LostRole(Role.ROVER, 2_500_000_000, "was ended by SIGKILL", "")
    assert str(CrewError(loss)) == (
        "the rover process was ended by SIGKILL at 2.5 s of simulated time"
    )
    wordy = msgspec.structs.replace(loss, last_words="Traceback\nValueError: 3")
    assert str(wordy).endswith("simulated time; its last words:\nTraceback\nValueError: 3")


class Table:
    """Launcher, three parties and the messages on their way between them."""

    def __init__(self) -> None:
        self.parties = {role: Party(role, node) for role, node in toy_nodes().items()}
        self.on_the_way: list[Said] = []
        self.reports: dict[Role, WindowReport] = {}

    def order(self, order: Advance) -> None:
        self.reports = {}
        self.on_the_way += [(advance_key(role), msgspec.msgpack.encode(order)) for role in Role]

    def deliver(self, pick: Callable[[int], int]) -> None:
        """Deliver all messages, and what is said upon them; `pick` one of so many as the next."""
        while self.on_the_way:
            self._arrive(self.on_the_way.pop(pick(len(self.on_the_way))))

    def _arrive(self, said: Said) -> None:
        key, payload = said
        for role, party in self.parties.items():
            if key in heard_by(role):
                self.on_the_way += party.hear(said)
            elif key == report_key(role):
                assert role not in self.reports
                self.reports[role] = msgspec.msgpack.decode(payload, type=WindowReport)

    def records(self) -> list[Record]:
        return [record for role in Role for record in self.reports[role].records]


def oldest_first(_: int) -> int:
    return 0


@given(st.data())
def test_parties_keep_step_with_plain_calls_however_messages_overtake_each_other(
    data: st.DataObject,
) -> None:
    table, crew = Table(), toy_crew()
    for window in range(WINDOWS):
        table.order(Advance(window, window * 10))
        table.deliver(lambda count: data.draw(st.integers(0, count - 1)))
        assert table.records() == crew.advance(window * 10)


def test_a_party_says_first_that_it_is_ready_for_the_first_window() -> None:
    key, payload = Party(Role.GROUND, End("ground", Direction.UP)).report([])
    assert key == "farside/ground/report"
    assert msgspec.msgpack.decode(payload, type=WindowReport) == WindowReport(0, [])


def test_nobody_is_ready_for_the_next_window_while_an_end_is_missing() -> None:
    table = Table()
    del table.parties[Role.GROUND]
    table.order(Advance(0, 10))
    table.deliver(oldest_first)
    assert table.reports.keys() == {Role.ROVER}


def test_the_link_waiting_for_an_end_goes_on_when_told_that_it_is_absent() -> None:
    table = Table()
    del table.parties[Role.GROUND]
    table.order(Advance(0, 10))
    table.deliver(oldest_first)
    table.order(Advance(0, 10, absent=(Role.GROUND,)))
    table.deliver(oldest_first)
    assert told(table.reports[Role.LINK].records) == [("link", b"rover0")]


def test_the_ends_live_on_without_the_link_and_hear_nothing() -> None:
    table = Table()
    table.order(Advance(0, 10))
    table.deliver(oldest_first)
    del table.parties[Role.LINK]
    for window in (1, 2):
        table.order(Advance(window, 10 + window, absent=(Role.LINK,)))
        table.deliver(oldest_first)
    assert told(table.reports[Role.ROVER].records) == [("rover", b"")]
    assert told(table.reports[Role.GROUND].records) == [("ground", b"")]


def test_frames_that_arrived_from_an_absent_role_in_time_still_count() -> None:
    table = Table()
    table.order(Advance(0, 10))
    table.deliver(oldest_first)
    del table.parties[Role.LINK]
    table.order(Advance(1, 20, absent=(Role.LINK,)))
    table.deliver(oldest_first)
    assert told(table.reports[Role.ROVER].records) == [("rover", b"ground0")]


def test_a_party_refuses_a_message_that_makes_no_sense() -> None:
    party = Party(Role.ROVER, End("rover", Direction.DOWN))
    with pytest.raises(msgspec.DecodeError):
        party.hear((advance_key(Role.ROVER), b"nonsense"))
