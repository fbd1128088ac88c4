"""`farside missions` and `farside schema`: which missions there are, and how one is written."""

import json


def list_missions() -> None:
    """List the missions that come with Farside.

    A line each: its name, how long it is in simulated time, and what it is about.

    \b
    farside missions
    farside missions | grep -i drive
    """
    from farside.missions.loading import load_mission, shipped_missions

    missions = [load_mission(name).mission for name in shipped_missions()]
    lengths = [f"{mission.duration_s:g} s" for mission in missions]
    wide = max(len(mission.name) for mission in missions)
    long = max(map(len, lengths))
    for mission, length in zip(missions, lengths, strict=True):
        print(f"{mission.name:<{wide}}  {length:>{long}}  {mission.about}")  # noqa: T201


def show_schema() -> None:
    """Print the JSON Schema of a mission file, for editors.

    An editor that knows it completes keys, shows what they mean, and marks mistakes.

    \b
    farside schema > mission.schema.json
    """
    from farside.missions.format import mission_schema

    print(json.dumps(mission_schema(), indent=2, ensure_ascii=False))  # noqa: T201
