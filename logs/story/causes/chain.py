"""What led to a record: the chain of records behind it, each with a sentence.

A table says for each type of message where to look for what led to it; see `parents`. Every chain
ends where the log knows of nothing before: at an order of the operator, a goal of the mission, an
outage or a fault, the battery, or the start.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import msgspec

from farside.frames import FrameFate
from farside.logs.file.reading import LogFile
from farside.logs.spacetime import cargo_text
from farside.logs.story.causes.authority import Given
from farside.logs.story.causes.crossing import hops_of, made_of
from farside.logs.story.causes.parents import parents_of
from farside.logs.story.search import Found, Search
from farside.logs.story.sentences import fate_text, sentence
from farside.node import Record

_MOST = 200
_DEEPEST = 40


class Cause(NamedTuple):
    """A record that led to another one.

    Attributes:
        t_ns: its log time; of what stands in the mission, from when it counts.
        topic: its topic; empty for what stands in the mission and not in a record, and where the
            chain is cut.
        sentence: what it says.
        depth: how many steps before the record asked for: 1 for what led to it at once. What
            follows with a greater depth led to this one.
        is_first: whether the log knows of nothing that led to it.
    """

    t_ns: int
    topic: str
    sentence: str
    depth: int
    is_first: bool


def causes(log: LogFile | Search, record: Record) -> tuple[Cause, ...]:
    """What led to a record, the nearest first; each followed by what led to it in turn.

    Where several things together led to one, such as a goal and a mode to an action, each has its
    own branch, told by `Cause.depth`; what has been told before is not told again. A chain that
    would have more than 200, or lead back more than 40 steps, is cut, and its last cause says so.

    Args:
        log: the log; or a search in it, for whoever asks often.
        record: one of its records.

    Raises:
        LogError: if the log is damaged where the chain leads.
    """
    search = log if isinstance(log, Search) else Search(log)
    return causes_of(search, Found.of(record))


def causes_of(search: Search, found: Found[msgspec.Struct]) -> tuple[Cause, ...]:
    """`causes` of a record that has been decoded."""
    chain: list[Cause] = []
    is_whole = _follow(search, [found], 0, chain, set())
    if not is_whole:
        chain.append(Cause(found.t_ns, "", _CUT, 1, is_first=False))
    return tuple(chain[1:])


_CUT = f"more led to it: told are {_MOST} causes at most, and {_DEEPEST} steps back"


def _sentence(search: Search, found: Found[msgspec.Struct]) -> str:
    """The record's sentence; of a frame's fate, which does not say what was in it, with that."""
    if isinstance(found.message, FrameFate):
        made = made_of(search, found.message)
        what = "" if made is None else cargo_text(made.message)
        return fate_text(found.message, what, hops_of(search, found.message, found.t_ns))
    return sentence(found.entry)


def _follow(
    search: Search,
    found: Iterable[Found[msgspec.Struct] | Given],
    depth: int,
    chain: list[Cause],
    told: set[tuple[int, str, bytes | str]],
) -> bool:
    """Add to the chain what was found, and what led to that; false if it had to be cut."""
    is_whole = True
    for one in found:
        what = one.sentence if isinstance(one, Given) else msgspec.json.encode(one.message)
        key = one.t_ns, one.topic, what
        if key in told:
            continue
        if len(chain) > _MOST or depth > _DEEPEST:
            return False
        told.add(key)
        if isinstance(one, Given):
            chain.append(Cause(one.t_ns, one.topic, one.sentence, depth, not one.topic))
            continue
        place = len(chain)
        text = _sentence(search, one)
        chain.append(Cause(one.t_ns, one.topic, text, depth, is_first=False))
        parents = parents_of(search, one)
        is_whole &= _follow(search, parents, depth + 1, chain, told)
        chain[place] = chain[place]._replace(is_first=not parents)
    return is_whole


def outline(chain: tuple[Cause, ...]) -> Iterator[tuple[int, Cause]]:
    """The causes with the depth to indent each by: one more only where several led to one.

    A long chain of one cause each stays at one margin, so that branches are seen.
    """
    children: Counter[int] = Counter()
    parents: list[int] = []  # of each cause, by place; -1 for the record itself
    above: dict[int, int] = {0: -1}
    for place, cause in enumerate(chain):
        parent = above.get(cause.depth - 1, -1)
        above[cause.depth] = place
        parents.append(parent)
        children[parent] += 1
    indents: dict[int, int] = {-1: -1 if children[-1] > 1 else 0}
    for place, cause in enumerate(chain):
        parent = parents[place]
        indents[place] = indents[parent] + (children[parent] > 1)
        yield indents[place], cause
