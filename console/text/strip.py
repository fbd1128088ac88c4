"""The light strip of a screen: the words between ground and rover, about now."""

from rich.text import Text

from farside.console.screen.screen import Strip
from farside.logs.terminal.strip import LEAST_NS, NAMES_WIDTH, SLOPE, Drawing
from farside.node import Role, to_s

STRIP_ROWS = 5
"""Rows of the strip, without a frame."""

_AFTER = 3  # one in so many columns is later than now
_TAKE_BACK = "✕"


def strip_title(strip: Strip) -> str:
    """What the strip shows, and how long light takes, which is how long a word is on its way."""
    light = f" {to_s(light_ns(strip)):.2f} s" if strip.words else ""
    return f"light{light}: ╲ up  ╱ down  ┄ not known  {_TAKE_BACK} last take-back"


def light_ns(strip: Strip) -> int:
    """The shortest time that a word of it is on its way, above 0; 1 s without a word."""
    times = [word.arrives_ns - word.sent_ns for word in strip.words]
    return min((time_ns for time_ns in times if time_ns > 0), default=10**9)


def strip_rows(strip: Strip, now_ns: int, width: int) -> list[Text]:
    """The strip in `STRIP_ROWS` rows of a width; no farther than it goes."""
    columns = max(width - NAMES_WIDTH, _AFTER)
    span_ns = max(strip.until_ns - strip.from_ns, columns)
    # So that the slope of a word is seen, if that leaves the strip as long as its place is.
    per_ns = max(min(max(light_ns(strip), LEAST_NS) // SLOPE, span_ns // columns), 1)
    # In whole columns, so that what is drawn moves and does not flicker.
    first_ns = (now_ns // per_ns - columns * (_AFTER - 1) // _AFTER) * per_ns
    drawing = Drawing(first_ns, per_ns, columns, now_ns)
    last_ns = first_ns + columns * per_ns
    drawing.gap(now_ns + per_ns, last_ns, "─", Role.GROUND)
    drawing.gap(strip.known_ns, last_ns, "┄", Role.ROVER)
    for begin_ns, end_ns in strip.gaps:
        drawing.gap(begin_ns, end_ns, " ", Role.GROUND)
    for word in strip.words:
        drawing.word(
            word.direction, word.sent_ns, word.arrives_ns, label=word.label, routine=word.routine
        )
    for number, time_ns in strip.begins:
        drawing.label(time_ns, str(number), Role.ROVER)
    for _, time_ns in strip.take_backs:
        drawing.label(time_ns, _TAKE_BACK, Role.GROUND)
    return list(drawing.rows())
