"""The proof that an emulator does to frames what a profile asks for."""

from farside.link.check.report import (
    FALSE_ALARM,
    FRAMES,
    CheckReport,
    CheckVerdict,
    Measurement,
    check_link,
)

__all__ = ["FALSE_ALARM", "FRAMES", "CheckReport", "CheckVerdict", "Measurement", "check_link"]
