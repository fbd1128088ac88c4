"""What a failing test tells of the runs that it made."""

import json
import shlex
from collections.abc import Iterator

import msgspec

from farside.escaping import printable
from farside.logs.events import EVENT_TOPICS, EventLine, time_text
from farside.logs.file.reading import LogEntry
from farside.logs.picture import Picture
from farside.logs.timeline import timeline
from farside.missions.run import FinishedRun
from farside.node import NEVER_NS, to_ns, to_s
from farside.validation import one_line

_EVENTS = 15
"""How many events are told (project default)."""

_VALUE_LENGTH = 200

_BEFORE_S = 10
"""How much earlier than the first of them the replay begins (project default)."""


def told_of(run: FinishedRun) -> str:
    """A run for whoever reads of a failed test.

    Outcome and expectations with what was found; modes, failsafe, link and goals over time; the
    last events before the time that the test asked about last, or else before the end; where the
    log is, and how to watch it.

    Raises:
        LogError: if the log cannot be read any more.
    """
    return "\n".join(map(printable, _lines(run)))


def _lines(run: FinishedRun) -> Iterator[str]:
    result = run.result
    yield f"{result.mission}, seed {result.seed}: {result.outcome} after {result.sim_seconds:.1f} s"
    overrides = run.file.attachments.get("overrides.json")
    for key, value in msgspec.json.decode(overrides.data) if overrides is not None else ():
        yield f"  with {key} = {one_line(json.dumps(value, ensure_ascii=False), _VALUE_LENGTH)}"
    for expected in result.expectations:
        yield f"  {'met    ' if expected.met else 'NOT MET'}  {expected.name}: {expected.detail}"
    for lost in run.lost_processes:
        yield f"  {lost}"
    yield from ("", *timeline(run), "")
    asked_s = run.asked_s
    events = _events(run)
    if asked_s is None:
        yield "the last events"
    else:
        yield f"the last events up to {time_text(to_ns(asked_s))}, which was asked about last"
    for line in events:
        yield f"{time_text(line.t_ns):>11}  {line.role:<6}  {line.text}"
    first_s = to_s(events[0].t_ns) if events else 0.0
    replay = ["farside", "replay", str(run.path), "--start", f"{max(0.0, first_s - _BEFORE_S):.0f}"]
    yield from run.file.damage  # told as it was met on the way here
    yield from ("", f"log:    {run.path}", f"replay: {shlex.join(replay)}")


def _events(run: FinishedRun) -> list[EventLine]:
    until_ns = NEVER_NS if run.asked_s is None else to_ns(run.asked_s)
    picture = Picture()
    for record in run.file.records(EVENT_TOPICS, end_ns=until_ns):
        picture.apply(LogEntry.of(record))
    return list(picture.lines)[-_EVENTS:]
