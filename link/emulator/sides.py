"""Sessions with the two Zenoh domains, opened once they are there.

Whoever is not there yet is waited for. Zenoh's own waiting cannot be interrupted and gives no
reason, so it is told to try once, in a thread, and asked for the reason when it fails.
"""

import re
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from queue import Empty, SimpleQueue

import zenoh

from farside.link.emulator.domains import Domain, domain_at, in_words

_RETRY_S = 1.0
"""Between two attempts to connect (project default)."""

_PATIENCE_S = 2.0
"""After which an attempt without an answer is told of as waiting (project default)."""

_GRACE_S = 1.0
"""For an attempt under way at the end (project default); one takes milliseconds or many seconds."""

_REFUSALS = (
    ("invalid peer certificate", "one whose certificate is not trusted"),
    ("received fatal alert", "one that does not trust the certificate of this side, or misses it"),
    ("close message (reason", "one that refuses the session, as it does a wrong user or password"),
    ("not supported for", "no such protocol"),
    ("invalid port", "no such port"),
    ("invalid socket address", "no host with a port"),
)
"""What Zenoh says where no waiting helps, and what was found then."""

_OF_SYSTEM = re.compile(r"([^:\[\]]+) \(os error \d+\)")

_Outcome = tuple[Domain, zenoh.Session | BaseException]
_Outcomes = SimpleQueue[_Outcome]


class AbsentError(ConnectionError):
    """Nobody answers there; waiting may help."""

    def __init__(self, domain: Domain, reason: str) -> None:
        super().__init__(f"{_expected(domain)}, found none: {reason}")
        self.reason = reason


@contextmanager
def open_session(locator: str, name: str) -> Iterator[zenoh.Session]:
    """A session with other Zenoh programs that are there, closed at the end.

    Args:
        locator: a router or peer to connect to, such as `tcp/192.0.2.1:7447`; with the prefix
            `listen/`, the address on which to be a router that others connect to.
        name: what is there, in the words of a message.

    Raises:
        ConnectionError: if nobody answers there, or the address is not free.
    """
    with _open(domain_at(locator, name)) as session:
        yield session


@contextmanager
def open_sides(
    domains: Sequence[Domain], notify: Callable[[str], None]
) -> Iterator[list[zenoh.Session]]:
    """Sessions with all domains once all are there, closed at the end.

    Args:
        domains: whose sessions, in this order.
        notify: called with a message when one is waited for, and when it is there at last.

    Raises:
        ConnectionError: if an address to listen on is not free, or somebody there refuses.
    """
    opened: dict[Domain, zenoh.Session] = {}
    waited_for: set[Domain] = set()
    outcomes: _Outcomes = SimpleQueue()
    over = threading.Event()
    # Daemons, since nothing ends an attempt of Zenoh's before its time.
    threads = [
        threading.Thread(target=_attempt, args=(domain, outcomes, over), daemon=True)
        for domain in domains
    ]
    with ExitStack() as stack:
        stack.callback(_leave, threads, outcomes, over)
        for thread in threads:
            thread.start()
        while len(opened) < len(domains):
            for domain, outcome in _next(outcomes, [one for one in domains if one not in opened]):
                if isinstance(outcome, zenoh.Session):
                    opened[domain] = stack.enter_context(outcome)
                    if domain in waited_for:
                        notify(f"{domain.name}: connected")
                elif not isinstance(outcome, AbsentError):
                    raise outcome
                elif domain not in waited_for:
                    waited_for.add(domain)
                    there = ", ".join(domain.connect)
                    notify(f"{domain.name}: waiting for it at {there}: {outcome.reason}")
        yield [opened[domain] for domain in domains]


def _next(outcomes: _Outcomes, missing: Sequence[Domain]) -> list[_Outcome]:
    """The next outcome; after a while without any, that those missing are absent."""
    try:
        return [outcomes.get(timeout=_PATIENCE_S)]
    except Empty:
        return [(domain, AbsentError(domain, "no answer")) for domain in missing]


def _attempt(domain: Domain, outcomes: _Outcomes, over: threading.Event) -> None:
    """Open a session, in a thread of its own, as often as it takes."""
    while not over.is_set():
        outcome: zenoh.Session | BaseException
        try:
            outcome = _open(domain)
        except BaseException as error:  # noqa: BLE001 - raised where it can be seen; some are panics
            outcome = error
        outcomes.put((domain, outcome))
        if not isinstance(outcome, AbsentError):
            break
        over.wait(_RETRY_S)
    if over.is_set():
        _close_rest(outcomes)


def _leave(threads: Sequence[threading.Thread], outcomes: _Outcomes, over: threading.Event) -> None:
    """Begin no more attempts, and let those under way come to their end if that is soon.

    A thread that came back from Zenoh while the interpreter is being taken down would abort it.
    """
    over.set()
    for thread in threads:
        thread.join(_GRACE_S)
    _close_rest(outcomes)


def _close_rest(outcomes: _Outcomes) -> None:
    """Close sessions that nobody waits for any more: with one open, the process would not end."""
    while not outcomes.empty():
        _, outcome = outcomes.get()
        if isinstance(outcome, zenoh.Session):
            outcome.close()


def _open(domain: Domain) -> zenoh.Session:
    is_client = domain.mode == "client"
    if not is_client:
        # A peer or router opens whoever is there.
        _find(domain)
    try:
        return zenoh.open(domain.config())
    except zenoh.ZError as error:
        if is_client:
            _find(domain)
        if not domain.listen:
            raise AbsentError(domain, in_words(error)) from error
        raise ConnectionError(
            f"expected to be able to listen for the {domain.name} on {', '.join(domain.listen)}, "
            f"found: {in_words(error)}"
        ) from error


def _find(domain: Domain) -> None:
    """Connect for a moment to the first who can be connected to.

    Raises:
        AbsentError: if nobody is there.
        ConnectionError: if nobody else is there than somebody who refuses.
    """
    # Only to a peer that must connect at once does Zenoh give a reason.
    settings = {
        "mode": "peer",
        "listen/endpoints": [],
        "connect/timeout_ms": 0,
        "connect/exit_on_failure": True,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
    }
    reasons = []
    for locator in domain.connect:
        try:
            zenoh.open(domain.config(settings | {"connect/endpoints": [locator]})).close()
        except zenoh.ZError as error:
            reasons.append(in_words(error))
        else:
            return
    for reason in reasons:
        for said, found in _REFUSALS:
            if said in reason:
                detail = reason[reason.index(said) :].partition(" on: ")[0]
                raise ConnectionError(f"{_expected(domain)}, found {found}: {detail}")
    if reasons:
        match = _OF_SYSTEM.search(reasons[0])
        reason = reasons[0] if match is None else match[1].strip()
        raise AbsentError(domain, reason.replace("deadline has elapsed", "no answer"))


def _expected(domain: Domain) -> str:
    return f"expected a Zenoh router or peer of the {domain.name} at {', '.join(domain.connect)}"
