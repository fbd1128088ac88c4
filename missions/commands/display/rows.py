"""What a run came to, as rows of texts; without what draws them, which takes long to import."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple, Protocol

from farside.escaping import printable
from farside.logs.result import GoalResult, Judgement, LinkResult, ModeResult

UNMET = "NO"
"""What stands in the second column of an expectation that was not met."""


class Rows(NamedTuple):
    """A table of texts.

    Attributes:
        columns: their headings.
        rows: the texts, fit for a terminal.
        numbers: which columns hold numbers, from 0 on.
    """

    columns: tuple[str, ...]
    rows: list[tuple[str, ...]]
    numbers: tuple[int, ...] = ()

    def lines(self) -> Iterator[str]:
        """The table as lines of text."""
        widths = [max(map(len, column)) for column in zip(self.columns, *self.rows, strict=True)]
        for row in (self.columns, *self.rows):
            cells = [
                cell.rjust(width) if number in self.numbers else cell.ljust(width)
                for number, (cell, width) in enumerate(zip(row, widths, strict=True))
            ]
            yield "  ".join(cells).rstrip()


def rows_of(
    columns: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[int] = ()
) -> Rows:
    """A table of texts from a log, whatever they hold."""
    fit = [tuple(map(printable, row)) for row in rows]
    return Rows(tuple(columns), fit, tuple(numbers))


class Told(Protocol):
    """What both the result of a run and the information on a log tell."""

    @property
    def modes(self) -> tuple[ModeResult, ...]:
        """See `RunResult`."""
        ...

    @property
    def goals(self) -> tuple[GoalResult, ...]:
        """See `RunResult`."""
        ...

    @property
    def link(self) -> LinkResult:
        """See `RunResult`."""
        ...

    @property
    def expectations(self) -> tuple[Judgement, ...]:
        """See `RunResult`."""
        ...


def tables(told: Told) -> Iterator[Rows]:
    """Modes, goals, link and expectations, as far as there are any."""
    for table in (_modes(told), _goals(told), _link(told), _expectations(told)):
        if table.rows:
            yield table


def _modes(told: Told) -> Rows:
    rows = [(f"{mode.t_s:.1f} s", mode.mode, mode.why) for mode in told.modes]
    return rows_of(("from", "mode", "why"), rows)


def _goals(told: Told) -> Rows:
    rows = [
        (
            " ".join(goal.tokens),
            goal.source,
            f"{goal.set_s:.1f} s",
            "never" if goal.reached_s is None else f"{goal.reached_s:.1f} s",
        )
        for goal in told.goals
    ]
    return rows_of(("goal", "of", "set", "reached"), rows)


def _link(told: Told) -> Rows:
    """Frames by fate. A rare fate has a column only if a frame met it."""
    directions = {"up": told.link.uplink, "down": told.link.downlink}
    columns = {
        "frames": [counters.sent for counters in directions.values()],
        "delivered": [counters.delivered for counters in directions.values()],
        "lost": [counters.lost for counters in directions.values()],
        "in outage": [counters.outage for counters in directions.values()],
        "queue full": [counters.queue_full for counters in directions.values()],
    }
    rare = {
        "expired": [counters.expired for counters in directions.values()],
        "bit errors": [counters.bit_error for counters in directions.values()],
        "store full": [counters.store_full for counters in directions.values()],
        "no route": [counters.no_route for counters in directions.values()],
        "damaged": [counters.damaged for counters in directions.values()],
        "twice": [counters.duplicated for counters in directions.values()],
        "refused": [counters.refused for counters in directions.values()],
        "in shadow": [counters.shadowed for counters in directions.values()],
    }
    columns |= {name: counts for name, counts in rare.items() if any(counts)}
    rows = []
    for name, counters, *counts in zip(
        directions, directions.values(), *columns.values(), strict=True
    ):
        delay = "" if counters.delay_s is None else f"{counters.delay_s:.2f} s"
        rows.append((name, *map(str, counts), delay))
    return rows_of(("link", *columns, "mean delay"), rows)


def _expectations(told: Told) -> Rows:
    rows = [
        (judgement.name, "yes" if judgement.met else UNMET, judgement.detail)
        for judgement in told.expectations
    ]
    return rows_of(("expected", "met", "found"), rows)
