"""A recorder that keeps nothing."""

import os
import tempfile
from pathlib import Path

from farside.logs.file.digest import Digest
from farside.logs.recording import Recorder


class _Nowhere:
    """What a log is written to that nobody keeps."""

    end = 0

    def write(self, data: bytes) -> None:
        """Drop `data`."""

    def flush(self) -> None:
        """Nothing is left to do."""


class UnwrittenRecorder(Recorder):
    """Makes of records what a log would hold of them, and hands it to a digest. Writes no log.

    Args:
        digest: is given every record that a log would hold, in order.
    """

    def __init__(self, digest: Digest) -> None:
        with tempfile.TemporaryDirectory(prefix="farside-") as folder:
            super().__init__(Path(folder) / "unwritten.mcap")
        self._tail = _Nowhere()  # type: ignore[assignment]
        self._digest = digest

    def close(self, *, packed: bool = True) -> None:  # noqa: ARG002 - there is nothing to pack
        """Forget it."""
        if self._is_open:
            self._is_open = False
            os.close(self._file)
