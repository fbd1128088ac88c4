"""The blueprint for Rerun: which views stand where, and what each shows of a log."""

from collections.abc import Sequence
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping

from farside.logs.foxglove.names import (
    GROUND_EVENTS,
    GROUND_FRAMES,
    GROUND_NUMBERS,
    GROUND_POSE_IN_YARD,
    GROUND_STATE,
    LINK_EVENTS,
    LINK_NUMBERS,
    LINK_STATE,
    ROVER_EVENTS,
    ROVER_FRAMES,
    ROVER_NUMBERS,
    ROVER_POSE_IN_YARD,
    ROVER_STATE,
    TRUTH_FLOOR,
    TRUTH_FRAMES,
    TRUTH_NUMBERS,
    TRUTH_POSE_IN_YARD,
    YARD,
    PictureTopic,
)

APPLICATION = "farside"
"""The application that the blueprint is for, as Rerun calls what it shows."""

TIMELINE = "message_log_time"
"""Rerun's name of the log times of an MCAP file."""

_Shown = tuple[PictureTopic, str, str]


def write_blueprint(path: Path) -> None:
    """Write the blueprint to a new file.

    Raises:
        OSError: if it cannot be written.
    """
    blueprint().save(APPLICATION, path)


def blueprint() -> rrb.Blueprint:
    """The views of a run: the yard with the three rovers, states, numbers and events."""
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(_yard(), _states(), row_shares=[7, 3]),
            rrb.Vertical(
                rrb.Tabs(*_numbers(), name="Numbers"),
                rrb.TextLogView(
                    name="Events",
                    contents=[topic.name for topic in (ROVER_EVENTS, LINK_EVENTS, GROUND_EVENTS)],
                ),
            ),
            column_shares=[3, 2],
        ),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed"),
    )


def _yard() -> rrb.Spatial3DView:
    """The yard with the three rovers: black the true one, blue its own estimate, amber as heard."""
    drawn = (TRUTH_FLOOR, TRUTH_FRAMES, ROVER_FRAMES, GROUND_FRAMES)
    rovers = {
        TRUTH_POSE_IN_YARD: (64, 64, 64),
        ROVER_POSE_IN_YARD: (87, 181, 232),
        GROUND_POSE_IN_YARD: (230, 153, 0),
    }
    return rrb.Spatial3DView(
        name="Yard",
        contents=[topic.name for topic in (*drawn, *rovers)],
        overrides={topic.name: _rover(colour) for topic, colour in rovers.items()},
        spatial_information=rrb.SpatialInformation(YARD),
    )


def _rover(colour: tuple[int, int, int]) -> list[rrb.Visualizer]:
    """A body and where it looks; a pose by itself draws nothing."""
    return [
        rr.Boxes3D(
            half_sizes=[(0.3, 0.2, 0.1)], colors=[colour], fill_mode=rr.components.FillMode.Solid
        ).visualizer(),
        rr.Arrows3D(vectors=[(0.6, 0.0, 0.0)], colors=[colour], radii=[0.06]).visualizer(),
    ]


def _states() -> rrb.StateTimelineView:
    shown: tuple[_Shown, ...] = (
        (ROVER_STATE, "mode", "mode"),
        (ROVER_STATE, "failsafe", "failsafe"),
        (ROVER_STATE, "goal", "goal"),
        (LINK_STATE, "down", "link, down"),
        (LINK_STATE, "up", "link, up"),
        (GROUND_STATE, "link", "link, as the ground knows"),
    )
    return rrb.StateTimelineView(
        name="Modes",
        contents=_entities(shown),
        overrides={
            entity: [
                rr.StateChange().visualizer(mappings=[_from(topic, field, "StateChange:state")])
                for topic, field, _ in shown
                if topic.name == entity
            ]
            for entity in _entities(shown)
        },
    )


def _numbers() -> list[rrb.TimeSeriesView]:
    return [
        _plot(
            "Battery",
            (TRUTH_NUMBERS, "battery", "truth"),
            (GROUND_NUMBERS, "battery", "as last heard"),
        ),
        _plot(
            "Link, s",
            (LINK_NUMBERS, "down_delay_s", "delay, down"),
            (LINK_NUMBERS, "up_delay_s", "delay, up"),
            (GROUND_NUMBERS, "telemetry_age_s", "age of the telemetry"),
        ),
        _plot(
            "Learning",
            (ROVER_NUMBERS, "mean_cm", "mean C_m"),
            (GROUND_NUMBERS, "place_probability", "surest place"),
        ),
        _plot(
            "Counts",
            (ROVER_NUMBERS, "signs", "Signs"),
            (ROVER_NUMBERS, "hypotheses", "hypotheses"),
            (ROVER_NUMBERS, "surprises", "surprises"),
            (ROVER_NUMBERS, "failed_predictions", "failed predictions"),
        ),
    ]


def _plot(name: str, *shown: _Shown) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        name=name,
        contents=_entities(shown),
        overrides={
            entity: [
                rr.SeriesLines(names=[label]).visualizer(
                    mappings=[_from(topic, field, "Scalars:scalars")]
                )
                for topic, field, label in shown
                if topic.name == entity
            ]
            for entity in _entities(shown)
        },
    )


def _entities(shown: Sequence[_Shown]) -> list[str]:
    return list(dict.fromkeys(topic.name for topic, _, _ in shown))


def _from(topic: PictureTopic, field: str, target: str) -> VisualizerComponentMapping:
    """Where a view finds what it shows: in a field of the topic's message."""
    return VisualizerComponentMapping(
        target,
        ComponentSourceKind.SourceComponent,
        source_component=f"{topic.schema_name}:message",
        selector=f".{field}",
    )
