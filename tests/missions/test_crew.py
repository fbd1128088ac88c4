"""The crew and its barrier, on toy nodes and without processes."""

from collections.abc import Callable, Sequence

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.missions.crew.barrier import Advance, Party, Sample, WindowReport
from farside.missions.crew.crew import CrewError, InProcessCrew, LostProcess
from farside.missions.crew.network import advance_key, report_key, subscriptions
from farside.node import Direction, Frame, Node, Record, Role, Step

WINDOWS = 4


class End:
    """Sends one frame per window, named after itself and the window, and records what arrived."""

    def __init__(self, name: str, direction: Direction) -> None:
        self.name, self.direction, self.count = name, direction, 0

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        frame = Frame(self.direction, self.count, until_ns, f"{self.name}{self.count}".encode())
        self.count += 1
        return Step([frame], [note(self.name, until_ns, arrivals)])


class Wire:
    """Delivers every frame, and records it."""

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


def contents(records: Sequence[Record]) -> list[tuple[str, bytes]]:
    return [(record.topic, record.payload) for record in records]


def test_the_link_takes_the_frames_that_both_ends_sent_in_the_window_the_rovers_first() -> None:
    assert contents(toy_crew().advance(10)) == [
        ("rover", b""),
        ("link", b"rover0 ground0"),
        ("ground", b""),
    ]


def test_frames_that_the_link_delivers_arrive_in_the_next_window() -> None:
    crew = toy_crew()
    crew.advance(10)
    assert contents(crew.advance(20)) == [
        ("rover", b"ground0"),
        ("link", b"rover1 ground1"),
        ("ground", b"rover0"),
    ]


def test_a_crew_in_one_process_loses_no_process() -> None:
    with toy_crew() as crew:
        assert crew.lost_processes == ()


def test_an_exception_in_a_node_propagates_from_a_crew_in_one_process() -> None:
    class Broken:
        def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
            raise ZeroDivisionError(until_ns, arrivals)

    nodes = toy_nodes() | {Role.LINK: Broken()}
    with pytest.raises(ZeroDivisionError):
        InProcessCrew(*nodes.values()).advance(10)


def test_a_lost_process_reads_as_a_sentence_that_ends_in_its_last_words() -> None:
    lost = LostProcess(Role.ROVER, 2_500_000_000, "was ended by SIGKILL", "")
    assert str(CrewError(lost)) == (
        "the rover process was ended by SIGKILL at 2.5 s of simulated time"
    )
    wordy = msgspec.structs.replace(lost, last_words="Traceback\nValueError: 3")
    assert str(wordy).endswith("simulated time; its last words:\nTraceback\nValueError: 3")


class Table:
    """Launcher, three parties and the samples under way between them."""

    def __init__(self) -> None:
        self.parties = {role: Party(role, node) for role, node in toy_nodes().items()}
        self.under_way: list[Sample] = []
        self.reports: dict[Role, WindowReport] = {}

    def advance(self, advance: Advance) -> None:
        self.reports = {}
        self.under_way += [(advance_key(role), msgspec.msgpack.encode(advance)) for role in Role]

    def deliver(self, pick: Callable[[int], int]) -> None:
        """Deliver all samples, and those sent in response; `pick` chooses the next of a number."""
        while self.under_way:
            self._arrive(self.under_way.pop(pick(len(self.under_way))))

    def _arrive(self, sample: Sample) -> None:
        key, payload = sample
        for role, party in self.parties.items():
            if key in subscriptions(role):
                self.under_way += party.take(sample)
            elif key == report_key(role):
                assert role not in self.reports
                self.reports[role] = msgspec.msgpack.decode(payload, type=WindowReport)

    def records(self) -> list[Record]:
        return [record for role in Role for record in self.reports[role].records]


def oldest_first(_: int) -> int:
    return 0


@given(st.data())
def test_parties_match_plain_calls_however_samples_overtake_each_other(
    data: st.DataObject,
) -> None:
    table, crew = Table(), toy_crew()
    for window in range(WINDOWS):
        table.advance(Advance(window, window * 10))
        table.deliver(lambda count: data.draw(st.integers(0, count - 1)))
        assert table.records() == crew.advance(window * 10)


def test_the_first_report_of_a_party_is_for_the_first_window() -> None:
    key, payload = Party(Role.GROUND, End("ground", Direction.UP)).report([])
    assert key == "farside/ground/report"
    assert msgspec.msgpack.decode(payload, type=WindowReport) == WindowReport(0, [])


def test_the_link_does_not_report_while_an_end_is_missing() -> None:
    table = Table()
    del table.parties[Role.GROUND]
    table.advance(Advance(0, 10))
    table.deliver(oldest_first)
    assert table.reports.keys() == {Role.ROVER}


def test_the_link_waiting_for_an_end_goes_on_once_that_end_is_absent() -> None:
    table = Table()
    del table.parties[Role.GROUND]
    table.advance(Advance(0, 10))
    table.deliver(oldest_first)
    table.advance(Advance(0, 10, absent=(Role.GROUND,)))
    table.deliver(oldest_first)
    assert contents(table.reports[Role.LINK].records) == [("link", b"rover0")]


def test_the_ends_go_on_without_the_link_and_receive_nothing() -> None:
    table = Table()
    table.advance(Advance(0, 10))
    table.deliver(oldest_first)
    del table.parties[Role.LINK]
    for window in (1, 2):
        table.advance(Advance(window, 10 + window, absent=(Role.LINK,)))
        table.deliver(oldest_first)
    assert contents(table.reports[Role.ROVER].records) == [("rover", b"")]
    assert contents(table.reports[Role.GROUND].records) == [("ground", b"")]


def test_frames_of_an_absent_role_that_arrived_in_time_still_count() -> None:
    table = Table()
    table.advance(Advance(0, 10))
    table.deliver(oldest_first)
    del table.parties[Role.LINK]
    table.advance(Advance(1, 20, absent=(Role.LINK,)))
    table.deliver(oldest_first)
    assert contents(table.reports[Role.ROVER].records) == [("rover", b"ground0")]


def test_a_party_refuses_a_payload_of_the_wrong_type() -> None:
    party = Party(Role.ROVER, End("rover", Direction.DOWN))
    with pytest.raises(msgspec.DecodeError):
        party.take((advance_key(Role.ROVER), b"nonsense"))
