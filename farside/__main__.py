"""The `farside` command, also as `python -m farside`."""

import os
import signal
import sys
from types import FrameType
from typing import NoReturn

from farside.missions.commands.failures import report
from farside.missions.commands.streams import OutputError, fill_standard_streams, telling_streams

_INTERRUPTED = 130


def main() -> NoReturn:
    """Run the command line, so that however it ends, it ends in words and with its status.

    An interrupt ends it quietly even while it is still importing; from then on each command has
    its own way with interrupts. So does a reader of its output who has seen enough, as in
    `farside replay LOG | head`.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        # Also where it was inherited as ignored, as by a job in the background of a script.
        signal.signal(number, _leave)
    # OpenBLAS raises SIGINT where it cannot start its threads, of which a run needs none.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    fill_standard_streams()
    try:
        with telling_streams():
            from farside.missions.commands.main import main as run_command_line  # noqa: PLC0415

            run_command_line()
    except OutputError as error:
        if error.message is not None:
            print(f"farside: {error.message}", file=sys.stderr)  # noqa: T201
        sys.exit(error.status)
    except (SystemExit, KeyboardInterrupt):
        raise
    except BaseException as error:  # noqa: BLE001 - none may end with a status that means another
        sys.exit(report(error))


def _leave(_number: int, _frame: FrameType | None) -> NoReturn:
    sys.exit(_INTERRUPTED)


if __name__ == "__main__":
    main()
