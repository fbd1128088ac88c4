"""Links over the whole schema, as `farside link` takes them: what `@given` draws them from."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
from hypothesis import reject
from hypothesis import strategies as st

from farside.link import LinkConfig
from farside.link.profile.layers import LinkConfigError, preset_names, with_preset
from farside.link.profile.plans.times import Window
from farside.link.profile.resolve import resolve_link

HORIZON_S = 200_000.0
GREATEST_S = 1e9
GREATEST_WHOLE = 2**63 - 1

Table = dict[str, Any]

fractions = st.sampled_from(
    [0.0, 1.0, 5e-324, 1e-300, 1e-17, 1e-12, 1e-6, 1e-3, 0.5, 1 - 2**-53]
) | st.floats(0, 1)

positive_s = (
    st.sampled_from([1e-12, 1e-9, 1e-6, 1e-3, 1.0, 1e4, GREATEST_S])
    | st.floats(1e-3, 10)
    | st.floats(1e-12, GREATEST_S)
)
seconds = st.just(0.0) | positive_s
times_s = st.sampled_from([0.0, 1e-9, 1.0, GREATEST_S]) | st.floats(0, 100) | seconds

rates_bit_s = (
    st.sampled_from([1, 1000, 9600, 10**6, 10**9, 10**11, GREATEST_WHOLE])
    | st.integers(1, 10**6)
    | st.integers(1, GREATEST_WHOLE)
)
counts = (
    st.sampled_from([1, 2, 63, 64, 1500, 4096, 65_536, 10**9, GREATEST_WHOLE])
    | st.integers(1, 3000)
    | st.integers(1, GREATEST_WHOLE)
)


def _growing(times: st.SearchStrategy[float], most: int) -> st.SearchStrategy[list[float]]:
    return st.lists(times, min_size=1, max_size=most, unique=True).map(sorted)


def _many(start: int, count: int, entry: Callable[[int], Table]) -> list[Table]:
    return [entry(start + number) for number in range(count)]


@st.composite
def delay_tables(draw: st.DrawFn) -> list[Table]:
    if draw(st.integers(0, 19)) == 0:
        step_s, up_s, half = draw(st.sampled_from([0.5, 60.0])), draw(seconds), 50
        return _many(
            0,
            2000,
            lambda n: {"t_s": n * step_s, "delay_s": up_s * abs(n % (2 * half) - half) / half},
        )
    return [{"t_s": t_s, "delay_s": draw(seconds)} for t_s in draw(_growing(times_s, 6))]


@st.composite
def rate_tables(draw: st.DrawFn) -> list[Table]:
    if draw(st.integers(0, 19)) == 0:
        step_s = draw(st.sampled_from([0.5, 60.0]))
        return _many(0, 2000, lambda n: {"t_s": n * step_s, "rate_bit_s": 1000 * (n % 170)})
    some = st.just(0) | rates_bit_s | st.sampled_from([8000, 16_000])
    starts_s = [0.0, *(t_s for t_s in draw(_growing(times_s, 6)) if t_s)]
    return [{"t_s": t_s, "rate_bit_s": draw(some)} for t_s in starts_s]


@st.composite
def traces(draw: st.DrawFn) -> Table:
    if draw(st.integers(0, 19)) == 0:
        times_ms = [n * n % 7 + 3 * n for n in range(3000)]
    else:
        some = st.integers(0, 20) | st.integers(0, 10**6) | st.integers(0, GREATEST_WHOLE)
        times_ms = draw(st.lists(some, min_size=1, max_size=8))
    return {
        "times_ms": sorted([*times_ms, draw(st.integers(1, 50))]),
        "at_end": draw(st.sampled_from(["wrap", "end"])),
    }


@st.composite
def losses(draw: st.DrawFn) -> float | Table:
    match draw(st.integers(0, 3)):
        case 0:
            return draw(fractions)
        case 1:
            keys = {"p": draw(fractions), "r": draw(fractions)}
            for key in ("bad_loss", "good_loss"):
                if draw(st.booleans()):
                    keys[key] = draw(fractions)
            return {"model": "gilbert-elliott", **keys}
        case 2:
            p = draw(fractions)
            return {"model": "correlated", "probability": p, "correlation": draw(correlations(p))}
        case _:
            p13, p14, p32, p31 = (draw(fractions) for _ in range(4))
            p14 = min(p14, 1 - p13) if p13 + p14 > 1 else p14
            keys = {"p13": p13, "p14": p14, "p23": draw(fractions)}
            if draw(st.booleans()):
                keys |= {"p31": min(p31, 1 - p32) if p31 + p32 > 1 else p31, "p32": p32}
            return {"model": "four-state", **keys}


@st.composite
def delay_traces(draw: st.DrawFn) -> Table:
    """The same as measured; what wraps has a length."""
    points = draw(delay_tables())
    wraps = draw(st.booleans()) and points[-1]["t_s"] > 0
    return {"points": points, "at_end": "wrap" if wraps else "hold"}


def correlations(probability: float) -> st.SearchStrategy[float]:
    """Those that two states with this probability can have."""
    rarer = min(probability, 1 - probability)
    least = -rarer / (1 - rarer)
    some = st.sampled_from([0.0, 0.5, 0.999, 0.999999999]) | st.floats(0, 1, exclude_max=True)
    return some | st.floats(max(least, -1 + 1e-9), 0) if least else some


@st.composite
def jitters(draw: st.DrawFn, *, remembers: bool = True) -> Table:
    """A jitter; one that does not remember has no correlation."""
    shapes = ["uniform", "exponential", "normal", "pareto", "paretonormal", "table"]
    jitter: Table = {"spread_s": draw(positive_s), "shape": draw(st.sampled_from(shapes))}
    if jitter["shape"] == "table":
        entries = st.integers(-(1 << 15), (1 << 15) - 1)
        few, many = st.lists(entries, min_size=1, max_size=5), st.just(list(range(-9000, 9000, 7)))
        jitter["table"] = draw(few | many)
    if jitter["shape"] not in {"uniform", "exponential"} and draw(st.booleans()):
        jitter["mean_s"] = draw(seconds)
    if remembers and draw(st.booleans()):
        jitter["correlation"] = draw(
            st.sampled_from([0.0, 0.999999999, -0.999999999, 0.9, -0.5])
            | st.floats(-1, 1, exclude_min=True, exclude_max=True)
        )
    return jitter


@st.composite
def reorders(draw: st.DrawFn) -> Table:
    share = draw(fractions)
    reorder = {"share": share, "hold_s": draw(positive_s)}
    return reorder | ({"correlation": draw(correlations(share))} if draw(st.booleans()) else {})


@st.composite
def slots(draw: st.DrawFn) -> Table:
    limits = {name: draw(counts) for name in ("frames", "bytes") if draw(st.booleans())}
    if draw(st.integers(0, 3)) == 0:
        return {"wait": draw(jitters(remembers=False)), **limits}
    if draw(st.booleans()):
        return {"min_s": draw(positive_s), **limits}
    waits_s = sorted([draw(seconds), draw(positive_s)])
    return {"min_s": waits_s[0], "max_s": waits_s[1], **limits}


bit_error_rates = fractions | st.floats(1e-9, 1e-2)

IMPAIRMENTS: dict[str, st.SearchStrategy[Any]] = {
    "loss": losses(),
    "bit_error_rate": bit_error_rates,
    "corrupt": fractions,
    "jitter": jitters(),
    "reorder": reorders(),
    "duplicate": fractions,
    "slots": slots(),
}

_DELAYS: tuple[dict[str, st.SearchStrategy[Any]], ...] = (
    {"delay_s": seconds},
    {"delay_table": delay_tables()},
    {"delay_trace": delay_traces()},
)
_RATES: tuple[dict[str, st.SearchStrategy[Any]], ...] = (
    {},
    {"rate_bit_s": rates_bit_s},
    {"rate_table": rate_tables()},
    {"rate_trace": traces()},
)
_REST: dict[str, st.SearchStrategy[Any]] = {
    "overhead_byte": st.sampled_from([0, 1, 20, 1499, 1500, 1501, 65_535]) | st.integers(0, 100),
    "queue_byte": counts,
    "queue_frame": counts,
    "drop": st.sampled_from(["newest", "oldest", "lowest"]),
    "lifetime_s": positive_s,
    "bit_errors": st.sampled_from(["lose", "flip"]),
    **IMPAIRMENTS,
}


@st.composite
def ways(draw: st.DrawFn, *, bare: bool = False) -> Table:
    """One direction; `bare` without what a contact plan gives."""
    given: Table = {}
    if not bare:
        for choice in (draw(st.sampled_from(_DELAYS)), draw(st.sampled_from(_RATES))):
            given |= {key: draw(strategy) for key, strategy in choice.items()}
    names = draw(st.lists(st.sampled_from(sorted(_REST)), unique=True, max_size=6))
    return given | {name: draw(_REST[name]) for name in names}


affected = st.sampled_from(["up", "down", "both"])


@st.composite
def changes(draw: st.DrawFn) -> Table:
    choices = {"rate_bit_s": rates_bit_s, **IMPAIRMENTS}
    names = draw(st.lists(st.sampled_from(sorted(choices)), unique=True, min_size=1, max_size=3))
    given = {name: draw(choices[name]) for name in names}
    return {"at_s": draw(times_s), "direction": draw(affected), **given}


@st.composite
def blackouts(draw: st.DrawFn) -> list[Table]:
    if draw(st.integers(0, 19)) == 0:
        period_s = draw(st.sampled_from([0.002, 2.0, 600.0]))
        return _many(
            0, 2000, lambda n: {"start_s": n * period_s, "end_s": n * period_s + period_s / 2}
        )
    spans = draw(st.lists(st.tuples(times_s, positive_s, affected), max_size=5))
    return [
        {"start_s": start_s, "end_s": start_s + length_s, "direction": direction}
        for start_s, length_s, direction in spans
        if start_s < start_s + length_s <= GREATEST_S
    ]


@st.composite
def passes(draw: st.DrawFn) -> Table:
    period_s = draw(st.floats(HORIZON_S / 1000, 3 * HORIZON_S))
    return {
        "first_s": draw(times_s),
        "period_s": period_s,
        "length_s": period_s * draw(st.floats(0.001, 0.999)),
        "direction": draw(affected),
    }


@st.composite
def plans(draw: st.DrawFn) -> str:
    """A contact plan of ION for the nodes 1 and 2, which may have only the node 3 between them."""
    by_another = draw(st.integers(0, 3)) == 0
    pairs = ["1 3", "3 2", "2 3", "3 1"] if by_another else ["1 2", "2 1"]
    lines, at_s = [], 0
    for number in range(draw(st.integers(len(pairs), 8))):
        at_s += draw(st.integers(0, 40))
        end_s = at_s + draw(st.sampled_from([1, 2, 10, 100, 5000]))
        rate = draw(st.sampled_from([1, 100, 1000, 2000, 10**9]))
        # Each pair once at least.
        nodes = pairs[number] if number < len(pairs) else draw(st.sampled_from(pairs))
        lines.append(f"a contact +{at_s} +{end_s} {nodes} {rate}")
        at_s = end_s
    owlt_s = draw(st.integers(0, 1000))
    ranges = (f"a range +0 +{at_s + 1} {pair} {owlt_s}" for pair in ("1 2", "1 3", "2 3"))
    return "\n".join([*lines, *ranges, ""])


@st.composite
def profiles(draw: st.DrawFn) -> LinkConfig:
    """Any link, resolved."""
    kind = draw(st.sampled_from(["plain", "plain", "plain", "preset", "contacts"]))
    table: Table = {}
    texts: dict[str, str] = {}
    if kind == "contacts":
        texts["plan.ionrc"] = draw(plans())
        table = {"contacts": {"file": "plan.ionrc", "ground": 1, "rover": 2}}
    if kind == "preset":
        table = {"preset": draw(st.sampled_from(preset_names()))}
    if kind == "plain" or draw(st.booleans()):
        table |= {name: draw(ways(bare=kind != "plain")) for name in ("up", "down")}
    if draw(st.booleans()):
        table["changes"] = draw(st.lists(changes(), max_size=4))
    if draw(st.booleans()):
        table["blackouts"] = draw(blackouts())
    if draw(st.integers(0, 4)) == 0:
        table["passes"] = draw(passes())
    is_whole = draw(st.booleans())
    if " 3 " not in texts.get("plan.ionrc", ""):
        return resolved(table, texts, is_whole=is_whole)
    try:
        return resolved(table, texts, is_whole=is_whole)
    except LinkConfigError:
        # By way of other nodes, not all that a link has is taken.
        reject()


def resolved(
    table: Table, texts: dict[str, str] | None = None, *, is_whole: bool = True
) -> LinkConfig:
    """The link that a table describes, as a profile does.

    Args:
        table: the profile.
        texts: of the files that it names.
        is_whole: whether nothing is after the horizon, as in a mission and in the check.
    """
    window = Window(0.0, HORIZON_S, is_whole)
    config = msgspec.convert(with_preset(table), LinkConfig)
    return resolve_link(config, folder=Path(), window=window, texts=texts or {})
