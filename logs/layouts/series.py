"""The states and numbers of a run that every layout shows, with the labels that they get."""

from typing import NamedTuple

from farside.logs.foxglove.names import (
    GROUND_NUMBERS,
    GROUND_STATE,
    LINK_NUMBERS,
    LINK_STATE,
    ROVER_NUMBERS,
    ROVER_STATE,
    TRUTH_NUMBERS,
    PictureTopic,
)


class Series(NamedTuple):
    """A line of a plot or a row of states: a field of a topic, with the label that it gets."""

    topic: PictureTopic
    field: str
    label: str

    @property
    def path(self) -> str:
        """The field as Foxglove and Lichtblick name it, such as `/rover/state.mode`."""
        return f"{self.topic.name}.{self.field}"


class PlotOf(NamedTuple):
    """A plot over time: its title, the unit of its axis if it has one, and its lines."""

    title: str
    unit: str
    series: tuple[Series, ...]


STATES = (
    Series(ROVER_STATE, "mode", "mode"),
    Series(ROVER_STATE, "failsafe", "failsafe"),
    Series(ROVER_STATE, "action", "action"),
    Series(ROVER_STATE, "goal", "goal"),
    Series(LINK_STATE, "down", "link, down"),
    Series(LINK_STATE, "up", "link, up"),
    Series(GROUND_STATE, "mode", "mode, as the ground knows"),
    Series(GROUND_STATE, "failsafe", "failsafe, as the ground knows"),
    Series(GROUND_STATE, "link", "link, as the ground knows"),
)
"""The states of rover, link and ground."""

PLOTS = (
    PlotOf(
        "Battery",
        "0 to 1",
        (
            Series(TRUTH_NUMBERS, "battery", "truth"),
            Series(GROUND_NUMBERS, "battery", "as last heard"),
        ),
    ),
    PlotOf(
        "Link",
        "s",
        (
            Series(LINK_NUMBERS, "down_delay_s", "delay, down"),
            Series(LINK_NUMBERS, "up_delay_s", "delay, up"),
            Series(GROUND_NUMBERS, "telemetry_age_s", "age of the telemetry"),
        ),
    ),
    PlotOf(
        "Learning",
        "0 to 1",
        (
            Series(ROVER_NUMBERS, "mean_cm", "mean C_m"),
            Series(GROUND_NUMBERS, "place_probability", "surest place"),
        ),
    ),
    PlotOf(
        "Counts",
        "",
        (
            Series(ROVER_NUMBERS, "signs", "Signs"),
            Series(ROVER_NUMBERS, "hypotheses", "hypotheses"),
            Series(ROVER_NUMBERS, "surprises", "surprises"),
            Series(ROVER_NUMBERS, "failed_predictions", "failed predictions"),
            Series(GROUND_NUMBERS, "commands_underway", "commands under way"),
        ),
    ),
)
"""The numbers of a run, each plot on an axis of its own."""
