"""Missions as environments, in coarse ticks, which are the quicker ones."""

from collections.abc import Callable
from typing import Any

import gymnasium
import pytest

import farside.gymnasium  # noqa: F401 - registers them

Made = Callable[..., gymnasium.Env[Any, Any]]


@pytest.fixture
def make() -> Made:
    """`gymnasium.make("farside/NAME-v0")` in ticks of 0.2 s; `overrides` come on top."""

    def made(name: str, **settings: Any) -> gymnasium.Env[Any, Any]:
        overrides = {"tick_s": 0.2, **settings.pop("overrides", {})}
        return gymnasium.make(f"farside/{name}-v0", overrides=overrides, **settings)

    return made
