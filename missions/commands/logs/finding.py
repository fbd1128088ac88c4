"""The log that a command reads, the one that is named or else the newest; and what it lacks."""

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from farside.missions.commands.failures import print_error

if TYPE_CHECKING:
    from farside.logs import LogFile


def log_named(path: Path | None) -> Path:
    """`path`, or where there is none the newest log, whose name is told on standard error.

    Raises:
        LogError: as `newest_log`.
    """
    if path is not None:
        return path
    newest = newest_log()
    print_error(f"no log is named: reading the newest, {newest}")
    return newest


def newest_log(folder: Path = Path("logs/runs")) -> Path:
    """The log in `folder` that was written to last: of a run that is over, or still going on.

    Raises:
        LogError: if there is none, or the folder cannot be read.
    """
    from farside.logs import LogError

    try:
        logs = [path for path in folder.glob("[!.]*.mcap") if path.is_file()]
        # Where two are as new, the name decides.
        return max(logs, key=lambda path: (path.stat().st_mtime_ns, path.name))
    except ValueError as error:
        message = (
            f"expected a log, LOG, or one in {folder}, found none there: "
            "name one, or run a mission, as in `farside run blackout`"
        )
        raise LogError(message) from error
    except OSError as error:
        raise LogError(f"the logs in {folder} cannot be listed: {error.strerror}") from error


def damage_told(context: typer.Context, log: "LogFile") -> "LogFile":
    """The same log; when the command ends, however it does, standard error says what is missing.

    Only then is known what could not be read of it. Whatever a command reads goes through here.
    """

    def tell() -> None:
        for sentence in log.damage:
            print_error(f"{log.path}: {sentence}")

    context.call_on_close(tell)
    return log
