"""S, the Sign List: every known conjunction of Tokens, and how Signs contain each other."""

from array import array
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import msgspec

from farside.dem.journal import Entry, SignAdded, SignRemoved
from farside.dem.lists.packing import packed, unpack_into

Sign = tuple[str, ...]
"""A conjunction of Tokens: each of them once, sorted."""


def to_sign(tokens: Iterable[str]) -> Sign:
    """The Sign of `tokens`, in whatever order they come and however often.

    Raises:
        TypeError: if `tokens` is a string, whose letters would pass for Tokens.
    """
    if isinstance(tokens, str):
        raise TypeError(f"expected Tokens, found the string {tokens!r}: write [{tokens!r}]")
    return tuple(sorted(set(tokens)))


class Sensing(NamedTuple):
    """What `SignList.sense` found, in order of age: the active Signs, and the novel among them."""

    active: list[int]
    novel: list[int]


class SignsState(msgspec.Struct, frozen=True, array_like=True):
    """A Sign List as it is saved: names and `packed` order of age by id, and what else it needs."""

    names: tuple[Sign, ...]
    born: bytes
    free: tuple[int, ...]
    never_active: tuple[int, ...]


class SignList:
    """S, every known Sign, by ids that count from 0 and are used again after a removal.

    A Token makes its own Sign when it is first sensed. A conjunction of several is watched under
    one of its Tokens only, the least watched, so that finding the active Signs costs what is
    sensed and not what is known.

    Attributes:
        names: Tokens by id, empty where there is no Sign.
        born: a number that grows with every Sign made, by id: the order of age.
        structure: moves on whenever Signs come or go.
        changed: ids that came or went since this was last cleared, for the policy map.
        journal: where Signs that come and go are written down, if anywhere.
    """

    def __init__(self) -> None:
        self.names: list[Sign] = []
        self.born = array("q")
        self.structure = 0
        self.changed: list[int] = []
        self.journal: list[Entry] | None = None
        self._ids: dict[Sign, int] = {}
        self._watched: dict[str, list[int]] = {}
        self._compounds: dict[str, list[int]] = {}
        self._never_active: set[int] = set()
        self._free: list[int] = []
        self._births = 0

    def __len__(self) -> int:
        return len(self._ids)

    def find(self, sign: Sign) -> int | None:
        """The id of `sign`, `None` where it is not known."""
        return self._ids.get(sign)

    def by_age(self) -> list[int]:
        """All ids, in order of age."""
        return sorted(self._ids.values(), key=self.born.__getitem__)

    def add(self, sign: Sign) -> int:
        """Make `sign` known, if it is not yet: its id."""
        known = self._ids.get(sign)
        if known is not None:
            return known
        known = self._take_id(sign)
        if len(sign) > 1:
            self._never_active.add(known)
            self._watch(known)
        return known

    def remove(self, sign: int) -> None:
        """Forget a Sign. The caller makes sure that nothing refers to it."""
        self.changed += self.wholes(sign)
        name = self.names[sign]
        if len(name) > 1:
            for token in name:
                self._compounds[token].remove(sign)
                if sign in self._watched.get(token, ()):
                    self._watched[token].remove(sign)
        self._never_active.discard(sign)
        del self._ids[name]
        self.names[sign] = ()
        self._free.append(sign)
        self.structure += 1
        self.changed.append(sign)
        if self.journal is not None:
            self.journal.append(SignRemoved(sign))

    def sense(self, tokens: Sign) -> Sensing:
        """Find the active Signs, making one for each new Token."""
        active, novel = [], []
        for token in tokens:
            sign = self._ids.get((token,))
            if sign is None:
                sign = self.add((token,))
                novel.append(sign)
            active.append(sign)
        if self._watched:
            conjunctions = self._active_conjunctions(tokens)
            active += conjunctions
            novel += self._never_active.intersection(conjunctions)
            self._never_active.difference_update(conjunctions)
        return Sensing(self._aged(active), self._aged(novel))

    def parts(self, sign: int) -> list[int]:
        """Known Signs that `sign` implies: those whose Tokens are some of its own, not all."""
        tokens = self.names[sign]
        if len(tokens) < 2:
            return []
        single = [self._ids[(token,)] for token in tokens if (token,) in self._ids]
        if len(tokens) == 2:
            return single
        mine = set(tokens)
        compounds = {
            other: None
            for token in tokens
            for other in self._compounds.get(token, ())
            if other != sign and mine.issuperset(self.names[other])
        }
        return single + list(compounds)

    def wholes(self, sign: int) -> list[int]:
        """Known Signs that imply `sign`: those that hold all its Tokens and more."""
        tokens = self.names[sign]
        if not tokens or not self._compounds:
            return []
        candidates = self._compounds.get(tokens[0], ())
        if len(tokens) == 1:
            return list(candidates)
        mine = set(tokens)
        return [other for other in candidates if other != sign and mine.issubset(self.names[other])]

    def is_compound(self, sign: int) -> bool:
        """Whether the Sign has several Tokens."""
        return len(self.names[sign]) > 1

    def state(self) -> SignsState:
        """Everything that `restore` needs."""
        return SignsState(
            names=tuple(self.names),
            born=packed(self.born),
            free=tuple(self._free),
            never_active=tuple(sorted(self._never_active)),
        )

    def restore(self, state: SignsState) -> None:
        """Become the list that `state` was taken of. This one is new and has no Signs yet."""
        self.names += state.names
        unpack_into(self.born, state.born)
        self._free += state.free
        self._never_active.update(state.never_active)
        # A removed Sign's number stays until its id is used again: the greatest is the last given.
        self._births = max(self.born, default=0)
        self._ids.update((name, sign) for sign, name in enumerate(self.names) if name)
        for sign in self.by_age():
            if self.is_compound(sign):
                self._watch(sign)

    def _watch(self, compound: int) -> None:
        tokens = self.names[compound]
        watches = [self._watched.setdefault(token, []) for token in tokens]
        min(watches, key=len).append(compound)
        for token in tokens:
            self._compounds.setdefault(token, []).append(compound)

    def _aged(self, signs: Sequence[int]) -> list[int]:
        return sorted(signs, key=self.born.__getitem__) if len(signs) > 1 else list(signs)

    def _active_conjunctions(self, tokens: Sign) -> list[int]:
        sensed = set(tokens)
        return [
            sign
            for token in tokens
            for sign in self._watched.get(token, ())
            if sensed.issuperset(self.names[sign])
        ]

    def _take_id(self, sign: Sign) -> int:
        self.structure += 1
        self._births += 1
        if self._free:
            known = self._free.pop()
            self.names[known] = sign
            self.born[known] = self._births
        else:
            known = len(self.names)
            self.names.append(sign)
            self.born.append(self._births)
        self._ids[sign] = known
        self.changed.append(known)
        if self.journal is not None:
            self.journal.append(SignAdded(sign))
        return known
