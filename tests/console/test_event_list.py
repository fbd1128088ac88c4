"""The list of events: the words of the log, newest first, each with its two times."""

from ground_stories import told
from noting import command_sent, logged

from farside.console.events import EVENTS_KEPT, EventList
from farside.console.screen.screen import Tone
from farside.control import Failsafe, Mode, ModeCause
from farside.logs import LogEntry, Picture
from farside.messages import Drive, FailsafeChanged, GoalReached, ModeChanged, SetMode
from farside.node import to_ns, to_s
from farside.topics import ShadowEntry


class Taking(EventList):
    """A list beside the picture that says what is news."""

    def __init__(self) -> None:
        super().__init__()
        self.picture = Picture(as_ground=True)

    def hear(self, entry: LogEntry) -> None:
        self.take(entry, self.picture.apply(entry))


def test_what_happened_on_board_stands_with_the_time_it_was_so_and_the_time_it_was_learned() -> (
    None
):
    events = Taking()
    events.hear(told(985.5, 713.2, GoalReached(("at:B",))))
    events.hear(told(985.5, 630, FailsafeChanged(Failsafe.HOLD, "nothing is heard", to_ns(10))))

    failsafe, goal = events.rows()
    assert (goal.number, goal.text, goal.tone) == (1, "goal at:B reached", Tone.PLAIN)
    assert (to_s(goal.so_ns), to_s(goal.learned_ns)) == (713.2, 985.5)
    assert failsafe.text == "failsafe hold: nothing is heard, after 10.0 s of silence"
    assert failsafe.tone is Tone.WRONG


def test_a_drive_of_many_is_routine_and_an_order_of_who_drives_is_not() -> None:
    events = Taking()
    events.hear(logged(to_ns(1), command_sent(1, Drive("N"))))
    events.hear(logged(to_ns(2), command_sent(2, SetMode(Mode.SHARED))))

    assert [(row.text, row.routine) for row in events.rows()] == [
        ("command 2: mode shared", False),
        ("command 1: drive N", True),
    ]


def test_what_is_no_news_is_left_out() -> None:
    events = Taking()
    for t_s, in_step in ((1, True), (2, False), (3, False), (4, True)):
        why = None if in_step else "an update is missing"
        events.hear(logged(to_ns(t_s), ShadowEntry(1, 7, in_step, why, 4, 5, 1)))

    assert [row.text for row in events.rows()] == [
        "the shadow of the model is in step",
        "the shadow of the model is out of step: an update is missing",
    ]


def test_only_the_last_are_kept_and_their_numbers_stay() -> None:
    events = Taking()
    for number in range(EVENTS_KEPT + 5):
        events.hear(told(number, number, ModeChanged(Mode.GUIDED, ModeCause.OPERATOR)))

    numbers = [row.number for row in events.rows()]
    assert numbers == list(range(EVENTS_KEPT + 5, 5, -1))


def test_text_from_a_log_cannot_break_the_line() -> None:
    events = Taking()
    events.hear(told(1, 1, GoalReached(("at:B\x1b[31m\nfree lunch",))))
    assert events.rows()[0].text.isprintable()


def test_after_a_blackout_all_of_it_is_told_at_once_with_its_own_times(
    known: list[LogEntry],
) -> None:
    events = Taking()
    for entry in known:
        events.hear(entry)

    told_at_once = [row for row in events.rows() if to_s(row.learned_ns) == 985.52]
    assert [(f"{to_s(row.so_ns):.1f}", row.text) for row in told_at_once] == [
        ("985.5", "command 94: mode guided"),
        ("981.6", "the link is back after 361.7 s; meanwhile 44 moves, and reached at:B, at:C"),
        (
            "981.6",
            "failsafe hold: the link is back, and the operator has not yet said who drives",
        ),
        (
            "763.5",
            "failsafe hold: the link is lost, and no goal is left, after 143.5 s of silence",
        ),
        ("763.5", "goal at:C reached"),
        ("713.2", "goal at:B reached"),
        ("650.0", "mode autonomous: link lost"),
        ("650.0", "failsafe alone: the link is lost, after 30.0 s of silence"),
        ("630.0", "failsafe hold: nothing is heard, after 10.0 s of silence"),
        ("621.6", "command 93 done on time after all"),
    ]
    assert events.picture.mode is Mode.GUIDED
