"""Queries on the rover: its state at a time, its modes, its condition at the end."""

from farside.control import BatteryState, Failsafe, Mode
from farside.logs.spans import (
    FailsafeSpan,
    LeastCharge,
    ModeSpan,
)
from farside.logs.views.topics import TopicView
from farside.topics import (
    ROVER_BATTERY,
    ROVER_CYCLE,
    ROVER_DECISION,
    ROVER_ESTIMATE,
    ROVER_FAILSAFE,
    ROVER_MODE,
    ROVER_STUCK,
    TRUTH_POSE,
    Cycle,
    Decision,
    Estimate,
    Pose,
)


class StateView(TopicView):
    """What was so of the rover."""

    def mode_at(self, t_s: float) -> Mode:
        """The rover's mode at a time.

        Raises:
            ValueError: if `t_s` is outside the run.
        """
        return self._asked(ROVER_MODE, t_s).mode

    def failsafe_at(self, t_s: float) -> Failsafe:
        """The failsafe's state at a time.

        Raises:
            ValueError: if `t_s` is outside the run.
        """
        return self._asked(ROVER_FAILSAFE, t_s).state

    def pose_at(self, t_s: float) -> Pose:
        """The rover's true pose at a time, as sampled last, in metres and radians.

        Raises:
            ValueError: if `t_s` is outside the run.
        """
        return self._asked(TRUTH_POSE, t_s)

    def place_at(self, t_s: float) -> str:
        """The Token of the rover's true place at a time.

        Raises:
            ValueError: if `t_s` is outside the run.
        """
        return self.pose_at(t_s).place

    def battery_at(self, t_s: float) -> float:
        """The battery's true state of charge at a time, 0 to 1, as sampled last.

        Raises:
            ValueError: if `t_s` is outside the run.
        """
        return self.pose_at(t_s).battery

    def estimate_at(self, t_s: float) -> Estimate:
        """Where the rover took itself to be at a time, in metres and radians.

        Raises:
            ValueError: if `t_s` is outside the run.
        """
        return self._asked(ROVER_ESTIMATE, t_s)

    @property
    def modes(self) -> tuple[ModeSpan, ...]:
        """The rover's modes in order, from the start of the run."""
        return tuple(
            ModeSpan(t_s, entry.mode, entry.why) for t_s, entry in self.entries(ROVER_MODE)
        )

    @property
    def failsafes(self) -> tuple[FailsafeSpan, ...]:
        """The failsafe's states in order, from the start of the run."""
        return tuple(
            FailsafeSpan(t_s, entry.state, entry.why, entry.causes)
            for t_s, entry in self.each(ROVER_FAILSAFE)
        )

    @property
    def decisions(self) -> tuple[tuple[float, Decision], ...]:
        """What was decided on board, each with its log time."""
        return self.entries(ROVER_DECISION)

    @property
    def least_charge(self) -> LeastCharge | None:
        """The least true state of charge, as sampled every second; `None` if it never was."""
        charges = (LeastCharge(t_s, pose.battery) for t_s, pose in self.each(TRUTH_POSE))
        return min(charges, key=lambda least: least.charge, default=None)

    @property
    def flat_since_s(self) -> float | None:
        """Since when the battery has been flat, `None` if it is not at the end of the run."""
        last = self._last(ROVER_BATTERY)
        return last[0] if last is not None and last[1].state is BatteryState.FLAT else None

    @property
    def stuck_since_s(self) -> float | None:
        """Since when the rover has been stuck, `None` if it is not at the end of the run."""
        last = self._last(ROVER_STUCK)
        return last[0] if last is not None and last[1].stuck else None

    @property
    def dem(self) -> Cycle | None:
        """The DEM's last cycle, which gives the sizes of its lists; `None` if there was none."""
        last = self._last(ROVER_CYCLE)
        return None if last is None else last[1]
