"""The foot of the replay's screen: where playback is, and the keys."""

import math
from collections.abc import Sequence

from rich.text import Text

from farside.logs.events import time_text
from farside.logs.playing import Player

Key = tuple[str, str]
"""A key, and what it does."""

_DIM, _BOLD, _FAIR = "bright_black", "bold", "yellow"
STEP_S, SEEK_S, FAR_S = 1, 10, 60
"""Simulated seconds of a step, a seek, and one far away."""

_GAP = "  "
_BAR_MIN = 8


def keys_of(player: Player, *, loop_from_ns: int | None = None) -> list[Key]:
    """The keys of a replay, and what they do now.

    Args:
        player: what plays.
        loop_from_ns: where the next loop will begin, if that is marked.
    """
    loop = "loop from here" if loop_from_ns is None else "loop to here"
    return [
        ("space", "pause" if player.playing else "play"),
        ("←→", f"{STEP_S} s"),
        ("⇧←→", f"{SEEK_S} s"),
        ("[ ]", "event"),
        ("+ -", "speed"),
        ("r", "reverse"),
        ("l", "no loop" if player.loop_ns else loop),
        ("g", "go to"),
        ("q", "leave"),
    ]


def keys_text(keys: Sequence[Key], width: int) -> list[Text]:
    """The keys in as many rows as they need in `width` columns; none is cut in two."""
    rows = [Text(no_wrap=True)]
    for key, does in keys:
        words = Text.assemble((key, _BOLD), " ", (does, _DIM))
        row = rows[-1]
        if row.cell_len + len(_GAP) + words.cell_len > width and row.cell_len:
            rows.append(row := Text(no_wrap=True))
        row.append(" " if not row.cell_len else _GAP).append(words)
    return rows


def transport(
    player: Player,
    width: int,
    *,
    loop_from_ns: int | None = None,
    at_end: str = "end",
    note: str = "",
) -> Text:
    """One row: what playback does, how far it is in the log, and the loop.

    Args:
        player: what plays.
        width: columns to fill.
        loop_from_ns: where the next loop will begin, if that is marked.
        at_end: a word for having come to the end.
        note: what else there is to say.
    """
    left = Text(f" {_state(player, at_end)} {speed_text(player.speed)} ", style=_BOLD, no_wrap=True)
    right = f" {time_text(player.log.end_ns)} "
    if player.loop_ns is not None:
        begin, end = map(time_text, player.loop_ns)
        right += f" loop {begin} to {end} "
    elif loop_from_ns is not None:
        right += f" loop from {time_text(loop_from_ns)} "
    said = Text(f" {note} " if note else "", style=_FAIR)
    room = width - left.cell_len - len(right) - said.cell_len
    if room >= _BAR_MIN:
        left.append(_bar(player, room))
    # The note comes first where there is no room for all.
    row = Text.assemble(left, (right, _DIM), said) if room >= 0 else Text.assemble(left, said)
    row.no_wrap = True
    row.truncate(width, overflow="ellipsis")
    return row


def speed_text(speed: float) -> str:
    """Simulated seconds per wall second, such as `×20`."""
    return "max" if math.isinf(speed) else f"×{speed:g}"


def _state(player: Player, at_end: str) -> str:
    if not player.playing:
        return "‖ paused"
    if player.at_end:
        return "■ beginning" if player.backwards else f"■ {at_end}"
    return "◀ reverse" if player.backwards else "▶ playing"


def _bar(player: Player, width: int) -> Text:
    """The whole log, with the loop in it and the present on it."""
    bar = Text("─" * width, style=_DIM)
    if player.loop_ns is not None:
        begin, end = (_column(player, time_ns, width) for time_ns in player.loop_ns)
        bar = Text("─" * begin + "═" * (end - begin) + "─" * (width - end), style=_DIM)
    now = _column(player, player.now_ns, width)
    return Text.assemble(bar[:now], ("●", _BOLD), bar[now + 1 :])


def _column(player: Player, time_ns: int, width: int) -> int:
    end_ns = max(player.log.end_ns, 1)
    return min(max(time_ns, 0), end_ns) * (width - 1) // end_ns
