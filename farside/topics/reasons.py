"""Reasons that the rover gives in words and that a reader of its log must know again.

Each is worded here and nowhere else: the rover says it, and `farside story` and `farside why` look
for what it speaks of. The failsafe's reasons are not among them: its causes are in the log as such.
"""

import re
from typing import Final

_DIGITS = 18  # what is longer is no number of a command
_WORDS = re.compile(r"\\\{\\\}")


class Reason:
    """A sentence with places for words, each written `{}`.

    Args:
        wording: the sentence.

    Attributes:
        wording: the sentence.
    """

    def __init__(self, wording: str) -> None:
        self.wording: Final = wording
        self._pattern = re.compile(_WORDS.sub("(.*?)", re.escape(wording)), re.DOTALL)

    def of(self, *words: object) -> str:
        """The sentence with these words in it, one for each place."""
        return self.wording.format(*words)

    def words_in(self, text: str | None) -> tuple[str, ...] | None:
        """The words at the places of this sentence; `None` if `text` is another one, or none."""
        found = None if text is None else self._pattern.fullmatch(text)
        return None if found is None else found.groups()

    def is_in(self, text: str | None) -> bool:
        """Whether `text` is this sentence, whatever words are in it."""
        return self.words_in(text) is not None

    def number_in(self, text: str | None) -> int | None:
        """The number that is the first word of this sentence; `None` if `text` is another one."""
        words = self.words_in(text)
        if not words or not (words[0].isascii() and words[0].isdecimal()):
            return None
        return int(words[0]) if len(words[0]) <= _DIGITS else None


# --- why a command was refused, or another took its place -------------------------------------

BATTERY_FLAT = Reason("the battery is flat")
BLOCKED_HERE = Reason("{} was blocked here just now")
CHARGE_TOO_LOW = Reason("a charge of {} would not suffice for the way to the dock")
OTHER_MODE = Reason("it was meant for mode {}, and the rover is in mode {}")
OTHER_PLACE = Reason("it was meant for {}, and the rover is at {}")
NOT_AFTER = Reason("it was meant to follow on command {}, which was not done")
NEVER_AFTER = Reason("it was to follow on command {}, {}")
MODE_CHANGED = Reason("command {} changed the mode")
LINK_LOST = Reason("the link was lost before it began")

# --- why a proposal stands no more ------------------------------------------------------------

CAME_BETWEEN = Reason("command {} came in between")
VETOED = Reason("vetoed by the operator")
OTHER_SITUATION = Reason("the situation is another one")
ANSWER_TOO_LATE = Reason("the answer came too late")
NO_VETO = Reason("carried out, as no veto came")
