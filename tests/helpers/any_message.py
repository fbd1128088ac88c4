"""Any message that a log may hold, for properties."""

from typing import Any

import msgspec.inspect as mi
from hypothesis import strategies as st

from farside.topics import TOPICS, Yard

SCALARS: dict[type[mi.Type], st.SearchStrategy[Any]] = {
    mi.FloatType: st.floats(allow_nan=False, allow_infinity=False),
    mi.IntType: st.integers(-(2**63), 2**63 - 1),
    mi.StrType: st.text(max_size=8),
    mi.BoolType: st.booleans(),
    mi.NoneType: st.none(),
}


YARDS = st.builds(
    lambda inside, cell_m: Yard(("######", f"#.{inside}#", "######"), cell_m),
    st.text("#.o~", min_size=3, max_size=3),
    st.floats(0.01, 1000),
)


def values(kind: mi.Type) -> st.SearchStrategy[Any]:
    """Any value that msgspec accepts for `kind`."""
    match kind:
        case mi.StructType(cls=cls, fields=fields):
            parts = {field.name: values(field.type) for field in fields}
            return YARDS if cls is Yard else st.builds(cls, **parts)
        case mi.VarTupleType(item_type=item):
            return st.lists(values(item), max_size=3).map(tuple)
        case mi.UnionType(types=types):
            return st.one_of(*map(values, types))
        case mi.EnumType(cls=cls):
            return st.sampled_from(cls)
        case mi.FloatType(ge=float(least), le=float(most)):
            return st.floats(least, most)
    return SCALARS[type(kind)]


messages = st.sampled_from(list(TOPICS.values())).flatmap(
    lambda topic: values(mi.type_info(topic.kind))
)
