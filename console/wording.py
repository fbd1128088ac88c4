"""Times and numbers as both screens say them."""

from farside.node import NS_PER_S, to_s

_TENTH_NS = NS_PER_S // 10
_LONG_S = 120.0


def clock_text(t_ns: int) -> str:
    """A time of a clock, in hours, minutes, seconds and tenths: `0:10:31.2`."""
    tenths = max(0, t_ns) // _TENTH_NS
    minutes, tenths = divmod(tenths, 600)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{tenths // 10:02}.{tenths % 10}"


def span_text(duration_ns: int) -> str:
    """A duration: `1.4 s` up to two minutes, `12:05` in minutes above that, hours above those."""
    seconds = to_s(max(0, duration_ns))
    if seconds < _LONG_S:
        return f"{seconds:.1f} s"
    minutes, left = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02}:{left:02}" if hours else f"{minutes}:{left:02}"


def percent(share: float) -> str:
    """A share or probability: `83 %`; what is neither none nor all is never told as that."""
    if 0 < share < 0.01:
        return "< 1 %"
    if 0.99 < share < 1:
        return "> 99 %"
    return f"{share:.0%}".replace("%", " %")


def times_text(so_ns: int, learned_ns: int) -> str:
    """When something was so, and when it was learned, on the ground's clock."""
    return f"{clock_text(so_ns)} so, {clock_text(learned_ns)} learned"
