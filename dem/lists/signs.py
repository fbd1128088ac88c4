"""S, the Sign List: the known conjunctions of Tokens, and which contains which."""

import zlib
from array import array
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import msgspec

from farside.dem.changes import ListChange, SignAdded, SignRemoved
from farside.dem.lists.given import shown
from farside.dem.lists.packing import crc_of, packed, unpack_into

Sign = tuple[str, ...]
"""A conjunction of Tokens, sorted and without duplicates."""


def to_sign(tokens: Iterable[str]) -> Sign:
    """The Sign of `tokens`, in any order and with any duplicates.

    Raises:
        TypeError: if `tokens` is a string, whose letters would pass as Tokens, or not all of them
            are strings.
        ValueError: if one has half a character, which cannot be saved.
    """
    if isinstance(tokens, str):
        raise TypeError(
            f"expected Tokens, found the string {shown(tokens)}: write [{shown(tokens)}]"
        )
    try:
        sign = tuple(sorted(set(tokens)))
        # The quickest way to look at the type of all: every cycle begins here.
        "".join(sign).encode()
    except TypeError as error:
        raise TypeError(f"expected Tokens, strings all of them, found {shown(tokens)}") from error
    except UnicodeEncodeError as error:
        raise ValueError(f"expected Tokens of whole characters, found {shown(tokens)}") from error
    return sign


class ActiveSigns(NamedTuple):
    """The active Signs, and the novel ones among them, as ids in order of age."""

    active: list[int]
    novel: list[int]


class SignsState(msgspec.Struct, frozen=True, array_like=True):
    """A Sign List as it is saved: by id the names and the `packed` order of age, and the rest."""

    names: tuple[Sign, ...]
    born: bytes
    free: tuple[int, ...]
    never_active: tuple[int, ...]


class SignList:
    """S, every known Sign, by ids that count from 0; those of removed Signs are reused.

    A Token becomes a Sign when it is first sensed. A conjunction is indexed under one of its
    Tokens only, the one with the fewest conjunctions, so that the time to find the active Signs
    depends on how many Tokens are sensed and not on how many Signs are known.

    Attributes:
        names: Tokens by id, empty for a free id.
        born: serial number of creation by id, which gives the order of age.
        structure: incremented whenever a Sign is added or removed.
        changed: ids of Signs that the policy map must look at, since the list was last cleared.
        recorded: where all changes are recorded for a shadow; `None` if they are not.
    """

    def __init__(self) -> None:
        self.names: list[Sign] = []
        self.born = array("q")
        self.structure = 0
        self.changed: list[int] = []
        self.recorded: list[ListChange] | None = None
        self._ids: dict[Sign, int] = {}
        self._indexed: dict[str, list[int]] = {}
        self._compounds: dict[str, list[int]] = {}
        self._never_active: set[int] = set()
        self._free: list[int] = []
        self._births = 0

    def __len__(self) -> int:
        return len(self._ids)

    def find(self, sign: Sign) -> int | None:
        """The id of `sign`, `None` if it is not known."""
        return self._ids.get(sign)

    def by_age(self) -> list[int]:
        """All ids, oldest first."""
        return sorted(self._ids.values(), key=self.born.__getitem__)

    def add(self, sign: Sign) -> int:
        """Add `sign` unless it is known, and return its id."""
        known = self._ids.get(sign)
        if known is not None:
            return known
        known = self._take_id(sign)
        if len(sign) > 1:
            self._never_active.add(known)
            self._index(known)
        return known

    def activate(self, sign: Sign) -> int:
        """Add a Sign that is active now unless it is known, and return its id."""
        known = self.add(sign)
        self._never_active.discard(known)
        return known

    def remove(self, sign: int) -> None:
        """Remove a Sign. The caller makes sure that nothing refers to it."""
        self.changed += self.wholes(sign)
        name = self.names[sign]
        if len(name) > 1:
            for token in name:
                self._compounds[token].remove(sign)
                if sign in self._indexed.get(token, ()):
                    self._indexed[token].remove(sign)
        self._never_active.discard(sign)
        del self._ids[name]
        self.names[sign] = ()
        self._free.append(sign)
        self.structure += 1
        self.changed.append(sign)
        if self.recorded is not None:
            self.recorded.append(SignRemoved(sign))

    def sense(self, tokens: Sign) -> ActiveSigns:
        """Find the active Signs, adding one for each new Token."""
        active, novel = [], []
        for token in tokens:
            sign = self._ids.get((token,))
            if sign is None:
                sign = self.add((token,))
                novel.append(sign)
            active.append(sign)
        if self._indexed:
            conjunctions = self._active_conjunctions(tokens)
            active += conjunctions
            novel += self._never_active.intersection(conjunctions)
            self._never_active.difference_update(conjunctions)
        return ActiveSigns(self._oldest_first(active), self._oldest_first(novel))

    def active(self, tokens: Sign) -> list[int]:
        """The known Signs that are active when `tokens` are sensed, oldest first."""
        known = [self._ids[(token,)] for token in tokens if (token,) in self._ids]
        return self._oldest_first(known + self._active_conjunctions(tokens))

    def parts(self, sign: int) -> list[int]:
        """The known Signs that `sign` implies: those of a proper subset of its Tokens."""
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
        """The known Signs that imply `sign`: those of a proper superset of its Tokens."""
        tokens = self.names[sign]
        if not tokens or not self._compounds:
            return []
        candidates = self._compounds.get(tokens[0], ())
        if len(tokens) == 1:
            return list(candidates)
        mine = set(tokens)
        return [other for other in candidates if other != sign and mine.issubset(self.names[other])]

    def is_compound(self, sign: int) -> bool:
        """Whether the Sign has more than one Token."""
        return len(self.names[sign]) > 1

    def tokens(self, sign: int) -> list[int]:
        """The Tokens of a Sign that were sensed, each as a Sign of its own."""
        return [self._ids[(token,)] for token in self.names[sign] if (token,) in self._ids]

    def state(self) -> SignsState:
        """Everything that `restore` needs."""
        return SignsState(
            names=tuple(self.names),
            born=packed(self.born),
            free=tuple(self._free),
            never_active=tuple(sorted(self._never_active)),
        )

    def crc(self) -> int:
        """CRC-32 of the Signs by id, of their order of age, and of which ids are reused next.

        Which Signs were never active is left out: a shadow does not know.
        """
        names = zlib.crc32(msgspec.msgpack.encode(self.names))
        return crc_of([self.born, array("q", self._free)], names)

    def restore(self, state: SignsState) -> None:
        """Become the list that `state` was taken from. This one must be new."""
        self.names += state.names
        unpack_into(self.born, state.born)
        self._free += state.free
        self._never_active.update(state.never_active)
        # A free id keeps its serial number, so the greatest is the last that was assigned.
        self._births = max(self.born, default=0)
        self._ids.update((name, sign) for sign, name in enumerate(self.names) if name)
        for sign in self.by_age():
            if self.is_compound(sign):
                self._index(sign)

    def _index(self, compound: int) -> None:
        tokens = self.names[compound]
        indexes = [self._indexed.setdefault(token, []) for token in tokens]
        min(indexes, key=len).append(compound)
        for token in tokens:
            self._compounds.setdefault(token, []).append(compound)

    def _oldest_first(self, signs: Sequence[int]) -> list[int]:
        return sorted(signs, key=self.born.__getitem__) if len(signs) > 1 else list(signs)

    def _active_conjunctions(self, tokens: Sign) -> list[int]:
        sensed = set(tokens)
        return [
            sign
            for token in tokens
            for sign in self._indexed.get(token, ())
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
        if self.recorded is not None:
            self.recorded.append(SignAdded(sign))
        return known
