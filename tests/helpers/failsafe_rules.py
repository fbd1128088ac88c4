"""The rules that no sequence of events may break: those of the design, said here anew.

Nothing in them is taken from the failsafe's table or from `Authority`.
"""

from collections.abc import Callable
from typing import NamedTuple

from pilot_stand import MODES, Memory, Moment, PilotStand, Word

from farside.control import Cause, Chooser, Failsafe, Mode, ModeCause, OnLoss
from farside.messages import FailsafeChanged, Happening, ModeChanged

BROKEN = {Cause.TILT, Cause.STUCK, Cause.SENSOR_DEAD}
UNHEARD = {Cause.SILENCE, Cause.LOST}


class Witness(NamedTuple):
    """What somebody knows who only listens to the operator and sees whether the rover is alone.

    Attributes:
        said: the mode that the operator wanted last, by whatever words.
        owed: whether the rover took over since then, so that the operator owes it a word.
        carry_on: whether the operator's answer to that was to go on.
        forbidden: whether autonomy on loss is forbidden.
    """

    said: Mode
    owed: bool
    carry_on: bool
    forbidden: bool

    def after(self, event: Cause | Word) -> "Witness":
        """What the witness knows when this has happened."""
        said, owed, carry_on, forbidden = self
        match event:
            case Word.FORBID | Word.ALLOW:
                return self._replace(forbidden=event is Word.FORBID)
            case Word.DRIVE if owed or said is Mode.AUTONOMOUS:
                return Witness(Mode.GUIDED, False, False, forbidden)
            case Word() if event in MODES:
                mode = MODES[event]
                return Witness(
                    mode, False, mode is Mode.AUTONOMOUS and (owed or carry_on), forbidden
                )
        return self

    def sees(self, state: Failsafe) -> "Witness":
        """What the witness knows when the failsafe's state is seen."""
        took_over = state is Failsafe.ALONE and self.said is not Mode.AUTONOMOUS
        return self._replace(owed=True) if took_over else self


class Scene(NamedTuple):
    """A tick, with what happened before it.

    Attributes:
        events: what happened since the tick before.
        causes: what is so.
        before, now: what showed after the tick before and after this one.
        told: what the rover told of it.
        witness: what is known of what the operator said.
    """

    events: tuple[Cause | Word, ...]
    causes: frozenset[Cause]
    before: Moment
    now: Moment
    told: tuple[Happening, ...]
    witness: Witness


def acts_without_a_word(scene: Scene) -> bool:
    """Whether the rover begins something of its own that its operator's mode would not allow."""
    return scene.now.acts is not None and scene.witness.said is Mode.GUIDED


def words(scene: Scene) -> set[Cause | Word]:
    """The words about who drives that were said."""
    return {one for one in scene.events if one in MODES or one is Word.DRIVE}


RULES: dict[str, Callable[[Scene], bool]] = {
    "without any goal the rover neither is alone nor begins anything of its own": lambda scene: (
        Cause.EXHAUSTED not in scene.causes
        or (
            scene.now.state is not Failsafe.ALONE
            and (scene.now.mode is Mode.SHARED or scene.now.acts is None)
        )
    ),
    "it is alone only while the link is lost": lambda scene: (
        scene.now.state is not Failsafe.ALONE or Cause.LOST in scene.causes
    ),
    "it acts without the operator's word only when alone": lambda scene: (
        not acts_without_a_word(scene) or scene.now.state is Failsafe.ALONE
    ),
    "it begins nothing of its own when it tilts, is stuck or knows no place": lambda scene: (
        not scene.causes & BROKEN or (scene.now.state is Failsafe.SAFE and scene.now.acts is None)
    ),
    "where autonomy on loss is forbidden it does nothing then": lambda scene: (
        not {Cause.LOST, Cause.FORBIDDEN} <= scene.causes or scene.now.acts is None
    ),
    "once it took over and the link is back, it begins nothing until a word comes": lambda scene: (
        not scene.witness.owed or Cause.LOST in scene.causes or scene.now.acts is None
    ),
    "only the operator ends autonomous mode": lambda scene: (
        scene.before.mode is not Mode.AUTONOMOUS
        or scene.now.mode is Mode.AUTONOMOUS
        or bool(words(scene))
    ),
    "the mode is what the operator said last, or autonomous since it took over": lambda scene: (
        scene.now.mode is (Mode.AUTONOMOUS if scene.witness.owed else scene.witness.said)
    ),
    "the rover is what brought the mode about exactly while a word is owed": lambda scene: (
        (scene.now.why is ModeCause.LINK_LOST) is scene.witness.owed
    ),
    "planned silence alone changes neither state nor mode": lambda scene: (
        set(scene.events) != {Cause.EXPECTED_SILENCE}
        or (scene.before.state, scene.before.mode) == (scene.now.state, scene.now.mode)
    ),
    "silence is not consent": lambda scene: (
        scene.now.mode is not Mode.SHARED
        or not scene.causes & {Cause.EXPECTED_SILENCE, *UNHEARD}
        or scene.now.acts is None
    ),
    "in hold and safe it begins nothing of its own": lambda scene: (
        scene.now.state not in {Failsafe.HOLD, Failsafe.SAFE} or scene.now.acts is None
    ),
    "no order begins while nothing is heard, insisted on or not": lambda scene: (
        not scene.causes & UNHEARD or not (scene.now.begins or scene.now.forced)
    ),
    "a tilted or blind rover begins only orders that are insisted on": lambda scene: (
        not scene.causes & {Cause.TILT, Cause.SENSOR_DEAD} or not scene.now.begins
    ),
    "while it is heard the operator can have any order begun": lambda scene: (
        bool(scene.causes & UNHEARD) or scene.now.forced
    ),
    "mission goals are on the list only alone, or when told to carry on": lambda scene: (
        scene.now.mission is (scene.now.state is Failsafe.ALONE or scene.witness.carry_on)
    ),
    "every change of state or mode is told, with its reason": lambda scene: (
        (
            scene.before[:2] == scene.now[:2]
            or any(
                isinstance(one, FailsafeChanged)
                and (one.state, one.why) == scene.now[:2]
                and one.why
                for one in scene.told
            )
        )
        and (
            scene.before.mode is scene.now.mode
            or ModeChanged(scene.now.mode, scene.now.why) in scene.told
        )
    ),
    # It is no use never to act either.
    "alone it acts, in whatever mode it was": lambda scene: (
        scene.now.state is not Failsafe.ALONE or scene.now.acts is Chooser.GOAL_DIRECTED
    ),
    "sound, allowed and with a goal, it is alone when the link is lost": lambda scene: (
        Cause.LOST not in scene.causes
        or bool(scene.causes & {*BROKEN, Cause.FORBIDDEN, Cause.EXHAUSTED})
        or scene.now.state is Failsafe.ALONE
    ),
    "with nothing wrong it does what its mode says": lambda scene: (
        bool(scene.causes & {*BROKEN, *UNHEARD, Cause.EXPECTED_SILENCE, Cause.EXHAUSTED})
        or scene.witness.owed
        or (scene.now.acts is None) is (scene.now.mode is Mode.GUIDED)
    ),
}


def broken(scene: Scene) -> list[str]:
    """The rules that do not hold there."""
    return [rule for rule, holds in RULES.items() if not holds(scene)]


class Play:
    """Lets things happen on a stand, with a witness at hand.

    Attributes:
        stand: where they happen.
        now: what shows since the last tick.
        witness: what is known of what the operator said.
    """

    def __init__(self, on_loss: OnLoss) -> None:
        self.stand = PilotStand(on_loss)
        self.now = self.stand.moment()
        self.witness = Witness(Mode.GUIDED, False, False, on_loss is OnLoss.HOLD)

    def step(self, *events: Cause | Word) -> Scene:
        """Let these happen, and then a tick."""
        before = self.now
        for event in events:
            self.stand.happen(event)
            self.witness = self.witness.after(event)
        told = tuple(self.stand.tick())
        self.now = self.stand.moment()
        self.witness = self.witness.sees(self.now.state)
        return Scene(events, self.causes, before, self.now, told, self.witness)

    @property
    def node(self) -> tuple[Memory, Witness]:
        """All that what happens next can depend on."""
        return self.stand.memory, self.witness

    def resume(self, node: tuple[Memory, Witness]) -> None:
        """Go on from there."""
        memory, self.witness = node
        self.stand.recall(memory)
        self.now = self.stand.moment()

    @property
    def causes(self) -> frozenset[Cause]:
        """What is so, by the witness."""
        derived = {Cause.UNCONFIRMED: self.witness.owed, Cause.FORBIDDEN: self.witness.forbidden}
        return self.stand.present | {cause for cause, is_so in derived.items() if is_so}
