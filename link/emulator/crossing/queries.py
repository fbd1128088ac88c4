"""Queries of one side: taken there, asked on the other side, and replied to here.

A query crosses as a message, and so does each reply, and the end of the replies. If a query or a
reply is lost, its caller waits until its time is up; a lost end is sent again. Of a query, all
that Zenoh shows to whoever replies to it crosses: key, parameters, payload, encoding, attachment,
which replies it accepts, source; of a reply, all that can be set. Not shown are a query's priority,
target, consolidation, and how long its caller waits. On the way it has Zenoh's default priority. On
the far side it goes to the best matching queryables; see also `queryables` beside this. All replies
cross, for consolidation is the caller's. The query is asked for ever, so that it never ends before
its caller's time is up.
"""

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Protocol

import msgspec
import zenoh

from farside.link.emulator.crossing.exchanges import MAX_OPEN, Exchanges
from farside.link.emulator.crossing.queryables import Queryables
from farside.link.emulator.crossing.ros import service_key
from farside.link.emulator.crossing.samples import OWN_KEYS
from farside.node import to_ns, to_s

_FOREVER_S = 1e9

_DEFAULT_TIMEOUT_NS = to_ns(10.0)
"""How long a caller waits that asks for nothing else (Zenoh's `queries_default_timeout`)."""

_REMOTE = zenoh.Locality.REMOTE

_ADVANCED = "/@adv/"
"""In the keys on which advanced subscribers ask advanced publishers for what they missed."""


class Question(msgspec.Struct, frozen=True, gc=False):
    """A query on its way: its number, and everything of it but its payload."""

    number: int
    key: zenoh.KeyExpr
    parameters: zenoh.Parameters
    has_payload: bool
    encoding: zenoh.Encoding | None
    attachment: zenoh.ZBytes | None
    accepted: zenoh.ReplyKeyExpr
    source: zenoh.SourceInfo | None


class Answer(msgspec.Struct, frozen=True, gc=False):
    """A reply on its way: its query, its own number, and everything of it but its payload.

    An error has no key.
    """

    number: int
    index: int
    encoding: zenoh.Encoding
    key: zenoh.KeyExpr | None = None
    deletes: bool = False
    attachment: zenoh.ZBytes | None = None
    timestamp: zenoh.Timestamp | None = None


class End(msgspec.Struct, frozen=True, gc=False):
    """The end of the replies to a query, of which there were `total`."""

    number: int
    total: int


class Post(Protocol):
    """The link and its loop, as queries see them."""

    def ask(
        self,
        time_ns: int,
        payload: bytes,
        question: Question,
        matters: Callable[[], bool] | None,
    ) -> None:
        """Send a query through the link, until it arrives if it `matters`."""

    def reply(
        self, time_ns: int, payload: bytes, answer: Answer, matters: Callable[[], bool] | None
    ) -> None:
        """Send a reply back through the link, until it arrives if it `matters`."""

    def end(self, time_ns: int, end: End, matters: Callable[[], bool]) -> None:
        """Send the end of the replies back through the link, until it arrives."""

    def least_round_trip_ns(self) -> int:
        """How long a query and its reply take at least."""

    def later(self, task: Callable[[int], None]) -> None:
        """Have something done in the loop's own thread, with the present time."""

    def notify(self, text: str) -> None:
        """Tell the user something."""


class Queries:
    """Takes the queries of the near side, and asks them on the far side when they arrive.

    Args:
        near, far: sessions with the two sides.
        keys: on which queries cross.
        post: the link.
    """

    def __init__(
        self, near: zenoh.Session, far: zenoh.Session, keys: Sequence[zenoh.KeyExpr], post: Post
    ) -> None:
        self._far, self._post = far, post
        self._exchanges: Exchanges[zenoh.Query] = Exchanges()
        self._cancel: dict[int, zenoh.CancellationToken] = {}
        self._warned: set[str] = set()
        self._keys = keys
        self._services: Counter[str] = Counter()
        self._queryables = Queryables(
            near, far, keys, self._take, lambda task: post.later(lambda _: task())
        )

    def service(self, token: str, *, present: bool) -> None:
        """A token of the far side appeared or vanished; if it is a service's, stand for that."""
        key = service_key(token)
        if key is None or not any(one.intersects(key) for one in self._keys):
            return
        self._services[key] += 1 if present else -1
        if not self._services[key]:
            del self._services[key]
            self._queryables.unmirror(key)
        elif present:
            self._queryables.mirror(key)

    def _take(self, query: zenoh.Query) -> None:
        if any(query.key_expr == own for own in OWN_KEYS):
            query.drop()
        else:
            self._post.later(partial(self._ask, query))

    def _ask(self, query: zenoh.Query, time_ns: int) -> None:
        key = query.key_expr
        if not self._queryables.is_served(key):
            query.drop()
            return
        payload = query.payload
        question = Question(
            self._exchanges.begin(query, time_ns),
            key,
            query.parameters,
            payload is not None,
            query.encoding,
            query.attachment,
            query.accepts_replies(),
            query.source_info,
        )
        self._post.ask(
            time_ns,
            b"" if payload is None else payload.to_bytes(),
            question,
            self._assured(question.number, key),
        )
        if question.number == 0:
            self._warn_of_patience(self._post.least_round_trip_ns())
        if (oldest := self._exchanges.overflow()) is not None:
            number, unanswered = oldest
            self._close(number, unanswered)
            self._warn_once(
                "open",
                f"more than {MAX_OPEN:,} queries are open without an answer: the oldest are ended",
            )

    def arrive(self, payload: bytes, question: Question) -> None:
        """A query arrived: ask it on the far side."""
        number = question.number
        if not self._exchanges.ask(number):
            return
        self._cancel[number] = cancel = zenoh.CancellationToken()
        self._far.get(
            zenoh.Selector(question.key, question.parameters),
            _direct(
                lambda reply: self._post.later(partial(self._reply, question, reply)),
                lambda: self._post.later(partial(self._end, number)),
            ),
            consolidation=zenoh.ConsolidationMode.NONE,
            accept_replies=question.accepted,
            timeout=_FOREVER_S,
            payload=payload if question.has_payload else None,
            encoding=question.encoding,
            attachment=question.attachment,
            allowed_destination=_REMOTE,
            source_info=question.source,
            cancellation_token=cancel,
        )

    def _reply(self, question: Question, reply: zenoh.Reply, time_ns: int) -> None:
        number = question.number
        assured = self._assured(number, question.key)
        index = self._exchanges.reply(number)
        if index is None:
            return
        sample = reply.ok
        if sample is None:
            error = reply.result
            answer = Answer(number, index, error.encoding)
            self._post.reply(time_ns, error.payload.to_bytes(), answer, assured)
            return
        answer = Answer(
            number,
            index,
            sample.encoding,
            sample.key_expr,
            sample.kind == zenoh.SampleKind.DELETE,
            sample.attachment,
            sample.timestamp,
        )
        self._post.reply(time_ns, sample.payload.to_bytes(), answer, assured)

    def _assured(self, number: int, key: zenoh.KeyExpr) -> Callable[[], bool] | None:
        """Whether what belongs to a query still has to arrive; `None` where it may be lost.

        An advanced subscriber (a latched one in ROS 2) tells nothing new before its query for what
        it missed has ended, and may wait for that for ever.
        """
        return partial(self._exchanges.is_open, number) if _ADVANCED in str(key) else None

    def _end(self, number: int, time_ns: int) -> None:
        self._cancel.pop(number, None)
        total = self._exchanges.end(number)
        if total is not None:
            is_open = partial(self._exchanges.is_open, number)
            self._post.end(time_ns, End(number, total), is_open)

    def receive(self, payload: bytes, reply: Answer | End, time_ns: int) -> None:
        """A reply or the end of the replies arrived: give it to the caller."""
        number = reply.number
        if isinstance(reply, End):
            done = self._exchanges.finish(number, time_ns, reply.total)
        else:
            query = self._exchanges.receive(number, reply.index, time_ns)
            if query is not None:
                _give(query, payload, reply)
            done = self._exchanges.finish(number, time_ns)
        self._warn_of_patience(self._exchanges.longest_ns)
        if done is not None:
            done.drop()

    def _close(self, number: int, query: zenoh.Query) -> None:
        query.drop()
        if (cancel := self._cancel.pop(number, None)) is not None:
            cancel.cancel()

    def _warn_of_patience(self, round_trip_ns: int) -> None:
        if round_trip_ns > _DEFAULT_TIMEOUT_NS:
            self._warn_once(
                "patience",
                f"a query and its answer take {to_s(round_trip_ns):,.1f} s: whoever asks for no "
                f"longer timeout waits for {to_s(_DEFAULT_TIMEOUT_NS):.0f} s, and hears no answer",
            )

    def _warn_once(self, kind: str, text: str) -> None:
        if kind not in self._warned:
            self._warned.add(kind)
            self._post.notify(text)


def _direct(
    take: Callable[[zenoh.Reply], None], end: Callable[[], None]
) -> "zenoh.handlers.Callback[zenoh.Reply]":
    """A callback in the thread that receives, and not in one of its own for each query."""
    return zenoh.handlers.Callback(take, end, indirect=False)


def _give(query: zenoh.Query, payload: bytes, answer: Answer) -> None:
    """Reply to `query` as it was replied to on the far side."""
    key = answer.key
    if key is None:
        query.reply_err(payload, encoding=answer.encoding)
    elif answer.deletes:
        query.reply_del(
            key,
            attachment=answer.attachment,
            timestamp=answer.timestamp,
        )
    else:
        query.reply(
            key,
            payload,
            encoding=answer.encoding,
            attachment=answer.attachment,
            timestamp=answer.timestamp,
        )
