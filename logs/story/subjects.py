"""What a story can be about: the grammar of `farside story LOG SUBJECT`."""

from enum import StrEnum
from typing import NamedTuple

from farside.messages import Tokens
from farside.node import Direction
from farside.validation import did_you_mean, shown

GRAMMAR = "command:NUMBER, proposal:NUMBER, event:NUMBER, goal:PLACE or frame:up|down:NUMBER"
"""How a subject is written, for messages."""

_DIGITS = 18  # what is longer is no number of a log's


class Kind(StrEnum):
    """The kinds of things that have a story."""

    COMMAND = "command"
    PROPOSAL = "proposal"
    EVENT = "event"
    GOAL = "goal"
    FRAME = "frame"


class SubjectError(ValueError):
    """There is no such thing to tell of; the message says which there are."""


class Subject(NamedTuple):
    """One thing in a run.

    Attributes:
        kind: what it is.
        number: its number; 0 of a goal.
        direction: of a frame.
        tokens: the Sign of a goal, sorted.
    """

    kind: Kind
    number: int = 0
    direction: Direction = Direction.UP
    tokens: Tokens = ()

    def __str__(self) -> str:
        match self.kind:
            case Kind.GOAL:
                return f"{self.kind}:{'+'.join(self.tokens)}"
            case Kind.FRAME:
                return f"{self.kind}:{self.direction}:{self.number}"
            case _:
                return f"{self.kind}:{self.number}"


def subject_of(text: str) -> Subject:
    """The subject that is written so: `command:12`, `goal:B`, `goal:at:D+on_charge`, `frame:up:7`.

    The name of a place stands for its Token.

    Raises:
        SubjectError: if it is not written so.
    """
    name, _, rest = text.partition(":")
    if name not in [kind.value for kind in Kind]:
        hint = did_you_mean(name, [kind.value for kind in Kind])
        raise SubjectError(f"expected {GRAMMAR}, found {shown(text)}{hint}")
    kind = Kind(name)
    if kind is Kind.GOAL:
        tokens = tuple(sorted(part.strip() for part in rest.split("+")))
        if not all(tokens):
            raise SubjectError(f"expected a goal such as goal:B, found {shown(text)}")
        return Subject(kind, tokens=tokens)
    direction = Direction.UP
    if kind is Kind.FRAME:
        way, _, rest = rest.partition(":")
        if way not in [direction.value for direction in Direction]:
            hint = did_you_mean(way, [direction.value for direction in Direction])
            raise SubjectError(
                f"expected a frame such as frame:up:17 or frame:down:17, found {shown(text)}{hint}"
            )
        direction = Direction(way)
    if not (rest.isascii() and rest.isdecimal() and len(rest) <= _DIGITS):
        raise SubjectError(f"expected a whole number after {kind}:, found {shown(text)}")
    return Subject(kind, int(rest), direction)
