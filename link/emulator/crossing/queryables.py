"""Where the near side is asked for the far side: queryables that stand for those over there.

A key without wildcards has a queryable on the near side while there is one on the far side,
complete if that is: so whoever looks for it, or asks for complete ones only, finds what is there.
What is served under a key with wildcards Zenoh does not tell. Such a key always has one, which is
incomplete so that it hides none of the near side's own.
"""

from collections import OrderedDict
from collections.abc import Callable, Sequence
from functools import partial

import zenoh

_MAX_WATCHED = 1024
"""How many keys are watched at once for whether anybody serves them."""

_REMOTE = zenoh.Locality.REMOTE


class Queryables:
    """The queryables of the near side for all keys on which queries cross.

    Args:
        near, far: sessions with the two sides.
        keys: on which queries cross.
        take: called once with each query, in a thread of Zenoh.
        later: has something done in the relay's own thread.
    """

    def __init__(
        self,
        near: zenoh.Session,
        far: zenoh.Session,
        keys: Sequence[zenoh.KeyExpr],
        take: Callable[[zenoh.Query], None],
        later: Callable[[Callable[[], None]], None],
    ) -> None:
        self._near, self._far, self._take, self._later = near, far, take, later
        self._wild = [key for key in keys if is_wild(key)]
        self._mirrors: dict[str, _Mirror] = {}
        self._watched: OrderedDict[str, zenoh.Querier] = OrderedDict()
        # As long as there is one for the wildcards, Zenoh knows at once what is served under them.
        self._interests = [far.declare_querier(key) for key in self._wild]
        for number, key in enumerate(self._wild):
            listener = _direct(partial(self._listen_wild, number))
            near.declare_queryable(key, listener, allowed_origin=_REMOTE)
        for key in keys:
            if not is_wild(key):
                self.mirror(str(key))

    def mirror(self, key: str) -> None:
        """From now on, have a queryable for a key without wildcards while the far side has one."""
        if key not in self._mirrors:
            mirror = _Mirror(self._near, self._far, key, _direct(partial(self._listen_exact, key)))
            self._mirrors[key] = mirror
            mirror.watch(lambda _: self._later(mirror.update))

    def unmirror(self, key: str) -> None:
        """No longer have a queryable of its own for a key."""
        if key in self._mirrors:
            self._mirrors.pop(key).close()

    def is_served(self, key: zenoh.KeyExpr) -> bool:
        """Whether anybody on the far side may reply to a query on `key`; yes with wildcards."""
        if is_wild(key):
            return True
        text = str(key)
        querier = self._watched.get(text)
        if querier is None:
            querier = _watch(self._far, text, zenoh.QueryTarget.ALL)
            self._watched[text] = querier
            if len(self._watched) > _MAX_WATCHED:
                self._watched.popitem(last=False)[1].undeclare()
        else:
            self._watched.move_to_end(text)
        return _matches(querier)

    def _listen_wild(self, number: int, query: zenoh.Query) -> None:
        key = query.key_expr
        mirror = self._mirrors.get(str(key))
        is_ours = mirror is None or not mirror.is_open
        if is_ours and not any(other.intersects(key) for other in self._wild[:number]):
            self._take(query)
        else:
            query.drop()

    def _listen_exact(self, key: str, query: zenoh.Query) -> None:
        asked, mirror = query.key_expr, self._mirrors.get(key)
        if str(asked) == key:
            is_ours = mirror is not None and mirror.is_open
        else:
            # It has wildcards, so whoever meets it first takes it.
            mirrors = [one.key for one in list(self._mirrors.values()) if one.is_open]
            first = next((one for one in mirrors if asked.intersects(one)), None)
            is_ours = first == key and not any(other.intersects(asked) for other in self._wild)
        if is_ours:
            self._take(query)
        else:
            query.drop()


class _Mirror:
    """A key without wildcards, and its queryable on the near side while there is one."""

    def __init__(
        self,
        near: zenoh.Session,
        far: zenoh.Session,
        key: str,
        listener: "zenoh.handlers.Callback[zenoh.Query]",
    ) -> None:
        self.key = key
        self.is_open = False
        self._near, self._listener = near, listener
        self._any = _watch(far, key, zenoh.QueryTarget.ALL)
        self._complete = _watch(far, key, zenoh.QueryTarget.ALL_COMPLETE)
        self._is_complete = False
        self._queryable: zenoh.Queryable[None] | None = None
        self._is_closed = False

    def watch(self, changed: Callable[[zenoh.MatchingStatus], None]) -> None:
        """Be told when to `update`."""
        for querier in (self._any, self._complete):
            querier.declare_matching_listener(changed)
        self.update()

    def update(self) -> None:
        """Have a queryable if the far side has one, complete if that is."""
        if self._is_closed:
            return
        exists, is_complete = _matches(self._any), _matches(self._complete)
        if exists is self.is_open and is_complete is self._is_complete:
            return
        before = self._queryable
        self.is_open, self._is_complete, self._queryable = False, is_complete, None
        if before is not None:
            before.undeclare()
        if exists:
            self._queryable = self._near.declare_queryable(
                self.key, self._listener, complete=is_complete, allowed_origin=_REMOTE
            )
            self.is_open = True

    def close(self) -> None:
        """Have none any more."""
        self.is_open, self._is_closed = False, True
        for entity in (self._queryable, self._any, self._complete):
            if entity is not None:
                entity.undeclare()  # type: ignore[no-untyped-call]


def is_wild(key: zenoh.KeyExpr) -> bool:
    """Whether a key expression has wildcards."""
    return "*" in str(key)


def _watch(far: zenoh.Session, key: str, target: zenoh.QueryTarget) -> zenoh.Querier:
    return far.declare_querier(key, target=target, allowed_destination=_REMOTE)


def _matches(querier: zenoh.Querier) -> bool:
    # Zenoh declares this a bool, and gives an object that is always true.
    status: bool = querier.matching_status.matching  # type: ignore[attr-defined]
    return status


def _direct(
    listen: Callable[[zenoh.Query], None],
) -> "zenoh.handlers.Callback[zenoh.Query]":
    """A callback in the thread that receives, since a thread for each key would be too many."""
    return zenoh.handlers.Callback(listen, indirect=False)
