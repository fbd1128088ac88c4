"""What takes over the whole terminal, and leaves it as it was."""

import os
import signal
from signal import SIGCONT, SIGTSTP

from textual.app import App

UPDATE_S = 0.1
"""Wall time between two screen updates: smooth to the eye, and light on a slow terminal."""


class WholeTerminal(App[None]):
    """An app on the whole terminal, in its own colours; see `show` and `tick`.

    Attributes:
        failure: what ended it, if not a key did.
    """

    ENABLE_COMMAND_PALETTE = False
    AUTO_FOCUS = None

    def __init__(self) -> None:
        super().__init__(ansi_color=True)
        self.theme = "ansi-dark"  # takes all colours from the terminal, of a light one too
        self.failure: Exception | None = None

    def show(self) -> None:
        """Take over the terminal until the screen is left.

        Raises:
            Exception: whatever went wrong, once the terminal is as before.
        """
        # Textual takes the variable out, and leaves its handlers behind.
        colourless = os.environ.get("NO_COLOR")
        handlers = {number: signal.getsignal(number) for number in (SIGTSTP, SIGCONT)}
        try:
            self.run(mouse=False)
        finally:
            if colourless is not None:
                os.environ["NO_COLOR"] = colourless
            for number, handler in handlers.items():
                signal.signal(number, handler)
        if self.failure is not None:
            raise self.failure

    def on_mount(self) -> None:
        """Begin to draw."""
        self.set_interval(UPDATE_S, self.tick)
        self.tick()

    def tick(self) -> None:
        """Draw what is so now, if anything changed; called ten times a second."""
        raise NotImplementedError

    def fail(self, error: Exception) -> None:
        """Leave the screen because of this."""
        self.failure = error
        self.exit()

    def _handle_exception(self, error: Exception) -> None:
        """Leave it to the command to tell of, in place of Textual's pages of variables."""
        if self.is_headless:  # as in a test
            super()._handle_exception(error)
        self.fail(error)
