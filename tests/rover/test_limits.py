"""Whatever the mission may say of body and drive, the physics stays finite."""

import math
from collections.abc import Callable
from typing import Any

import msgspec
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from farside.messages import Drive
from farside.rover.config import BodyConfig, DriveConfig
from farside.topics import TRUTH_POSE


def limits(table: type[msgspec.Struct]) -> st.SearchStrategy[dict[str, float]]:
    """Values for the bounded keys of a table, each at one of its limits or its default."""
    keys = {}
    for field in msgspec.inspect.type_info(table).fields:  # type: ignore[attr-defined]
        bounds = [bound for bound in (field.type.ge, field.type.le) if bound is not None]
        if len(bounds) == 2:
            keys[field.name] = st.sampled_from([*bounds, field.default])
    return st.fixed_dictionaries(keys)


@settings(
    deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(body=limits(BodyConfig), drive=limits(DriveConfig))
def test_a_rover_at_any_limit_has_a_pose(
    bench: Callable[..., Any], body: dict[str, float], drive: dict[str, float]
) -> None:
    rover = bench(start="A", body=body, drive={**drive, "give_up_s": 2.0})
    for action in "NESW":
        rover.order(Drive(action))
    rover.run_s(12)

    pose = rover.of(TRUTH_POSE)[-1]
    assert all(map(math.isfinite, (pose.x_m, pose.y_m, pose.heading_rad, pose.speed_m_s)))
