"""Registers missions as gymnasium environments, where this is imported; see `docs/gymnasium.md`.

    import gymnasium
    import farside.gymnasium

    env = gymnasium.make("farside/blackout-v0", seat="ground")

Or in one, as gymnasium imports what stands before a colon:
`gymnasium.make("farside.gymnasium:farside/blackout-v0")`.

Requires Farside's extra `gymnasium`. Since version 1.0 gymnasium looks for no environments by
itself, whatever is installed.
"""

from gymnasium.envs.registration import register, registry

__all__ = ["MISSIONS"]

MISSIONS = ("blackout", "mars-relay", "shadow", "teach", "tether")
"""The shipped missions, each an environment of its name; `farside/mission-v0` takes any other."""

_ENTRY = "farside.missions.environment.environment:MissionEnv"

for _name in ("mission", *MISSIONS):
    if (_number := f"farside/{_name}-v0") not in registry:  # registered once, however often read
        register(_number, _ENTRY, kwargs={} if _name == "mission" else {"mission": _name})
