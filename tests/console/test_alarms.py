"""Alarms: few, each with its cause, and each stays until the person acknowledges it."""

import pytest
from ground_stories import seen, told, way
from noting import logged, said_of

from farside.console.alarms import ACKNOWLEDGED_KEPT, SHADOW_PATIENCE_NS, Alarms
from farside.console.screen.screen import Tone
from farside.control import BatteryState, CommandStage, Failsafe, Mode, ModeCause, Signal, Verdict
from farside.logs import LogEntry
from farside.messages import (
    BatteryChanged,
    CommandReached,
    CommandsMissing,
    FailsafeChanged,
    Happening,
    ModeChanged,
    StuckChanged,
)
from farside.node import to_ns, to_s
from farside.topics import BeliefEntry, Known, LearnedBy, LifeEntry, ShadowEntry, Silence

OVERDUE, ON_TIME = Verdict.OVERDUE, Verdict.ON_TIME
DONE, REFUSED = CommandStage.DONE, CommandStage.REFUSED


class Watch:
    """A person who watches the alarms."""

    def __init__(self) -> None:
        self.alarms = Alarms()

    def hears(self, *entries: LogEntry) -> None:
        for entry in entries:
            self.alarms.take(entry)

    def is_told(self, *happenings: Happening, t_s: float = 12.0, so_s: float = 10.0) -> None:
        self.hears(*(told(t_s, so_s, what) for what in happenings))

    @property
    def texts(self) -> list[str]:
        return [row.text for row in self.alarms.rows() if not row.acknowledged]


@pytest.fixture
def watch() -> Watch:
    return Watch()


def in_step(t_s: float, *, why: str | None = None) -> LogEntry:
    return logged(to_ns(t_s), ShadowEntry(3, 7, why is None, why, 4, 5, 1))


def overdue(number: int, t_s: float) -> LogEntry:
    return logged(to_ns(t_s), said_of(number, DONE, OVERDUE, due_s=t_s - 5))


def signal(t_s: float, value: Signal) -> LogEntry:
    known = Known(value, to_ns(t_s - 2), to_ns(t_s), LearnedBy.TELEMETRY)
    return logged(to_ns(t_s), BeliefEntry((), signal=known))


TROUBLES: list[tuple[Happening, str]] = [
    (FailsafeChanged(Failsafe.SAFE, "the rover is stuck", 0), "failsafe safe: the rover is stuck"),
    (ModeChanged(Mode.AUTONOMOUS, ModeCause.LINK_LOST), "mode autonomous: link lost"),
    (CommandReached(4, REFUSED, "a wall"), "command 4 refused: a wall"),
    (CommandReached(4, CommandStage.FAILED, "blocked"), "command 4 failed: blocked"),
    (CommandReached(4, CommandStage.EXPIRED, "too late"), "command 4 expired: too late"),
    (CommandReached(4, CommandStage.SUPERSEDED, "by 5"), "command 4 superseded: by 5"),
    (
        CommandsMissing(missing=True, last=9),
        "commands up to 9 do not arrive, though the ground is heard",
    ),
    (BatteryChanged(BatteryState.LOW, 0.2), "battery low, 20%"),
    (BatteryChanged(BatteryState.FLAT, 0.0), "battery flat: the rover cannot move"),
    (StuckChanged(stuck=True, moves=4), "stuck: the last 4 moves were blocked"),
]


@pytest.mark.parametrize(("what", "text"), TROUBLES)
def test_trouble_on_board_raises_an_alarm_in_the_words_of_the_log(
    watch: Watch, what: Happening, text: str
) -> None:
    watch.is_told(what, t_s=12, so_s=10)

    (row,) = watch.alarms.rows()
    assert row.text == text
    assert (to_s(row.so_ns), to_s(row.learned_ns)) == (10, 12)


@pytest.mark.parametrize(
    "what",
    [
        FailsafeChanged(Failsafe.NOMINAL, "the link is up", 0),
        ModeChanged(Mode.SHARED, ModeCause.OPERATOR),
        CommandReached(4, CommandStage.WITHDRAWN, "taken back"),
        CommandReached(4, DONE),
        CommandsMissing(missing=False, last=9),
        BatteryChanged(BatteryState.CHARGING, 0.3),
        StuckChanged(stuck=False, moves=0),
    ],
)
def test_what_is_in_order_or_was_ordered_raises_none(watch: Watch, what: Happening) -> None:
    watch.is_told(what)
    assert not watch.alarms.rows()


def test_the_same_again_is_one_alarm_with_a_count_and_the_latest_text(watch: Watch) -> None:
    for number, t_s in ((4, 10.0), (6, 20.0)):
        why = f"it was meant for at:3,{number}, and the rover is at at:D"
        watch.is_told(CommandReached(number, REFUSED, why), t_s=t_s, so_s=t_s)
    watch.is_told(CommandReached(7, REFUSED, "a wall"))

    wall, meant = watch.alarms.rows()
    assert (wall.count, meant.count) == (1, 2)
    assert meant.text == "command 6 refused: it was meant for at:3,6, and the rover is at at:D"
    assert to_s(meant.so_ns) == 20
    assert watch.alarms.raised == 3


def test_once_acknowledged_the_same_again_is_a_new_alarm(watch: Watch) -> None:
    watch.is_told(CommandReached(4, REFUSED, "a wall"))
    assert watch.alarms.acknowledge(1) == 1
    assert watch.alarms.acknowledge(1) == 0
    assert watch.alarms.left == 0
    watch.is_told(CommandReached(5, REFUSED, "a wall"))

    rows = watch.alarms.rows()
    assert [(row.number, row.count, row.acknowledged) for row in rows] == [
        (2, 1, False),
        (1, 1, True),
    ]


def test_those_not_acknowledged_come_first_and_the_newest_of_them(watch: Watch) -> None:
    watch.is_told(*(what for what, _ in TROUBLES[:4]))
    watch.alarms.acknowledge(4)
    assert watch.alarms.left == 3

    assert [row.number for row in watch.alarms.rows()] == [3, 2, 1, 4]


def test_only_the_last_acknowledged_are_kept_but_all_that_are_not(watch: Watch) -> None:
    kept = ACKNOWLEDGED_KEPT
    reasons = ["a wall" + "!" * extra for extra in range(2 * kept)]
    watch.is_told(*(CommandReached(1, REFUSED, why) for why in reasons))
    assert len(watch.texts) == 2 * kept

    assert watch.alarms.acknowledge() == 2 * kept
    assert [row.number for row in watch.alarms.rows()] == list(range(2 * kept, kept, -1))


def test_silence_that_nobody_planned_is_an_alarm_and_says_when_it_is_over(watch: Watch) -> None:
    watch.hears(logged(to_ns(100), Silence(silent=False, expected=True)))
    watch.alarms.see(seen(195, silent_since_s=192))
    assert not watch.texts

    watch.hears(logged(to_ns(200), Silence(silent=True)))
    watch.alarms.see(seen(200))
    watch.alarms.see(seen(200, silent_since_s=192))
    (row,) = watch.alarms.rows()
    assert (row.text, row.tone) == ("hears nothing from the rover", Tone.WRONG)
    assert (to_s(row.so_ns), to_s(row.learned_ns)) == (192, 200)

    watch.hears(logged(to_ns(300), Silence(silent=False)))
    (row,) = watch.alarms.rows()
    assert row.text == "hears nothing from the rover; over since 0:05:00.0"
    assert row.tone is Tone.CAUTION


def test_silence_again_before_the_alarm_is_acknowledged_counts_and_is_not_over(
    watch: Watch,
) -> None:
    for t_s, silent in ((10, True), (20, False), (30, True)):
        watch.hears(logged(to_ns(t_s), Silence(silent=silent)))

    (row,) = watch.alarms.rows()
    assert (row.text, row.count) == ("hears nothing from the rover", 2)


@pytest.mark.parametrize(
    ("trouble", "end"),
    [
        (
            ModeChanged(Mode.AUTONOMOUS, ModeCause.LINK_LOST),
            ModeChanged(Mode.GUIDED, ModeCause.TAKEN_OVER),
        ),
        (
            FailsafeChanged(Failsafe.HOLD, "nothing is heard", 0),
            FailsafeChanged(Failsafe.NOMINAL, "the link is up", 0),
        ),
        (CommandsMissing(missing=True, last=9), CommandsMissing(missing=False, last=9)),
        (BatteryChanged(BatteryState.LOW, 0.2), BatteryChanged(BatteryState.CHARGING, 0.2)),
        (StuckChanged(stuck=True, moves=4), StuckChanged(stuck=False, moves=0)),
    ],
)
def test_what_is_over_by_itself_stays_and_says_so_even_if_acknowledged(
    watch: Watch, trouble: Happening, end: Happening
) -> None:
    watch.is_told(trouble, t_s=12, so_s=10)
    watch.alarms.acknowledge()
    watch.is_told(trouble, t_s=22, so_s=20)
    watch.is_told(end, t_s=32, so_s=30)

    assert [row.text.partition("; ")[2] for row in watch.alarms.rows()] == [
        "over since 0:00:30.0",
        "over since 0:00:30.0",
    ]


def test_a_battery_that_goes_flat_is_still_low(watch: Watch) -> None:
    watch.is_told(BatteryChanged(BatteryState.LOW, 0.2), BatteryChanged(BatteryState.FLAT, 0.0))
    assert watch.texts == ["battery flat: the rover cannot move", "battery low, 20%"]


def test_the_failsafe_asks_for_the_operators_word_when_it_waits_for_it(watch: Watch) -> None:
    why = "the link is back, and the operator has not yet said who drives"
    watch.is_told(
        FailsafeChanged(Failsafe.ALONE, "the link is lost", to_ns(30)),
        FailsafeChanged(Failsafe.HOLD, why, 0),
    )

    hold, alone = watch.alarms.rows()
    assert (hold.text, hold.tone) == (f"failsafe hold: {why}", Tone.WORD)
    assert "over since" in alone.text


def test_overdue_commands_are_one_alarm_until_word_of_all_of_them_has_come(watch: Watch) -> None:
    watch.hears(overdue(7, 20), overdue(7, 21), overdue(8, 22))
    (row,) = watch.alarms.rows()
    assert row.count == 2
    assert row.text == "command 8 overdue: should have been done by 17.0 s, no word"

    watch.hears(logged(to_ns(30), said_of(7, DONE, ON_TIME, so_s=15)))
    assert "over" not in watch.texts[0].removeprefix("command 8 overdue")
    watch.hears(logged(to_ns(31), said_of(8, CommandStage.WITHDRAWN, ON_TIME, so_s=16)))
    assert watch.texts[0].endswith("; over since 0:00:31.0")


def test_a_verdict_that_nothing_can_be_known_resolves_nothing(watch: Watch) -> None:
    watch.hears(overdue(7, 20), logged(to_ns(22), LifeEntry(7, DONE, Verdict.UNKNOWN)))
    watch.hears(overdue(7, 24))
    assert watch.alarms.raised == 1


def test_a_signal_that_is_lost_is_an_alarm_once_and_a_weak_one_is_none(watch: Watch) -> None:
    hidden = Watch()
    hidden.hears(signal(10, Signal.NONE))
    assert hidden.alarms.raised == 1

    watch.hears(signal(10, Signal.WEAK))
    assert not watch.texts

    watch.hears(signal(20, Signal.NONE), signal(21, Signal.NONE))
    assert watch.texts == ["signal lost: terrain hides the other end of the link"]
    watch.hears(signal(30, Signal.STRONG))
    (row,) = watch.alarms.rows()
    assert row.text.endswith("; over since 0:00:28.0")
    assert (to_s(row.so_ns), row.count) == (18, 1)


def test_a_shadow_is_an_alarm_only_if_it_is_out_of_step_for_longer_than_a_repair_takes(
    watch: Watch,
) -> None:
    patience_s = to_s(SHADOW_PATIENCE_NS) + 2 * 600
    far = way(600)
    watch.hears(in_step(100, why="its update 2 is missing"))
    watch.hears(in_step(150, why="its update 4 is missing"))
    watch.alarms.see(seen(100 + patience_s - 1, far, far))
    assert not watch.texts

    for late_s in (0, 1):
        watch.alarms.see(seen(100 + patience_s + late_s, far, far))
    (row,) = watch.alarms.rows()
    assert row.text == "the shadow of the model is out of step: its update 4 is missing"
    assert (to_s(row.so_ns), to_s(row.learned_ns)) == (100, 100 + patience_s)

    watch.hears(in_step(3000))
    assert watch.texts[0].endswith("; over since 0:50:00.0")
    watch.alarms.see(seen(9000, far, far))
    assert watch.alarms.raised == 1


def test_a_whole_blackout_leaves_five_alarms_each_of_them_over_when_the_operator_drives(
    watch: Watch, known: list[LogEntry]
) -> None:
    watch.hears(*known)

    assert watch.texts == [
        "mode autonomous: link lost; over since 0:16:27.3",
        "failsafe alone: the link is lost, after 30.0 s of silence; over since 0:12:43.4",
        (
            "failsafe hold: the link is back, and the operator has not yet said who drives; "
            "over since 0:16:27.3"
        ),
        "hears nothing from the rover; over since 0:16:21.8",
        "command 93 overdue: should have been done by 622.6 s, no word; over since 0:16:21.8",
    ]
