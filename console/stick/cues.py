"""The cues: what a person feels or sees of an option before it is chosen.

One table leads from an option to its cue, and from a cue to its three forms of equal meaning: the
force of a stick that has motors, the rumble of a pad, and the edge of the option's button on the
screen. The page is sent this very table (`msgspec.to_builtins(TABLE)`) and has no numbers of its
own.

The stick's axes are x to the east and y to the north, each from -1 to 1. The *deflection* towards
an action is how far the stick stands out in its direction, 0 to 1. It is *near* 0 within the dead
zone and near 1 where the action would be chosen.
"""

from enum import StrEnum

import msgspec

from farside.console.screen.screen import OptionRow
from farside.ground.view.view import OptionKind


class Edge(StrEnum):
    """How the edge of an option's button is drawn."""

    PLAIN = "plain"
    BARRED = "barred"
    HATCHED = "hatched"
    LIT = "lit"


class Force(msgspec.Struct, frozen=True):
    """What the motors of a stick do; every level is a share of the strongest, 0 to 1.

    Attributes:
        spring: the spring that draws the stick to `centre`.
        centre: where it draws to: the deflection towards the option, 0 for the middle. It is too
            near the middle to choose anything: a stick that is drawn with no hand on it stays
            silent, and counts as come back.
        shake: the constant force along the option's direction, whose sign changes at `shake_hz`.
        shake_hz: full changes to and fro per wall second.
    """

    spring: float = 0.0
    centre: float = 0.0
    shake: float = 0.0
    shake_hz: float = 20.0


class Rumble(msgspec.Struct, frozen=True):
    """What the motors of a pad do.

    Attributes:
        strength: 0 to 1.
        pulses: how many pulses; 0 where it lasts as long as the stick is near.
        pulse_ms: how long each is, in wall milliseconds.
        pause_ms: how long the pause after each is.
    """

    strength: float = 0.0
    pulses: int = 0
    pulse_ms: int = 0
    pause_ms: int = 0


class Forms(msgspec.Struct, frozen=True):
    """A row of the table: the three forms of a cue.

    Attributes:
        least: the strength of the cue where the option's severity is 0; it is 1 at severity 1 and
            grows evenly between.
        rises: whether shake and rumble grow with how near the stick is.
        force, rumble, edge: the forms at strength 1, and nearest.
    """

    least: float
    rises: bool
    force: Force
    rumble: Rumble
    edge: Edge


class Thresholds(msgspec.Struct, frozen=True):
    """Where and when a deflection means something; see `farside.console.stick.intention`.

    Attributes:
        dead_zone: the deflection that is not felt yet.
        choose_at: where an action is chosen.
        back_below: a second choice needs the stick to come back below this first.
        full_at: what counts as full deflection.
        aside: the most that the stick may stand aside of an action's direction, as a share of its
            deflection towards it, for that action to be chosen.
        insist_s: how long full deflection insists on an invalid action, in wall seconds.
        approve_s: how long the proposed action is held to approve it, in wall seconds.
        quiet_s: how long nothing is ordered after the options changed, in wall seconds.
    """

    dead_zone: float = 0.2
    choose_at: float = 0.8
    back_below: float = 0.4
    full_at: float = 0.95
    aside: float = 0.6
    insist_s: float = 1.0
    approve_s: float = 0.5
    quiet_s: float = 0.5


class Table(msgspec.Struct, frozen=True):
    """All that any stick needs, on this host or in a page.

    Attributes:
        directions: the direction of every action that has one, as (x, y).
        thresholds: where and when a deflection means something.
        forms: what each kind of option feels and looks like.
    """

    directions: dict[str, tuple[float, float]]
    thresholds: Thresholds
    forms: dict[OptionKind, Forms]


TABLE = Table(
    directions={"N": (0.0, 1.0), "E": (1.0, 0.0), "S": (0.0, -1.0), "W": (-1.0, 0.0)},
    thresholds=Thresholds(),
    forms={
        OptionKind.FREE: Forms(
            least=0.0, rises=False, force=Force(), rumble=Rumble(), edge=Edge.PLAIN
        ),
        OptionKind.INVALID: Forms(
            least=1.0,
            rises=False,
            force=Force(spring=1.0),
            rumble=Rumble(strength=1.0, pulses=2, pulse_ms=80, pause_ms=80),
            edge=Edge.BARRED,
        ),
        OptionKind.PROBLEMATIC: Forms(
            least=0.3,
            rises=True,
            force=Force(shake=0.6),
            rumble=Rumble(strength=0.8),
            edge=Edge.HATCHED,
        ),
        OptionKind.PROPOSED: Forms(
            least=1.0,
            rises=False,
            force=Force(spring=0.35, centre=0.35),
            rumble=Rumble(strength=0.5, pulses=1, pulse_ms=400),
            edge=Edge.LIT,
        ),
    },
)
"""The table; there is no other."""


class Cue(msgspec.Struct, frozen=True):
    """What an option is to make a person feel: of which kind, and how strongly, 0 to 1."""

    kind: OptionKind
    strength: float


def cue_of(option: OptionRow) -> Cue:
    """The cue of an option, whatever shows it."""
    least = TABLE.forms[option.kind].least
    return Cue(option.kind, least + (1.0 - least) * option.severity)


def deflection(x: float, y: float, action: str) -> float:
    """How far the stick stands out towards an action, 0 to 1; 0 for one without a direction."""
    east, north = TABLE.directions.get(action, (0.0, 0.0))
    return min(max(x * east + y * north, 0.0), 1.0)


def nearness(towards: float) -> float:
    """How near an action is at this deflection towards it: 0 (not felt) to 1 (chosen)."""
    zone, full = TABLE.thresholds.dead_zone, TABLE.thresholds.choose_at
    return min(max((towards - zone) / (full - zone), 0.0), 1.0)


def force_of(cue: Cue, near: float) -> Force:
    """The force of a cue for a stick that is this near, 0 to 1."""
    forms = TABLE.forms[cue.kind]
    level = cue.strength * (near if forms.rises else 1.0)
    force = forms.force
    return msgspec.structs.replace(force, spring=force.spring * level, shake=force.shake * level)


def rumble_of(cue: Cue, near: float) -> Rumble:
    """The rumble of a cue for a stick that is this near, 0 to 1."""
    forms = TABLE.forms[cue.kind]
    level = cue.strength * (near if forms.rises else 1.0)
    return msgspec.structs.replace(forms.rumble, strength=forms.rumble.strength * level)


def edge_of(cue: Cue) -> Edge:
    """The edge of the option's button on the screen; it is there whether a stick nears or not."""
    return TABLE.forms[cue.kind].edge
