"""As ground nothing shows what the ground could not know: every view, at every time.

From a log everything is deleted that the ground had not learned by T. As of T, every view of what
is left is, to the byte, that of the whole log.
"""

import inspect
import shutil
from collections.abc import Callable
from contextlib import chdir
from functools import partial
from io import StringIO
from pathlib import Path
from typing import Any

import msgspec
import msgspec.inspect as mi
import pytest
from any_message import values
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from rich.console import Console
from typer.testing import CliRunner

import farside.logs
from farside.logs import LogError, LogFile, Recorder, RunView, picture_at, replay, screen
from farside.logs.story import Aspect, SubjectError, story, story_lines, subject_of, why
from farside.messages import Proposal
from farside.missions import load_mission, run_mission
from farside.missions.commands.main import app
from farside.node import Direction, Journal, Topic, to_ns
from farside.places import Chart
from farside.topics import GROUND_PROPOSAL, GROUND_TELEMETRY, TOPICS
from tests.ground.conftest import telemetry

View = Callable[[Path, float], object]
"""What is seen of the log at a path, as ground as of a time in seconds."""


def queries(path: Path, t_s: float) -> object:
    """Every query of a `RunView` with what it answers, or why it is refused."""
    run = farside.logs.open(path, as_ground=True, until_s=t_s)
    asked: dict[str, Callable[[], object]] = {"repr": lambda: repr(run)}
    for name, query in inspect.getmembers(RunView):
        if name.startswith("_") or name in {"file", "path"}:
            continue
        if not callable(query):
            asked[name] = partial(getattr, run, name)
        elif list(inspect.signature(query).parameters) == ["self", "t_s"]:
            for share in (0.3, 1.0):
                asked[f"{name}({share})"] = partial(query, run, share * t_s)
    for topic in TOPICS.values():
        asked[topic.name] = partial(run.entries, topic)
    asked["frames"] = run.frames
    asked["counters"] = lambda: run.link_counters(Direction.UP)
    asked["reached"] = lambda: run.reached("A")
    return {name: answer(query) for name, query in asked.items()}


def answer(query: Callable[[], object]) -> object:
    try:
        found = query()
    except (ValueError, LogError, SubjectError) as refusal:
        return str(refusal)
    return found.rows if isinstance(found, Chart) else found


def picture(path: Path, t_s: float) -> object:
    shown = vars(picture_at(LogFile(path).as_ground(to_ns(t_s)), to_ns(t_s)))
    return {**shown, "chart": shown["chart"] and shown["chart"].rows}


def terminal(path: Path, t_s: float) -> object:
    log = LogFile(path).as_ground(to_ns(t_s))
    console = Console(width=100, height=30, color_system=None)
    with console.capture() as shown:
        drawn = picture_at(log, to_ns(t_s))
        console.print(screen(drawn, to_ns(t_s), width=100, height=30, end_ns=log.end_ns))
    return shown.get()


def stories(path: Path, t_s: float) -> object:
    """The first of each kind of thing, from birth to effect."""
    log = LogFile(path).as_ground(to_ns(t_s))
    told = {}
    for text in ("command:1", "proposal:1", "event:1", "goal:B", "frame:up:1", "frame:down:1"):
        told[text] = answer(partial(told_of, log, text))
    return told


def told_of(log: LogFile, text: str) -> object:
    return list(story_lines(story(log, subject_of(text))))


def reasons(path: Path, t_s: float) -> object:
    """The reasons of everything that has any."""
    log = LogFile(path).as_ground(to_ns(t_s))
    return {aspect: answer(partial(why, log, to_ns(t_s), aspect)) for aspect in Aspect}


def pictures(path: Path, t_s: float) -> object:
    """All that Foxglove shows, which draws from the same records as `farside replay --live`."""
    return list(LogFile(path).as_ground(to_ns(t_s)).records(pictures=True))


def printed(path: Path, t_s: float) -> object:
    """What a replay prints into a pipe."""
    text = StringIO()
    replay(LogFile(path).as_ground(to_ns(t_s)), Console(file=text, width=100))
    return text.getvalue()


def command(name: str, *more: str) -> View:
    """What a command prints, and the files that it writes into the folder `out`."""

    def view(path: Path, t_s: float) -> object:
        shutil.rmtree("out", ignore_errors=True)
        done = CliRunner().invoke(
            app, [name, str(path), *more, "--as", "ground", "--at", repr(t_s)]
        )
        files = sorted(file for file in Path("out").rglob("*") if file.is_file())
        return done.exit_code, done.output, [(file, file.read_bytes()) for file in files]

    return view


VIEWS: dict[str, View] = {
    "queries": queries,
    "picture": picture,
    "terminal": terminal,
    "pictures": pictures,
    "replay": printed,
    "stories": stories,
    "reasons": reasons,
    "export": command("export", "--out", "out"),
    "export csv": command("export", "--format", "csv", "--out", "out"),
    "report": command("report", "--out", "out/run.html"),
}
"""Every view. A new one is a line here; of a command, `command("its name")`."""


def seen(view: View, folder: Path, t_s: float) -> object:
    """What a view shows of the log in a folder, without the folder."""
    with chdir(folder):
        return view(Path("run.mcap"), t_s)


def learned_by(log: LogFile, t_s: float, folder: Path) -> Path:
    """A log of what the ground had learned by a time, alone; returns its folder."""
    folder.mkdir()
    with Recorder(folder / "run.mcap") as recorder:
        for name, values in log.as_ground().metadata.items():
            recorder.metadata(name, dict(values))
        known = (
            record
            for record in log.records()
            if record.topic.startswith("/ground/") and record.log_time_ns <= to_ns(t_s)
        )
        recorder.write(known)
    return folder


def differing(log: LogFile, t_s: float, folder: Path) -> list[str]:
    """The views that show something as of a time that the ground had not learned."""
    known = learned_by(log, t_s, folder / "known")
    return [
        name
        for name, view in VIEWS.items()
        if seen(view, log.path.parent, t_s) != seen(view, known, t_s)
    ]


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> LogFile:
    """A real run with a blackout, from before it until it is known what happened in it."""
    folder = tmp_path_factory.mktemp("flown")
    values = {"duration_s": 100.0, "link.blackouts": [{"start_s": 30.0, "end_s": 60.0}]}
    run = run_mission(load_mission("blackout", values), in_process=True, out=folder)
    run.log.rename(folder / "run.mcap")
    return LogFile(folder / "run.mcap")


@settings(max_examples=3, suppress_health_check=list(HealthCheck), phases=[Phase.generate])
@given(share=st.floats(0, 1))
def test_no_view_of_a_real_run_knows_more_than_the_ground(
    flown: LogFile, tmp_path_factory: pytest.TempPathFactory, share: float
) -> None:
    t_s = share * flown.end_ns / 1e9

    assert differing(flown, t_s, tmp_path_factory.mktemp("deleted")) == []


SAID = st.lists(
    st.sampled_from(list(TOPICS.values())).flatmap(
        lambda topic: st.tuples(st.floats(0, 10), st.just(topic), values(mi.type_info(topic.kind)))
    ),
    min_size=5,
    max_size=20,
)


@settings(max_examples=4, suppress_health_check=list(HealthCheck), phases=[Phase.generate])
@given(said=SAID, t_s=st.floats(0, 10))
def test_whatever_a_log_holds_no_view_knows_more_than_the_ground(
    said: list[tuple[float, Topic[msgspec.Struct], msgspec.Struct]],
    t_s: float,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    journal = Journal()
    for at_s, topic, message in sorted(said, key=lambda one: one[0]):
        journal.note(topic, message, log_time_ns=to_ns(at_s))
    folder = tmp_path_factory.mktemp("any")
    with Recorder(folder / "run.mcap") as recorder:
        recorder.metadata("farside.run", {"mission": "any", "seed": "1"})
        recorder.metadata("farside.result", {"outcome": "success", "digest": "0" * 64})
        recorder.attach("mission.toml", "application/toml", b"")
        recorder.write(journal.take())

    assert differing(LogFile(folder / "run.mcap"), t_s, folder) == []


# --- what is there to see ----------------------------------------------------------------------


@pytest.mark.parametrize("t_s", [1, 20, 45, 90])
def test_the_picture_is_what_the_ground_believed(flown: LogFile, t_s: float) -> None:
    believed = farside.logs.open(flown.path).believed_at(t_s)

    shown = picture_at(flown.as_ground(to_ns(t_s)), to_ns(t_s))

    belief = believed.belief
    assert shown.chart.rows == RunView(flown).chart.rows
    assert shown.mode == (belief.mode and belief.mode.value)
    assert shown.failsafe == (belief.failsafe and belief.failsafe.value)
    assert list(shown.goals) == list(belief.goals.value if belief.goals else ())
    assert (shown.silent, shown.prediction) == (believed.silent, believed.prediction)
    assert (shown.pose, shown.action, shown.cycle, shown.link) == (None, None, None, {})


def test_the_places_where_the_rover_was_heard_to_be_count_as_visited(run: Any, path: Path) -> None:
    run.start("at:D").stand(1, "at:C").hear(4, "at:A", since_s=2).hear(8, "at:B", since_s=3)

    picture = picture_at(LogFile(run.log(path)).as_ground(), to_ns(5))

    assert list(picture.visited) == ["at:A"]


HEARD = {3: (2.0, None), 5: (4.0, 1), 8: (7.0, None)}
"""When the ground hears of the proposal that stands: measured when, and its number."""


@pytest.mark.parametrize(
    ("heard", "stands"),
    [
        ([3], True),  # that was before it was made
        ([3, 5], True),
        ([8], False),
        ([5, 8], False),
        ([8, 3], False),
    ],
)
def test_a_proposal_stands_until_telemetry_measured_since_says_otherwise(
    heard: list[int], stands: bool, path: Path
) -> None:
    proposed = Proposal(1, to_ns(3), ("at:B",), "E", ())
    journal = Journal()
    journal.note(GROUND_PROPOSAL, proposed, log_time_ns=to_ns(4))
    for at_s in heard:
        so_s, number = HEARD[at_s]
        journal.note(GROUND_TELEMETRY, telemetry(so_s, proposal=number), log_time_ns=to_ns(at_s))
    with Recorder(path) as recorder:
        recorder.write(sorted(journal.take(), key=lambda record: record.log_time_ns))

    shown = picture_at(LogFile(path).as_ground(), to_ns(10))

    assert shown.proposal == (proposed if stands else None)


def test_the_screen_tells_what_was_heard_and_not_what_was_so(run: Any, path: Path) -> None:
    run.start("at:D").frame(1, Direction.UP).stand(4, "at:C").hear(4, "at:A", since_s=2.75)

    shown = str(terminal(run.log(path), 6.0))

    assert "heard at at:A" in shown
    assert "at:C" not in shown
    assert "not known at the ground" in shown
    assert "delivered" not in shown
