"""The one owner of proposals: which stands, for what situation, and whether it has consent."""

from farside.control import Chooser
from farside.messages import Proposal, ProposedStep, Tokens
from farside.node import NS_PER_S, Journal, to_s
from farside.rover.config import Consent, ConsentConfig
from farside.topics import ROVER_PROPOSAL, ROVER_PROPOSAL_ENDED, ProposalEnded, reasons

_MARGIN_NS = 4 * NS_PER_S  # what a lost frame may take on top of a round trip

Situation = tuple[object, ...]
"""What a proposal was made for: it dies with it."""


class Proposals:
    """Keeps the proposal that stands, one at a time.

    With consent by veto it is carried out when the veto window has run out. The window runs from
    when the ground has said that the operator was shown the proposal; from one frame heard to the
    next, and over no silence; and it does not end while a command is known to be on its way that
    may be the veto.

    Args:
        config: how the operator consents.
        round_trip_ns: of the link.
        grace_ns: a gap between frames as long as this is silence.
        journal: where proposals and their ends are noted.

    Attributes:
        standing: the proposal that stands.
    """

    def __init__(
        self, config: ConsentConfig, round_trip_ns: int, grace_ns: int, journal: Journal
    ) -> None:
        self._round_trip_ns = round_trip_ns
        self.change(config, grace_ns)
        self._journal = journal
        self._last = 0
        self._situation: Situation | None = None
        self._vetoed: Situation | None = None
        self._counted_ns: int | None = None  # up to when the window has run
        self._ran_ns = 0
        self._may_end = False
        self.standing: Proposal | None = None

    def change(self, config: ConsentConfig, grace_ns: int) -> None:
        """Take consent by `config` from now on, for proposals that are made from now on."""
        self._window_ns: int | None = None
        if config.by is Consent.VETO:
            asked_ns = int(config.veto_window_s * NS_PER_S)
            self._window_ns = max(asked_ns, self._round_trip_ns + _MARGIN_NS)
        self._grace_ns = grace_ns

    def absence(self, number: int) -> str:
        """Why a proposal does not stand, in words."""
        if not 0 < number <= self._last:
            return f"there is no proposal {number}"
        if self.standing is None:
            return f"proposal {number} is no more"
        return f"proposal {number} gave way to {self.standing.number}"

    def may_make(self, situation: Situation) -> bool:
        """Whether a proposal is due: none stands, and this situation has had no veto."""
        return self.standing is None and situation != self._vetoed

    def make(
        self,
        situation: Situation,
        goal: Tokens,
        action: str,
        path: tuple[ProposedStep, ...],
        *,
        by_approval: bool,
        model_check: int | None = None,
        last_command: int = 0,
    ) -> Proposal:
        """Make the proposal that stands from now on; see `Proposal` for what it says.

        `by_approval`: whatever the mission says of consent.
        """
        self._last += 1
        window_ns = None if by_approval else self._window_ns
        self._situation, self._vetoed = situation, None
        self._counted_ns, self._ran_ns, self._may_end = None, 0, False
        self.standing = Proposal(
            number=self._last,
            time_ns=self._journal.now_ns,
            goal=goal,
            action=action,
            path=path,
            veto_window_s=None if window_ns is None else to_s(window_ns),
            model_check=model_check,
            last_command=last_command,
        )
        self._journal.note(ROVER_PROPOSAL, self.standing)
        return self.standing

    def follow(self, situation: Situation) -> None:
        """End the proposal if the situation is another one than it was made for."""
        if self.standing is not None and situation != self._situation:
            self.end(reasons.OTHER_SITUATION.of())

    def end(self, why: str) -> None:
        """The proposal does not stand any more."""
        if self.standing is not None:
            self._journal.note(ROVER_PROPOSAL_ENDED, ProposalEnded(self.standing.number, why))
            self.standing = None

    def veto(self) -> None:
        """The operator does not want it: nothing is proposed again in this situation."""
        self._vetoed = self._situation
        self.end(reasons.VETOED.of())

    # --- consent by veto window ----------------------------------------------------------------

    def shown(self, number: int, now_ns: int) -> None:
        """The operator was shown a proposal: the window may run."""
        if self.standing is not None and self.standing.number == number:
            self._counted_ns = now_ns if self._counted_ns is None else self._counted_ns

    def heartbeat(self, now_ns: int, *, all_arrived: bool) -> None:
        """The ground was heard; `all_arrived` if every command that it has given has arrived."""
        self._may_end = all_arrived
        if self._counted_ns is None or now_ns <= self._counted_ns:
            return
        gap_ns = now_ns - self._counted_ns
        self._ran_ns += gap_ns if gap_ns < self._grace_ns else 0
        self._counted_ns = now_ns

    @property
    def chooser(self) -> Chooser:
        """Who chose what is proposed: the policy map, or the track back, which has no path."""
        has_path = self.standing is not None and self.standing.path
        return Chooser.GOAL_DIRECTED if has_path else Chooser.RETURNING

    @property
    def has_consent(self) -> bool:
        """Whether the proposal that stands has not been vetoed in time."""
        proposal = self.standing
        return (
            proposal is not None
            and proposal.veto_window_s is not None
            and self._may_end
            and self._ran_ns >= proposal.veto_window_s * NS_PER_S
        )
