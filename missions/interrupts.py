"""Ctrl-C and SIGTERM during a run: met between windows, so that no log suffers."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupts:
    """Counts signals, and lets them break off only what may be broken off. A context manager.

    It takes the signals over from whoever had them, also where they were ignored, as for a job
    that a shell started in the background; at its end they are as before. Signals reach the main
    thread alone: anywhere else nothing is ever requested.
    """

    def __init__(self) -> None:
        self._count = 0
        self._breaks_at: int | None = None
        self._handlers: dict[signal.Signals, object] = {}

    @property
    def requested(self) -> bool:
        """Whether the run should end with the window that is on."""
        return self._count > 0

    @contextmanager
    def breakable(self, at: int) -> Iterator[None]:
        """Within this, the `at`-th signal raises KeyboardInterrupt.

        Raises:
            KeyboardInterrupt: also at once, if so many have come already.
        """
        try:
            self._breaks_at = at
            if self._count >= at:
                raise KeyboardInterrupt
            yield
        finally:
            self._breaks_at = None

    def _hear(self, _number: int, _frame: FrameType | None) -> None:
        self._count += 1
        if self._breaks_at is not None and self._count >= self._breaks_at:
            self._breaks_at = None
            raise KeyboardInterrupt

    def __enter__(self) -> Self:
        if threading.current_thread() is threading.main_thread():
            for number in _SIGNALS:
                self._handlers[number] = signal.signal(number, self._hear)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._handlers.items():
            signal.signal(number, handler)  # type: ignore[arg-type]  # as `signal` gave it
