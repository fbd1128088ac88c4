"""`farside link` as a process, followed by what it says."""

import json
import signal
import socket
import subprocess
import sys
from typing import Any, Self

_PATIENCE_S = 30.0


def unused_port() -> int:
    """A port of this machine that nobody uses at the moment."""
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        port: int = one.getsockname()[1]
    return port


class LinkProcess:
    """`farside link`, killed at the end of its `with` block."""

    def __init__(self, *options: str) -> None:
        self.process = subprocess.Popen(  # noqa: S603 - our own
            [sys.executable, "-m", "farside", "link", *options, "--json"],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.communicate()

    def says(self) -> str:
        """The next line that it tells its user."""
        errors = self.process.stderr
        assert errors is not None
        return errors.readline().strip()

    def passes(self) -> Self:
        """Wait until messages pass."""
        while not (line := self.says()).startswith("passing messages"):
            assert line, "expected it to pass messages, found it ended"
        return self

    def end(self) -> tuple[int, str, str]:
        """Wait for its end; returns status, output and the errors not read yet."""
        output, errors = self.process.communicate(timeout=_PATIENCE_S)
        return self.process.returncode, output, errors

    def interrupt(self) -> tuple[int, str, str]:
        """Press Ctrl-C; returns as `end`."""
        self.process.send_signal(signal.SIGINT)
        return self.end()

    def state(self) -> dict[str, Any]:
        """Press Ctrl-C; returns the counters that it prints at its end."""
        status, output, errors = self.interrupt()
        assert status == 0, errors
        state: dict[str, Any] = json.loads(output)
        return state
