"""What the ground knew at a moment, at a glance."""

from typing import Any

import msgspec

from farside.logs.events import sign_text
from farside.logs.information.run import origin
from farside.logs.known import command_text
from farside.logs.moments import picture_at
from farside.logs.views.run import RunView
from farside.node import to_ns, to_s
from farside.topics import BeliefItem

_EVENTS = 10
_COMMANDS = 8


class BelievedItem(msgspec.Struct, frozen=True):
    """An item of what the ground believed of the rover.

    Attributes:
        value: in words.
        so_s: when it was so.
        learned_s: when the ground learned of it.
        stale: whether something newer was due.
    """

    value: str
    so_s: float
    learned_s: float
    stale: bool


class GroundCommand(msgspec.Struct, frozen=True):
    """A command as the ground knew it: what it is to do, when it was sent, what was known of it."""

    number: int
    order: str
    sent_s: float
    known: str


class GroundEvent(msgspec.Struct, frozen=True):
    """An event that the ground knew of, at its time."""

    t_s: float
    text: str


class GroundInformation(msgspec.Struct, frozen=True, kw_only=True):
    """What the ground knew at a moment. Times are simulated seconds.

    Attributes:
        log: path of the log.
        mission: name of the mission; `None` where the log does not say.
        seed: the seed of the run; likewise.
        versions: of Farside and what it rests on, by name.
        at_s: the moment.
        heard_s: when the newest telemetry was measured; `None` before the first.
        silent: whether the rover counted as silent.
        believed: what was believed of the rover, by item.
        commands: those that mattered most, eight at most, newest first.
        events: the last, ten at most.
    """

    log: str
    mission: str | None
    seed: int | None
    versions: dict[str, str]
    at_s: float
    heard_s: float | None
    silent: bool
    believed: dict[str, BelievedItem]
    commands: tuple[GroundCommand, ...]
    events: tuple[GroundEvent, ...]


def ground_information(view: RunView) -> GroundInformation:
    """What the ground knew at the end of a run that was opened as ground.

    Raises:
        LogError: if a message cannot be decoded.
    """
    log, at_s = view.file, view.duration_s
    believed, now_ns = view.believed_at(at_s), to_ns(at_s)
    picture = picture_at(log, now_ns)
    mission, seed, versions = origin(log)
    heard = believed.telemetry
    return GroundInformation(
        log=str(log.path),
        mission=mission,
        seed=seed,
        versions=versions,
        at_s=at_s,
        heard_s=None if heard is None else to_s(heard.time_ns),
        silent=believed.silent,
        believed={
            item: BelievedItem(
                _words(known.value),
                to_s(known.so_ns),
                to_s(known.learned_ns),
                item in believed.belief.stale,
            )
            for item in BeliefItem
            if (known := getattr(believed.belief, item)) is not None
        },
        commands=tuple(
            GroundCommand(
                command.number,
                command_text(command),
                to_s(command.sent_ns),
                ", ".join(command.words(now_ns)),
            )
            for command in picture.commands.foremost(_COMMANDS)
        ),
        events=tuple(
            GroundEvent(to_s(line.t_ns), line.text) for line in list(picture.lines)[-_EVENTS:]
        ),
    )


def _words(value: Any) -> str:
    """A value that the ground believed."""
    match value:
        case None | ():
            return "none"
        case float():
            return f"{value:.0%}"
        case tuple():
            return ", ".join(map(sign_text, value))
        case msgspec.Struct():
            fields = msgspec.structs.asdict(value).items()
            return ", ".join(f"{name} {_number(field)}" for name, field in fields)
        case _:
            return str(value)


def _number(field: Any) -> str:
    return f"{field:.2f}" if isinstance(field, float) else str(field)
