"""What a transmit queue does to a crowd of frames, by its settings alone."""

import numpy as np

from farside.link.check.traffic.planning import Burst
from farside.link.check.traffic.reference import Phase
from farside.link.profile.config import DropPolicy, OneWay


def sent_of(
    way: OneWay,
    burst: Burst,
    starts_ns: list[int],
    *,
    waiting_first: bool,
    lifetime_ns: int | None,
) -> list[int]:
    """Which frames of a crowded burst are sent, in that order, by their place in it.

    Args:
        way: settings of the queue.
        burst: the first frame, and then all others at once.
        starts_ns: when the first frame that is sent begins to leave, the second, and so on, counted
            from the hand-over of the first.
        waiting_first: whether the first frame still waits when the others come.
        lifetime_ns: how long a frame may wait; any time if `None`.
    """
    priorities = burst.priorities or (0,) * burst.frames
    sent, waiting = ([], [0]) if waiting_first else ([0], list[int]())
    most = min(way.queue_byte // burst.size_byte, way.queue_frame or burst.frames)
    for place in range(1, burst.frames):
        waiting.append(place)
        if len(waiting) > most:
            match way.drop:
                case DropPolicy.NEWEST:
                    waiting.remove(max(waiting))
                case DropPolicy.OLDEST:
                    waiting.remove(min(waiting))
                case DropPolicy.LOWEST:
                    waiting.remove(max(waiting, key=lambda one: (-priorities[one], one)))
    for place in sorted(waiting, key=lambda one: (-priorities[one], one)):
        handed_over_ns = min(place, 1)
        waited_ns = starts_ns[min(len(sent), len(starts_ns) - 1)] - handed_over_ns
        if lifetime_ns is None or waited_ns <= lifetime_ns:
            sent.append(place)
    return sent


def starts_of(phase: Phase, burst: Burst, begin_ns: int) -> list[int]:
    """When each frame that is sent begins to leave, counted from the hand-over of the first."""
    if phase.way.slots is not None:
        # At the latest: all wait for a slot.
        return [phase.waits_ns(burst.size_byte, place + 1) for place in range(burst.frames)]
    if phase.trace is None:
        sending_ns = phase.sending_ns(burst.size_byte)
        return [place * sending_ns for place in range(burst.frames)]
    needed = phase.trace.needed(phase.frame_byte(burst.size_byte))
    begun = int(phase.trace.first_from(np.array([begin_ns]))[0])
    numbers = begun + np.arange(burst.frames) * needed
    found: list[int] = (phase.trace.time_ns(numbers) - begin_ns).tolist()
    return found
