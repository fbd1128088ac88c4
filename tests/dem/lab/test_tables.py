"""The lists as tables: every attribute a column, in each of the three libraries."""

import sys

import msgspec
import numpy as np
import pytest

from farside.dem import DynamicExpectancyModel, Hypothesis, PolicyValue, ShadowModel
from farside.dem.lab import hypotheses, policy, signs


@pytest.fixture
def model() -> DynamicExpectancyModel:
    """Knows the way from 0 to 3, and that it is bright everywhere."""
    model = DynamicExpectancyModel({"E": 1.0, "W": 1.0}, rng=np.random.default_rng(0))
    for place, action in [(0, "E"), (1, "E"), (2, "E"), (3, "W"), (2, None)]:
        model.sense([f"at:{place}", "bright"])
        model.perform(action)
    model.set_goal(["at:3"], priority=1.0)
    return model


def test_hypotheses_are_rows_with_all_that_is_known_of_them(model: DynamicExpectancyModel) -> None:
    table = hypotheses(model)
    names = [field.name for field in msgspec.structs.fields(Hypothesis)]
    frame = table.to_polars()
    assert frame.columns == names
    assert len(frame) == len(table) == model.hypothesis_count
    assert [
        Hypothesis(**{**row, "context": tuple(row["context"]), "outcome": tuple(row["outcome"])})
        for row in frame.to_dicts()
    ] == list(model.hypotheses)


def test_pandas_and_arrow_have_the_same_rows(model: DynamicExpectancyModel) -> None:
    table = hypotheses(model)
    frame = table.to_pandas()
    assert list(frame.cm) == [one.cm for one in model.hypotheses]
    assert [tuple(sign) for sign in frame.context] == [one.context for one in model.hypotheses]
    assert table.to_arrow().num_rows == len(frame)


def test_signs_are_told_with_what_refers_to_them_and_their_value(
    model: DynamicExpectancyModel,
) -> None:
    rows = {tuple(row["sign"]): row for row in signs(model).to_polars().to_dicts()}
    assert list(rows) == list(model.signs)
    assert rows["at:3",]["value"] == 0.0
    assert rows["at:2",]["as_outcome"] == sum(one.outcome == ("at:2",) for one in model.hypotheses)
    assert rows["bright",]["as_context"] == sum(
        one.context == ("bright",) for one in model.hypotheses
    )


def test_the_map_is_a_table_from_the_goal_on(model: DynamicExpectancyModel) -> None:
    frame = policy(model).to_polars()
    assert frame.columns == [field.name for field in msgspec.structs.fields(PolicyValue)]
    assert frame["value"].to_list() == [row.value for row in model.policy_map()]
    assert frame["action"].to_list()[0] is None


def test_a_shadow_at_the_ground_has_the_same_tables(model: DynamicExpectancyModel) -> None:
    model.record_changes()
    shadow = ShadowModel({"E": 1.0, "W": 1.0}, model.parameters)
    shadow.apply(model.take_delta())
    for table in (hypotheses, signs, policy):
        assert table(shadow).rows == table(model).rows


def test_the_tables_of_a_new_model_are_empty_and_have_their_columns() -> None:
    model = DynamicExpectancyModel({"E": 1.0}, rng=np.random.default_rng(0))
    for table in (hypotheses(model), signs(model), policy(model)):
        assert table.to_polars().shape[0] == 0
        assert table.to_polars().shape[1] >= 4


@pytest.mark.parametrize("missing", ["polars", "pyarrow"])
def test_who_lacks_a_library_is_told_what_to_install(
    model: DynamicExpectancyModel, missing: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, missing, None)
    with pytest.raises(ModuleNotFoundError, match=f"expected {missing} .+: pip install '"):
        hypotheses(model).to_polars()
