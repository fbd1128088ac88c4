"""The screen: all that a person at the ground is shown at a moment, ready to be drawn.

The page and the terminal draw the same screen, so its words are those of both. Times are integer
nanoseconds of simulated time on the ground's clock, unless a name says otherwise; places are cells
of the chart, counted from its south-west corner.
"""

from enum import StrEnum

import msgspec

from farside.ground.view.view import OptionKind
from farside.messages import Tokens
from farside.node import Direction


class Tone(StrEnum):
    """What a word or a row asks of a person; shape and word say the same as colour.

    Attributes:
        PLAIN: normal.
        WORD: it asks for the operator's word.
        CAUTION: it will need attention.
        WRONG: it is wrong now.
    """

    PLAIN = "plain"
    WORD = "word"
    CAUTION = "caution"
    WRONG = "wrong"


class Said(msgspec.Struct, frozen=True, omit_defaults=True):
    """A value in words, with its unit and, where it matters, its age.

    Attributes:
        name: what it is, such as `battery`; empty where the text says it.
        text: the value, such as `92 %, 1.4 s ago`.
        tone: what it asks for.
        stale: whether something newer was due: it is drawn outlined, not filled.
    """

    name: str
    text: str
    tone: Tone = Tone.PLAIN
    stale: bool = False


class Spot(msgspec.Struct, frozen=True, array_like=True):
    """A place on the map: cells east and north, and how much (a probability, or a cost in s)."""

    east: int
    north: int
    amount: float


class Pose(msgspec.Struct, frozen=True):
    """A pose on the chart, in metres east and north of its south-west corner."""

    x_m: float
    y_m: float
    heading_rad: float


class Ghost(msgspec.Struct, frozen=True):
    """Where the rover is predicted to be.

    Attributes:
        spots: the places, each with its probability, the most probable first.
        command: the command after which it will be there; `None` for now.
        label: such as `now, as predicted 83 %` or `after 93`.
    """

    spots: tuple[Spot, ...]
    command: int | None
    label: str


class GoalSpot(msgspec.Struct, frozen=True):
    """A goal on the map; `order` counts from 1, the top-goal; `is_sent` while it is on its way."""

    east: int
    north: int
    name: str
    order: int
    is_sent: bool


class Chart(msgspec.Struct, frozen=True):
    """The map as the ground has it; see `farside.places.Chart`. It never changes in a run."""

    rows: tuple[str, ...]
    cell_m: float


class MapView(msgspec.Struct, frozen=True, omit_defaults=True):
    """What stands on the map.

    Attributes:
        heard: the pose as last heard; `None` before that.
        heard_label: its age, such as `as of 1.4 s ago`.
        heard_stale: whether something newer was due.
        now: where the rover is now, as predicted.
        after: the same after each command on its way, in order.
        track: places where it was heard to be of late, oldest first; the amount is its age (s).
        committed: the places that the commands on their way lead through, most probably, in order.
        policy: the policy path in focus, each with the cost to go; empty without one.
        policy_label: such as `to B: 24.1 s to go, as planned 83 %`.
        goals: the goals that are places.
        heat: the cost to go from every known place, where asked for.
    """

    heard: Pose | None = None
    heard_label: str = ""
    heard_stale: bool = False
    now: Ghost | None = None
    after: tuple[Ghost, ...] = ()
    track: tuple[Spot, ...] = ()
    committed: tuple[Spot, ...] = ()
    policy: tuple[Spot, ...] = ()
    policy_label: str = ""
    goals: tuple[GoalSpot, ...] = ()
    heat: tuple[Spot, ...] = ()


class OptionRow(msgspec.Struct, frozen=True, omit_defaults=True):
    """An action that can be chosen, and its cue.

    Attributes:
        action: such as `E`.
        kind: what is found of it; see `farside.console.stick.cues`.
        severity: how much speaks against it, 0 to 1.
        does: what choosing it orders, such as `overrides proposal 14 with E`.
        why: what speaks against it or for it.
        spots: where it may lead, each with its probability.
    """

    action: str
    kind: OptionKind
    severity: float
    does: str
    why: str = ""
    spots: tuple[Spot, ...] = ()


class ProposalCard(msgspec.Struct, frozen=True, omit_defaults=True):
    """The proposal that stands.

    Attributes:
        number: its number; whoever answers it says it.
        action: what it proposes.
        title: such as `Proposal 14: E, towards B`.
        facts: cost, probability, age.
        conflicts: what the ground has learned or sent since.
        runner_up: such as `runner-up N, 3.2 s dearer`; empty without one.
        answered: how it was answered, such as `approved by command 92, begins in 1.2 s`; empty
            while it is not.
        veto_left_s: the time left in which a veto arrives before the rover acts; `None` where
            consent is by approval.
        veto_window_s: how long that is in all.
        can_answer: whether it can be answered now: not twice, and not into unexpected silence.
    """

    number: int
    action: str
    title: str
    facts: tuple[Said, ...]
    conflicts: tuple[str, ...] = ()
    runner_up: str = ""
    answered: str = ""
    veto_left_s: float | None = None
    veto_window_s: float | None = None
    can_answer: bool = False


class CommandRow(msgspec.Struct, frozen=True, omit_defaults=True):
    """A command, or what is held at the ground.

    Attributes:
        number: the command's; 0 of what is held.
        text: what it orders, such as `drive E`.
        words: what is known of it, the most important first.
        tone: of the row.
        is_over: whether it is known to be over.
        begins_ns, seen_ns: when it takes effect, and when word of its effect is due; `None` where
            it did or is not known.
        take_back_until_ns: until when it can be taken back for sure.
        can_take_back: whether a take-back can still be tried.
        held: the number of holding of what is held at the ground; below 0 of what waits at the
            console while time stands.
    """

    number: int
    text: str
    words: tuple[str, ...]
    tone: Tone = Tone.PLAIN
    is_over: bool = False
    begins_ns: int | None = None
    seen_ns: int | None = None
    take_back_until_ns: int | None = None
    can_take_back: bool = False
    held: int | None = None


class GoalRow(msgspec.Struct, frozen=True):
    """A goal; `tokens` withdraw it; `text` such as `B, priority 2, yours`."""

    tokens: Tokens
    text: str
    tone: Tone = Tone.PLAIN


class EventRow(msgspec.Struct, frozen=True, omit_defaults=True):
    """Something that happened, with the time when it was so and the time when it was learned."""

    number: int
    so_ns: int
    learned_ns: int
    text: str
    tone: Tone = Tone.PLAIN
    routine: bool = False


class AlarmRow(msgspec.Struct, frozen=True, omit_defaults=True):
    """An alarm, which stays until it is acknowledged; the same one twice is one with a count."""

    number: int
    so_ns: int
    learned_ns: int
    text: str
    count: int = 1
    tone: Tone = Tone.WRONG
    acknowledged: bool = False


class StripWord(msgspec.Struct, frozen=True, omit_defaults=True):
    """A word between ground and rover, as a line of the light strip.

    Attributes:
        direction: which way.
        what: what it carries, in words.
        sent_ns: when it was sent; of a word that was heard: its arrival less the light time.
        arrives_ns: when it arrives, or is due to.
        label: what to write at its foot, such as the number of a command; mostly empty.
        routine: whether it is a heartbeat or telemetry.
    """

    direction: Direction
    what: str
    sent_ns: int
    arrives_ns: int
    label: str = ""
    routine: bool = False


class Strip(msgspec.Struct, frozen=True, omit_defaults=True):
    """The light strip: a space-time diagram, ground above, rover below, time to the right.

    Attributes:
        from_ns, until_ns: the time that it covers.
        known_ns: what lies later on the rover's line is not known yet.
        words: its words, in order of sending.
        begins: when each command on its way begins on the rover's line: (number, time).
        take_backs: for those that can be taken back for sure: (number, until when).
        gaps: stretches without contact by plan, or in unexpected silence, on the ground's line.
    """

    from_ns: int
    until_ns: int
    known_ns: int
    words: tuple[StripWord, ...] = ()
    begins: tuple[tuple[int, int], ...] = ()
    take_backs: tuple[tuple[int, int], ...] = ()
    gaps: tuple[tuple[int, int], ...] = ()


class ExerciseStep(msgspec.Struct, frozen=True):
    """A step of the guided exercise.

    Attributes:
        text: what to do.
        how: how it is done.
        done: whether it was really done.
        missed: whether it cannot be done any more in this run.
    """

    text: str
    how: str
    done: bool
    missed: bool = False

    @property
    def mark(self) -> str:
        """A tick, a dash for what was missed, or an empty circle."""
        return "✓" if self.done else "–" if self.missed else "○"


class Screen(msgspec.Struct, frozen=True, omit_defaults=True):
    """All that is shown at a moment.

    Attributes:
        mission: its name.
        now_ns: the ground's clock; what `here` says.
        rover_ns: the rover's "now" as far as light goes: now less the light time down.
        end_ns: when the mission ends.
        speed: simulated seconds per wall second that are asked for.
        paused: whether time stands.
        warp: what time is warped to, such as `until something arrives`; empty without.
        slowed: why it went back to 1x by itself, or stopped, such as `proposal 14 has come`.
        over: how the run ended; empty while it goes on.
        standing: what the run waits for, such as a process that does not answer; mostly empty.
        mode: the mode in words, capitals, as last heard.
        status: the parts of the status strip after the mode, in order.
        on_the_way: how many commands have gone out and are not known to be over.
        waiting: how many orders go out when time goes on.
        if_nothing: what happens if the operator does nothing.
        proposal: the proposal that stands.
        options: the actions, in the order N, E, S, W.
        commands: those on the way and the last that ended, newest first.
        goals, rover, model, failsafe, link: the blocks on the right.
        map: the map.
        strip: the light strip.
        events: newest first.
        alarms: those not acknowledged first, then the newest.
        exercise: the steps of the guided exercise; empty without one.
    """

    mission: str
    now_ns: int
    rover_ns: int
    end_ns: int
    speed: float
    paused: bool
    mode: Said
    if_nothing: str
    map: MapView
    strip: Strip
    warp: str = ""
    slowed: str = ""
    over: str = ""
    standing: str = ""
    status: tuple[Said, ...] = ()
    on_the_way: int = 0
    waiting: int = 0
    proposal: ProposalCard | None = None
    options: tuple[OptionRow, ...] = ()
    commands: tuple[CommandRow, ...] = ()
    goals: tuple[GoalRow, ...] = ()
    rover: tuple[Said, ...] = ()
    model: tuple[Said, ...] = ()
    failsafe: tuple[Said, ...] = ()
    link: tuple[Said, ...] = ()
    events: tuple[EventRow, ...] = ()
    alarms: tuple[AlarmRow, ...] = ()
    exercise: tuple[ExerciseStep, ...] = ()


def way_sign(screen: Screen) -> str:
    """The standing sign: `2 ON THE WAY`, `1 WAITS HERE`; empty where there is neither."""
    said = [f"{screen.on_the_way} ON THE WAY"] if screen.on_the_way else []
    if screen.waiting:
        said.append(f"{screen.waiting} {'WAITS' if screen.waiting == 1 else 'WAIT'} HERE")
    return " · ".join(said)
