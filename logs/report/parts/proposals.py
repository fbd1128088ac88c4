"""The proposals: what they were, until when they stood, and what became of them."""

from typing import Any

from farside.logs.events import sign_text
from farside.logs.file.reading import LogEntry
from farside.logs.report.model import Lane, Proposed, Side, Span, View
from farside.logs.report.thinning import ms
from farside.messages import Proposal, Telemetry
from farside.node import Topic
from farside.topics import (
    GROUND_PROPOSAL,
    GROUND_REVIEW,
    GROUND_TELEMETRY,
    ROVER_PROPOSAL,
    ROVER_PROPOSAL_ENDED,
    ProposalEnded,
    Review,
)

_MOST = 1500


class Proposals:
    """On board, or as they came to the ground, which learns of an end by an answer of its own.

    Otherwise it learns by the telemetry: what stands is told there.
    """

    topics: tuple[Topic[Any], ...]

    def __init__(self, side: Side) -> None:
        self._as_ground = side.is_ground
        self.topics = (
            (GROUND_PROPOSAL, GROUND_REVIEW, GROUND_TELEMETRY)
            if self._as_ground
            else (ROVER_PROPOSAL, ROVER_PROPOSAL_ENDED)
        )
        self._all: dict[int, Proposed] = {}
        self._open: dict[int, Proposed] = {}
        self._left_out = 0

    def take(self, entry: LogEntry) -> None:
        """See `Gatherer`."""
        t_ns = entry.log_time_ns
        match entry.message:
            case Proposal() as made:
                self._make(made, t_ns)
            case ProposalEnded(number=number, why=why):
                self._end(number, why, t_ns, t_ns)
            case Review(proposal=number, answer=answer):
                self._end(number, str(answer), t_ns, t_ns)
            case Telemetry(proposal=standing, time_ns=time_ns):
                for number, proposed in list(self._open.items()):
                    if number != standing and ms(time_ns) > proposed.made:
                        self._end(number, "does not stand any more", time_ns, t_ns)

    def _make(self, made: Proposal, known_ns: int) -> None:
        if len(self._all) >= _MOST:
            self._left_out += 1
            return
        path = [sign_text(step.sign) for step in made.path]
        proposed = Proposed(made.number, ms(made.time_ns), made.action, sign_text(made.goal), path)
        if self._as_ground:
            proposed.known = ms(known_ns)
        self._all[made.number] = self._open[made.number] = proposed

    def _end(self, number: int, why: str, so_ns: int, known_ns: int) -> None:
        proposed = self._open.pop(number, None)
        if proposed is None:
            return
        proposed.ended, proposed.why = ms(so_ns), why
        if self._as_ground:
            proposed.known_end = ms(known_ns)

    def fill(self, view: View) -> None:
        """See `Gatherer`."""
        view.proposals = list(self._all.values())
        if not view.proposals:
            return
        spans = [
            Span(
                one.made,
                one.ended,
                "proposal",
                one.action,
                f"proposal {one.number}: {one.action}, towards {one.goal}"
                + (f"; {one.why}" if one.why else ""),
                one.known,
                one.known_end,
            )
            for one in view.proposals
        ]
        view.lanes.append(Lane("Proposal", spans))
        if self._left_out:
            view.notes.append(
                f"Proposals: the first {_MOST} are shown, {self._left_out} are left out"
            )
