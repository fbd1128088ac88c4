"""A run over time, as lines of text."""

from pathlib import Path
from typing import Any

import pytest
from noting import failsafe_entry, view_of

import farside.logs
from farside.control import Failsafe, Mode, ModeCause
from farside.frames import LinkOutage, OutageReason
from farside.logs.timeline import timeline
from farside.node import Direction
from farside.topics import ModeEntry, Silence


def test_modes_failsafe_link_and_goals_over_time(run: Any) -> None:
    run.start().goal(1, "at:B")
    for way, start_s, end_s in ((Direction.UP, 10, 16), (Direction.DOWN, 12, 14)):
        run.note(start_s, LinkOutage(way, down=True, reason=OutageReason.BLACKOUT))
        run.note(end_s, LinkOutage(way, down=False, reason=OutageReason.BLACKOUT))
    run.note(11, failsafe_entry(Failsafe.HOLD), ModeEntry(Mode.SHARED, ModeCause.OPERATOR))
    run.note(11.5, failsafe_entry(Failsafe.ALONE), ModeEntry(Mode.AUTONOMOUS, ModeCause.LINK_LOST))
    run.note(16, failsafe_entry(), ModeEntry(Mode.GUIDED, ModeCause.OPERATOR))
    run.stand(15, "at:B").reach(15, "at:B").note(40, Silence(silent=True))

    assert timeline(view_of(run.records), columns=40) == [
        "          0 s                 20.0 s        40.0 s",
        "mode      gggggggggggAAAAAgggggggggggggggggggggggg",
        "failsafe  ···········AAAAA························",
        "uplink    ──────────xxxxxx────────────────────────",
        "downlink  ────────────xx──────────────────────────",
        "reached                  B",
        "          g guided, s shared, A autonomous; h hold, A alone, S safe; x outage",
    ]


def test_what_was_short_is_seen_too(run: Any) -> None:
    run.start().note(500, failsafe_entry(Failsafe.SAFE)).note(500.1, failsafe_entry())

    lines = timeline(view_of(run.note(1000, Silence(silent=True)).records), columns=20)

    assert lines[2] == "failsafe  ··········S·········"


def test_a_run_that_has_only_begun_has_a_timeline(run: Any) -> None:
    assert timeline(view_of(run.start().records), columns=4)[1] == "mode      g"


def test_the_ground_does_not_know_it(run: Any, path: Path) -> None:
    with pytest.raises(ValueError, match="not known at the ground"):
        timeline(farside.logs.open(run.start().log(path), as_ground=True))
