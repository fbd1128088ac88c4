"""The blueprint for Rerun: which views stand where, and what each shows of a log."""

from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import Any

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.encodings import ComponentSourceKind, VisualizerComponentMapping

from farside.logs.foxglove.names import (
    GROUND_EVENTS,
    GROUND_FRAMES,
    GROUND_POSE_IN_YARD,
    LINK_EVENTS,
    ROVER_EVENTS,
    ROVER_FRAMES,
    ROVER_POSE_IN_YARD,
    TRUTH_FLOOR,
    TRUTH_FRAMES,
    TRUTH_POSE_IN_YARD,
    YARD,
)
from farside.logs.layouts.series import PLOTS, STATES, PlotOf, Series

APPLICATION = "farside"
"""The application that the blueprint is for, as Rerun calls what it shows."""

TIMELINE = "message_log_time"
"""Rerun's name of the log times of an MCAP file."""


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
                rrb.Tabs(*map(_plot, PLOTS), name="Numbers"),
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
    return rrb.StateTimelineView(
        name="Modes",
        contents=_entities(STATES),
        overrides=_shown(
            STATES,
            lambda each: rr.StateChange().visualizer(mappings=[_from(each, "StateChange:state")]),
        ),
    )


def _plot(plot: PlotOf) -> rrb.TimeSeriesView:
    return rrb.TimeSeriesView(
        # Rerun has no place for the unit of an axis.
        name=f"{plot.title}, {plot.unit}" if plot.unit else plot.title,
        contents=_entities(plot.series),
        overrides=_shown(
            plot.series,
            lambda each: rr.SeriesLines(names=[each.label]).visualizer(
                mappings=[_from(each, "Scalars:scalars")]
            ),
        ),
    )


def _entities(series: Iterable[Series]) -> list[str]:
    return list(dict.fromkeys(each.topic.name for each in series))


def _shown(
    series: Collection[Series], show: Callable[[Series], rrb.Visualizer]
) -> dict[Any, list[rrb.Visualizer]]:
    """What shows the series of each topic, by its name, of which Rerun has a type of its own."""
    return {
        entity: [show(each) for each in series if each.topic.name == entity]
        for entity in _entities(series)
    }


def _from(each: Series, target: str) -> VisualizerComponentMapping:
    """Where a view finds what it shows: in a field of the topic's message."""
    return VisualizerComponentMapping(
        target,
        ComponentSourceKind.SourceComponent,
        source_component=f"{each.topic.schema_name}:message",
        selector=f".{each.field}",
    )
