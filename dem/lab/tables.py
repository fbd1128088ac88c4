"""The lists of a model as tables, for polars, pandas or pyarrow, whichever is asked for."""

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

import msgspec

from farside.dem.lists.hypothesis import Hypothesis
from farside.dem.lists.signs import Sign
from farside.dem.policy.planning import PolicyValue

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl
    import pyarrow as pa

_Row = TypeVar("_Row", bound=msgspec.Struct)


class Listed(Protocol):
    """What has lists: a `DynamicExpectancyModel`, or a `ShadowModel` at the ground."""

    @property
    def signs(self) -> tuple[Sign, ...]:
        """The Sign List."""
        ...

    @property
    def hypotheses(self) -> tuple[Hypothesis, ...]:
        """The Hypothesis List."""
        ...

    def policy_map(self) -> tuple[PolicyValue, ...]:
        """The top-goal's map."""
        ...


class SignRow(msgspec.Struct, frozen=True):
    """A Sign, as it stands in a table.

    Attributes:
        sign: its Tokens.
        tokens: how many these are.
        as_context: the number of hypotheses with it as their context.
        as_outcome: the number of hypotheses with it as their outcome.
        value: P_v towards the top-goal, `None` off its map.
    """

    sign: Sign
    tokens: int
    as_context: int
    as_outcome: int
    value: float | None


class Table(Generic[_Row]):
    """Rows of one kind; a column for each of its attributes, Signs as lists of Tokens.

    Attributes:
        rows: the rows.
    """

    def __init__(self, kind: type[_Row], rows: Sequence[_Row]) -> None:
        self._kind = kind
        self.rows = tuple(rows)

    def __len__(self) -> int:
        return len(self.rows)

    def to_arrow(self) -> "pa.Table":
        """As a pyarrow table.

        Raises:
            ModuleNotFoundError: without Farside's extra `tables`. The message says how to get it.
        """
        arrow = _needed("pyarrow", "farside[tables]")
        names = [field.name for field in msgspec.structs.fields(self._kind)]
        types = [_ARROW[field.type](arrow) for field in msgspec.structs.fields(self._kind)]
        schema = arrow.schema(list(zip(names, types, strict=True)))
        columns = {name: [getattr(row, name) for row in self.rows] for name in names}
        return arrow.table(columns, schema=schema)

    def to_polars(self) -> "pl.DataFrame":
        """As a polars frame.

        Raises:
            ModuleNotFoundError: without polars or pyarrow. The message says how to get it.
        """
        polars = _needed("polars", "polars")
        frame: pl.DataFrame = polars.from_arrow(self.to_arrow())
        return frame

    def to_pandas(self) -> "pd.DataFrame":
        """As a pandas frame; a Sign is an array of its Tokens.

        Raises:
            ModuleNotFoundError: without pandas or pyarrow. The message says how to get it.
        """
        _needed("pandas", "pandas")
        return self.to_arrow().to_pandas()


def hypotheses(model: Listed) -> Table[Hypothesis]:
    """The Hypothesis List, oldest first; the columns are the attributes of `Hypothesis`."""
    return Table(Hypothesis, model.hypotheses)


def signs(model: Listed) -> Table[SignRow]:
    """The Sign List, oldest first; the columns are the attributes of `SignRow`."""
    contexts: dict[Sign, int] = {}
    outcomes: dict[Sign, int] = {}
    for one in model.hypotheses:
        contexts[one.context] = contexts.get(one.context, 0) + 1
        outcomes[one.outcome] = outcomes.get(one.outcome, 0) + 1
    values = {row.sign: row.value for row in model.policy_map()}
    rows = [
        SignRow(sign, len(sign), contexts.get(sign, 0), outcomes.get(sign, 0), values.get(sign))
        for sign in model.signs
    ]
    return Table(SignRow, rows)


def policy(model: Listed) -> Table[PolicyValue]:
    """The top-goal's map, nearest first; the columns are the attributes of `PolicyValue`."""
    return Table(PolicyValue, model.policy_map())


_ARROW: dict[Any, Callable[[Any], Any]] = {
    Sign: lambda arrow: arrow.list_(arrow.string()),
    str: lambda arrow: arrow.string(),
    str | None: lambda arrow: arrow.string(),
    int: lambda arrow: arrow.int64(),
    float: lambda arrow: arrow.float64(),
    float | None: lambda arrow: arrow.float64(),
}


def _needed(module: str, package: str) -> Any:
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"expected {module} for this table, found none: pip install '{package}'", name=module
        ) from error
