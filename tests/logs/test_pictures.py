"""What Foxglove, Lichtblick and Rerun are shown of a run."""

import math
from typing import Any

import msgspec
import pytest
from drawn import decoded, drawn
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from noting import failsafe_entry, records_of, with_pictures

from farside.control import Chooser, Failsafe, Mode, ModeCause
from farside.frames import Fate, LinkOutage, OutageReason
from farside.logs import LogFile
from farside.logs.foxglove.names import (
    FRAME_BELIEVED,
    GROUND_EVENTS,
    GROUND_FLOOR,
    GROUND_FRAMES,
    GROUND_MAP,
    GROUND_PLACES,
    GROUND_POLICY,
    GROUND_PREDICTED,
    GROUND_STATE,
    LINK_EVENTS,
    LINK_NUMBERS,
    LINK_STATE,
    PICTURES,
    ROVER_EVENTS,
    ROVER_POLICY,
    ROVER_POLICY_CELLS,
    ROVER_STATE,
    TRUTH_BODY,
    TRUTH_FLOOR,
    TRUTH_FRAMES,
    TRUTH_MAP,
    TRUTH_NUMBERS,
    TRUTH_PLACES,
    TRUTH_TRACK,
)
from farside.logs.foxglove.pictures import Pictures
from farside.messages import Proposal, ProposedStep
from farside.node import Direction, Record, to_ns
from farside.topics import (
    GROUND_CHART,
    GROUND_PROPOSAL,
    GROUND_STORED_TELEMETRY,
    TRUTH_YARD,
    ActionStarted,
    Decision,
    Likely,
    ModeEntry,
    PolicyMapEntry,
    PolicyMapPlace,
    Pose,
    Prediction,
    Silence,
    Yard,
)

SOUTH, EAST = -math.pi / 2, 0.0


@pytest.fixture(scope="session")
def records(flown: LogFile) -> list[Record]:
    """The records of the shipped blackout mission."""
    return list(flown.records())


def on(topic: Any, records: list[Record]) -> list[Record]:
    """The same records, on another topic."""
    return [msgspec.structs.replace(record, topic=topic.name) for record in records]


def at(*points: tuple[float, float, float]) -> list[Record]:
    """The rover truly at x and y, at each of some times."""
    return records_of((t_s, Pose(x_m, y_m, 0.0, 0.3, "at:A", 0.75)) for t_s, x_m, y_m in points)


# --- laws --------------------------------------------------------------------------------------

of_a_run = settings(
    max_examples=5, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


@of_a_run
@given(cuts=st.lists(st.integers(0, 8_000), max_size=6))
def test_pictures_do_not_depend_on_windows(records: list[Record], cuts: list[int]) -> None:
    records = records[:8_000]
    pictures, found = Pictures(), list[Record]()
    ends = [*sorted(cuts), len(records)]
    for start, end in zip([0, *ends], ends, strict=False):
        found += pictures.beside(records[start:end])

    assert found == with_pictures(records)


@of_a_run
@given(until_s=st.floats(0, 1275))
def test_what_the_ground_is_shown_needs_no_records_but_its_own(
    records: list[Record], until_s: float
) -> None:
    until_ns = to_ns(until_s)
    known = [r for r in records if r.topic.startswith("/ground/") and r.log_time_ns <= until_ns]

    shown = [
        r
        for r in with_pictures(records)
        if r.topic.startswith("/ground/") and r.log_time_ns <= until_ns
    ]
    assert with_pictures(known) == shown


def test_every_picture_is_known_with_a_record_of_that_time(records: list[Record]) -> None:
    times_ns = {record.log_time_ns for record in records}
    pictures = [record for record in with_pictures(records) if record.topic in PICTURES]

    assert {picture.log_time_ns for picture in pictures} <= times_ns
    assert {picture.topic for picture in pictures} == set(PICTURES)


def test_a_log_as_the_ground_had_it_has_the_pictures_of_the_ground(flown: LogFile) -> None:
    known = flown.as_ground(to_ns(700))

    topics = {record.topic for record in known.records(pictures=True)}
    assert {"/ground/frames", "/ground/map", "/ground/telemetry"} <= topics
    assert all(topic.startswith("/ground/") for topic in topics)
    assert not {record.topic for record in known.records()} & set(PICTURES)


# --- the map -----------------------------------------------------------------------------------


def test_the_map_begins_in_the_south_west_and_has_the_colours_of_its_cells() -> None:
    yard = records_of([(0, Yard(("#####", "#A.o#", "#~D.#", "#####"), 2.0))])
    for topics, source in (
        ((TRUTH_MAP, TRUTH_FLOOR, TRUTH_PLACES), TRUTH_YARD),
        ((GROUND_MAP, GROUND_FLOOR, GROUND_PLACES), GROUND_CHART),
    ):
        (_, grid), (_, floor), (_, places) = (drawn(on(source, yard), topic)[0] for topic in topics)

        assert (grid.column_count, grid.cell_size.x, grid.row_stride) == (5, 2.0, 20)
        assert [field.name for field in grid.fields] == ["red", "green", "blue", "alpha"]
        rows = [
            [grid.data[at : at + 4] for at in range(row, row + grid.row_stride, grid.cell_stride)]
            for row in range(0, len(grid.data), grid.row_stride)
        ]
        wall, place, shadow, rock = rows[0][0], rows[1][3], rows[1][1], rows[2][3]
        assert len({wall, place, shadow, rock, rows[1][2], rows[2][1]}) == 6
        assert rows[0] == rows[3] == [wall] * 5
        assert rows[2][2] == place
        assert (floor.row_count, floor.column_count, floor.data) == (4, 5, grid.data)
        (entity,) = places.entities
        named = {text.text: (text.pose.position.x, text.pose.position.y) for text in entity.texts}
        assert named == {"A": (3.0, 5.0), "D": (5.0, 3.0)}


# --- three robots ------------------------------------------------------------------------------


def test_the_frame_of_the_rover_turns_counter_clockwise_from_east(run: Any) -> None:
    run.start().stand(1, "at:D", heading_rad=math.pi / 2)

    (_, first), *_ = drawn(run.records, TRUTH_FRAMES)

    (transform,) = first.transforms
    assert (transform.parent_frame_id, transform.child_frame_id) == ("yard", "rover_truth")
    assert (transform.translation.x, transform.translation.y) == (5.5, 1.5)
    rotation = transform.rotation
    assert 2 * math.atan2(rotation.z, rotation.w) == pytest.approx(math.pi / 2)


def test_a_rover_that_stood_is_not_drawn_on_its_way_before_it_left() -> None:
    frames = drawn(at((0, 1, 1), (1, 1, 1), (9, 1, 1), (10, 1.5, 1)), TRUTH_FRAMES)

    assert [t_s for t_s, _ in frames] == [0, 10]
    held, moved = frames[1][1].transforms
    assert (held.timestamp.seconds, held.translation.x) == (9, 1.0)
    assert (moved.timestamp.seconds, moved.translation.x) == (10, 1.5)


def test_the_ground_sees_the_rover_move_when_telemetry_arrives_and_no_sooner(run: Any) -> None:
    run.start().hear(2, "at:A", since_s=0.7).hear(80, "at:B", since_s=78.7)

    frames = drawn(run.records, GROUND_FRAMES)

    assert [t_s for t_s, _ in frames] == [2, 80]
    held, moved = frames[1][1].transforms
    assert (held.child_frame_id, held.translation.x) == (FRAME_BELIEVED, 1.5)
    assert (held.timestamp.seconds, held.timestamp.nanos) == (79, 999_999_999)
    assert (moved.timestamp.seconds, moved.translation.x) == (80, 5.5)


def test_old_telemetry_from_the_store_does_not_move_the_rover_back(run: Any) -> None:
    live = run.start().hear(2, "at:A", since_s=0.7).records
    stored = type(run)().hear(9, "at:B", since_s=0.5).records

    assert len(drawn([*live, *on(GROUND_STORED_TELEMETRY, stored)], GROUND_FRAMES)) == 1


def test_the_body_of_the_rover_moves_with_its_frame(run: Any) -> None:
    run.start().stand(1, "at:A").stand(2, "at:B")

    ((_, scene),) = drawn(run.records, TRUTH_BODY)

    (entity,) = scene.entities
    assert (entity.frame_id, entity.frame_locked) == ("rover_truth", True)


# --- paths -------------------------------------------------------------------------------------


def test_the_track_has_the_colour_of_the_mode_and_goes_on_where_it_was() -> None:
    shared = records_of([(5, ModeEntry(Mode.SHARED, ModeCause.OPERATOR))])
    track = drawn(
        [*at((0, 1, 1), (1, 2, 1), (2, 3, 1)), *shared, *at((6, 3, 2), (7, 3, 3))], TRUTH_TRACK
    )

    lines = [scene.entities[0] for _, scene in track]
    assert [line.id for line in lines] == ["track 0", "track 0", "track 1", "track 1"]
    points = [[(p.x, p.y) for p in line.lines[0].points] for line in lines]
    assert points[1] == [(1, 1), (3, 1)], "what is straight has no corners"
    assert points[3] == [(3, 1), (3, 3)]
    assert lines[1].lines[0].color != lines[3].lines[0].color


def test_a_track_grows_with_the_way_and_no_faster() -> None:
    def size_byte(steps: int) -> int:
        zigzag = at(*((t, float(t), float(t % 2)) for t in range(steps)))
        return sum(len(record.payload) for record in with_pictures(zigzag))

    assert size_byte(2000) < 2.2 * size_byte(1000)


A, B, D = ("at:A",), ("at:B",), ("at:D",)
TO_A = PolicyMapEntry(
    A,
    (
        PolicyMapPlace(A, 0.0, None, 0),
        PolicyMapPlace(("at:1,2",), 5.0, "N", 1),
        PolicyMapPlace(("at:2,2",), 10.0, "W", 2),
    ),
)


def decision(place: str) -> Decision:
    return Decision(Chooser.GOAL_DIRECTED, "W", A, ((place,),), None, None, None)


def test_the_policy_map_is_drawn_while_there_is_a_goal(run: Any) -> None:
    run.start().note(1, TO_A).note(9, PolicyMapEntry(None))

    (_, shown), (_, gone) = drawn(run.records, ROVER_POLICY_CELLS)

    (cells,) = shown.entities
    assert [(c.pose.position.x, c.pose.position.y) for c in cells.cubes] == [
        (1.5, 3.5),
        (1.5, 2.5),
        (2.5, 2.5),
    ]
    assert len(cells.arrows) == 2
    assert gone.deletions[0].timestamp.seconds == 9
    assert not gone.entities


def test_the_path_follows_the_best_actions_and_goes_with_the_goal(run: Any) -> None:
    run.start().note(1, TO_A).note(2, decision("at:2,2")).note(3, decision("at:1,2"))
    run.note(9, PolicyMapEntry(None))

    (begun_s, path), (gone_s, gone) = drawn(run.records, ROVER_POLICY)

    assert (begun_s, gone_s) == (2, 9), "a rover farther on the same path is no other path"
    (entity,) = path.entities
    assert [(p.x, p.y) for p in entity.lines[0].points] == [(2.5, 2.5), (1.5, 2.5), (1.5, 3.5)]
    assert [text.text for text in entity.texts] == ["10", "5", "0"]
    assert gone.deletions


def test_the_ground_is_shown_the_path_that_was_proposed_to_it(run: Any) -> None:
    path = (ProposedStep(("at:2,2",), "W", 10.0), ProposedStep(("at:1,2",), "N", 5.0))
    proposal = records_of([(3, Proposal(1, to_ns(1), A, "W", path))])
    yard = on(GROUND_CHART, run.start().records[:1])

    ((_, scene),) = drawn([*yard, *on(GROUND_PROPOSAL, proposal)], GROUND_POLICY)

    points = scene.entities[0].lines[0].points
    assert [(p.x, p.y) for p in points] == [(2.5, 2.5), (1.5, 2.5), (1.5, 3.5)]


def test_a_prediction_is_the_more_solid_the_more_probable(run: Any) -> None:
    yard = on(GROUND_CHART, run.start().records[:1])
    likely = (Likely(A, 0.8), Likely(("at:1,2",), 0.15))
    prediction = Prediction(to_ns(3), to_ns(1), likely, 0.05)
    predicted = records_of([(3, prediction), (4, prediction)])

    ((_, scene),) = drawn([*yard, *predicted], GROUND_PREDICTED)

    (entity,) = scene.entities
    assert entity.cubes[0].color.a > entity.cubes[1].color.a > 0
    assert [text.text for text in entity.texts] == ["80%"]
    assert len(entity.spheres) == 1


# --- states, numbers and events ----------------------------------------------------------------


def test_the_state_of_the_rover_is_never_null(run: Any) -> None:
    run.start().note(2, ActionStarted("N", Chooser.GUIDED, 1, None))

    states = [state for _, state in drawn(run.records, ROVER_STATE)]

    assert [(s.mode, s.failsafe, s.action, s.goal) for s in states] == [
        ("guided", "unknown", "none", "none"),
        ("guided", "nominal", "none", "none"),
        ("guided", "nominal", "N", "none"),
    ]


def test_the_link_is_open_until_an_outage_and_after_it(run: Any) -> None:
    run.start()
    for t_s, down in ((5, True), (9, False)):
        run.note(t_s, LinkOutage(Direction.UP, down, OutageReason.BLACKOUT))

    states = [(t_s, s.up, s.down) for t_s, s in drawn(run.records, LINK_STATE)]

    assert states == [(0, "open", "open"), (5, "blackout", "open"), (9, "open", "open")]
    assert [log.message for _, log in drawn(run.records, LINK_EVENTS)] == [
        "uplink: blackout begins",
        "uplink: blackout ends",
    ]


def test_numbers_of_the_link_are_those_since_the_last(run: Any) -> None:
    for t_s in (1, 2, 3, 4):
        run.frame(t_s, Direction.UP, size_byte=100)
    run.frame(5, Direction.UP, Fate.LOST)

    ((told_s, numbers),) = drawn(run.records, LINK_NUMBERS)

    assert told_s == 5
    assert (numbers.up_delay_s, numbers.up_lost_frames, numbers.down_lost_frames) == (1.25, 1, 0)


def test_the_ground_says_whether_it_hears_the_rover(run: Any) -> None:
    run.hear(2, "at:A", since_s=1).note(30, Silence(silent=True)).note(60, Silence(silent=False))

    assert [(t_s, s.link) for t_s, s in drawn(run.records, GROUND_STATE)] == [
        (2, "heard"),
        (30, "silent"),
        (60, "heard"),
    ]


def test_events_say_who_learned_of_them_and_how_much_they_matter(run: Any) -> None:
    run.start().note(30, failsafe_entry(Failsafe.HOLD), Silence(silent=True))

    on_board = [(log.name, log.level, log.message) for _, log in drawn(run.records, ROVER_EVENTS)]
    heard = [(log.name, log.level, log.message) for _, log in drawn(run.records, GROUND_EVENTS)]

    information, warning = 2, 3
    assert on_board[0] == ("rover", information, "mode guided: start")
    assert on_board[-1] == ("rover", warning, "failsafe hold: nothing is heard")
    assert heard == [("ground", warning, "hears nothing from the rover")]


def test_a_charge_that_changes_too_little_to_be_seen_is_not_told_again() -> None:
    poses = records_of(
        (float(t), Pose(1.0, 1.0, 0.0, 0.0, "at:A", 0.75 - 0.0004 * t)) for t in range(6)
    )

    assert [t_s for t_s, _ in drawn(poses, TRUTH_NUMBERS)] == [0, 3]


# --- time --------------------------------------------------------------------------------------


def test_the_time_in_a_picture_is_when_it_was_known(records: list[Record]) -> None:
    for record in with_pictures(records[:4000]):
        if record.topic.endswith(("/pose_in_yard", "/events", "/map", "/floor")):
            stamp = decoded(record).timestamp
            assert to_ns(stamp.seconds) + stamp.nanos == record.log_time_ns
