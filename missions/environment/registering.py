"""The environments that gymnasium finds by itself where Farside is installed.

It looks for them at every `import gymnasium`, so nothing is imported here but that.
"""

from gymnasium.envs.registration import register, registry

MISSIONS = ("blackout", "mars-relay", "shadow", "teach", "tether")
"""The shipped missions, each an environment of its name."""

_ENTRY = "farside.missions.environment.environment:MissionEnv"


def register_environments() -> None:
    """Register `farside/mission-v0`, for any mission file, and one for each shipped mission.

    What is registered already stays as it is. Gymnasium calls this, as its entry point in the group
    `gymnasium.envs`.
    """
    _register("mission", {})
    for name in MISSIONS:
        _register(name, {"mission": name})


def _register(name: str, settings: dict[str, str]) -> None:
    number = f"farside/{name}-v0"
    if number not in registry:
        register(number, _ENTRY, kwargs=settings)
