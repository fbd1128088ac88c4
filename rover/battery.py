"""The battery: its charge over time, and when that counts as low."""

from farside.control import BatteryState
from farside.node import to_s
from farside.rover.config import BatteryConfig


class Battery:
    """State of charge, integrated over simulated time.

    Attributes:
        low: whether the battery wants charging, with hysteresis: set below `config.low`, cleared
            at `config.charged`.
    """

    def __init__(self, config: BatteryConfig) -> None:
        self._config = config
        self._charge_j = config.initial * config.capacity_j
        self._at_ns = 0
        self._charging = False
        self.low = config.initial < config.low

    def change(self, config: BatteryConfig) -> None:
        """Be a battery by `config` from now on, with the energy that is left."""
        self._config = config
        self._charge_j = min(self._charge_j, config.capacity_j)

    @property
    def charge(self) -> float:
        """State of charge, 0 to 1."""
        return self._charge_j / self._config.capacity_j

    @property
    def charge_j(self) -> float:
        """The energy left."""
        return self._charge_j

    @property
    def driving_w(self) -> float:
        """The power drawn while driving."""
        return self._config.idle_w + self._config.drive_w

    @property
    def empty(self) -> bool:
        """Whether no charge is left."""
        return self._charge_j <= 0

    @property
    def state(self) -> BatteryState:
        """What the battery does. It charges only while the rover stands on the dock."""
        if self.empty:
            return BatteryState.FLAT
        if self._charging:
            return BatteryState.CHARGING
        return BatteryState.LOW if self.low else BatteryState.NOMINAL

    @property
    def urgency(self) -> float:
        """Priority of the inherent goal `on_charge`: 0 at `config.low`, growing as charge falls."""
        if not self._config.low:
            return 0.0
        return self._config.charge_priority * max(0.0, 1 - self.charge / self._config.low)

    def ask_for_charge(self) -> None:
        """Count as low from now on until charged."""
        self.low = True

    def flow(self, now_ns: int, *, driving: bool, docked: bool) -> None:
        """Account for the time since the last call, spent driving or not, docked or not."""
        config = self._config
        power_w = (config.charge_w if docked else 0.0) - config.idle_w
        power_w -= config.drive_w if driving else 0.0
        charge_j = self._charge_j + power_w * to_s(now_ns - self._at_ns)
        self._charge_j = min(config.capacity_j, max(0.0, charge_j))
        self._at_ns = now_ns
        full = self._charge_j >= config.capacity_j
        self._charging = docked and not driving and power_w > 0 and not full
        if self.charge < config.low:
            self.low = True
        elif self.charge >= config.charged:
            self.low = False
