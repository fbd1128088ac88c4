"""Ctrl-C and SIGTERM during a run: handled between windows, so that no log is damaged."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupts:
    """Counts signals, and raises KeyboardInterrupt only where that does no harm. A context manager.

    It replaces the handlers of both signals, even if they were ignored, as in a job that a shell
    started in the background, and restores them on exit. Python runs handlers in the main thread
    only: entered in any other it hears nothing, and what is breakable in another is not broken by
    what it hears.
    """

    def __init__(self) -> None:
        self._count = 0
        self._breaks_at: int | None = None
        self._handlers: dict[signal.Signals, object] = {}

    @property
    def requested(self) -> bool:
        """Whether the run should end with the window in progress."""
        return self._count > 0

    @property
    def repeated(self) -> bool:
        """Whether somebody does not want to wait for that."""
        return self._count > 1

    @contextmanager
    def breakable(self, at: int) -> Iterator[None]:
        """Let the `at`-th signal raise KeyboardInterrupt within this context.

        Raises:
            KeyboardInterrupt: at once, if as many have arrived already.
        """
        try:
            if threading.current_thread() is threading.main_thread():
                self._breaks_at = at
            if self._count >= at:
                raise KeyboardInterrupt
            yield
        finally:
            self._breaks_at = None

    def request(self) -> None:
        """Count as a signal, but interrupt nothing: the run ends with the window in progress."""
        self._count += 1

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
