"""The crew and its barrier, on toy nodes and without processes."""

import re
from collections.abc import Callable, Sequence

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from farside.ground.view.view import FailsafeOutlook, Focus, GroundView, Way
from farside.missions.crew.barrier import (
    Advance,
    Complaint,
    Frames,
    Look,
    Party,
    Sample,
    WindowReport,
)
from farside.missions.crew.barrier import Seen as Answer
from farside.missions.crew.checks import ConductError, check_records
from farside.missions.crew.crew import CrewError, InProcessCrew, LostProcess
from farside.missions.crew.network import advance_key, in_key, out_key, report_key, subscriptions
from farside.node import Direction, Frame, Node, Record, Role, Step

WINDOWS = 4


class End:
    """Sends one frame per window, named after itself and the window, and records what arrived."""

    def __init__(self, name: str, direction: Direction) -> None:
        self.name, self.direction, self.count = name, direction, 0

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        payload = f"{self.name}{self.count}".encode()
        frame = Frame(self.direction, self.count, until_ns - 1, payload)
        self.count += 1
        return Step([frame], [note(self.name, until_ns, arrivals)])


class Wire:
    """Delivers every frame, and records it."""

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        delivered = [msgspec.structs.replace(frame, time_ns=until_ns) for frame in arrivals]
        return Step(delivered, [note("link", until_ns, arrivals)])


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


class Broken:
    """Raises in its second window."""

    def __init__(self, node: Node) -> None:
        self.node, self.count = node, 0

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        self.count += 1
        if self.count == 2:
            raise ZeroDivisionError("no such thing")
        return self.node.advance(until_ns, arrivals)


def broken_crew(role: Role) -> InProcessCrew:
    nodes = toy_nodes()
    return InProcessCrew(*(nodes | {role: Broken(nodes[role])}).values())


@pytest.mark.parametrize("role", [Role.LINK, Role.GROUND])
def test_a_crew_in_one_process_goes_on_without_a_node_that_raised(role: Role) -> None:
    crew = broken_crew(role)
    for until_ns in (10, 20, 30):
        records = crew.advance(until_ns)
    [lost] = crew.lost_processes
    assert role not in {record.topic for record in records}
    assert str(lost) == (
        f"the {role} node failed at 1e-08 s of simulated time: ZeroDivisionError: no such thing"
    )
    assert lost.last_words.startswith("Traceback")


class Seen:
    """A node that can be looked at until it has a fault."""

    def __init__(self, node: Node, view: GroundView) -> None:
        self.node, self.view, self.faulty = node, view, False

    def advance(self, until_ns: int, arrivals: Sequence[Frame]) -> Step:
        return self.node.advance(until_ns, arrivals)

    def look(self, focus: Focus) -> GroundView:
        if self.faulty:
            raise ZeroDivisionError(str(focus))
        return self.view


def a_view(now_ns: int) -> GroundView:
    way = Way(light_ns=1, is_open=True, changes_ns=None, used=0.0, queued_until_ns=now_ns)
    failsafe = FailsafeOutlook(None, 10.0, 30.0)
    return GroundView(now_ns, way, way, 0, 0, failsafe, "the rover stands")


def test_a_ground_that_fails_while_it_is_looked_at_is_lost_and_the_run_goes_on() -> None:
    nodes = toy_nodes()
    ground = Seen(nodes[Role.GROUND], a_view(10))
    crew = InProcessCrew(*(nodes | {Role.GROUND: ground}).values())
    crew.advance(10)
    assert crew.look(Focus()) == a_view(10)
    ground.faulty = True
    assert crew.look(Focus()) is None
    [lost] = crew.lost_processes
    assert str(lost).startswith("the ground node failed at 1e-08 s of simulated time: ZeroDivision")
    assert {record.topic for record in crew.advance(20)} == {"rover", "link"}
    assert crew.look(Focus()) is None


def test_a_ground_that_cannot_be_looked_at_is_not_lost_by_it() -> None:
    crew = toy_crew()
    assert crew.look(Focus()) is None
    assert crew.lost_processes == ()
    party = Party(Role.GROUND, toy_nodes()[Role.GROUND])
    [(key, payload)] = party.take(
        (advance_key(Role.GROUND), msgspec.msgpack.encode(Look(3, Focus(heat=True))))
    )
    assert (key, payload) == (
        report_key(Role.GROUND),
        msgspec.msgpack.encode(Answer(3, None)),
    )


def test_a_rover_that_raises_ends_the_run() -> None:
    crew = broken_crew(Role.ROVER)
    crew.advance(10)
    with pytest.raises(CrewError, match=r"the rover node failed .* no such thing") as caught:
        crew.advance(20)
    assert isinstance(caught.value.__cause__, ZeroDivisionError)


def test_a_lost_process_reads_as_one_line_that_ends_in_its_last_one() -> None:
    lost = LostProcess(Role.ROVER, 2_500_000_000, "was ended by SIGKILL", "")
    sentence = "the rover process was ended by SIGKILL at 2.5 s of simulated time"
    assert str(CrewError(lost)) == sentence
    wordy = msgspec.structs.replace(lost, last_words="Traceback\nValueError: 3")
    assert str(wordy) == f"{sentence}: ValueError: 3"


def test_last_words_cannot_steer_the_terminal_or_fill_it() -> None:
    lost = LostProcess(Role.ROVER, 0, "failed", "\x1b[2J" + "a" * 10_000)
    assert str(lost).startswith(r"the rover process failed at 0 s of simulated time: \x1b[2Jaaa")
    assert len(str(lost)) < 400


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
        table.advance(Advance(window, (window + 1) * 10))
        table.deliver(lambda count: data.draw(st.integers(0, count - 1)))
        assert table.records() == crew.advance((window + 1) * 10)


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


def test_a_party_refuses_nonsense_from_the_launcher() -> None:
    party = Party(Role.ROVER, End("rover", Direction.DOWN))
    with pytest.raises(msgspec.DecodeError):
        party.take((advance_key(Role.ROVER), b"nonsense"))


def frames(window: int, *frames: Frame) -> bytes:
    return msgspec.msgpack.encode(Frames(window, list(frames)))


def down(time_ns: int, direction: Direction = Direction.DOWN) -> Frame:
    return Frame(direction, 0, time_ns, b"")


WRONG = {
    "not msgpack": (b"\xc1", "cannot be decoded"),
    "another type": (msgspec.msgpack.encode({"window": 1}), "cannot be decoded"),
    "an endless array": (b"\x92\x01\xdd\xff\xff\xff\xff", "cannot be decoded"),
    "a deep array": (b"\x92\x01" + b"\x91" * 1_000_000, "cannot be decoded"),
    "the past": (frames(0), "window 0 in window 1"),
    "the future": (frames(2), "window 2 in window 1"),
    "a frame of the past": (frames(1, down(9)), "outside the window"),
    "a frame of the future": (frames(1, down(20)), "outside the window"),
    "the wrong direction": (frames(1, down(15, Direction.UP)), "in direction up"),
}


@pytest.mark.parametrize(("payload", "words"), WRONG.values(), ids=WRONG)
def test_wrong_frames_are_complained_about_and_their_sender_is_done_without(
    payload: bytes, words: str
) -> None:
    party = Party(Role.LINK, Wire())
    party.take((advance_key(Role.LINK), msgspec.msgpack.encode(Advance(0, 10))))
    for end in (Role.ROVER, Role.GROUND):
        party.take((out_key(end), frames(0)))
    party.take((advance_key(Role.LINK), msgspec.msgpack.encode(Advance(1, 20))))

    [(key, said)] = party.take((out_key(Role.ROVER), payload))
    complaint = msgspec.msgpack.decode(said, type=Complaint)
    assert (key, complaint.about) == (report_key(Role.LINK), Role.ROVER)
    assert words in complaint.what

    assert party.take((out_key(Role.ROVER), frames(1, down(15)))) == [], "ignored from now on"
    assert party.take((out_key(Role.GROUND), frames(1))) == []
    absent = Advance(1, 20, absent=(Role.ROVER,))
    *_, (_, said) = party.take((advance_key(Role.LINK), msgspec.msgpack.encode(absent)))
    assert contents(msgspec.msgpack.decode(said, type=WindowReport).records) == [("link", b"")]


def test_frames_sent_twice_are_not_replaced() -> None:
    party = Party(Role.LINK, Wire())
    party.take((advance_key(Role.LINK), msgspec.msgpack.encode(Advance(0, 10))))
    assert party.take((out_key(Role.ROVER), frames(0, down(5)))) == []
    [(_, said)] = party.take((out_key(Role.ROVER), frames(0)))
    assert "twice" in msgspec.msgpack.decode(said, type=Complaint).what


def test_a_link_that_delivers_into_the_past_is_complained_about() -> None:
    party = Party(Role.GROUND, End("ground", Direction.UP))
    party.take((advance_key(Role.GROUND), msgspec.msgpack.encode(Advance(0, 10))))
    party.take((advance_key(Role.GROUND), msgspec.msgpack.encode(Advance(1, 20))))
    on_time = party.take((in_key(Role.GROUND), frames(1, down(9))))
    assert in_key(Role.GROUND) not in dict(on_time), "sent in the window before: no delay, no past"
    party.take((advance_key(Role.GROUND), msgspec.msgpack.encode(Advance(2, 30))))
    [(_, said)] = party.take((in_key(Role.GROUND), frames(2, down(9))))
    assert msgspec.msgpack.decode(said, type=Complaint).about is Role.LINK


@pytest.mark.parametrize(
    ("payload", "words"),
    [
        (b"\xc1", "cannot be decoded"),
        (frames(0), "window 0 in window 1"),
        (frames(2), "window 2 in window 1"),
        (frames(1, down(15)), "in direction down"),
    ],
)
def test_the_link_is_complained_about_by_an_end(payload: bytes, words: str) -> None:
    party = Party(Role.ROVER, End("rover", Direction.DOWN))
    for window in range(2):
        advance = Advance(window, 10 * window + 10)
        party.take((advance_key(Role.ROVER), msgspec.msgpack.encode(advance)))

    [(key, said)] = party.take((in_key(Role.ROVER), payload))
    complaint = msgspec.msgpack.decode(said, type=Complaint)
    assert (key, complaint.about) == (report_key(Role.ROVER), Role.LINK)
    assert words in complaint.what


def record(topic: str, time_ns: int, payload: bytes, publish_time_ns: int = 0) -> Record:
    return Record(topic, time_ns, publish_time_ns, payload)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        (record("/no/such", 15, b"{}"), "'/no/such', which is not one of its topics"),
        (record("/truth/pose", 15, b"{}"), "not one of its topics"),
        (record("/ground/silence", 9, b"{}"), "outside the window"),
        (record("/ground/silence", 20, b"{}"), "outside the window"),
        (record("/ground/silence", 15, b"{}", -1), "publish time of -1 ns"),
        (record("/ground/silence", 15, b"{}", 1 << 63), "publish time"),
        (record("/ground/silence", 15, b"[]"), "cannot be decoded"),
        (record("/ground/silence", 15, b"\xff"), "cannot be decoded"),
        (record("/ground/silence", 15, b"[" * 1_000_000), "cannot be decoded"),
    ],
)
def test_wrong_records_are_refused(wrong: Record, words: str) -> None:
    with pytest.raises(ConductError, match=re.escape(words)):
        check_records([wrong], Role.GROUND, 10, 20)
