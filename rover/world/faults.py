"""What goes wrong with the rover, and when."""

from collections.abc import Sequence

from farside.node import to_ns
from farside.rover.config import Fault, FaultKind


class Faults:
    """The faults of a mission over time."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self._kinds = {fault.what for fault in faults}
        self._spans = [(fault, to_ns(fault.start_s), to_ns(fault.end_s)) for fault in faults]

    def tilt_rad(self, now_ns: int) -> float:
        """The tilt of the rover."""
        if FaultKind.TILT not in self._kinds:
            return 0.0
        return max((fault.tilt_rad for fault in self._now(FaultKind.TILT, now_ns)), default=0.0)

    def has_position(self, now_ns: int) -> bool:
        """Whether the position sensor works."""
        if FaultKind.POSITION_SENSOR not in self._kinds:
            return True
        return not self._now(FaultKind.POSITION_SENSOR, now_ns)

    def _now(self, kind: FaultKind, now_ns: int) -> list[Fault]:
        return [
            fault
            for fault, start_ns, end_ns in self._spans
            if fault.what is kind and start_ns <= now_ns < end_ns
        ]
