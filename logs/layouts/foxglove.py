"""The layout for Foxglove and Lichtblick: which panels stand where, and what each shows.

Foxglove's own library says what the panels can be told. Around them stands the form of a layout
that both programs import from a file, and that Foxglove exports: panels by id, and a tree of them.
"""

import json
from collections.abc import Iterable
from typing import Any, Literal, NamedTuple

from foxglove.layouts import (
    BaseRendererGridTopicSettings,
    BaseRendererSceneUpdateTopicSettings,
    LogConfig,
    PlotConfig,
    PlotSeries,
    RawMessagesConfig,
    StateTransitionsConfig,
    StateTransitionsSeries,
    ThreeDeeCameraState,
    ThreeDeeConfig,
)

from farside.logs.foxglove.names import (
    FRAME_BELIEVED,
    FRAME_TRUTH,
    GROUND_BODY,
    GROUND_EVENTS,
    GROUND_MAP,
    GROUND_PLACES,
    GROUND_POLICY,
    GROUND_PREDICTED,
    LINK_EVENTS,
    ROVER_BODY,
    ROVER_EVENTS,
    ROVER_POLICY,
    ROVER_POLICY_CELLS,
    TRUTH_BODY,
    TRUTH_MAP,
    TRUTH_PLACES,
    TRUTH_TRACK,
    PictureTopic,
)
from farside.logs.layouts.series import PLOTS, STATES, PlotOf, Series
from farside.node import Topic
from farside.topics import GROUND_COMMAND, GROUND_LIFE, ROVER_DECISION

_CAMERA_M = 30.0  # far enough for a yard of twenty places by twenty

_Config = LogConfig | PlotConfig | RawMessagesConfig | StateTransitionsConfig | ThreeDeeConfig
_Tree = str | dict[str, object]


class _Panel(NamedTuple):
    """A panel: its kind as both programs name it, its title and its configuration."""

    kind: Literal["3D", "StateTransitions", "Plot", "RosOut", "RawMessages"]
    title: str
    config: _Config


def foxglove_layout(*, as_ground: bool = False) -> bytes:
    """The layout as JSON.

    Args:
        as_ground: only what the ground knew, for a log that is played as the ground had it.
    """
    layout = _Layout(as_ground=as_ground)
    left = layout.column(70, layout.add(_map(as_ground=as_ground)), layout.add(layout.states()))
    plots = layout.tabs("Numbers", *map(layout.plot, PLOTS))
    events = layout.tabs(
        "Events",
        layout.log("Rover", ROVER_EVENTS),
        layout.log("Ground", GROUND_EVENTS),
        layout.log("Link", LINK_EVENTS),
    )
    messages = layout.tabs(
        "Messages",
        layout.raw("Decision", ROVER_DECISION),
        layout.raw("Command sent", GROUND_COMMAND),
        layout.raw("Command's life", GROUND_LIFE),
    )
    right = layout.column(40, plots, layout.column(55, events, messages))
    return layout.encoded(layout.row(60, left, right))


def _map(*, as_ground: bool) -> _Panel:
    """The yard from above, with the three rovers; the camera goes with the rover."""
    drawn: tuple[PictureTopic, ...] = (GROUND_BODY, GROUND_PREDICTED)
    if as_ground:
        drawn += GROUND_MAP, GROUND_PLACES, GROUND_POLICY
    else:
        drawn += TRUTH_MAP, TRUTH_PLACES, TRUTH_TRACK, TRUTH_BODY
        drawn += ROVER_BODY, ROVER_POLICY_CELLS, ROVER_POLICY
    config = ThreeDeeConfig(
        camera_state=ThreeDeeCameraState(
            distance=_CAMERA_M, perspective=False, phi=0.0, theta_offset=0.0
        ),
        follow_tf=FRAME_BELIEVED if as_ground else FRAME_TRUTH,
        follow_mode="follow-position",
        topics={
            topic.name: BaseRendererGridTopicSettings(visible=True, color_mode="rgba-fields")
            if topic.kind == "foxglove.Grid"
            else BaseRendererSceneUpdateTopicSettings(visible=True)
            for topic in drawn
        },
    )
    return _Panel("3D", "Yard", config)


class _Layout:
    """A layout that is being put together."""

    def __init__(self, *, as_ground: bool) -> None:
        self._as_ground = as_ground
        self._configs: dict[str, object] = {}

    def add(self, panel: _Panel) -> str:
        """Add a panel; returns its id."""
        config: dict[str, object] = json.loads(panel.config.to_json())
        # Foxglove's name of a panel's title, and Lichtblick's.
        titles = {"foxglovePanelTitle": panel.title, "lichtblickPanelTitle": panel.title}
        return self._keep(panel.kind, config | titles)

    def states(self) -> _Panel:
        """The states of rover, link and ground over time."""
        paths = [
            StateTransitionsSeries(
                value=each.path, label=each.label, enabled=True, timestamp_method="receiveTime"
            )
            for each in self._known(STATES)
        ]
        return _Panel(
            "StateTransitions", "Modes", StateTransitionsConfig(paths=paths, is_synced=True)
        )

    def plot(self, plot: PlotOf) -> tuple[_Panel, ...]:
        """A plot over time; none if nothing of it was known."""
        paths = [
            PlotSeries(
                value=each.path, label=each.label, enabled=True, timestamp_method="receiveTime"
            )
            for each in self._known(plot.series)
        ]
        config = PlotConfig(
            paths=paths,
            x_axis_val="timestamp",
            y_axis_label=plot.unit,
            is_synced=True,
            show_legend=True,
            legend_display="floating",
            show_plot_values_in_legend=True,
            show_x_axis_labels=True,
            show_y_axis_labels=True,
            sidebar_dimension=240,
        )
        return (_Panel("Plot", plot.title, config),) if paths else ()

    def log(self, title: str, topic: PictureTopic) -> tuple[_Panel, ...]:
        """The events of one side as they come; none if they were not known."""
        if not self._knows(topic):
            return ()
        return (_Panel("RosOut", title, LogConfig(topic_to_render=topic.name, min_log_level=1)),)

    def raw(self, title: str, topic: Topic[Any]) -> tuple[_Panel, ...]:
        """The last message of a topic; none if it was not known."""
        if not self._knows(topic):
            return ()
        return (_Panel("RawMessages", title, RawMessagesConfig(topic_path=topic.name)),)

    def tabs(self, title: str, *panels: tuple[_Panel, ...]) -> str:
        """Panels behind one another; returns the id of what holds them."""
        tabs = [
            {"title": panel.title, "layout": self.add(panel)} for each in panels for panel in each
        ]
        return self._keep("Tab", {"activeTabIdx": 0, "tabs": tabs, "foxglovePanelTitle": title})

    @staticmethod
    def row(percent: int, left: _Tree, right: _Tree) -> _Tree:
        """Two beside each other, the left one so wide."""
        return {"direction": "row", "splitPercentage": percent, "first": left, "second": right}

    @staticmethod
    def column(percent: int, upper: _Tree, lower: _Tree) -> _Tree:
        """Two above each other, the upper one so high."""
        return {"direction": "column", "splitPercentage": percent, "first": upper, "second": lower}

    def encoded(self, tree: _Tree) -> bytes:
        """The layout of these panels."""
        layout = {
            "configById": self._configs,
            "globalVariables": {},
            "userNodes": {},
            "playbackConfig": {"speed": 1},
            "layout": tree,
        }
        return json.dumps(layout, indent=1).encode() + b"\n"

    def _keep(self, kind: str, config: dict[str, object]) -> str:
        name = f"{kind}!farside{len(self._configs)}"
        self._configs[name] = config
        return name

    def _known(self, series: Iterable[Series]) -> list[Series]:
        return [each for each in series if self._knows(each.topic)]

    def _knows(self, topic: PictureTopic | Topic[Any]) -> bool:
        return not self._as_ground or topic.name.startswith("/ground/")
