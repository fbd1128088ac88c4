"""What a supervisor with four rules reaches on each shipped mission: alone, and after the guide."""

from collections.abc import Iterator, Sequence
from typing import Any

from nodes import flown
from noting import view_of

from farside.missions import MissionFile, load_mission
from farside.places import is_place_token, place_name
from farside.topics import GROUND_REVIEW, Answer

MISSIONS = ("blackout", "mars-relay", "shadow", "teach", "tether")
LEAST_S = 3600.0
AVOIDED = {
    "blackout": "8,2",
    "mars-relay": "3,3",
    "shadow": "10,3",
    "teach": "3,1",
    "tether": "5,4",
}
"""A place of each yard that no path may lead over."""

RULES = (
    {"rule": "cost", "below": 150.0},
    {"rule": "chance", "above": 0.5},
    {"rule": "age", "below_s": 120.0},
)
"""Three of the four rules; the fourth is what to avoid."""


def supervised(name: str, lessons: int, seed: int) -> dict[str, Any]:
    """One run: all named places as goals, in shared mode; after a tour of the guide, or not.

    The mission keeps its yard, rover and link with all outages, and lasts an hour at least.
    """
    plain = load_mission(name).mission
    places = goals_of(plain)
    supervise = {"do": "supervise", "goals": [{"place": place} for place in places]}
    teach = [{"do": "teach"}] * lessons
    mission = load_mission(
        name,
        {
            "seed": seed,
            "duration_s": max(LEAST_S, plain.duration_s),
            "expect": [],
            "ground.operator": "scripted",
            "ground.script": [*teach, supervise],
            "ground.rules": [*RULES, {"rule": "avoids", "places": [AVOIDED[name]]}],
        },
    ).mission
    view = view_of(flown(mission).records)
    answers = [review.answer for _, review in view.each(GROUND_REVIEW)]
    reached = [place for place in places if view.reached(place) is not None]
    return {
        "mission": name,
        "taught": lessons > 0,
        "seed": seed,
        "goals": len(places),
        "reached": len(reached),
        "approved": answers.count(Answer.APPROVED),
        "vetoed": answers.count(Answer.VETOED),
        "left": "" if view.operator is None else str(view.operator.waiting_for or ""),
    }


def goals_of(mission: MissionFile) -> list[str]:
    """The named places of a yard but for where the rover starts."""
    chart = mission.world.chart()
    named = (place_name(token) for token in chart.cells if is_place_token(token))
    return sorted(name for name in named if name.isalpha() and name != mission.rover.start)


def supervision_cases(seeds: Sequence[int]) -> Iterator[tuple[str, int, int]]:
    """Every run."""
    for name in MISSIONS:
        for lessons in (1, 0):
            yield from ((name, lessons, seed) for seed in seeds)
